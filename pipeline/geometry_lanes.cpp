#include "pipeline/geometry_lanes.h"

#include "base/isa_dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/geometry_lanes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h:
#include <hwy/highway.h>

#include "pipeline/triangle_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

using Doubles = hn::ScalableTag<double>;
using Floats = hn::Rebind<float, Doubles>;  // as many floats as there are doubles in a vector
using Vector = hn::Vec<Doubles>;
using Mask = hn::Mask<Doubles>;
constexpr Doubles kDoubles;
constexpr Floats kFloats;
constexpr hn::Rebind<std::int32_t, Doubles> kIntegers;

struct LaneCorner {
  Vector x, y, z, w, near_distance;
};

HWY_INLINE Vector apply(const AffineRow& row, const LanePoint& p) {
  const auto times = [](double factor, Vector v) HWY_ATTR { return hn::Mul(hn::Set(kDoubles, factor), v); };
  return hn::Add(hn::Add(hn::Add(times(row.x, p.x), times(row.y, p.y)), times(row.z, p.z)),
                 hn::Set(kDoubles, row.w));
}

HWY_INLINE LaneCorner transform_corner(const ScreenTransform& t, const LanePoint& p) {
  return {apply(t.x, p), apply(t.y, p), apply(t.z, p), apply(t.w, p), apply(t.near_distance, p)};
}

/// x - x is 0 for finite x only.
HWY_INLINE Mask is_finite(const LanePoint& p) {
  const auto zero = hn::Zero(kDoubles);
  const auto finite = [&](Vector v) HWY_ATTR { return hn::Eq(hn::Sub(v, v), zero); };
  return hn::And(hn::And(finite(p.x), finite(p.y)), finite(p.z));
}

HWY_INLINE Mask has_zero_area(const LanePoint& a, const LanePoint& b, const LanePoint& c) {
  const auto ux = hn::Sub(b.x, a.x), uy = hn::Sub(b.y, a.y), uz = hn::Sub(b.z, a.z);
  const auto vx = hn::Sub(c.x, a.x), vy = hn::Sub(c.y, a.y), vz = hn::Sub(c.z, a.z);
  return hn::And(hn::And(hn::Eq(hn::Mul(uy, vz), hn::Mul(uz, vy)), hn::Eq(hn::Mul(uz, vx), hn::Mul(ux, vz))),
                 hn::Eq(hn::Mul(ux, vy), hn::Mul(uy, vx)));
}

/// The lanes that are still on their way, and how many left it where.
class Lanes {
 public:
  HWY_INLINE Lanes() : on_way_(hn::FirstN(kDoubles, hn::Lanes(kDoubles))), left_(hn::FirstN(kDoubles, 0)) {}
  HWY_INLINE bool any() const { return !hn::AllFalse(kDoubles, on_way_); }
  HWY_INLINE Mask on_way() const { return on_way_; }

  /// Lanes of `mask` end here, counted in `count`.
  HWY_INLINE void reject(Mask mask, std::int64_t& count) {
    count += static_cast<std::int64_t>(hn::CountTrue(kDoubles, hn::And(on_way_, mask)));
    on_way_ = hn::AndNot(mask, on_way_);
  }
  /// Lanes of `mask` are left to others.
  HWY_INLINE void leave(Mask mask) {
    left_ = hn::Or(left_, hn::And(on_way_, mask));
    on_way_ = hn::AndNot(mask, on_way_);
  }
  HWY_INLINE std::uint64_t left_bits() const { return bits(left_); }

 private:
  static HWY_INLINE std::uint64_t bits(Mask mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(kDoubles, mask, bytes);
    return bytes[0];  // at most 8 doubles
  }

  Mask on_way_, left_;
};

template <class Test>
HWY_INLINE Mask any_of(const LaneCorner (&c)[3], Test test) {
  return hn::Or(hn::Or(test(c[0]), test(c[1])), test(c[2]));
}

template <class Test>
HWY_INLINE Mask all_of(const LaneCorner (&c)[3], Test test) {
  return hn::And(hn::And(test(c[0]), test(c[1])), test(c[2]));
}

/// Three coordinates of the lanes' corners, as they are stored: rounded once.
HWY_INLINE void store_rounded(Vector v, float* out) { hn::StoreU(hn::DemoteTo(kFloats, v), kFloats, out); }
HWY_INLINE void store_rounded(Vector v, double* out) { hn::StoreU(v, kDoubles, out); }

/// A vector of screen triangles.
struct LaneScreen {
  Vector x[3], y[3], d[3], ids;
};

