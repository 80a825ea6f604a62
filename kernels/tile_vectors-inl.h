// What the vectorised loops of fused_tiles share, in whatever numeric mode: boxes, doubles, stores of some
// lanes. To be included as fixed_lanes-inl.h is.
#if defined(RASTERBENCH_KERNELS_TILE_VECTORS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef RASTERBENCH_KERNELS_TILE_VECTORS_INL_H_
#undef RASTERBENCH_KERNELS_TILE_VECTORS_INL_H_
#else
#define RASTERBENCH_KERNELS_TILE_VECTORS_INL_H_
#endif

#include <hwy/highway.h>

#include <array>
#include <cstddef>
#include <cstdint>

#include "kernels/fixed_lanes-inl.h"

#ifndef RASTERBENCH_KERNELS_LANE_ORDERS
#define RASTERBENCH_KERNELS_LANE_ORDERS
namespace rasterbench {

/// For each set of lanes, as bits, the order that brings them to the front.
template <std::size_t kLanes>
struct LaneOrders {
  struct alignas(4 * kLanes) Order : std::array<std::int32_t, kLanes> {};
  static constexpr std::array<Order, std::size_t{1} << kLanes> kFront = [] {
    std::array<Order, std::size_t{1} << kLanes> orders{};
    for (std::size_t bits = 0; bits < orders.size(); ++bits) {
      std::size_t end = 0;
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        if (bits >> lane & 1) orders[bits][end++] = static_cast<std::int32_t>(lane);
    }
    return orders;
  }();
};

}  // namespace rasterbench
#endif

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

using Doubles = hn::ScalableTag<double>;
using HalfIntegers = hn::Rebind<std::int32_t, Doubles>;  // as many as there are doubles in a vector
using HalfFloats = hn::Rebind<float, Doubles>;
constexpr Doubles kDoubles;
constexpr HalfIntegers kHalfIntegers;
constexpr HalfFloats kHalfFloats;
using Double = hn::Vec<Doubles>;

constexpr auto kWidth = static_cast<std::int32_t>(kLanes);

HWY_INLINE Integer integer(std::int32_t value) { return hn::Set(kIntegers, value); }

HWY_INLINE std::uint32_t bits_of(IntegerMask mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(kIntegers, mask, bytes);
  return bytes[0] | std::uint32_t{bytes[1]} << 8;  // at most 16 lanes
}

/// Side in pixels of the boxes of small triangles.
constexpr int kSmallSide = 4;

/// The pixels of the image in the lanes' boxes.
struct LaneBox {
  Integer x0, y0, x1, y1;

  HWY_INLINE IntegerMask holds_a_sample() const { return hn::And(hn::Lt(x0, x1), hn::Lt(y0, y1)); }
};

/// first_pixel() and end_pixel() of coordinates in pixels, as sample_box() of numeric/mode.h. Within the
/// guard band a float32 holds every half, so that comparing with one is exact where subtracting it would
/// round.
HWY_INLINE Integer first_pixel(Float pixels) {
  const Float floor = hn::Floor(pixels);
  const FloatMask is_beyond = hn::Gt(pixels, hn::Add(floor, hn::Set(kFloats, 0.5f)));
  return hn::ConvertTo(kIntegers, hn::Add(floor, hn::IfThenElseZero(is_beyond, hn::Set(kFloats, 1.0f))));
}
HWY_INLINE Integer end_pixel(Float pixels) {
  const Float floor = hn::Floor(pixels);
  const FloatMask reaches = hn::Ge(pixels, hn::Add(floor, hn::Set(kFloats, 0.5f)));
  return hn::ConvertTo(kIntegers, hn::Add(floor, hn::IfThenElseZero(reaches, hn::Set(kFloats, 1.0f))));
}

/// Of corners in 1/256 px (integers) or in pixels (floats).
template <class Coordinate>
HWY_INLINE LaneBox whole_box(const Coordinate (&x)[3], const Coordinate (&y)[3]) {
  return {first_pixel(hn::Min(hn::Min(x[0], x[1]), x[2])), first_pixel(hn::Min(hn::Min(y[0], y[1]), y[2])),
          end_pixel(hn::Max(hn::Max(x[0], x[1]), x[2])), end_pixel(hn::Max(hn::Max(y[0], y[1]), y[2]))};
}

HWY_INLINE LaneBox within(const LaneBox& box, std::int32_t width, std::int32_t height) {
  const Integer zero = hn::Zero(kIntegers);
  return {hn::Max(box.x0, zero), hn::Max(box.y0, zero), hn::Min(box.x1, integer(width)),
          hn::Min(box.y1, integer(height))};
}

