#include "kernels/fixed_lanes.h"

#include <algorithm>
#include <bit>

#include "base/isa_dispatch.h"
#include "kernels/fragments.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/fixed_lanes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h:
#include <hwy/highway.h>

#include "kernels/fixed_lanes-inl.h"

#ifndef RASTERBENCH_FIXED_LANES_ONCE
#define RASTERBENCH_FIXED_LANES_ONCE
namespace rasterbench {
namespace {

/// Narrows [x0, x1) to the samples of row y that are inside, by dividing edge values: they are integers, so
/// that the quotient is exact and not a guess.
inline void find_span(const Fixed8::Prepared& t, std::int32_t y, std::int32_t& x0, std::int32_t& x1) {
  for (int e = 0; e < 3 && x0 < x1; ++e) {
    const std::int64_t first = FixedEdges<8>::grid_value(t, e, x0, y) - t.least[e];
    const std::int64_t last = FixedEdges<8>::grid_value(t, e, x1 - 1, y) - t.least[e];
    if (first >= 0 && last >= 0) continue;
    const std::int64_t fall = std::int64_t{t.dy[e]} * FixedEdges<8>::kOne;  // from a pixel to the next
    if (first < 0 && last < 0)
      x1 = x0;
    else if (first >= 0)
      x1 = x0 + static_cast<std::int32_t>(first / fall) + 1;
    else
      x0 = x1 - static_cast<std::int32_t>(last / -fall) - 1;
  }
}

}  // namespace
}  // namespace rasterbench
#endif

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

using Keys = hn::ScalableTag<std::uint64_t>;
using HalfFloats = hn::Rebind<float, Keys>;  // as many as there are keys in a vector
constexpr Keys kKeys;
constexpr HalfFloats kHalfFloats;

/// Samples x0 <= x < x1 of row y, all inside. The last vector of a span overlaps the one before it, which
/// changes nothing: a key that was kept is kept again.
HWY_INLINE void draw_span(const Fixed8::Prepared& t, std::int32_t y, std::int32_t x0, std::int32_t x1,
                          std::uint64_t* row) {
  const auto lanes = static_cast<std::int32_t>(hn::Lanes(kKeys));
  if (x1 - x0 < lanes) {
    for (std::int32_t x = x0; x < x1; ++x) keep_nearest(row[x], Fixed8::key(Fixed8::depth(t, x, y), t.rank));
    return;
  }
  const auto& plane = t.plane;
  const float of_row = plane.d0 + plane.gy * ((static_cast<float>(y) + 0.5f) - plane.y0);
  const auto at_row = hn::Set(kHalfFloats, of_row), gx = hn::Set(kHalfFloats, plane.gx);
  const auto low = hn::Set(kHalfFloats, plane.low), high = hn::Set(kHalfFloats, plane.high);
  const auto corner = hn::Set(kHalfFloats, plane.x0), half = hn::Set(kHalfFloats, 0.5f);
  const auto rank = hn::Set(kKeys, std::uint64_t{t.rank});
  for (std::int32_t next = x0; next < x1; next += lanes) {
    const std::int32_t x = std::min(next, x1 - lanes);
    // Pixel numbers are small integers: float32 holds them exactly.
    const auto sample = hn::Add(counting_from(kHalfFloats, static_cast<float>(x)), half);
    const auto depth = clamped(hn::Add(at_row, hn::Mul(gx, hn::Sub(sample, corner))), low, high);
    const auto code = hn::PromoteTo(kKeys, encode(kHalfFloats, depth));
    const auto key = hn::Or(hn::ShiftLeft<32>(code), rank);
    hn::StoreU(hn::Min(hn::LoadU(kKeys, row + x), key), kKeys, row + x);
  }
}

void draw_large(const Fixed8::Prepared& triangle, const PixelBox& box, const LaneTarget& out) {
  for (std::int32_t y = box.y0; y < box.y1; ++y) {
    std::int32_t x0 = box.x0, x1 = box.x1;
    find_span(triangle, y, x0, x1);
    if (x0 < x1) draw_span(triangle, y, x0, x1, out.keys + y * out.width);
  }
}

/// Up to a vector of triangles, taken apart.
struct Loaded {
  alignas(64) float x[3][kLanes], y[3][kLanes], d[3][kLanes];
  alignas(64) std::int32_t ids[kLanes];

  HWY_INLINE void set(std::size_t lane, const ScreenTriangle<float>& t) {
    for (int i = 0; i < 3; ++i) {
      x[i][lane] = t.x[i];
      y[i][lane] = t.y[i];
      d[i][lane] = t.d[i];
    }
    ids[lane] = t.id;
  }
};