/// Stores them one behind the other.
template <class Real>
HWY_INLINE void store_screen(const LaneScreen& v, ScreenTriangle<Real>* slots, std::int64_t first) {
  constexpr std::size_t kLanes = hn::MaxLanes(kDoubles);
  alignas(64) Real x[3][kLanes], y[3][kLanes], d[3][kLanes];
  alignas(64) double ids[kLanes];
  for (int i = 0; i < 3; ++i) {
    store_rounded(v.x[i], x[i]);
    store_rounded(v.y[i], y[i]);
    store_rounded(v.d[i], d[i]);
  }
  hn::StoreU(v.ids, kDoubles, ids);
  for (std::size_t lane = 0; lane < hn::Lanes(kDoubles); ++lane) {
    ScreenTriangle<Real>& slot = slots[first + static_cast<std::int64_t>(lane)];
    for (int i = 0; i < 3; ++i) {
      slot.x[i] = x[i][lane];
      slot.y[i] = y[i][lane];
      slot.d[i] = d[i][lane];
    }
    slot.id = static_cast<std::int32_t>(ids[lane]);
  }
}

/// Stores each coordinate in its array.
template <class Real>
HWY_INLINE void store_screen(const LaneScreen& v, ScreenBatch<Real>* batch, std::int64_t first) {
  for (int i = 0; i < 3; ++i) {
    store_rounded(v.x[i], batch->x[i] + first);
    store_rounded(v.y[i], batch->y[i] + first);
    store_rounded(v.d[i], batch->d[i] + first);
  }
  hn::StoreU(hn::DemoteTo(kIntegers, v.ids), kIntegers, batch->ids + first);
}

/// One vector of triangles; the steps are those of Passage in geometry.cpp, in its order.
template <class Slots>
HWY_INLINE std::uint64_t transform_vector(const Triangle* triangles, std::int32_t first_id,
                                          const ScreenTransform& t, const GeometryOptions& options,
                                          Slots* slots, std::int64_t first_slot, GeometryCounts& counts) {
  const SceneNeeds& needs = options.needs;
  const auto [a, b, c] = load_triangles([&](std::size_t lane) { return triangles + lane; });
  Lanes lanes;
  if (needs.finite_test)
    lanes.reject(hn::Not(hn::And(hn::And(is_finite(a), is_finite(b)), is_finite(c))), counts.non_finite);
  if (needs.zero_area_test) lanes.reject(has_zero_area(a, b, c), counts.zero_area);

  const LaneCorner corners[3] = {transform_corner(t, a), transform_corner(t, b), transform_corner(t, c)};
  const auto zero = hn::Zero(kDoubles);
  if (needs.near_clip && options.near_rule == NearRule::kClip) {
    const auto before_near = [&](const LaneCorner& p) HWY_ATTR { return hn::Lt(p.near_distance, zero); };
    lanes.reject(all_of(corners, before_near), counts.behind_near);
    lanes.leave(any_of(corners, before_near));
  }
  if (needs.behind_reject)
    lanes.reject(any_of(corners, [&](const LaneCorner& p) HWY_ATTR { return hn::Not(hn::Gt(p.w, zero)); }),
                 counts.behind_near);
  if (needs.far_reject) {
    const auto far_depth = hn::Set(kDoubles, t.far_depth);
    lanes.reject(hn::Not(any_of(corners, [&](const LaneCorner& p)
                                             HWY_ATTR { return hn::Lt(p.z, hn::Mul(far_depth, p.w)); })),
                 counts.beyond_far);
  }
  if (needs.guard_clip) {
    const auto band = hn::Set(kDoubles, kGuardBand);
    lanes.leave(any_of(corners, [&](const LaneCorner& p) HWY_ATTR {
      const auto reach = hn::Mul(band, p.w);
      return hn::Or(hn::Gt(hn::Abs(p.x), reach), hn::Gt(hn::Abs(p.y), reach));
    }));
  }

  LaneScreen screen;
  auto &x = screen.x, &y = screen.y, &d = screen.d;
  if (lanes.any()) {
    for (int i = 0; i < 3; ++i) {
      x[i] = hn::Div(corners[i].x, corners[i].w);
      y[i] = hn::Div(corners[i].y, corners[i].w);
      d[i] = hn::Div(corners[i].z, corners[i].w);
    }
    if (needs.off_screen_reject) {
      const auto low_x = hn::Min(hn::Min(x[0], x[1]), x[2]), high_x = hn::Max(hn::Max(x[0], x[1]), x[2]);
      const auto low_y = hn::Min(hn::Min(y[0], y[1]), y[2]), high_y = hn::Max(hn::Max(y[0], y[1]), y[2]);
      lanes.reject(hn::Or(hn::Or(hn::Lt(high_x, zero), hn::Gt(low_x, hn::Set(kDoubles, t.width))),
                          hn::Or(hn::Lt(high_y, zero), hn::Gt(low_y, hn::Set(kDoubles, t.height)))),
                   counts.off_screen);
    }
    if (options.cull_back_faces) {
      const auto area2 = hn::Sub(hn::Mul(hn::Sub(x[1], x[0]), hn::Sub(y[2], y[0])),
                                 hn::Mul(hn::Sub(y[1], y[0]), hn::Sub(x[2], x[0])));
      lanes.reject(hn::Gt(area2, zero), counts.back_facing);
    }
    for (int i = 0; i < 3; ++i) {  // what draws nothing is stored as zeros
      x[i] = hn::IfThenElseZero(lanes.on_way(), x[i]);
      y[i] = hn::IfThenElseZero(lanes.on_way(), y[i]);
      d[i] = hn::IfThenElseZero(lanes.on_way(), d[i]);
    }
  } else {
    for (int i = 0; i < 3; ++i) x[i] = y[i] = d[i] = zero;
  }
  const auto drawn = static_cast<std::int64_t>(hn::CountTrue(kDoubles, lanes.on_way()));
  counts.drawn += drawn;
  counts.pieces += drawn;

  const auto lane_ids = hn::Add(hn::Set(kDoubles, first_id), hn::Iota(kDoubles, 0));
  screen.ids = hn::IfThenElse(lanes.on_way(), lane_ids, hn::Set(kDoubles, -1));
  store_screen(screen, slots, first_slot);
  return lanes.left_bits();
}