/// The tiles at the corners of boxes that hold a sample.
struct LaneTiles {
  Integer x0, y0, x1, y1;

  HWY_INLINE LaneTiles(const LaneBox& box, int shift)
      : x0(hn::ShiftRightSame(box.x0, shift)),
        y0(hn::ShiftRightSame(box.y0, shift)),
        x1(hn::ShiftRightSame(hn::Sub(box.x1, integer(1)), shift)),
        y1(hn::ShiftRightSame(hn::Sub(box.y1, integer(1)), shift)) {}
};

/// A vector in double, in which products of coordinates are exact or nearly so: in as many vectors as it
/// takes.
struct Wide {
  static constexpr std::size_t kParts = kLanes / hn::MaxLanes(kDoubles);
  Double parts[kParts];
};
HWY_INLINE Wide wide(Integer v) {
#if HWY_TARGET == HWY_SCALAR  // a vector of one lane has no halves
  return {{hn::PromoteTo(kDoubles, v)}};
#else
  return {
      {hn::PromoteTo(kDoubles, hn::LowerHalf(v)), hn::PromoteTo(kDoubles, hn::UpperHalf(kHalfIntegers, v))}};
#endif
}
HWY_INLINE Wide wide(Float v) {
#if HWY_TARGET == HWY_SCALAR
  return {{hn::PromoteTo(kDoubles, v)}};
#else
  return {
      {hn::PromoteTo(kDoubles, hn::LowerHalf(v)), hn::PromoteTo(kDoubles, hn::UpperHalf(kHalfFloats, v))}};
#endif
}
template <class Function>
HWY_INLINE Integer narrow(const Wide& v, Function function) {
#if HWY_TARGET == HWY_SCALAR
  return hn::DemoteTo(kHalfIntegers, function(v.parts[0]));
#else
  return hn::Combine(kIntegers, hn::DemoteTo(kHalfIntegers, function(v.parts[1])),
                     hn::DemoteTo(kHalfIntegers, function(v.parts[0])));
#endif
}
/// Rounded to the nearest, infinite beyond the largest float.
HWY_INLINE Float narrow(const Wide& v) {
#if HWY_TARGET == HWY_SCALAR  // whose DemoteTo() gives the largest float in place of infinity
  return hn::Set(kFloats, static_cast<float>(hn::GetLane(v.parts[0])));
#else
  return hn::Combine(kFloats, hn::DemoteTo(kHalfFloats, v.parts[1]), hn::DemoteTo(kHalfFloats, v.parts[0]));
#endif
}
HWY_INLINE Wide operator*(const Wide& a, const Wide& b) {
  Wide product;
  for (std::size_t i = 0; i < Wide::kParts; ++i) product.parts[i] = hn::Mul(a.parts[i], b.parts[i]);
  return product;
}
HWY_INLINE Wide operator-(const Wide& a, const Wide& b) {
  Wide difference;
  for (std::size_t i = 0; i < Wide::kParts; ++i) difference.parts[i] = hn::Sub(a.parts[i], b.parts[i]);
  return difference;
}
HWY_INLINE Wide operator/(const Wide& a, const Wide& b) {
  Wide quotient;
  for (std::size_t i = 0; i < Wide::kParts; ++i) quotient.parts[i] = hn::Div(a.parts[i], b.parts[i]);
  return quotient;
}

/// What is known of samples, one in each lane: those that are certain are among those that are possible.
struct LaneCoverage {
  IntegerMask possible, certain;
};

/// What an edge does to the samples of each lane's box.
struct EdgeCut {
  IntegerMask misses;  ///< all are outside
  IntegerMask cuts;    ///< some may be outside
};

/// The lanes of `mask`, moved together to the front; what follows them is of no use.
HWY_INLINE Integer compressed(Integer v, IntegerMask mask) {
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4
  // Highway 1.0's own function copies its table of these orders onto the stack with every call.
  constexpr auto& kOrders = LaneOrders<kLanes>::kFront;
  return hn::TableLookupLanes(
      v, hn::IndicesFromVec(kIntegers, hn::Load(kIntegers, kOrders[bits_of(mask)].data())));
#else
  return hn::Compress(v, mask);
#endif
}

HWY_INLINE void store(Integer v, IntegerMask mask, std::int32_t* to) {
  hn::StoreU(compressed(v, mask), kIntegers, to);
}
HWY_INLINE void store(Float v, IntegerMask mask, float* to) {
  hn::StoreU(hn::BitCast(kFloats, compressed(hn::BitCast(kIntegers, v), mask)), kFloats, to);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
