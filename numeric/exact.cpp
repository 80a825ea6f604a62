#include "numeric/exact.h"

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>

namespace rasterbench {
namespace {

using Rational = boost::multiprecision::cpp_rational;

/// The depth as a quotient of two polynomials in the corners: no division until it is compared.
struct Quotient {
  Rational numerator, denominator;  // denominator > 0
};

Quotient exact_depth(const ExactDepth& depth) {
  if (depth.triangle == nullptr) return {1, 1};
  const ScreenTriangle<float>& t = *depth.triangle;
  const Rational x = Rational(depth.x) + Rational(1, 2), y = Rational(depth.y) + Rational(1, 2);
  Rational numerator = 0, denominator = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    // Twice the signed area that corner i's opposite edge spans with the sample: i's share of the sample.
    const Rational share =
        (Rational(t.x[j]) - x) * (Rational(t.y[k]) - y) - (Rational(t.x[k]) - x) * (Rational(t.y[j]) - y);
    numerator += share * Rational(t.d[i]);
    denominator += share;
  }
  if (denominator < 0) return {-numerator, -denominator};
  return {numerator, denominator};
}

bool same_corners(const ScreenTriangle<float>& a, const ScreenTriangle<float>& b) {
  const ScreenTriangle<float> p = canonical(a), q = canonical(b);
  return std::equal(p.x, p.x + 3, q.x) && std::equal(p.y, p.y + 3, q.y) && std::equal(p.d, p.d + 3, q.d);
}

}  // namespace

int compare_exactly(const ExactDepth& a, const ExactDepth& b) {
  // Every triangle drawn twice is a common scene, and each of its pixels a tie.
  if (a.triangle == b.triangle || (a.triangle && b.triangle && same_corners(*a.triangle, *b.triangle)))
    return 0;
  const Quotient p = exact_depth(a), q = exact_depth(b);
  return Rational(p.numerator * q.denominator).compare(q.numerator * p.denominator);
}

float Exact::depth_error(const ScreenTriangle<float>& t, const Plane::Setup& plane) {
  // Forward error of PlaneDepth<double, double> (Higham, Accuracy and Stability, 3.1), with u = 2^-53: a
  // gradient's numerator is within 5 u of the sizes of its two products, the area likewise, and the quotient
  // adds u; the plane adds 4 u of each of its terms. Small constants are rounded up.
  constexpr double kUnit = 0x1p-53;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double x1 = double{t.x[1]} - double{t.x[0]}, y1 = double{t.y[1]} - double{t.y[0]};
  const double x2 = double{t.x[2]} - double{t.x[0]}, y2 = double{t.y[2]} - double{t.y[0]};
  const double d1 = double{t.d[1]} - double{t.d[0]}, d2 = double{t.d[2]} - double{t.d[0]};
  const double area = std::abs(x1 * y2 - y1 * x2);
  const double area_error = 8 * kUnit * (std::abs(x1 * y2) + std::abs(y1 * x2));
  double error = kInfinity;
  if (area > 2 * area_error) {
    const auto gradient_error = [&](double gradient, double size) {
      return (8 * kUnit * size + std::abs(gradient) * area_error) / (area - area_error) +
             2 * kUnit * std::abs(gradient);
    };
    const double width = x2 + 1;
    const double height = std::max({t.y[0], t.y[1], t.y[2]}) - std::min({t.y[0], t.y[1], t.y[2]}) + 1.0;
    error = gradient_error(plane.gx, std::abs(d1 * y2) + std::abs(d2 * y1)) * width +
            gradient_error(plane.gy, std::abs(d2 * x1) + std::abs(d1 * x2)) * height +
            8 * kUnit * (std::abs(plane.d0) + std::abs(plane.gx) * width + std::abs(plane.gy) * height);
  }
  // Rounded up, and never so small that sums of errors underflow; NaN (0 times infinity) becomes infinite.
  return error < 1 ? std::nextafter(static_cast<float>(error), 2.0f) + 0x1p-100f
                   : std::numeric_limits<float>::infinity();
}

}  // namespace rasterbench