template <class Slots>
HWY_INLINE std::uint64_t transform_lanes(const Triangle* triangles, std::int64_t n, std::int32_t first_id,
                                         const ScreenTransform& t, const GeometryOptions& options,
                                         Slots* slots, std::int64_t first_slot, GeometryCounts& counts) {
  const auto lanes = static_cast<std::int64_t>(hn::Lanes(kDoubles));
  std::uint64_t left = 0;
  std::int64_t i = 0;
  for (; i + lanes <= n; i += lanes) {
    // The processor's own prefetching stops at every page of the model.
    const auto* const ahead = reinterpret_cast<const char*>(triangles + i) + 4096;
    for (std::int64_t byte = 0; byte < lanes * static_cast<std::int64_t>(sizeof(Triangle)); byte += 64)
      __builtin_prefetch(ahead + byte);
    left |= transform_vector(triangles + i, first_id + static_cast<std::int32_t>(i), t, options, slots,
                             first_slot + i, counts)
            << i;
  }
  for (; i < n; ++i) left |= std::uint64_t{1} << i;
  return left;
}

#define RASTERBENCH_TRANSFORM(name, Slots)                                                   \
  std::uint64_t name(const Triangle* triangles, std::int64_t n, std::int32_t first_id,       \
                     const ScreenTransform& t, const GeometryOptions& options, Slots* slots, \
                     std::int64_t first_slot, GeometryCounts& counts) {                      \
    return transform_lanes(triangles, n, first_id, t, options, slots, first_slot, counts);   \
  }
RASTERBENCH_TRANSFORM(transform_floats, ScreenTriangle<float>)
RASTERBENCH_TRANSFORM(transform_doubles, ScreenTriangle<double>)
RASTERBENCH_TRANSFORM(transform_float_batch, ScreenBatch<float>)
#undef RASTERBENCH_TRANSFORM

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace rasterbench {

namespace {

HWY_EXPORT(transform_floats);
HWY_EXPORT(transform_doubles);
HWY_EXPORT(transform_float_batch);

}  // namespace

#define RASTERBENCH_TRANSFORM(name, Slots)                                                            \
  template <>                                                                                         \
  std::uint64_t transform_in_lanes(const Triangle* triangles, std::int64_t n, std::int32_t first_id,  \
                                   const ScreenTransform& transform, const GeometryOptions& options,  \
                                   Slots* slots, std::int64_t first_slot, GeometryCounts& counts) {   \
    if (options.isa == Isa::kBaseline) return ~std::uint64_t{0} >> (kMaxLaneTriangles - n);           \
    return RASTERBENCH_DISPATCH(name, options.isa)(triangles, n, first_id, transform, options, slots, \
                                                   first_slot, counts);                               \
  }
RASTERBENCH_TRANSFORM(transform_floats, ScreenTriangle<float>)
RASTERBENCH_TRANSFORM(transform_doubles, ScreenTriangle<double>)
RASTERBENCH_TRANSFORM(transform_float_batch, ScreenBatch<float>)
#undef RASTERBENCH_TRANSFORM

}  // namespace rasterbench
#endif  // HWY_ONCE
