// World triangles -> vectors, a triangle in each lane. To be included as stream_lanes-inl.h is.
#if defined(RASTERBENCH_PIPELINE_TRIANGLE_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef RASTERBENCH_PIPELINE_TRIANGLE_LANES_INL_H_
#undef RASTERBENCH_PIPELINE_TRIANGLE_LANES_INL_H_
#else
#define RASTERBENCH_PIPELINE_TRIANGLE_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "scene/model.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// A point in each lane.
struct LanePoint {
  hn::Vec<hn::ScalableTag<double>> x, y, z;
};

/// A triangle in each lane, in world space.
struct LaneTriangle {
  LanePoint a, b, c;
};

#if HWY_TARGET != HWY_SCALAR
/// Of the coordinates a.x, a.y, ..., c.z of each lane's triangle the four from `first` on, a vector each.
/// Blocks of four by four are transposed in registers: gathers cost more than all the arithmetic on some
/// CPUs. D: 4 or 8 floats.
template <class D, class TriangleOf>
HWY_INLINE void load_four(D d, TriangleOf triangle_of, std::size_t first, hn::Vec<D> (&out)[4]) {
  const auto row = [&](std::size_t lane) HWY_ATTR {
    const float* const from = &triangle_of(lane)->a.x + first;
    if constexpr (hn::MaxLanes(D()) == 4) {
      return hn::LoadU(d, from);
    } else {
      constexpr hn::Half<D> kBlock;
      return hn::Combine(d, hn::LoadU(kBlock, &triangle_of(lane + 4)->a.x + first), hn::LoadU(kBlock, from));
    }
  };
  const auto row0 = row(0), row1 = row(1), row2 = row(2), row3 = row(3);
  constexpr hn::Repartition<double, D> kPairs;
  const auto pairs = [&](auto v) HWY_ATTR { return hn::BitCast(kPairs, v); };
  const auto low01 = pairs(hn::InterleaveLower(d, row0, row1)),
             high01 = pairs(hn::InterleaveUpper(d, row0, row1));
  const auto low23 = pairs(hn::InterleaveLower(d, row2, row3)),
             high23 = pairs(hn::InterleaveUpper(d, row2, row3));
  out[0] = hn::BitCast(d, hn::InterleaveLower(kPairs, low01, low23));
  out[1] = hn::BitCast(d, hn::InterleaveUpper(kPairs, low01, low23));
  out[2] = hn::BitCast(d, hn::InterleaveLower(kPairs, high01, high23));
  out[3] = hn::BitCast(d, hn::InterleaveUpper(kPairs, high01, high23));
}
#endif

template <class D, class TriangleOf>
HWY_INLINE LaneTriangle load_triangles(D d, TriangleOf triangle_of) {
  static_assert(sizeof(Triangle) == 9 * sizeof(float));
  const auto wide = [](hn::Vec<D> v) HWY_ATTR { return hn::PromoteTo(hn::ScalableTag<double>(), v); };
  if constexpr (hn::MaxLanes(D()) >= 4) {
    hn::Vec<D> first[4], middle[4], last[4];
    load_four(d, triangle_of, 0, first);
    load_four(d, triangle_of, 4, middle);
    load_four(d, triangle_of, 5, last);  // nothing beyond a triangle is read; what is not used is not made
    return {{wide(first[0]), wide(first[1]), wide(first[2])},
            {wide(first[3]), wide(middle[0]), wide(middle[1])},
            {wide(middle[2]), wide(middle[3]), wide(last[3])}};
  } else {
    constexpr std::size_t kLanes = hn::MaxLanes(D());
    alignas(64) float coordinates[9][kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      for (std::size_t i = 0; i < 9; ++i) coordinates[i][lane] = (&triangle_of(lane)->a.x)[i];
    const auto at = [&](std::size_t i) HWY_ATTR { return wide(hn::Load(d, coordinates[i])); };
    return {{at(0), at(1), at(2)}, {at(3), at(4), at(5)}, {at(6), at(7), at(8)}};
  }
}

/// The triangles triangle_of(lane), of which every lane has one.
template <class TriangleOf>
HWY_INLINE LaneTriangle load_triangles(TriangleOf triangle_of) {
  return load_triangles(hn::Rebind<float, hn::ScalableTag<double>>(), triangle_of);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
