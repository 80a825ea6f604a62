// Where and how deep a kernel may draw one triangle without breaking the bound of its numeric mode.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "reference/double_renderer.h"

namespace rasterbench::reference {

/// A vertex on the screen and how far from it the kernel's may be: `reach` in pixels, `slack` in depth.
struct Vertex {
  double x, y, d;
  double reach, slack;
};

/// A convex polygon on the screen: the visible part of a triangle, or a piece of it.
struct Polygon {
  std::vector<Vertex> vertices;
  std::vector<bool> firm;  ///< edge i, i + 1: no error can bring another vertex to its outside
  double reach = 0;        ///< the largest of the vertices
  double perimeter = 0;
  double orientation = 0;  ///< sign of the area
  double x_min = INFINITY, x_max = -INFINITY, y_min = INFINITY, y_max = -INFINITY;
  bool is_bounded = true;  ///< false: errors are so large that nothing can be said

  std::size_t next(std::size_t i) const { return i + 1 < vertices.size() ? i + 1 : 0; }
};

/// The depths that a kernel may compute at a point.
struct DepthRange {
  double low, high;
  bool contains(double depth) const { return depth >= low && depth <= high; }
};

/// The footprint of one triangle in the pictures of all kernels that keep to `bound`.
class Footprint {
 public:
  Footprint() = default;
  Footprint(const Triangle& triangle, std::int32_t id, const Camera& camera, NearRule near_rule,
            const PictureBound& bound);

  /// The triangle's, or -1 for an empty footprint.
  std::int32_t id() const { return id_; }
  /// Whether a kernel may find the point covered.
  bool may_cover(double x, double y) const;
  /// Whether every kernel has to find the point covered.
  bool must_cover(double x, double y) const;
  /// The depths that kernels may compute at a point that they may cover.
  DepthRange depths(double x, double y) const;

 private:
  std::int32_t id_ = -1;
  PictureBound bound_{};
  bool may_vanish_ = false;  // its world area or, without a near plane, its w is zero but for rounding
  Polygon smallest_;         // with the near plane as far away as errors can bring it
  // With the near plane as near as errors can bring it, all triangles of the polygon's vertices: any fan that
  // a kernel cuts it into is made of these.
  std::vector<Polygon> pieces_;
};

}  // namespace rasterbench::reference
