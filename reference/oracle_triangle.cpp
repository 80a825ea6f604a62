#include "reference/oracle_triangle.h"

#include <algorithm>
#include <bit>
#include <boost/multiprecision/gmp.hpp>
#include <cmath>

namespace rasterbench::reference {
namespace {

using Integer = boost::multiprecision::mpz_int;
using Rational = boost::multiprecision::mpq_rational;

/// A sum or product as rounded, and what rounding took away: value + rest is exact.
struct Exactly {
  double value, rest;
};

/// Knuth 1969; Shewchuk 1997, theorem 7.
Exactly difference(double a, double b) {
  const double value = a - b;
  const double minus_b = value - a;
  const double rounded_a = value - minus_b;
  return {value, (a - rounded_a) - (b + minus_b)};
}

/// Exact unless the rest underflows.
Exactly product(double a, double b) {
  const double value = a * b;
  return {value, std::fma(a, b, -value)};
}

/// Below this the rest of a product may underflow: it has an exponent up to 106 smaller.
constexpr double kSmallestProduct = 0x1p-960;

bool rest_is_exact(const Exactly& product, double a, double b) {
  return std::abs(product.value) >= kSmallestProduct || a == 0 || b == 0;
}

int sign(double value) { return (value > 0) - (value < 0); }

/// A unit 2^-shift that all of some doubles are multiples of. Integers of one unit need no fractions to be
/// cancelled, which is most of the time that rationals take.
class Unit {
 public:
  void add(double v) { shift_ = std::max(shift_, -parts(v).exponent); }
  void add(const ScreenPoint& p) { add(p.x), add(p.y); }
  void add(const std::array<OracleCorner, 3>& corners) {
    for (const OracleCorner& c : corners) add(c.x), add(c.y), add(c.d);
  }

  Integer count(double v) const {
    const Parts p = parts(v);
    return p.mantissa == 0 ? Integer(0) : Integer(p.mantissa) << static_cast<unsigned>(p.exponent + shift_);
  }

  Integer cross(const ScreenPoint& from, const ScreenPoint& to, const ScreenPoint& p) const {
    const Integer from_x = count(from.x), from_y = count(from.y);
    return (count(to.x) - from_x) * (count(p.y) - from_y) - (count(to.y) - from_y) * (count(p.x) - from_x);
  }

 private:
  struct Parts {
    std::int64_t mantissa;  // odd or zero
    int exponent;           // v = mantissa 2^exponent
  };
  static Parts parts(double v) {
    int exponent = 0;
    auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(v, &exponent), 53));
    if (mantissa == 0) return {0, 0};
    const int zeros = std::countr_zero(static_cast<std::uint64_t>(mantissa));
    return {mantissa >> zeros, exponent - 53 + zeros};
  }

  int shift_ = 0;
};

struct ExactSign {
  int sign;
  bool by_rationals;
};

/// Sign of (to - from) x (p - from).
ExactSign exact_cross_sign(const ScreenPoint& from, const ScreenPoint& to, const ScreenPoint& p) {
  const OracleEdge::Value at = OracleEdge{from, to, to.x - from.x, to.y - from.y, 0, true}.at(p);
  if (std::abs(at.value) > at.error()) return {sign(at.value), false};
  const Exactly ex = difference(to.x, from.x), ey = difference(to.y, from.y);
  const Exactly vx = difference(p.x, from.x), vy = difference(p.y, from.y);
  if (ex.rest == 0 && ey.rest == 0 && vx.rest == 0 && vy.rest == 0) {
    const Exactly left = product(ex.value, vy.value), right = product(ey.value, vx.value);
    // Rounding is monotone: products that differ when rounded differ the same way.
    if (rest_is_exact(left, ex.value, vy.value) && rest_is_exact(right, ey.value, vx.value))
      return {left.value != right.value ? sign(left.value - right.value) : sign(left.rest - right.rest),
              false};
  }
  Unit unit;
  unit.add(from), unit.add(to), unit.add(p);
  return {unit.cross(from, to, p).sign(), true};
}

