// Edge functions (b-a) x (p-a) in one floating-point format.
//
// The end points are in lexicographic order and the sign is restored. Written so it is monotone along a row
// and both triangles at an edge see the same number; (a-p) x (b-p) and the unordered form lack one or the
// other (accuracy.md, section 4). Pineda, A parallel algorithm for polygon rasterization, SIGGRAPH 1988.
#pragma once

#include <cstdint>
#include <limits>

#include "numeric/mode.h"

namespace rasterbench {

template <class Float>
struct CrossEdges {
  using Real = Float;
  static constexpr bool kMonotone = true;

  /// Edges 01, 12 and 02 of the sorted corners. A sample is inside where, for each e,
  /// dx[e] (y - ay[e]) - dy[e] (x - ax[e]) >= least[e]; dx and dy carry the orientation's sign.
  struct Setup {
    Real ax[3], ay[3], dx[3], dy[3], least[3];
  };

  static ScreenTriangle<Real> corners(const ScreenTriangle<Real>& triangle) { return canonical(triangle); }

  static bool setup(const ScreenTriangle<Real>& t, const SampleGrid& grid, Setup& s) {
    const Real x1 = t.x[1] - t.x[0], y1 = t.y[1] - t.y[0];
    const Real x2 = t.x[2] - t.x[0], y2 = t.y[2] - t.y[0];
    const Real area2 = x1 * y2 - y1 * x2;
    if (area2 == 0) return false;
    for (int e = 0; e < 3; ++e) {
      const Real ex = t.x[kEdgeTo[e]] - t.x[kEdgeFrom[e]];
      const Real ey = t.y[kEdgeTo[e]] - t.y[kEdgeFrom[e]];
      const bool flip = is_flipped(area2 < 0, e);
      s.ax[e] = t.x[kEdgeFrom[e]];
      s.ay[e] = t.y[kEdgeFrom[e]];
      s.dx[e] = flip ? -ex : ex;
      s.dy[e] = flip ? -ey : ey;
      s.least[e] = grid.fill == FillRule::kClosed || owns_edge(s.dx[e], s.dy[e])
                       ? Real{0}
                       : std::numeric_limits<Real>::denorm_min();
    }
    return true;
  }

  static Real value(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    const Real sx = static_cast<Real>(x) + Real{0.5};
    const Real sy = static_cast<Real>(y) + Real{0.5};
    return s.dx[e] * (sy - s.ay[e]) - s.dy[e] * (sx - s.ax[e]);
  }

  static bool inside_edge(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    return value(s, e, x, y) >= s.least[e];
  }
};

}  // namespace rasterbench