void find_boxes(const ScreenTriangle<float>* triangles, std::int64_t n, PixelBox* boxes) {
  const auto lanes = static_cast<std::int64_t>(hn::Lanes(kFloats));
  Loaded loaded;
  for (std::int64_t first = 0; first < n; first += lanes) {
    const std::int64_t m = std::min(lanes, n - first);
    for (std::int64_t lane = 0; lane < lanes; ++lane)
      loaded.set(static_cast<std::size_t>(lane), triangles[first + std::min(lane, m - 1)]);
    Integer x[3], y[3];
    for (int i = 0; i < 3; ++i) {
      x[i] = snapped(hn::Load(kFloats, loaded.x[i]));
      y[i] = snapped(hn::Load(kFloats, loaded.y[i]));
    }
    const auto x0 = first_pixel(hn::Min(hn::Min(x[0], x[1]), x[2]));
    const auto x1 = end_pixel(hn::Max(hn::Max(x[0], x[1]), x[2]));
    const auto y0 = first_pixel(hn::Min(hn::Min(y[0], y[1]), y[2]));
    const auto y1 = end_pixel(hn::Max(hn::Max(y[0], y[1]), y[2]));
    const auto draws = hn::Gt(hn::Load(kIntegers, loaded.ids), hn::Set(kIntegers, -1));
    alignas(64) std::int32_t found[4][kLanes];
    hn::Store(hn::IfThenElseZero(draws, x0), kIntegers, found[0]);
    hn::Store(hn::IfThenElseZero(draws, y0), kIntegers, found[1]);
    hn::Store(hn::IfThenElseZero(draws, x1), kIntegers, found[2]);
    hn::Store(hn::IfThenElseZero(draws, y1), kIntegers, found[3]);
    for (std::int64_t lane = 0; lane < m; ++lane)
      boxes[first + lane] = {found[0][lane], found[1][lane], found[2][lane], found[3][lane]};
  }
}

/// The box of each lane: where it begins, its sides, and its first key.
struct LaneBoxes {
  alignas(64) std::int32_t x[kLanes], y[kLanes], width[kLanes], height[kLanes];
  std::uint64_t* keys[kLanes];
  std::uint32_t ranks[kLanes];
  std::int32_t widest = 0, highest = 0;
};

HWY_INLINE void draw_vector(const Loaded& loaded, const LaneBoxes& boxes, FillRule fill,
                            const LaneTarget& out) {
  const Integer box_x = hn::Load(kIntegers, boxes.x), box_y = hn::Load(kIntegers, boxes.y);
  LaneCorner corners[3];
  for (int i = 0; i < 3; ++i)
    corners[i] = {snapped(hn::Load(kFloats, loaded.x[i])), snapped(hn::Load(kFloats, loaded.y[i])),
                  hn::Load(kFloats, loaded.d[i])};
  sort_corners(corners);
  SmallEdges s = small_edges(corners, box_x, box_y, fill);
  const LanePlane plane = depth_plane(corners);
  const Integer width = hn::Load(kIntegers, boxes.width), height = hn::Load(kIntegers, boxes.height);
  for (std::int32_t row = 0; row < boxes.highest; ++row) {
    const auto in_rows = hn::And(s.draws, hn::Gt(height, hn::Set(kIntegers, row)));
    const auto of_row = depth_of_row(plane, sample_of(hn::Add(box_y, hn::Set(kIntegers, row))));
    Integer e0 = s.value[0], e1 = s.value[1], e2 = s.value[2];
    for (std::int32_t column = 0; column < boxes.widest; ++column) {
      const auto inside = hn::And(hn::And(in_rows, hn::Gt(width, hn::Set(kIntegers, column))),
                                  hn::Gt(hn::Or(hn::Or(e0, e1), e2), hn::Set(kIntegers, -1)));
      e0 = hn::Add(e0, s.per_column[0]);
      e1 = hn::Add(e1, s.per_column[1]);
      e2 = hn::Add(e2, s.per_column[2]);
      std::uint8_t bytes[8] = {};
      hn::StoreMaskBits(kIntegers, inside, bytes);
      std::uint32_t bits = bytes[0] | std::uint32_t{bytes[1]} << 8;  // at most 16 lanes
      if (bits == 0) continue;
      const auto depth = depth_at(plane, of_row, sample_of(hn::Add(box_x, hn::Set(kIntegers, column))));
      alignas(64) std::uint32_t codes[kLanes];
      hn::Store(encode(kFloats, depth), kCodes, codes);
      for (; bits != 0; bits &= bits - 1) {
        const int lane = std::countr_zero(bits);
        keep_nearest(boxes.keys[lane][row * out.width + column],
                     std::uint64_t{codes[lane]} << 32 | boxes.ranks[lane]);
      }
    }
    for (int e = 0; e < 3; ++e) s.value[e] = hn::Add(s.value[e], s.per_row[e]);
  }
}

