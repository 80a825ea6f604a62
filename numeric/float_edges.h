// Edge functions and depth in one floating-point format: the modes f32 and f64.
//
// The edge from a to b at p is (b-a) x (p-a), its end points in lexicographic order and the sign restored.
// Written so it is monotone along a row and both triangles at an edge see the same number; (a-p) x (b-p) and
// the unordered form lack one or the other (accuracy.md, section 4). Pineda, A parallel algorithm for polygon
// rasterization, SIGGRAPH 1988.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "numeric/mode.h"

namespace rasterbench {

template <class Float>
struct FloatEdges {
  using Real = Float;

  /// Edges 01, 12 and 02 of the sorted corners. A sample is inside where, for each e,
  /// dx[e] (y - ay[e]) - dy[e] (x - ax[e]) >= least[e]; dx and dy carry the orientation's sign.
  struct Prepared {
    PixelBox box;
    Real ax[3], ay[3], dx[3], dy[3], least[3];
    DepthPlane<Real> plane;
    std::uint32_t rank;
  };

  static Prepared prepare(const ScreenTriangle<Real>& triangle, FillRule fill, std::uint32_t rank) {
    const ScreenTriangle<Real> t = canonical(triangle);
    Prepared p{};
    p.rank = rank;
    const Real x1 = t.x[1] - t.x[0], y1 = t.y[1] - t.y[0];
    const Real x2 = t.x[2] - t.x[0], y2 = t.y[2] - t.y[0];
    const Real area2 = x1 * y2 - y1 * x2;
    if (area2 == 0) return p;  // draws nothing: the box stays empty
    constexpr int kFrom[3] = {0, 1, 0};
    constexpr int kTo[3] = {1, 2, 2};
    for (int e = 0; e < 3; ++e) {
      // Edge 02 runs against the loop 0 -> 1 -> 2 -> 0, hence the opposite sign.
      const bool flip = (area2 < 0) != (e == 2);
      const Real ex = t.x[kTo[e]] - t.x[kFrom[e]];
      const Real ey = t.y[kTo[e]] - t.y[kFrom[e]];
      p.ax[e] = t.x[kFrom[e]];
      p.ay[e] = t.y[kFrom[e]];
      p.dx[e] = flip ? -ex : ex;
      p.dy[e] = flip ? -ey : ey;
      // y points down: the inside is to the right of an edge where dy < 0 (a left edge), below a level one
      // where dx > 0.
      const bool owns = p.dy[e] < 0 || (p.dy[e] == 0 && p.dx[e] > 0);
      p.least[e] = fill == FillRule::kClosed || owns ? Real{0} : std::numeric_limits<Real>::denorm_min();
    }
    p.box = sample_box(t);
    p.plane = DepthPlane<Real>::through(t.d, x1, y1, x2, y2, area2);
    return p;
  }

  static bool inside_edge(const Prepared& p, int e, std::int32_t x, std::int32_t y) {
    const Real sx = static_cast<Real>(x) + Real{0.5};
    const Real sy = static_cast<Real>(y) + Real{0.5};
    return p.dx[e] * (sy - p.ay[e]) - p.dy[e] * (sx - p.ax[e]) >= p.least[e];
  }

  static bool inside(const Prepared& p, std::int32_t x, std::int32_t y) {
    return inside_edge(p, 0, x, y) && inside_edge(p, 1, x, y) && inside_edge(p, 2, x, y);
  }

  static Real depth(const Prepared& p, std::int32_t x, std::int32_t y) {
    // The anchor of the plane is the first corner, which is also the origin of edge 0.
    return p.plane.at((static_cast<Real>(x) + Real{0.5}) - p.ax[0],
                      (static_cast<Real>(y) + Real{0.5}) - p.ay[0]);
  }

 private:
  /// Pixels whose samples lie within the corners' extents, edges included. Subtracting one half is exact
  /// wherever the result can decide a pixel of the image.
  static PixelBox sample_box(const ScreenTriangle<Real>& t) {
    const double low_x = std::min({t.x[0], t.x[1], t.x[2]}), high_x = std::max({t.x[0], t.x[1], t.x[2]});
    const double low_y = std::min({t.y[0], t.y[1], t.y[2]}), high_y = std::max({t.y[0], t.y[1], t.y[2]});
    return {static_cast<std::int32_t>(std::ceil(low_x - 0.5)),
            static_cast<std::int32_t>(std::ceil(low_y - 0.5)),
            static_cast<std::int32_t>(std::floor(high_x - 0.5)) + 1,
            static_cast<std::int32_t>(std::floor(high_y - 0.5)) + 1};
  }
};

}  // namespace rasterbench
