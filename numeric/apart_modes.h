// Modes whose arithmetic is compiled apart (apart.h): fused multiply-adds and -ffast-math.
#pragma once

#include "numeric/apart.h"
#include "numeric/mode.h"

namespace rasterbench {

/// Evaluates an edge form in one of the variants. Variant has the functions of apart.h.
template <class Variant, apart::Form kForm>
struct ApartMode : PackedKeys {
  using Real = float;
  static constexpr bool kMonotone = false;  // nothing is promised of what a compiler made of it

  struct Prepared : apart::Setup {
    PixelBox box;
    std::uint32_t rank;
  };

  static Prepared prepare(const ScreenTriangle<float>& triangle, const SampleGrid& grid, std::uint32_t rank) {
    const ScreenTriangle<float> t = kForm == apart::Form::kTwoProduct ? triangle : canonical(triangle);
    Prepared p{};
    p.rank = rank;
    const apart::Corners corners{
        {t.x[0], t.x[1], t.x[2]}, {t.y[0], t.y[1], t.y[2]}, {t.d[0], t.d[1], t.d[2]}};
    if (Variant::setup(kForm, corners, grid.fill == FillRule::kClosed, grid.width, grid.height, p))
      p.box = sample_box(t);
    return p;
  }

  static bool inside_edge(const Prepared& p, int e, std::int32_t x, std::int32_t y) {
    return Variant::inside_edge(kForm, p, e, x, y);
  }
  static bool inside(const Prepared& p, std::int32_t x, std::int32_t y) {
    return inside_run(p, x, y, 1) != 0;
  }
  static float edge_value(const Prepared& p, int e, std::int32_t x, std::int32_t y) {
    return Variant::edge_value(kForm, p, e, x, y);
  }
  static float depth(const Prepared& p, std::int32_t x, std::int32_t y) {
    float depth;
    depth_run(p, x, y, 1, &depth);
    return depth;
  }
  static std::uint64_t inside_run(const Prepared& p, std::int32_t x, std::int32_t y, std::int32_t n) {
    return Variant::inside_run(kForm, p, x, y, n);
  }
  static void depth_run(const Prepared& p, std::int32_t x, std::int32_t y, std::int32_t n, float* depths) {
    Variant::depth_run(kForm, p, x, y, n, depths);
  }
};

struct FmaVariant {
  static constexpr auto setup = apart::fma::setup;
  static constexpr auto inside_edge = apart::fma::inside_edge;
  static constexpr auto edge_value = apart::fma::edge_value;
  static constexpr auto inside_run = apart::fma::inside_run;
  static constexpr auto depth_run = apart::fma::depth_run;
};
struct FastmathVariant {
  static constexpr auto setup = apart::fastmath::setup;
  static constexpr auto inside_edge = apart::fastmath::inside_edge;
  static constexpr auto edge_value = apart::fastmath::edge_value;
  static constexpr auto inside_run = apart::fastmath::inside_run;
  static constexpr auto depth_run = apart::fastmath::depth_run;
};

}  // namespace rasterbench
