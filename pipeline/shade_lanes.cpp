#include "pipeline/shade_lanes.h"

#include <algorithm>
#include <cmath>

#include "base/isa_dispatch.h"
#include "pipeline/resolve.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/shade_lanes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h:
#include <hwy/highway.h>

#include "pipeline/triangle_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

using Doubles = hn::ScalableTag<double>;
using Integers = hn::Rebind<std::int32_t, Doubles>;
using Vector = hn::Vec<Doubles>;
constexpr Doubles kDoubles;
constexpr Integers kIntegers;
constexpr std::size_t kLanes = hn::MaxLanes(kDoubles);

/// trunc(min(255, s C)) of each lane.
HWY_INLINE hn::Vec<Integers> channel(Vector s, std::uint8_t c) {
  const auto most = hn::Set(kDoubles, 255.0);
  const auto value = hn::Mul(s, hn::Set(kDoubles, static_cast<double>(c)));
  return hn::DemoteTo(kIntegers, hn::IfThenElse(hn::Lt(value, most), value, most));
}

void shade(const Triangle* triangles, const std::uint32_t* ids, std::size_t n, const Rgb& colour,
           std::uint32_t* colours) {
  const std::size_t lanes = hn::Lanes(kDoubles);
  alignas(64) std::int32_t packed[kLanes];
  for (std::size_t first = 0; first < n; first += lanes) {
    const std::size_t m = std::min(lanes, n - first);
    const auto [a, b, c] =
        load_triangles([&](std::size_t lane) { return triangles + ids[first + std::min(lane, m - 1)]; });
    const Vector ux = hn::Sub(b.x, a.x), uy = hn::Sub(b.y, a.y), uz = hn::Sub(b.z, a.z);
    const Vector vx = hn::Sub(c.x, a.x), vy = hn::Sub(c.y, a.y), vz = hn::Sub(c.z, a.z);
    const Vector nx = hn::Sub(hn::Mul(uy, vz), hn::Mul(uz, vy));
    const Vector ny = hn::Sub(hn::Mul(uz, vx), hn::Mul(ux, vz));
    const Vector nz = hn::Sub(hn::Mul(ux, vy), hn::Mul(uy, vx));
    const Vector length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(nx, nx), hn::Mul(ny, ny)), hn::Mul(nz, nz)));
    const Vector cosine =
        hn::Div(hn::Add(hn::Add(nx, ny), nz), hn::Mul(length, hn::Set(kDoubles, std::sqrt(3.0))));
    const auto zero = hn::Zero(kDoubles);
    const Vector s = hn::IfThenElse(hn::Lt(zero, cosine), cosine, zero);  // 0 where there is no normal
    const auto rgba = hn::Or(hn::Or(channel(s, colour.r), hn::ShiftLeft<8>(channel(s, colour.g))),
                             hn::Or(hn::ShiftLeft<16>(channel(s, colour.b)),
                                    hn::Set(kIntegers, static_cast<std::int32_t>(0xff000000u))));
    hn::Store(rgba, kIntegers, packed);
    for (std::size_t lane = 0; lane < m; ++lane)
      colours[first + lane] = static_cast<std::uint32_t>(packed[lane]);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace rasterbench {
namespace {

HWY_EXPORT(shade);

}  // namespace

void shade_in_lanes(std::span<const Triangle> triangles, std::span<const std::uint32_t> ids,
                    const Rgb& colour, std::uint32_t* colours, Isa isa) {
  if (isa == Isa::kBaseline) {
    for (std::size_t i = 0; i < ids.size(); ++i) colours[i] = shade_flat(triangles[ids[i]], colour);
    return;
  }
  RASTERBENCH_DISPATCH(shade, isa)(triangles.data(), ids.data(), ids.size(), colour, colours);
}

}  // namespace rasterbench
#endif  // HWY_ONCE
