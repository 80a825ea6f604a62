#include "harness/bound.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace rasterbench {
namespace {

Bound first_that_holds(const PointCosts& c) {
  const auto percent = [&](double ms) { return 100 * ms / c.frame; };
  if (c.floor && c.frame <= kNearFloor * *c.floor)
    return {"memory bandwidth",
            fmt::format(
                "the frame takes {:.2f} times its floor of {:.3f} ms (at most {:g} times): what is left is "
                "reading the triangles and writing the pixels",
                c.frame / *c.floor, *c.floor, kNearFloor)};
  if (c.own_bytes && c.frame <= kNearFloor * *c.own_bytes)
    return {
        "memory bandwidth",
        fmt::format("the bytes that its stages go through pass in {:.3f} ms at the measured rates, and the "
                    "frame takes {:.2f} times that (at most {:g} times): to be faster it has to move less",
                    *c.own_bytes, c.frame / *c.own_bytes, kNearFloor)};
  const double lost = c.raster_imbalance + c.raster_serial;
  if (lost >= kLostShare * c.frame) {
    const bool imbalance = c.raster_imbalance >= c.raster_serial;
    return {imbalance ? "imbalance" : "serial part",
            fmt::format(
                "threads wait in the raster stage for {:.1f} % of the frame (from {:g} % on): {:.3f} ms for "
                "the last of them, {:.3f} ms in serial parts, barriers and starts",
                percent(lost), 100 * kLostShare, c.raster_imbalance, c.raster_serial)};
  }
  if (c.geometry >= kGeometryShare * c.frame)
    return {"geometry",
            fmt::format("{:.1f} % of the frame is the geometry stage (from {:g} % on), whose bytes "
                        "do not explain it: transform and tests of the triangles",
                        percent(c.geometry), 100 * kGeometryShare)};
  const auto longest = std::max({std::pair{c.clear, "clear"}, std::pair{c.geometry, "geometry"},
                                 std::pair{c.raster, "raster"}, std::pair{c.resolve, "resolve"}},
                                [](const auto& a, const auto& b) { return a.first < b.first; });
  return {"instructions",
          fmt::format("neither memory nor waiting explains the frame; its longest stage is {}, {:.1f} %{}",
                      longest.second, percent(longest.first),
                      c.ipc ? fmt::format(", at {:.2f} instructions per cycle", *c.ipc) : std::string())};
}

std::string measures_of(const PointCosts& c) {
  const auto times = [&](const std::optional<double>& ms) {
    return ms ? fmt::format("{:.2f}", c.frame / *ms) : std::string("unknown");
  };
  return fmt::format(
      "frame / floor {}, frame / bytes of its stages {} (bandwidth: at most {:g}); waiting in the raster "
      "stage "
      "{:.1f} % of the frame (imbalance or serial part: from {:g} % on); geometry {:.1f} % (from {:g} % on)",
      times(c.floor), times(c.own_bytes), kNearFloor, 100 * (c.raster_imbalance + c.raster_serial) / c.frame,
      100 * kLostShare, 100 * c.geometry / c.frame, 100 * kGeometryShare);
}

}  // namespace

Bound find_bound(const PointCosts& costs) {
  Bound bound = first_that_holds(costs);
  bound.measures = measures_of(costs);
  return bound;
}

}  // namespace rasterbench
