// Edge functions A x + B y + C in float32: the form of most textbooks and the cheapest to step, with errors
// that grow with the distance from the image's origin instead of from the edge.
#pragma once

#include "numeric/cross_edges.h"

namespace rasterbench {

struct PlaneEdges {
  using Real = float;
  static constexpr bool kMonotone = true;

  /// A sample is inside where, for each e, (dx[e] y - dy[e] x) + c[e] >= least[e].
  struct Setup {
    float dx[3], dy[3], c[3], least[3];
  };

  static ScreenTriangle<float> corners(const ScreenTriangle<float>& triangle) { return canonical(triangle); }

  static bool setup(const ScreenTriangle<float>& t, const SampleGrid& grid, Setup& s) {
    CrossEdges<float>::Setup cross;
    if (!CrossEdges<float>::setup(t, grid, cross)) return false;
    for (int e = 0; e < 3; ++e) {
      s.dx[e] = cross.dx[e];
      s.dy[e] = cross.dy[e];
      s.c[e] = cross.dy[e] * cross.ax[e] - cross.dx[e] * cross.ay[e];
      s.least[e] = cross.least[e];
    }
    return true;
  }

  static float value(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    const float sx = static_cast<float>(x) + 0.5f;
    const float sy = static_cast<float>(y) + 0.5f;
    return (s.dx[e] * sy - s.dy[e] * sx) + s.c[e];
  }

  static bool inside_edge(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    return value(s, e, x, y) >= s.least[e];
  }
};

}  // namespace rasterbench