/// The value of an edge function in about twice the precision of double, rounded to double: the weights of
/// the corners need relative accuracy where a sliver's are small differences of large products.
struct Weight {
  double value, error;
};

Weight precise_weight(const OracleEdge& edge, const ScreenPoint& p) {
  const Exactly ex = difference(edge.to.x, edge.from.x), ey = difference(edge.to.y, edge.from.y);
  const Exactly vx = difference(p.x, edge.from.x), vy = difference(p.y, edge.from.y);
  const Exactly left = product(ex.value, vy.value), right = product(ey.value, vx.value);
  const double left_cross = ex.value * vy.rest + ex.rest * vy.value;
  const double right_cross = ey.value * vx.rest + ey.rest * vx.value;
  // The first difference is exact where it is so small that the rests matter (Sterbenz 1974). What was left
  // out or rounded twice is below 16 * 2^-106 of the products.
  const double value = (left.value - right.value) + ((left.rest - right.rest) + (left_cross - right_cross));
  return {value,
          0x1p-100 * (std::abs(left.value) + std::abs(right.value)) + 0x1p-52 * std::abs(value) + kUnderflow};
}

/// The exact depth is a convex combination of those of the corners that do not have weight zero.
struct ActiveCorners {
  double low, high;  // their depths
  std::size_t first;
};

ActiveCorners active_corners(const std::array<OracleCorner, 3>& corners, std::uint8_t on_edges) {
  ActiveCorners active{INFINITY, -INFINITY, 3};
  for (std::size_t i = 3; i-- > 0;) {
    if (on_edges >> i & 1) continue;
    active.low = std::min(active.low, corners[i].d);
    active.high = std::max(active.high, corners[i].d);
    active.first = i;
  }
  return active;
}

/// sum w d / sum w, whose error is, of the weights' errors, sum |error| (high - low) / sum w.
OracleTriangle::Depth weighted_depth(const std::array<OracleCorner, 3>& corners,
                                     const std::array<Weight, 3>& weights, const ActiveCorners& active) {
  const double origin = corners[active.first].d, range = active.high - active.low;
  if (range == 0) return {origin, 0};
  double sum = 0, total = 0, error = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    sum += weights[i].value * (corners[i].d - origin);
    total += weights[i].value;
    error += weights[i].error;
  }
  const double largest = std::max(std::abs(active.low), std::abs(active.high));
  // The quotient takes seven roundings relative to the range, the last sum one relative to the value.
  return {std::clamp(origin + sum / total, active.low, active.high),
          range * (1.01 * error / total + 8 * kDoubleUnit) + 2 * kDoubleUnit * largest +
              kUnderflow * (1 + 1 / total)};
}

/// The exact depth at a sample, sum / total, total > 0, in a unit.
struct ExactDepth {
  Integer sum = 0, total = 0;

  ExactDepth(const std::array<OracleCorner, 3>& corners, const std::array<OracleEdge, 3>& edges,
             const ScreenPoint& sample, const Unit& unit) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Integer weight = unit.cross(edges[i].from, edges[i].to, sample);
      sum += weight * unit.count(corners[i].d);
      total += weight;
    }
  }
};

/// Whether the corners of non-zero weight are the same: the sample then has the same weights in both, and
/// exactly the same depth.
bool same_active_corners(const std::array<OracleCorner, 3>& a, std::uint8_t on_edges_a,
                         const std::array<OracleCorner, 3>& b, std::uint8_t on_edges_b) {
  int active_a = 0, active_b = 0, shared = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    active_b += (on_edges_b >> i & 1) == 0;
    if (on_edges_a >> i & 1) continue;
    ++active_a;
    for (std::size_t k = 0; k < 3; ++k) shared += (on_edges_b >> k & 1) == 0 && a[i] == b[k];
  }
  return active_a == active_b && shared == active_a;
}

bool is_finite(const OracleCorner& c) {
  return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.d);
}

}  // namespace

