// Mode fixed_8: vertices snapped to 1/256 px, edge functions in exact integers, depth in float32.
//
// The snapping and the integers are those of Direct3D 11.3, 3.4.1 (n.8 fixed point), and of Mesa's llvmpipe.
// Integers make order, tiles and instruction sets free: coverage of the snapped triangle is exact.
#pragma once

#include <cmath>
#include <cstdint>

#include "numeric/mode.h"

namespace rasterbench {

struct Fixed8 : PackedKeys {
  using Real = float;
  static constexpr int kFractionBits = 8;
  static constexpr std::int32_t kOne = 1 << kFractionBits;  ///< one pixel
  static constexpr std::int32_t kHalf = kOne / 2;           ///< from a pixel's corner to its sample

  static constexpr ModeInfo kInfo{
      .name = "fixed_8",
      .vertices = "float32, snapped to 1/256 px (round to nearest, ties to even)",
      .edges = "int64, exact",
      .depth = "float32, plane through the first snapped corner, clamped",
      .bound = "a centre is misclassified only within 0.707/256 px of an edge; exact on the snapped vertices",
      .numbers = {.vertex_unit = 0x1p-24, .snap = 0x1p-9, .edge_unit = 0, .depth_unit = 0x1p-24}};

  /// Edges 01, 12 and 02 of the sorted snapped corners, in 1/256 px; |coordinate| <= 2^25, so products fit in
  /// 2^53. A sample is inside where, for each e, dx[e] (y - ay[e]) - dy[e] (x - ax[e]) >= least[e].
  struct Prepared {
    PixelBox box;
    std::int32_t ax[3], ay[3], dx[3], dy[3], least[3];
    DepthPlane<float> plane;
    std::uint32_t rank;
  };

  static Prepared prepare(const ScreenTriangle<float>& triangle, FillRule fill, std::uint32_t rank) {
    ScreenTriangle<float> snapped = triangle;
    for (int i = 0; i < 3; ++i) {
      snapped.x[i] = std::nearbyint(triangle.x[i] * kOne);  // the product is exact: a power of two
      snapped.y[i] = std::nearbyint(triangle.y[i] * kOne);
    }
    const ScreenTriangle<float> t = canonical(snapped);
    std::int32_t x[3], y[3];
    for (int i = 0; i < 3; ++i) {
      x[i] = static_cast<std::int32_t>(t.x[i]);
      y[i] = static_cast<std::int32_t>(t.y[i]);
    }
    Prepared p{};
    p.rank = rank;
    const std::int32_t x1 = x[1] - x[0], y1 = y[1] - y[0], x2 = x[2] - x[0], y2 = y[2] - y[0];
    const std::int64_t area2 = std::int64_t{x1} * y2 - std::int64_t{y1} * x2;
    if (area2 == 0) return p;  // draws nothing: the box stays empty
    constexpr int kFrom[3] = {0, 1, 0};
    constexpr int kTo[3] = {1, 2, 2};
    for (int e = 0; e < 3; ++e) {
      // Edge 02 runs against the loop 0 -> 1 -> 2 -> 0, hence the opposite sign.
      const std::int32_t sign = (area2 < 0) != (e == 2) ? -1 : 1;
      p.ax[e] = x[kFrom[e]];
      p.ay[e] = y[kFrom[e]];
      p.dx[e] = sign * (x[kTo[e]] - x[kFrom[e]]);
      p.dy[e] = sign * (y[kTo[e]] - y[kFrom[e]]);
      // y points down: the inside is to the right of an edge where dy < 0 (a left edge), below a level one
      // where dx > 0.
      const bool owns = p.dy[e] < 0 || (p.dy[e] == 0 && p.dx[e] > 0);
      p.least[e] = fill == FillRule::kClosed || owns ? 0 : 1;
    }
    // Samples at kOne * j + kHalf within the extents; >> rounds down, also below zero.
    p.box = {(x[0] + kHalf - 1) >> kFractionBits, (std::min({y[0], y[1], y[2]}) + kHalf - 1) >> kFractionBits,
             ((x[2] - kHalf) >> kFractionBits) + 1,
             ((std::max({y[0], y[1], y[2]}) - kHalf) >> kFractionBits) + 1};
    p.plane =
        DepthPlane<float>::through(t.d, static_cast<float>(x1), static_cast<float>(y1),
                                   static_cast<float>(x2), static_cast<float>(y2), static_cast<float>(area2));
    return p;
  }

  static bool inside_edge(const Prepared& p, int e, std::int32_t x, std::int32_t y) {
    const std::int64_t sx = x * kOne + kHalf;
    const std::int64_t sy = y * kOne + kHalf;
    return p.dx[e] * (sy - p.ay[e]) - p.dy[e] * (sx - p.ax[e]) >= p.least[e];
  }

  static bool inside(const Prepared& p, std::int32_t x, std::int32_t y) {
    return inside_edge(p, 0, x, y) && inside_edge(p, 1, x, y) && inside_edge(p, 2, x, y);
  }

  static float depth(const Prepared& p, std::int32_t x, std::int32_t y) {
    // The anchor of the plane is the first corner, which is also the origin of edge 0.
    return p.plane.at(static_cast<float>(x * kOne + kHalf - p.ax[0]),
                      static_cast<float>(y * kOne + kHalf - p.ay[0]));
  }
};

}  // namespace rasterbench
