// Forward error bounds as in: Nicholas J. Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002,
// section 3.1. With unit roundoff u, n roundings change a product by a factor within 1 +- gamma_n, where
// gamma_n = n u / (1 - n u).
//
// The corners are exact numbers; errors of geometry are none of these. This file's own roundings in double
// are counted as if they were the mode's: u + 2^-53 stands for u.
#include "reference/bounded_triangle.h"

#include <algorithm>
#include <cmath>

namespace rasterbench::reference {
namespace {

constexpr double gamma(int n, double unit) { return n * unit / (1 - n * unit); }

// An edge function: two differences and a product in each term, and their difference; twice that, because the
// other orders of the operations (the constant of A x + B y + C) are bounded by the same number.
constexpr int kEdgeRoundings = 8;
// The area and the numerators of the gradients: two differences and a product in each term, their difference,
// and the conversion of what they are made of.
constexpr int kGradientRoundings = 6;
// The plane at a sample: the gradient's own format, a difference, a product and two sums.
constexpr int kPlaneRoundings = 5;
// kIncremental: additions from a column that is a multiple of 64 (design.md, numeric modes).
constexpr double kColumns = 64;
// Formats with a larger unit roundoff underflow and overflow like float32, the others like float64.
constexpr double kFloatUnit = 0x1p-40;
constexpr double kFloatUnderflow = 0x1p-140;  // many times the smallest float32
constexpr double kFloatOverflow = 0x1p120;  // and a gradient times a distance of 2^18 pixels not yet infinite

double underflow_of(double unit) { return unit > kFloatUnit ? kFloatUnderflow : kUnderflow; }

double largest_of(double a, double b) { return std::max(std::abs(a), std::abs(b)); }

}  // namespace

BoundedTriangle::BoundedTriangle(const OracleTriangle& exact, const ModeBound& bound, DepthFunction function)
    : exact_(exact),
      bound_(bound),
      far_(far_value(function)),
      edge_unit_((bound.edge_form == EdgeForm::kExact ? 0 : bound.edge_unit) + kDoubleUnit),
      underflow_(underflow_of(std::max({bound.edge_unit, bound.gradient_unit, bound.depth_unit}))),
      reach_(1.001 * bound.snap),
      coverage_is_exact_(edge_unit_ == kDoubleUnit && bound.snap == 0) {
  if (coverage_is_exact_) {
    if (!exact_.has_area()) return;
  } else {
    bound_the_area();
    const double width = exact_.high_x() - exact_.low_x() + reach_;
    const double height = exact_.high_y() - exact_.low_y() + reach_;
    const double x = largest_of(exact_.low_x(), exact_.high_x()) + reach_;
    const double y = largest_of(exact_.low_y(), exact_.high_y()) + reach_;
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const OracleEdge& edge = exact_.edges()[i];
      const double value = std::abs(edge.dx) * height + std::abs(edge.dy) * width;
      const double moved = bound.snap * std::sqrt(2) * (edge.length + 4 * std::hypot(width, height)) +
                           2 * bound.snap * bound.snap;
      slack_[i] = rounding_tolerance(edge, width, height, x, y, value) + moved;
      sum += slack_[i];
    }
    // Turned over, each edge function is at most its tolerance, and so at least minus those of the others,
    // because the three sum up to the area.
    if (may_turn_over_) slack_ = {sum, sum, sum};
  }
  // The anchor of the depth is the first corner in the order of x, which snapping may change. Nothing is said
  // of modes that snap and round, whose samples may lie outside of the snapped triangle.
  if (bound.snap > 0 && edge_unit_ > kDoubleUnit) return;
  for (std::size_t i = 0; i < 3; ++i) {
    if (exact_.corners()[i].x > exact_.low_x() + 2 * reach_) continue;
    if (add_plane(i)) continue;
    plane_count_ = 0;
    return;
  }
}

Span BoundedTriangle::span(double y, int width) const {
  return coverage_is_exact_ ? exact_.covered_span(y, width) : exact_.span(y, slack_, reach_, width);
}