OracleTriangle::OracleTriangle(std::int32_t id, FillRule fill, const std::array<OracleCorner, 3>& corners)
    : id_(id), corners_(corners) {
  const auto point = [&](std::size_t i) { return ScreenPoint{corners_[i].x, corners_[i].y}; };
  const auto [low_x, high_x] = std::minmax({corners[0].x, corners[1].x, corners[2].x});
  const auto [low_y, high_y] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
  const auto [low_d, high_d] = std::minmax({corners[0].d, corners[1].d, corners[2].d});
  low_x_ = low_x, high_x_ = high_x, low_y_ = low_y, high_y_ = high_y, low_depth_ = low_d,
  high_depth_ = high_d;
  const bool finite = std::all_of(corners.begin(), corners.end(), is_finite);
  const int orientation = finite ? exact_cross_sign(point(0), point(1), point(2)).sign : 0;
  has_area_ = orientation != 0;
  if (orientation < 0) std::swap(corners_[1], corners_[2]);
  for (std::size_t i = 0; i < 3; ++i) {
    const ScreenPoint from = point((i + 1) % 3), to = point((i + 2) % 3);
    const double dx = to.x - from.x, dy = to.y - from.y;
    // y points down: the inside is to the right of an edge where dy < 0 (a left edge), below a level one
    // where dx > 0. A difference of doubles has the exact sign.
    const bool is_top_or_left = dy < 0 || (dy == 0 && dx > 0);
    edges_[i] = {from, to, dx, dy, std::hypot(dx, dy), fill == FillRule::kClosed || is_top_or_left};
  }
}

bool OracleTriangle::same_corners(const OracleTriangle& other) const {
  return std::is_permutation(corners_.begin(), corners_.end(), other.corners_.begin());
}

Span OracleTriangle::span(double y, const std::array<double, 3>& slack, double reach, int width) const {
  if (!(y >= low_y_ - reach && y <= high_y_ + reach)) return {};
  double low = low_x_ - reach, high = high_x_ + reach;
  for (std::size_t i = 0; i < 3; ++i) {
    // dx (y - from.y) - dy (x - from.x) >= -slack, solved for x. Where `rise` and the slack cancel, the
    // roundings of `rise` are room to be left before the division; all others are relative to the crossing.
    const OracleEdge& edge = edges_[i];
    const double rise = edge.dx * (y - edge.from.y);
    const double room = rise + (slack[i] + 8 * kDoubleUnit * std::abs(rise) + kUnderflow);
    const double crossing = edge.from.x + room / edge.dy;
    const double rounding = 0x1p-40 * (1 + std::abs(crossing) + std::abs(edge.from.x));
    if (edge.dy > 0) {
      high = std::min(high, crossing + rounding);
    } else if (edge.dy < 0) {
      low = std::max(low, crossing - rounding);
    } else if (room < 0) {
      return {};
    }
  }
  low = std::max(low, 0.0), high = std::min(high, static_cast<double>(width));
  if (!(low <= high)) return {};
  return {static_cast<int>(std::ceil(low - 0.5)), static_cast<int>(std::floor(high + 0.5))};
}

Span OracleTriangle::covered_span(double y, int width) const { return span(y, {0, 0, 0}, 0, width); }

OracleTriangle::Cover OracleTriangle::covers(const ScreenPoint& sample, OracleEffort& effort) const {
  if (!has_area_) return {};
  Cover cover{true, 0};
  for (std::size_t i = 0; i < 3; ++i) {
    const OracleEdge& edge = edges_[i];
    const OracleEdge::Value at = edge.at(sample);
    ++effort.coverage_tests;
    if (at.value > at.error()) continue;
    if (at.value < -at.error()) return {};
    const ExactSign exact = exact_cross_sign(edge.from, edge.to, sample);
    effort.coverage_fallbacks += exact.by_rationals;
    if (exact.sign < 0) return {};
    if (exact.sign > 0) continue;
    if (!edge.owns_zero) return {};
    cover.on_edges |= static_cast<std::uint8_t>(1u << i);
  }
  return cover;
}

