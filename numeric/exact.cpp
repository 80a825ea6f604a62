#include "numeric/exact.h"

#include <algorithm>
#include <array>
#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

namespace rasterbench {
namespace {

using Integer = boost::multiprecision::cpp_int;

/// A float32 number as a whole number of units 2^exponent: floats are binary fractions, so that integers do
/// what rationals would, without their common divisors.
struct Scaled {
  std::int64_t mantissa = 0;
  int exponent = std::numeric_limits<int>::max();  ///< of the last bit that is set; zero has none

  explicit Scaled(float value) {
    if (value == 0) return;
    mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(value, &exponent), kMantissaBits));
    const int zeros = std::countr_zero(static_cast<std::uint64_t>(mantissa));
    mantissa /= std::int64_t{1} << zeros;
    exponent += zeros - kMantissaBits;
  }
  Integer in_units_of(int unit) const {
    return mantissa == 0 ? Integer(0) : Integer(mantissa) << (exponent - unit);
  }

  static constexpr int kMantissaBits = std::numeric_limits<float>::digits;
};

/// numerator / denominator * 2^exponent, the denominator positive: no division until it is compared.
struct Quotient {
  Integer numerator, denominator;
  int exponent;
};

Quotient exact_depth(const ExactDepth& depth) {
  if (depth.triangle == nullptr) return {1, 1, 0};
  const ScreenTriangle<float>& t = *depth.triangle;
  const std::array x{Scaled(t.x[0]), Scaled(t.x[1]), Scaled(t.x[2])};
  const std::array y{Scaled(t.y[0]), Scaled(t.y[1]), Scaled(t.y[2])};
  const std::array d{Scaled(t.d[0]), Scaled(t.d[1]), Scaled(t.d[2])};
  int unit = -1;  // of coordinates in pixels: samples have halves
  for (std::size_t i = 0; i < 3; ++i) unit = std::min({unit, x[i].exponent, y[i].exponent});
  int depth_unit = 0;
  for (std::size_t i = 0; i < 3; ++i) depth_unit = std::min(depth_unit, d[i].exponent);

  // Corners as seen from the sample.
  const Integer sample_x = Integer(2 * depth.x + 1) << (-1 - unit);
  const Integer sample_y = Integer(2 * depth.y + 1) << (-1 - unit);
  std::array<Integer, 3> dx, dy;
  for (std::size_t i = 0; i < 3; ++i) {
    dx[i] = x[i].in_units_of(unit) - sample_x;
    dy[i] = y[i].in_units_of(unit) - sample_y;
  }
  Quotient quotient{0, 0, depth_unit};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    // Twice the signed area that corner i's opposite edge spans with the sample: i's share of the sample.
    const Integer share = dx[j] * dy[k] - dx[k] * dy[j];
    quotient.numerator += share * d[i].in_units_of(depth_unit);
    quotient.denominator += share;
  }
  if (quotient.denominator < 0) {
    quotient.numerator = -quotient.numerator;
    quotient.denominator = -quotient.denominator;
  }
  return quotient;
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
  const int unit = std::min(p.exponent, q.exponent);
  const Integer left = (p.numerator * q.denominator) << (p.exponent - unit);
  const Integer right = (q.numerator * p.denominator) << (q.exponent - unit);
  return left.compare(right);
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
