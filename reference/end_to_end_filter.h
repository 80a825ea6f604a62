// First stage of the end-to-end truth: coverage and depth of a triangle at a sample in double precision, each
// with a bound of its error.
//
// Coordinates. A sample is the pair X = 2 j + 1 - W, Y = H - 1 - 2 i: both are integers, hence exact, and
// x_S W/H = X/H, y_S = Y/H. With k = tan(theta/2), a world point is seen at X = U/z, Y = V/z where
//   U = (H/k) u,   V = (H/k) v,   z = -w   (u, v, w: the view coordinates of accuracy.md, section 1)
#pragma once

#include <array>
#include <optional>

#include "scene/camera.h"
#include "scene/model.h"

namespace rasterbench::end_to_end {

/// World to (U, V, z), all three in units of `unit` world units: U = u.P, V = v.P, z = distance + z.P. Each
/// number is the true one rounded once; each is at most 2^40 in magnitude, so that nothing overflows.
struct SampleTransform {
  Vec3d u, v, z;
  double distance;
  double unit;  ///< a power of two
  int width, height;
};

/// The pixel rows or columns first .. last.
struct IndexRange {
  int first = 0, last = -1;
  bool empty() const { return first > last; }
};

/// A triangle that possibly covers a sample. Distances are along the view axis in world units.
struct Fragment {
  double nearest, farthest;  ///< bounds of the true distance, if it covers the sample
  double distance;           ///< estimate
  bool covers;               ///< certainly: the sample is inside and on no edge
};

/// A triangle as the filter sees it. All corners are finite.
class FilteredTriangle {
 public:
  FilteredTriangle(const Triangle& triangle, const SampleTransform& transform);

  /// Sign of det of the corners' (U, V, z); 0 where double does not decide. The other functions take the true
  /// one.
  int orientation() const;
  /// Whether z > 0, or z < 0, certainly holds at all corners.
  bool is_in_front() const;
  bool is_behind() const;

  /// The rows and columns outside which no sample is covered.
  IndexRange rows() const;
  IndexRange columns() const;

  /// What a row of pixels sees of the triangle.
  struct Row {
    std::array<double, 3> y;      ///< V - Y z of the corners
    std::array<double, 3> reach;  ///< |y| at most
    bool misses;                  ///< no sample of the row is covered
  };
  Row row(int i) const { return row_at(height_ - 1 - 2.0 * i); }
  /// Those of `columns` that the edges leave possible.
  IndexRange columns(const Row& row, int orientation, IndexRange columns) const;
  /// Nothing where the sample of column j is certainly not covered.
  std::optional<Fragment> fragment(const Row& row, int j, int orientation) const;

 private:
  struct Corner {
    double u, v, z;
    double u_reach;                    // |U - X z| at most, over the whole picture
    double x_error, y_error, z_error;  // of U - X z and V - Y z, over the whole picture, and of z
  };
  // Share e_i of corner i in the point seen: the cross product of the other two corners relative to the
  // sample; and the bound of its error.
  struct Shares {
    std::array<double, 3> value, error;
  };

  Row row_at(double y) const;
  Shares shares(const Row& row, double x) const;

  std::array<Corner, 3> corners_;
  double z_low_, z_high_;  // of the true corners
  double unit_;
  int width_, height_;
};

}  // namespace rasterbench::end_to_end