// How far an edge function may be from the exact one by rounding, at a sample within reach_x, reach_y of both
// ends. Monotone in everything but the edge.
double BoundedTriangle::rounding_tolerance(const OracleEdge& edge, double reach_x, double reach_y,
                                           double sample_x, double sample_y, double value) const {
  const double dx = std::abs(edge.dx) + 2 * bound_.snap, dy = std::abs(edge.dy) + 2 * bound_.snap;
  const double x = reach_x + bound_.snap, y = reach_y + bound_.snap;
  const double cross = dx * y + dy * x;
  double tolerance = gamma(kEdgeRoundings, edge_unit_) * cross + underflow_;
  if (bound_.edge_form == EdgeForm::kPlane) {
    tolerance = gamma(kEdgeRoundings, edge_unit_) *
                    (dy * (sample_x + largest_of(edge.from.x, edge.to.x) + bound_.snap) +
                     dx * (sample_y + largest_of(edge.from.y, edge.to.y) + bound_.snap)) +
                underflow_;
  } else if (bound_.edge_form == EdgeForm::kIncremental) {
    // The start lies up to 64 pixels to the left; each addition rounds a sum that is at most as large as the
    // value at one of the ends, and carries the error of the step. 1.1 is for terms of second order.
    tolerance += gamma(kEdgeRoundings, edge_unit_) * dy * kColumns +
                 1.1 * kColumns * edge_unit_ * (value + (kColumns + 1) * dy) + kColumns * underflow_;
  }
  return tolerance;
}

// With a and b moved by alpha and beta, and p = a + t (b - a) + n, n at right angles to the edge, expanding
// the product gives (b' - a') x (p - a') = (b - a) x (p - a) + (1 - t) alpha x (b - a) + t beta x (b - a) +
// (beta - alpha) x n + alpha x beta, and no coordinate of alpha or beta exceeds the snap.
double BoundedTriangle::edge_tolerance(const OracleEdge& edge, const ScreenPoint& sample,
                                       double value) const {
  const double from_x = std::abs(sample.x - edge.from.x), to_x = std::abs(sample.x - edge.to.x);
  const double from_y = std::abs(sample.y - edge.from.y), to_y = std::abs(sample.y - edge.to.y);
  const double rounding = rounding_tolerance(edge, std::max(from_x, to_x), std::max(from_y, to_y),
                                             std::abs(sample.x), std::abs(sample.y), std::abs(value));
  const double snap = bound_.snap;
  if (snap == 0) return rounding;
  const double apart = std::abs(edge.dx) + std::abs(edge.dy);
  const double square = edge.length * edge.length;
  const double t = ((sample.x - edge.from.x) * edge.dx + (sample.y - edge.from.y) * edge.dy) / square;
  const double across = std::abs(value) / edge.length;
  const double refined = snap * apart * std::max(1.0, std::abs(2 * t - 1)) + 2 * snap * std::sqrt(2) * across;
  // Of an edge of no length, and as good for a short one.
  const double general = snap * (apart + 2 * (from_x + from_y));
  return rounding + (refined < general ? refined : general) + 2 * snap * snap;
}

void BoundedTriangle::bound_the_area() {
  double size = 0, perimeter = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const OracleEdge &p = exact_.edges()[i], &q = exact_.edges()[(i + 1) % 3];
    const double s = 2 * bound_.snap;
    size = std::max(
        size, (std::abs(p.dx) + s) * (std::abs(q.dy) + s) + (std::abs(p.dy) + s) * (std::abs(q.dx) + s));
    perimeter += std::abs(p.dx) + std::abs(p.dy);
  }
  const OracleCorner& corner = exact_.corners()[0];
  const double area = exact_.edges()[0].at({corner.x, corner.y}).value;
  // Each corner's snap moves the area by at most that of the opposite edge's extents.
  const double tolerance = gamma(kEdgeRoundings, edge_unit_) * size + bound_.snap * perimeter +
                           6 * bound_.snap * bound_.snap + underflow_;
  may_turn_over_ = !(area > tolerance);
}

BoundedTriangle::Coverage BoundedTriangle::coverage(const ScreenPoint& sample, OracleEffort& effort) const {
  if (coverage_is_exact_) {
    const bool inside = exact_.covers(sample, effort).inside;
    return {inside, inside};
  }
  if (!(sample.x >= exact_.low_x() - reach_ && sample.x <= exact_.high_x() + reach_ &&
        sample.y >= exact_.low_y() - reach_ && sample.y <= exact_.high_y() + reach_))
    return {};
  bool may = true, may_turned = may_turn_over_, must = !may_turn_over_;
  for (std::size_t i = 0; i < 3; ++i) {
    const OracleEdge& edge = exact_.edges()[i];
    const double value = edge.at(sample).value;
    if (value > slack_[i] && !may_turned) continue;
    const double tolerance = edge_tolerance(edge, sample, value);
    may = may && value >= -tolerance;
    may_turned = may_turned && value <= tolerance;
    must = must && value > tolerance;
    if (!may && !may_turned) return {};
  }
  return {true, must};
}

