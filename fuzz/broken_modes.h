// Numeric modes that are broken on purpose: what the fuzzer has to find.
#pragma once

#include <cmath>

#include "numeric/modes.h"

namespace rasterbench::fuzz {

constexpr ModeInfo broken_info(std::string_view name, const ModeBound& claimed) {
  ModeInfo info{};
  info.name = name;
  info.numbers = claimed;
  return info;
}

/// Edge functions (a-p) x (b-p) with the corners as they come and one product fused: the two windings round
/// differently, and so do the two triangles at an edge (accuracy.md, section 4).
struct UnorderedFmaEdges {
  using Real = float;
  static constexpr bool kMonotone = false;
  struct Setup {
    float x[3], y[3], sign;
  };
  static ScreenTriangle<float> corners(const ScreenTriangle<float>& t) { return t; }
  static bool setup(const ScreenTriangle<float>& t, const SampleGrid&, Setup& s) {
    const int orientation = exact_orientation(t.x[0], t.y[0], t.x[1], t.y[1], t.x[2], t.y[2]);
    for (int i = 0; i < 3; ++i) {
      s.x[i] = t.x[i];
      s.y[i] = t.y[i];
    }
    s.sign = static_cast<float>(orientation);
    return orientation != 0;
  }
  static float value(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    const float px = static_cast<float>(x) + 0.5f, py = static_cast<float>(y) + 0.5f;
    const int next = (e + 1) % 3;
    const float ax = s.x[e] - px, ay = s.y[e] - py, bx = s.x[next] - px, by = s.y[next] - py;
    return s.sign * std::fma(ax, by, -(ay * bx));
  }
  static bool inside_edge(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    return value(s, e, x, y) >= 0;
  }
};
struct UnorderedFma : Combined<UnorderedFmaEdges, F32Depth> {
  static constexpr ModeInfo kInfo = broken_info("unordered_fma", kF32Bound);
};

/// The last column of every box is forgotten.
struct NarrowBox : Filtered {
  static constexpr ModeInfo kInfo = broken_info("narrow_box", Filtered::kInfo.numbers);
  static Prepared prepare(const ScreenTriangle<float>& t, const SampleGrid& grid, std::uint32_t rank) {
    Prepared p = Filtered::prepare(t, grid, rank);
    --p.box.x1;
    return p;
  }
};

/// Of equal depths the one that is drawn first wins, whatever its rank.
struct TieByOrder : Filtered {
  static constexpr ModeInfo kInfo = broken_info("tie_by_order", Filtered::kInfo.numbers);
  template <class Depth>
  static Key key(Depth depth, std::uint32_t) {
    return Filtered::key(depth, 0);
  }
};

/// Top-left with the wrong sides: bottom and right edges are owned.
struct BottomRight : Filtered {
  static constexpr ModeInfo kInfo = broken_info("bottom_right", Filtered::kInfo.numbers);
  static Prepared prepare(const ScreenTriangle<float>& t, const SampleGrid& grid, std::uint32_t rank) {
    Prepared p = Filtered::prepare(t, grid, rank);
    if (grid.fill == FillRule::kTopLeft)
      for (auto& least : p.least) least = static_cast<std::int8_t>(1 - least);
    return p;
  }
};

/// The gradients of the depth are mistaken for each other.
struct SwappedDepths : Filtered {
  static constexpr ModeInfo kInfo = broken_info("swapped_depths", Filtered::kInfo.numbers);
  static Prepared prepare(const ScreenTriangle<float>& t, const SampleGrid& grid, std::uint32_t rank) {
    Prepared p = Filtered::prepare(t, grid, rank);
    std::swap(p.plane.gx, p.plane.gy);
    return p;
  }
};

/// A bound that the mode does not keep: A x + B y + C has larger errors than (b-a)x(p-a).
struct PlaneThatClaimsCross : F32Plane {
  static constexpr ModeInfo kInfo = broken_info("plane_that_claims_cross", kF32Bound);
};
struct GridThatClaimsAFinerOne : Fixed4 {
  static constexpr ModeInfo kInfo = broken_info("grid_that_claims_a_finer_one", fixed_bound(6));
};

/// A filter that trusts float32 more than it may.
struct TrustingFilter : Filtered {
  static constexpr ModeInfo kInfo = broken_info("trusting_filter", Filtered::kInfo.numbers);
  static Prepared prepare(const ScreenTriangle<float>& t, const SampleGrid& grid, std::uint32_t rank) {
    Prepared p = Filtered::prepare(t, grid, rank);
    p.error *= 0.01f;
    return p;
  }
};

}  // namespace rasterbench::fuzz
