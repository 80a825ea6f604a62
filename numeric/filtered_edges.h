// Edge functions in float32 with an a-priori error bound per edge, and exact where the sign is uncertain: no
// coverage error at nearly the cost of float32.
//
// A floating-point filter (Fortune & Van Wyk, Efficient exact arithmetic for computational geometry, SoCG
// 1993) whose bound is computed once per triangle, from its extents: "model only what a scene requires".
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "numeric/cross_edges.h"
#include "numeric/exact_sign.h"

namespace rasterbench {

struct FilteredEdges {
  using Real = float;
  static constexpr bool kMonotone = true;  // so is the exact sign

  /// As CrossEdges, with the error of every edge function at samples of the box; x, y are the sorted corners.
  struct Setup {
    float ax[3], ay[3], dx[3], dy[3];
    float error;
    float x[3], y[3];
    std::int8_t sign[3];   ///< of edge e, so that the inside is positive
    std::int8_t least[3];  ///< smallest sign that is inside: 0, or 1 where the edge is not owned
  };

  static ScreenTriangle<float> corners(const ScreenTriangle<float>& triangle) { return canonical(triangle); }

  static bool setup(const ScreenTriangle<float>& t, const SampleGrid& grid, Setup& s) {
    const int orientation = orientation_of(t);
    if (orientation == 0) return false;
    const double width = double{t.x[2]} - double{t.x[0]};
    const double height =
        double{std::max({t.y[0], t.y[1], t.y[2]})} - double{std::min({t.y[0], t.y[1], t.y[2]})};
    double size = 0;
    for (int e = 0; e < 3; ++e) {
      const int a = kEdgeFrom[e], b = kEdgeTo[e];
      const bool flip = is_flipped(orientation < 0, e);
      const float ex = t.x[b] - t.x[a], ey = t.y[b] - t.y[a];
      s.x[e] = t.x[e];
      s.y[e] = t.y[e];
      s.ax[e] = t.x[a];
      s.ay[e] = t.y[a];
      s.dx[e] = flip ? -ex : ex;
      s.dy[e] = flip ? -ey : ey;
      s.sign[e] = flip ? -1 : 1;
      // Differences of float32 numbers have the sign of the exact ones, so that ownership is exact.
      s.least[e] = grid.fill == FillRule::kClosed || owns_edge(s.dx[e], s.dy[e]) ? 0 : 1;
      size = std::max(size, std::abs(double{ex}) * height + std::abs(double{ey}) * width);
    }
    // Within the box |y - ay| <= height and |x - ax| <= width. Each product carries three roundings of 2^-24
    // and their difference one more: 4 u (|dx| height + |dy| width) and terms of second order, for which 5
    // instead of 4 is ample, as for the rounding of this line; underflow adds less than 2^-140.
    s.error = static_cast<float>(5 * 0x1p-24 * size + 0x1p-140);
    return true;
  }

  static float value(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    const float sx = static_cast<float>(x) + 0.5f;
    const float sy = static_cast<float>(y) + 0.5f;
    return s.dx[e] * (sy - s.ay[e]) - s.dy[e] * (sx - s.ax[e]);
  }

  static bool inside_edge(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    const float filter = value(s, e, x, y);
    if (filter > s.error) return true;
    if (filter < -s.error) return false;
    return exactly_inside_edge(s, e, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
  }

  /// All three edges at once: a sample is certain by the smallest of their values.
  static bool inside(const Setup& s, std::int32_t x, std::int32_t y) {
    const float smallest = std::min({value(s, 0, x, y), value(s, 1, x, y), value(s, 2, x, y)});
    if (smallest < -s.error) return false;
    if (smallest > s.error) return true;
    return inside_edge(s, 0, x, y) && inside_edge(s, 1, x, y) && inside_edge(s, 2, x, y);
  }

 private:
  static int orientation_of(const ScreenTriangle<float>& t) {
    const double x1 = double{t.x[1]} - double{t.x[0]}, y1 = double{t.y[1]} - double{t.y[0]};
    const double x2 = double{t.x[2]} - double{t.x[0]}, y2 = double{t.y[2]} - double{t.y[0]};
    const double forth = x1 * y2, back = y1 * x2;
    // Three roundings a product and one of their difference, each of 2^-53 (no underflow: the smallest
    // product of float32 differences is 2^-298).
    const double error = 5 * 0x1p-53 * (std::abs(forth) + std::abs(back));
    if (forth - back > error) return 1;
    if (forth - back < -error) return -1;
    return exact_orientation(t.x[0], t.y[0], t.x[1], t.y[1], t.x[2], t.y[2]);
  }

  /// Out of line: it is rare, and the loops are shorter without it.
  [[gnu::noinline]] static bool exactly_inside_edge(const Setup& s, int e, float sx, float sy) {
    const int b = kEdgeTo[e];
    return s.sign[e] * exact_orientation(s.ax[e], s.ay[e], s.x[b], s.y[b], sx, sy) >= s.least[e];
  }
};

}  // namespace rasterbench
