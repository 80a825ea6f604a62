// Edge functions in exact integers on vertices snapped to a fixed-point grid.
//
// The snapping and the integers are those of Direct3D 11.3, 3.4.1 (n.8 fixed point), and of Mesa's llvmpipe.
// Integers make order, tiles and instruction sets free: coverage of the snapped triangle is exact.
#pragma once

#include <cmath>
#include <cstdint>

#include "numeric/mode.h"

namespace rasterbench {

template <int FractionBits>
struct FixedEdges {
  using Real = float;
  static constexpr bool kMonotone = true;
  static constexpr std::int32_t kOne = 1 << FractionBits;  ///< one pixel
  static constexpr std::int32_t kHalf = kOne / 2;          ///< from a pixel's corner to its sample

  /// Edges 01, 12 and 02 of the sorted snapped corners, in 1/kOne px. With 12 bits |coordinate| <= 2^29, so
  /// that products fit in 2^61. A sample is inside where, for each e,
  /// dx[e] (y - ay[e]) - dy[e] (x - ax[e]) >= least[e].
  struct Setup {
    std::int32_t ax[3], ay[3], dx[3], dy[3], least[3];
  };

  /// Snapped to the nearest, ties to even; in pixels, where they are exact.
  static ScreenTriangle<float> corners(const ScreenTriangle<float>& triangle) {
    ScreenTriangle<float> snapped = triangle;
    for (int i = 0; i < 3; ++i) {
      snapped.x[i] = std::nearbyint(triangle.x[i] * kOne) / kOne;  // scaling is exact: a power of two
      snapped.y[i] = std::nearbyint(triangle.y[i] * kOne) / kOne;
    }
    return canonical(snapped);
  }

  static bool setup(const ScreenTriangle<float>& t, const SampleGrid& grid, Setup& s) {
    std::int32_t x[3], y[3];
    for (int i = 0; i < 3; ++i) {
      x[i] = static_cast<std::int32_t>(t.x[i] * kOne);
      y[i] = static_cast<std::int32_t>(t.y[i] * kOne);
    }
    const std::int32_t x1 = x[1] - x[0], y1 = y[1] - y[0], x2 = x[2] - x[0], y2 = y[2] - y[0];
    const std::int64_t area2 = std::int64_t{x1} * y2 - std::int64_t{y1} * x2;
    if (area2 == 0) return false;
    for (int e = 0; e < 3; ++e) {
      const std::int32_t sign = is_flipped(area2 < 0, e) ? -1 : 1;
      s.ax[e] = x[kEdgeFrom[e]];
      s.ay[e] = y[kEdgeFrom[e]];
      s.dx[e] = sign * (x[kEdgeTo[e]] - x[kEdgeFrom[e]]);
      s.dy[e] = sign * (y[kEdgeTo[e]] - y[kEdgeFrom[e]]);
      s.least[e] = grid.fill == FillRule::kClosed || owns_edge(s.dx[e], s.dy[e]) ? 0 : 1;
    }
    return true;
  }

  /// In 1 / kOne^2 px^2.
  static std::int64_t grid_value(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    const std::int64_t sx = x * kOne + kHalf;
    const std::int64_t sy = y * kOne + kHalf;
    return s.dx[e] * (sy - s.ay[e]) - s.dy[e] * (sx - s.ax[e]);
  }
  static double value(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    return static_cast<double>(grid_value(s, e, x, y)) / (double{kOne} * kOne);
  }

  static bool inside_edge(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    return grid_value(s, e, x, y) >= s.least[e];
  }
};

}  // namespace rasterbench
