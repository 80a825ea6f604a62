// What vectorised loops over triangles share: snapping and edges of mode fixed_8, and corners, depth planes
// and keys, which those of mode filtered use too. Compiled once for each instruction set: to be included
// after hwy/highway.h by a file that hwy/foreach_target.h includes again and again.
#if defined(RASTERBENCH_KERNELS_FIXED_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef RASTERBENCH_KERNELS_FIXED_LANES_INL_H_
#undef RASTERBENCH_KERNELS_FIXED_LANES_INL_H_
#else
#define RASTERBENCH_KERNELS_FIXED_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <iterator>

#include "numeric/mode.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Integers = hn::ScalableTag<std::int32_t>;
using Codes = hn::ScalableTag<std::uint32_t>;
constexpr Floats kFloats;
constexpr Integers kIntegers;
constexpr Codes kCodes;
constexpr std::size_t kLanes = hn::MaxLanes(kFloats);

using Float = hn::Vec<Floats>;
using Integer = hn::Vec<Integers>;
using FloatMask = hn::Mask<Floats>;
using IntegerMask = hn::Mask<Integers>;

/// first, first + 1, ... Highway 1.0's Iota() builds its vector in memory lane by lane, and waits for it.
template <class D>
HWY_INLINE hn::Vec<D> counting_from(D d, hn::TFromD<D> first) {
  alignas(64) static constexpr hn::TFromD<D> kCounting[] = {0, 1, 2,  3,  4,  5,  6,  7,
                                                            8, 9, 10, 11, 12, 13, 14, 15};
  static_assert(hn::MaxLanes(D()) <= std::size(kCounting));
  return hn::Add(hn::Load(d, kCounting), hn::Set(d, first));
}

/// encode() of numeric/mode.h.
template <class D, class V>
HWY_INLINE hn::Vec<hn::RebindToUnsigned<D>> encode(D d, V depth) {
  const hn::RebindToUnsigned<D> du;
  const hn::RebindToSigned<D> di;
  const auto bits = hn::BitCast(du, hn::Add(depth, hn::Zero(d)));
  const auto sign = hn::BitCast(du, hn::ShiftRight<31>(hn::BitCast(di, bits)));  // all ones where negative
  return hn::Xor(bits, hn::Or(sign, hn::Set(du, 0x80000000u)));
}

/// The clamp of DepthPlane: of a NaN, Max gives its second argument.
template <class V>
HWY_INLINE V clamped(V depth, V low, V high) {
  return hn::Min(hn::Max(depth, low), high);
}

/// A coordinate in 1/256 px, to the nearest, ties to even.
HWY_INLINE Integer snapped(Float pixels) {
  return hn::ConvertTo(kIntegers, hn::Round(hn::Mul(pixels, hn::Set(kFloats, 256.0f))));
}

/// The pixel of the first sample at or after a coordinate, and that behind the last one before or at it.
HWY_INLINE Integer first_pixel(Integer grid) {
  return hn::ShiftRight<8>(hn::Add(grid, hn::Set(kIntegers, 127)));
}
HWY_INLINE Integer end_pixel(Integer grid) {
  return hn::Add(hn::ShiftRight<8>(hn::Sub(grid, hn::Set(kIntegers, 128))), hn::Set(kIntegers, 1));
}

/// A corner of each lane's triangle, and its depth.
template <class Coordinate>
struct LaneCornerOf {
  Coordinate x, y;
  Float d;
};
using LaneCorner = LaneCornerOf<Integer>;  // in 1/256 px

/// sort_corners() of numeric/mode.h.
template <class Coordinate>
HWY_INLINE void sort_corners(LaneCornerOf<Coordinate>& a, LaneCornerOf<Coordinate>& b) {
  const auto before = [](Coordinate u, Coordinate v, auto otherwise)
                          HWY_ATTR { return hn::Or(hn::Lt(u, v), hn::And(hn::Eq(u, v), otherwise)); };
  const auto depth_before = hn::RebindMask(hn::DFromV<Coordinate>(), hn::Le(a.d, b.d));
  const auto ordered = before(a.x, b.x, before(a.y, b.y, depth_before));
  const auto ordered_float = hn::RebindMask(kFloats, ordered);
  const LaneCornerOf<Coordinate> u = a, v = b;
  a = {hn::IfThenElse(ordered, u.x, v.x), hn::IfThenElse(ordered, u.y, v.y),
       hn::IfThenElse(ordered_float, u.d, v.d)};
  b = {hn::IfThenElse(ordered, v.x, u.x), hn::IfThenElse(ordered, v.y, u.y),
       hn::IfThenElse(ordered_float, v.d, u.d)};
}

template <class Coordinate>
HWY_INLINE void sort_corners(LaneCornerOf<Coordinate> (&c)[3]) {
  sort_corners(c[0], c[1]);
  sort_corners(c[1], c[2]);
  sort_corners(c[0], c[1]);
}

