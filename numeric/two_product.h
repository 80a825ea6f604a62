// Mode two_product: the literal program of the course text (INFO0939), in float32 normalised device
// coordinates: a sample is inside where two products of edge functions are not negative, and depth is
// interpolated with the same edge functions as barycentric coordinates.
//
// The base of the trade between speed and accuracy, and unbounded: both products vanish on the whole line
// AB, wherever on it the sample lies. Its screen vertices are those of every other mode, taken to normalised
// device coordinates in double and rounded once.
#pragma once

#include <algorithm>
#include <cstdint>

#include "numeric/mode.h"

namespace rasterbench {

struct TwoProduct : PackedKeys {
  using Real = float;
  static constexpr bool kMonotone = false;

  struct Prepared {
    PixelBox box;
    float x[3], y[3], d[3];
    float low, high;
    float width, height;
    std::uint32_t rank;
  };

  static Prepared prepare(const ScreenTriangle<float>& t, const SampleGrid& grid, std::uint32_t rank) {
    Prepared p{};
    p.rank = rank;
    p.width = static_cast<float>(grid.width);
    p.height = static_cast<float>(grid.height);
    for (int i = 0; i < 3; ++i) {
      p.x[i] = static_cast<float>(2 * double{t.x[i]} / grid.width - 1);
      p.y[i] = static_cast<float>(1 - 2 * double{t.y[i]} / grid.height);
      p.d[i] = t.d[i];
    }
    p.low = std::min({t.d[0], t.d[1], t.d[2]});
    p.high = std::max({t.d[0], t.d[1], t.d[2]});
    p.box = sample_box(t);
    return p;
  }

  /// Edge function e of the sample: (corner e - sample) x (corner e+1 - sample).
  static float edge_value(const Prepared& p, int e, std::int32_t x, std::int32_t y) {
    const float sx = 2 * (static_cast<float>(x) + 0.5f) / p.width - 1;
    const float sy = 1 - 2 * (static_cast<float>(y) + 0.5f) / p.height;
    const int next = e == 2 ? 0 : e + 1;
    return (p.x[e] - sx) * (p.y[next] - sy) - (p.x[next] - sx) * (p.y[e] - sy);
  }

  /// There are two tests here, not three: the products with the edge function of AB.
  static bool inside_edge(const Prepared& p, int e, std::int32_t x, std::int32_t y) {
    return e == 0 || edge_value(p, 0, x, y) * edge_value(p, e, x, y) >= 0;
  }

  static bool inside(const Prepared& p, std::int32_t x, std::int32_t y) {
    return inside_edge(p, 1, x, y) && inside_edge(p, 2, x, y);
  }

  static float depth(const Prepared& p, std::int32_t x, std::int32_t y) {
    const float ab = edge_value(p, 0, x, y), bc = edge_value(p, 1, x, y), ca = edge_value(p, 2, x, y);
    const float depth = (bc * p.d[0] + ca * p.d[1] + ab * p.d[2]) / (ab + bc + ca);
    const float raised = depth > p.low ? depth : p.low;  // 0 / 0 becomes the smallest
    return raised < p.high ? raised : p.high;
  }
};

}  // namespace rasterbench
