#include "pipeline/needs.h"

#include <fmt/format.h>

#include "pipeline/corner.h"

namespace rasterbench {
namespace {

constexpr const char* kAfterNear = "what the near clip leaves of a triangle may lie anywhere";
constexpr const char* kAfterGuard = "what the guard-band clip leaves of a triangle may lie anywhere";

std::string counted(std::int64_t triangles, const char* one, const char* many) {
  return fmt::format("{} triangle{}", triangles, triangles == 1 ? one : many);
}

}  // namespace

NeedsAnalysis analyse_needs(std::span<const Triangle> triangles, const ScreenTransform& transform,
                            NearRule near_rule) {
  NeedsAnalysis a;
  a.near_rule = near_rule;
  a.triangles = static_cast<std::int64_t>(triangles.size());
  for (const Triangle& triangle : triangles) {
    if (!is_finite(triangle)) {
      ++a.non_finite;
      continue;
    }
    if (has_zero_area(triangle)) {
      ++a.zero_area;
      continue;
    }
    const std::array corners{transform_corner(transform, triangle.a), transform_corner(transform, triangle.b),
                             transform_corner(transform, triangle.c)};
    for (const Corner& corner : corners) {
      a.nearest = std::min(a.nearest, corner.near_distance);
      a.farthest = std::max(a.farthest, corner.near_distance);
    }
    if (near_rule == NearRule::kClip && any(corners, is_before_near)) {
      ++(all(corners, is_before_near) ? a.before_near : a.across_near);
    } else if (any(corners, has_no_place)) {
      ++a.behind;
    } else if (!any(corners, [&](const Corner& c) { return is_before_far(c, transform); })) {
      ++a.beyond_far;
    } else if (any(corners, is_beyond_guard_band)) {
      ++a.beyond_guard;
    } else {
      const std::array points{project(corners[0]), project(corners[1]), project(corners[2])};
      for (const ScreenPoint& p : points) a.outermost = std::max({a.outermost, std::abs(p.x), std::abs(p.y)});
      a.off_screen += misses_image(points, transform);
    }
  }
  const bool across = a.across_near > 0, guard = across || a.beyond_guard > 0;
  a.needs = {.finite_test = a.non_finite > 0,
             .zero_area_test = a.zero_area > 0,
             .near_clip = across || a.before_near > 0,
             .behind_reject = across || a.behind > 0,
             .far_reject = across || a.beyond_far > 0,
             .guard_clip = guard,
             .off_screen_reject = guard || a.off_screen > 0};
  return a;
}

std::vector<NeedStatement> explain_needs(const NeedsAnalysis& a, const Camera& camera) {
  std::vector<NeedStatement> all;
  const auto state = [&](const char* test, bool kept, const std::string& why_kept,
                         const std::string& why_not) {
    all.push_back({test, kept, kept ? why_kept : why_not});
  };
  const bool seen = a.farthest >= a.nearest;  // some triangle got as far as a place in the view
  state("test of finite coordinates", a.needs.finite_test,
        counted(a.non_finite, " has", "s have") + " a coordinate that is not finite",
        "every coordinate is finite");
  state("test of zero area", a.needs.zero_area_test, counted(a.zero_area, " has", "s have") + " no area",
        "every triangle has an area");
  state("near clip", a.needs.near_clip,
        counted(a.across_near, " lies", "s lie") +
            fmt::format(" across the near plane, {} before it", a.before_near),
        a.near_rule == NearRule::kOff ? "switched off (near = off)"
        : seen ? fmt::format("the nearest corner is {:.3g} behind the near plane", a.nearest)
               : "there is no corner");
  state("test of w > 0", a.needs.behind_reject,
        a.behind > 0 ? counted(a.behind, " has", "s have") + " a corner at or behind the camera" : kAfterNear,
        "no corner lies at or behind the camera");
  const double beyond = a.farthest - (camera.far_plane - camera.near_plane);
  state("far rejection", a.needs.far_reject,
        a.beyond_far > 0 ? counted(a.beyond_far, " lies", "s lie") + " beyond the far plane" : kAfterNear,
        !seen ? "there is no corner"
        : beyond <= 0
            ? fmt::format("the farthest corner is {:.3g} before the far plane", -beyond)
            : fmt::format("the farthest corner is {:.3g} beyond the far plane, but every triangle has "
                          "one before it",
                          beyond));
  state("guard-band clip", a.needs.guard_clip,
        a.beyond_guard > 0 ? counted(a.beyond_guard, " leaves", "s leave") +
                                 fmt::format(" the guard band of +-{:.0f} px", kGuardBand)
                           : kAfterNear,
        fmt::format("the outermost corner is at {:.0f} px, the guard band at {:.0f} px", a.outermost,
                    kGuardBand));
  state("off-screen rejection", a.needs.off_screen_reject,
        a.off_screen > 0    ? counted(a.off_screen, " misses", "s miss") + " the image"
        : a.across_near > 0 ? kAfterNear
                            : kAfterGuard,
        "no triangle misses the image");
  return all;
}

std::string to_string(const std::vector<NeedStatement>& statements) {
  std::string text;
  for (const NeedStatement& s : statements)
    text += fmt::format("{}: {}, {}\n", s.test, s.kept ? "kept" : "left out", s.reason);
  return text;
}

}  // namespace rasterbench