void draw_small(const BoxedTriangles& in, const std::uint32_t* indices, std::int64_t n,
                const PixelBox& bounds, const LaneTarget& out) {
  const auto lanes = static_cast<std::int64_t>(hn::Lanes(kFloats));
  Loaded loaded;
  LaneBoxes boxes;
  for (std::int64_t first = 0; first < n; first += lanes) {
    boxes.widest = boxes.highest = 0;
    for (std::int64_t i = 0; i < lanes; ++i) {
      const auto lane = static_cast<std::size_t>(i);
      const std::uint32_t index = indices[std::min(first + i, n - 1)];
      const ScreenTriangle<float>& triangle = in.triangles[index];
      const PixelBox box = intersect(in.boxes[index], bounds);
      loaded.set(lane, triangle);
      boxes.x[lane] = box.x0;
      boxes.y[lane] = box.y0;
      boxes.width[lane] = first + i < n ? box.x1 - box.x0 : 0;  // beyond the last one: an empty box
      boxes.height[lane] = box.y1 - box.y0;
      boxes.keys[lane] = out.keys + box.y0 * out.width + box.x0;
      boxes.ranks[lane] = swap_rank(in.tie, in.triangle_count, static_cast<std::uint32_t>(triangle.id));
      boxes.widest = std::max(boxes.widest, boxes.width[lane]);
      boxes.highest = std::max(boxes.highest, boxes.height[lane]);
    }
    draw_vector(loaded, boxes, in.fill, out);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace rasterbench {
namespace {

HWY_EXPORT(find_boxes);
HWY_EXPORT(draw_small);
HWY_EXPORT(draw_large);

namespace scalar {

void find_boxes(const ScreenTriangle<float>* triangles, std::int64_t n, PixelBox* boxes) {
  for (std::int64_t i = 0; i < n; ++i)
    boxes[i] = triangles[i].id < 0 ? PixelBox{} : sample_box(FixedEdges<8>::corners(triangles[i]));
}

void draw_large(const Fixed8::Prepared& triangle, const PixelBox& box, const LaneTarget& out) {
  for (std::int32_t y = box.y0; y < box.y1; ++y) {
    std::int32_t x0 = box.x0, x1 = box.x1;
    find_span(triangle, y, x0, x1);
    std::uint64_t* row = out.keys + y * out.width;
    for (std::int32_t x = x0; x < x1; ++x)
      keep_nearest(row[x], Fixed8::key(Fixed8::depth(triangle, x, y), triangle.rank));
  }
}

void draw_small(const BoxedTriangles& in, const std::uint32_t* indices, std::int64_t n,
                const PixelBox& bounds, const LaneTarget& out) {
  for (std::int64_t i = 0; i < n; ++i) {
    const ScreenTriangle<float>& triangle = in.triangles[indices[i]];
    const auto prepared =
        Fixed8::prepare(triangle, {in.fill, 0, 0},
                        swap_rank(in.tie, in.triangle_count, static_cast<std::uint32_t>(triangle.id)));
    if (!prepared.box.empty()) draw_large(prepared, intersect(in.boxes[indices[i]], bounds), out);
  }
}

}  // namespace scalar

FixedLanes compiled_for(Isa isa) {
  if (isa == Isa::kBaseline) return {scalar::find_boxes, scalar::draw_small, scalar::draw_large};
  const std::size_t index = dispatch_index(isa);
  return {HWY_DISPATCH_TABLE(find_boxes)[index], HWY_DISPATCH_TABLE(draw_small)[index],
          HWY_DISPATCH_TABLE(draw_large)[index]};
}

}  // namespace

const FixedLanes& fixed_lanes(Isa isa) {
  static const FixedLanes compiled[] = {compiled_for(Isa::kBaseline), compiled_for(Isa::kSse4),
                                        compiled_for(Isa::kAvx2), compiled_for(Isa::kAvx512)};
  return compiled[static_cast<std::size_t>(isa)];
}

}  // namespace rasterbench
#endif  // HWY_ONCE
