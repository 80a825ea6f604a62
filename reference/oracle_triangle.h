// One screen triangle in exact arithmetic: the signs and the depths that the oracle decides by.
//
// Every question is first asked in double with a forward error bound (Shewchuk, Adaptive precision
// floating-point arithmetic and fast robust geometric predicates, 1997), then, where that does not decide, in
// sums and products of doubles whose roundings are known exactly (Dekker, A floating-point technique for
// extending the available precision, 1971), and at last in rationals: quotients of GMP's integers.
#pragma once

#include <array>
#include <cstdint>

#include "numeric/screen.h"
#include "reference/oracle.h"

namespace rasterbench::reference {

/// Unit roundoff of double.
inline constexpr double kDoubleUnit = 0x1p-53;
/// l - r for l = fl(fl(b-a) fl(p-c)) and r likewise is within this times |l| + |r| of the exact value
/// (Shewchuk 1997, section 4.3), but for underflow.
inline constexpr double kCrossError = (3 + 16 * kDoubleUnit) * kDoubleUnit;
/// More than all underflows of such a formula together: each is at most 2^-1075.
inline constexpr double kUnderflow = 0x1p-1070;

/// A point on the screen in pixels.
struct ScreenPoint {
  double x, y;
};

/// The sample of pixel (x, y).
inline ScreenPoint sample_of(int x, int y) { return {x + 0.5, y + 0.5}; }

/// A corner: pixels, and a depth value.
struct OracleCorner {
  double x, y, d;
  bool operator==(const OracleCorner&) const = default;
};

/// An edge from `from` to `to`; the inside is where (to - from) x (p - from) > 0.
struct OracleEdge {
  ScreenPoint from, to;
  double dx, dy;   ///< to - from, rounded
  double length;   ///< pixels, rounded
  bool owns_zero;  ///< whether a sample exactly on it is inside, by the fill rule

  /// (to - from) x (p - from) in double, and the size of what it was subtracted from.
  struct Value {
    double value, size;
    double error() const { return kCrossError * size + kUnderflow; }
  };
  Value at(const ScreenPoint& p) const {
    const double left = dx * (p.y - from.y), right = dy * (p.x - from.x);
    return {left - right, (left < 0 ? -left : left) + (right < 0 ? -right : right)};
  }
};

/// Pixels first <= x < last of a row.
struct Span {
  int first = 0, last = 0;
};

class OracleTriangle {
 public:
  /// Coverage of a sample; `on_edges` has bit i where the sample lies exactly on edge i.
  struct Cover {
    bool inside = false;
    std::uint8_t on_edges = 0;
  };

  /// A depth value and how far the exact one may be from it.
  struct Depth {
    double value = 0, error = 0;
    /// Whether the errors leave no doubt of which exact value is the smaller one, or that they are equal. The
    /// difference and the sum of the errors are rounded, too.
    bool decides_against(const Depth& other) const {
      const double gap = value > other.value ? value - other.value : other.value - value;
      return gap > 1.01 * (error + other.error) || (error == 0 && other.error == 0);
    }
  };

  template <class Real>
  OracleTriangle(const ScreenTriangle<Real>& triangle, FillRule fill)
      : OracleTriangle(triangle.id, fill,
                       {{{triangle.x[0], triangle.y[0], triangle.d[0]},
                         {triangle.x[1], triangle.y[1], triangle.d[1]},
                         {triangle.x[2], triangle.y[2], triangle.d[2]}}}) {}

  std::int32_t id() const { return id_; }
  /// Corners such that the area is positive, or as they were given where it is zero.
  const std::array<OracleCorner, 3>& corners() const { return corners_; }
  /// Edge i is opposite to corner i.
  const std::array<OracleEdge, 3>& edges() const { return edges_; }
  bool has_area() const { return has_area_; }
  double low_x() const { return low_x_; }
  double high_x() const { return high_x_; }
  double low_y() const { return low_y_; }
  double high_y() const { return high_y_; }
  double low_depth() const { return low_depth_; }
  double high_depth() const { return high_depth_; }
  /// Whether the two have the same corners, in any order.
  bool same_corners(const OracleTriangle& other) const;

  /// A superset of the pixels 0 <= x < width of a row of samples at height `y` that are within `reach` pixels
  /// of the bounding box and where edge i is at least -slack[i], for each i. Preconditions: reach >= 0, slack
  /// >= 0.
  Span span(double y, const std::array<double, 3>& slack, double reach, int width) const;
  /// The same for the samples that the triangle covers.
  Span covered_span(double y, int width) const;

  /// Exact coverage. Draws nothing where the area is exactly zero.
  Cover covers(const ScreenPoint& sample, OracleEffort& effort) const;

  /// The depth value at a covered sample, within 2^-48 of the largest of the corners'.
  Depth depth(const ScreenPoint& sample, std::uint8_t on_edges) const;

  /// Whether the exact depth value at a covered sample is below `limit`; `here` = depth() there.
  bool nearer_than(double limit, const Depth& here, const ScreenPoint& sample, std::uint8_t on_edges,
                   OracleEffort& effort) const;

  /// The depth value at any point near the triangle, clamped to those of the corners, in plain double.
  double clamped_depth(const ScreenPoint& point) const;

  /// Distance in pixels from a point to the outline.
  double distance_to_outline(const ScreenPoint& point) const;

 private:
  friend int compare_depths_exactly(const OracleTriangle&, std::uint8_t, const OracleTriangle&, std::uint8_t,
                                    const ScreenPoint&, OracleEffort&);

  OracleTriangle(std::int32_t id, FillRule fill, const std::array<OracleCorner, 3>& corners);

  std::int32_t id_;
  bool has_area_;
  std::array<OracleCorner, 3> corners_;
  std::array<OracleEdge, 3> edges_;
  double low_x_, high_x_, low_y_, high_y_, low_depth_, high_depth_;
};

/// Sign of the exact depth of `a` minus that of `b` at a sample that both cover, for where depth() did not
/// decide it.
int compare_depths_exactly(const OracleTriangle& a, std::uint8_t on_edges_a, const OracleTriangle& b,
                           std::uint8_t on_edges_b, const ScreenPoint& sample, OracleEffort& effort);

}  // namespace rasterbench::reference