/// The depth plane of each lane, as in PlaneDepth<float, float>.
struct LanePlane {
  Float d0, gx, gy, low, high, x0, y0;
};

/// Of sorted corners.
HWY_INLINE LanePlane depth_plane(const LaneCorner (&c)[3]) {
  const auto in_pixels = [](Integer grid) HWY_ATTR {  // exact: a power of two
    return hn::Mul(hn::ConvertTo(kFloats, grid), hn::Set(kFloats, 1.0f / 256));
  };
  LanePlane plane;
  plane.x0 = in_pixels(c[0].x);
  plane.y0 = in_pixels(c[0].y);
  const auto x1 = hn::Sub(in_pixels(c[1].x), plane.x0), y1 = hn::Sub(in_pixels(c[1].y), plane.y0);
  const auto x2 = hn::Sub(in_pixels(c[2].x), plane.x0), y2 = hn::Sub(in_pixels(c[2].y), plane.y0);
  const auto d1 = hn::Sub(c[1].d, c[0].d), d2 = hn::Sub(c[2].d, c[0].d);
  const auto area = hn::Sub(hn::Mul(x1, y2), hn::Mul(y1, x2));
  plane.d0 = c[0].d;
  plane.gx = hn::Div(hn::Sub(hn::Mul(d1, y2), hn::Mul(d2, y1)), area);
  plane.gy = hn::Div(hn::Sub(hn::Mul(d2, x1), hn::Mul(d1, x2)), area);
  plane.low = hn::Min(hn::Min(c[0].d, c[1].d), c[2].d);
  plane.high = hn::Max(hn::Max(c[0].d, c[1].d), c[2].d);
  return plane;
}

/// The samples of pixels, in pixels: exact, since pixel numbers are small integers.
HWY_INLINE Float sample_of(Integer pixels) {
  return hn::Add(hn::ConvertTo(kFloats, pixels), hn::Set(kFloats, 0.5f));
}

/// What a row of samples adds to the plane, and the depth at a column.
HWY_INLINE Float depth_of_row(const LanePlane& plane, Float sample_y) {
  return hn::Add(plane.d0, hn::Mul(plane.gy, hn::Sub(sample_y, plane.y0)));
}
HWY_INLINE Float depth_at(const LanePlane& plane, Float of_row, Float sample_x) {
  return clamped(hn::Add(of_row, hn::Mul(plane.gx, hn::Sub(sample_x, plane.x0))), plane.low, plane.high);
}

/// The edges of small triangles, as in FixedEdges: of a few pixels, near which they are evaluated too, so
/// that 32 bits hold every product.
struct SmallEdges {
  Integer value[3];  ///< at the first sample of the box, less what counts as inside: inside where >= 0
  Integer per_column[3], per_row[3];
  IntegerMask draws;  ///< has an area
};

/// Of sorted corners; box_x, box_y: the first pixel of each lane's box.
HWY_INLINE SmallEdges small_edges(const LaneCorner (&c)[3], Integer box_x, Integer box_y, FillRule fill) {
  SmallEdges s;
  const auto zero = hn::Zero(kIntegers);
  const auto area2 = hn::Sub(hn::Mul(hn::Sub(c[1].x, c[0].x), hn::Sub(c[2].y, c[0].y)),
                             hn::Mul(hn::Sub(c[1].y, c[0].y), hn::Sub(c[2].x, c[0].x)));
  s.draws = hn::Ne(area2, zero);
  const auto half = hn::Set(kIntegers, 128);
  const auto sample_x = hn::Add(hn::ShiftLeft<8>(box_x), half),
             sample_y = hn::Add(hn::ShiftLeft<8>(box_y), half);
  const auto is_negative = hn::Lt(area2, zero);
  for (int e = 0; e < 3; ++e) {
    const LaneCorner &from = c[kEdgeFrom[e]], &to = c[kEdgeTo[e]];
    const auto flip = e == 2 ? hn::Not(is_negative) : is_negative;
    const auto ex = hn::Sub(to.x, from.x), ey = hn::Sub(to.y, from.y);
    const auto dx = hn::IfThenElse(flip, hn::Neg(ex), ex), dy = hn::IfThenElse(flip, hn::Neg(ey), ey);
    auto value = hn::Sub(hn::Mul(dx, hn::Sub(sample_y, from.y)), hn::Mul(dy, hn::Sub(sample_x, from.x)));
    if (fill == FillRule::kTopLeft) {
      const auto owned = hn::Or(hn::Lt(dy, zero), hn::And(hn::Eq(dy, zero), hn::Gt(dx, zero)));
      value = hn::Sub(value, hn::IfThenZeroElse(owned, hn::Set(kIntegers, 1)));
    }
    s.value[e] = value;
    s.per_column[e] = hn::Neg(hn::ShiftLeft<8>(dy));
    s.per_row[e] = hn::ShiftLeft<8>(dx);
  }
  return s;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