/// False where the errors are so large that the clamp alone bounds the depth.
bool BoundedTriangle::add_plane(std::size_t anchor) {
  const OracleCorner &a = exact_.corners()[anchor], &b = exact_.corners()[(anchor + 1) % 3],
                     &c = exact_.corners()[(anchor + 2) % 3];
  const double x1 = b.x - a.x, y1 = b.y - a.y, d1 = b.d - a.d;
  const double x2 = c.x - a.x, y2 = c.y - a.y, d2 = c.d - a.d;
  const double s = 2 * bound_.snap, unit = bound_.gradient_unit + kDoubleUnit;
  const double ax1 = std::abs(x1) + s, ay1 = std::abs(y1) + s, ad1 = std::abs(d1);
  const double ax2 = std::abs(x2) + s, ay2 = std::abs(y2) + s, ad2 = std::abs(d2);
  const double rounding = gamma(kGradientRoundings, unit);

  const double area = x1 * y2 - y1 * x2;
  const double area_error = rounding * (ax1 * ay2 + ay1 * ax2) + underflow_;
  const double least = area - area_error - s * (ax1 + ay1 + ax2 + ay2);
  if (!(least > area / 2)) return false;
  const double division = bound_.reciprocal_error + 2 * unit;
  Plane plane{.anchor = a, .gx = (d1 * y2 - d2 * y1) / area, .gy = (d2 * x1 - d1 * x2) / area};
  const auto bound_gradient = [&](double gradient, double products, double& most, double& error) {
    // The exact gradient of snapped corners, then what is rounded on the way to it.
    const double snapped = (std::abs(gradient) * area + s * (ad1 + ad2)) / least;
    error = (rounding * products + underflow_ + snapped * area_error) / least * (1 + division) +
            division * snapped + underflow_;
    most = snapped + error;
  };
  bound_gradient(plane.gx, ad1 * ay2 + ad2 * ay1, plane.gx_most, plane.gx_error);
  bound_gradient(plane.gy, ad1 * ax2 + ad2 * ax1, plane.gy_most, plane.gy_error);
  if (underflow_ == kFloatUnderflow && !(plane.gx_most + plane.gy_most < kFloatOverflow)) return false;
  planes_[plane_count_++] = plane;
  return true;
}

DepthInterval BoundedTriangle::depths(const ScreenPoint& sample) const {
  const double unit = bound_.depth_unit + kDoubleUnit;
  DepthInterval interval{INFINITY, -INFINITY};
  for (const Plane& plane : std::span(planes_).first(plane_count_)) {
    const double dx = sample.x - plane.anchor.x, dy = sample.y - plane.anchor.y;
    const double ax = std::abs(dx) + bound_.snap, ay = std::abs(dy) + bound_.snap;
    const double depth = plane.anchor.d + plane.gy * dy + plane.gx * dx;
    // The planes of exact and of snapped corners differ by at most gradient times snap at the corners, and so
    // at every sample that the snapped triangle covers.
    const double error =
        plane.gx_error * ax + plane.gy_error * ay + bound_.snap * (plane.gx_most + plane.gy_most) +
        gamma(kPlaneRoundings, unit) * (std::abs(plane.anchor.d) + plane.gx_most * ax + plane.gy_most * ay) +
        4 * underflow_;
    interval = {std::min(interval.low, depth - error), std::max(interval.high, depth + error)};
  }
  const double low = exact_.low_depth(), high = exact_.high_depth();
  if (plane_count_ == 0) interval = {low, high};
  interval = {std::clamp(interval.low, low, high), std::clamp(interval.high, low, high)};
  // What the format makes of it: one rounding, or half a step and the roundings of the scaling.
  const double largest = std::max({1.0, std::abs(low), std::abs(high)});
  const double format = bound_.depth_step > 0 ? 0.5 * bound_.depth_step + 4 * unit * largest
                                              : unit * std::max(std::abs(low), std::abs(high)) + underflow_;
  interval = {interval.low - format, interval.high + format};
  // A fixed-point format cannot say what lies beyond its ends.
  if (bound_.depth_step > 0) interval = {std::min(interval.low, far_), std::max(interval.high, -1.0)};
  return interval;
}

}  // namespace rasterbench::reference