OracleTriangle::Depth OracleTriangle::depth(const ScreenPoint& sample, std::uint8_t on_edges) const {
  const ActiveCorners active = active_corners(corners_, on_edges);
  const double tolerance = 0x1p-48 * std::max(std::abs(active.low), std::abs(active.high));
  std::array<Weight, 3> weights{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (on_edges >> i & 1) continue;
    const OracleEdge::Value at = edges_[i].at(sample);
    weights[i] = {std::max(at.value, 0.0), at.error()};
  }
  Depth result = weighted_depth(corners_, weights, active);
  if (result.error <= tolerance) return result;

  for (std::size_t i = 0; i < 3; ++i) {
    if (on_edges >> i & 1) continue;
    weights[i] = precise_weight(edges_[i], sample);
    weights[i].value = std::max(weights[i].value, 0.0);
  }
  result = weighted_depth(corners_, weights, active);
  if (result.error <= tolerance) return result;

  Unit unit;
  unit.add(corners_), unit.add(sample);
  const ExactDepth exact(corners_, edges_, sample, unit);
  const double value = Rational(exact.sum, exact.total * unit.count(1)).convert_to<double>();
  return {value, 2 * kDoubleUnit * std::abs(value) + kUnderflow};
}

bool OracleTriangle::nearer_than(double limit, const Depth& here, const ScreenPoint& sample,
                                 std::uint8_t on_edges, OracleEffort& effort) const {
  if (high_depth_ < limit) return true;
  const ActiveCorners active = active_corners(corners_, on_edges);
  if (active.high < limit) return true;
  if (active.low >= limit) return false;
  ++effort.depth_tests;
  if (here.decides_against({limit, 0})) return here.value < limit;
  ++effort.depth_fallbacks;
  Unit unit;
  unit.add(corners_), unit.add(sample), unit.add(limit);
  const ExactDepth exact(corners_, edges_, sample, unit);
  return exact.sum < unit.count(limit) * exact.total;
}

double OracleTriangle::clamped_depth(const ScreenPoint& point) const {
  double sum = 0, total = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double weight = edges_[i].at(point).value;
    sum += weight * (corners_[i].d - low_depth_);
    total += weight;
  }
  const double depth = low_depth_ + sum / total;
  // Of a triangle without area the depth is not a number; it may be as near as its nearest corner.
  return depth > low_depth_ ? std::min(depth, high_depth_) : low_depth_;
}

double OracleTriangle::distance_to_outline(const ScreenPoint& point) const {
  double nearest_square = INFINITY;
  for (const OracleEdge& edge : edges_) {
    const double vx = point.x - edge.from.x, vy = point.y - edge.from.y;
    const double along = vx * edge.dx + vy * edge.dy, whole = edge.length * edge.length;
    double square;
    if (along <= 0) {
      square = vx * vx + vy * vy;
    } else if (along >= whole) {
      const double wx = point.x - edge.to.x, wy = point.y - edge.to.y;
      square = wx * wx + wy * wy;
    } else {
      const double cross = edge.at(point).value;
      square = cross * cross / whole;
    }
    nearest_square = std::min(nearest_square, square);
  }
  return std::sqrt(nearest_square);
}

int compare_depths_exactly(const OracleTriangle& a, std::uint8_t on_edges_a, const OracleTriangle& b,
                           std::uint8_t on_edges_b, const ScreenPoint& sample, OracleEffort& effort) {
  if (same_active_corners(a.corners_, on_edges_a, b.corners_, on_edges_b)) return 0;
  ++effort.depth_fallbacks;
  Unit unit;
  unit.add(a.corners_), unit.add(b.corners_), unit.add(sample);
  const ExactDepth exact_a(a.corners_, a.edges_, sample, unit), exact_b(b.corners_, b.edges_, sample, unit);
  return Integer(exact_a.sum * exact_b.total).compare(exact_b.sum * exact_a.total);
}

}  // namespace rasterbench::reference
