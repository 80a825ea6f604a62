#include "harness/verify.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/hash.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

Json comparison_json(const Comparison& c) {
  Json json;
  json["renderer"] = "double precision, homogeneous, serial";
  json["identical"] = c.identical;
  json["edge_ties"] = c.edge_ties;
  json["depth_ties"] = c.depth_ties;
  json["errors"] = c.errors;
  json["max_depth_error_steps"] = c.max_depth_error_steps;
  json["within_bound"] = c.within_bound();
  return json;
}

Json work_json(const GeometryCounts& c, const Picture& specification, std::size_t bytes) {
  Json work;
  work["triangles"] = c.triangles;
  work["drawn"] = c.drawn;
  work["pieces"] = c.pieces;
  work["rejected"] = {{"non_finite", c.non_finite},   {"zero_area", c.zero_area},
                      {"behind_near", c.behind_near}, {"beyond_far", c.beyond_far},
                      {"off_screen", c.off_screen},   {"back_facing", c.back_facing}};
  work["near_clipped"] = c.near_clipped;
  work["guard_clipped"] = c.guard_clipped;
  work["fragments_tested"] = specification.samples_tested;
  work["fragments_covered"] = specification.samples_covered;
  work["covered_pixels"] = std::count_if(specification.ids.begin(), specification.ids.end(),
                                         [](std::int32_t id) { return id >= 0; });
  work["bytes"] = bytes;
  return work;
}

}  // namespace

std::string picture_hash(const Renderer& renderer) {
  const auto bytes = [](const auto& span) {
    return std::string_view(reinterpret_cast<const char*>(span.data()), span.size_bytes());
  };
  return hash_bytes(hash_bytes(bytes(renderer.colours())) + hash_bytes(bytes(renderer.depths())));
}

const Verifier::Expected& Verifier::expected(const Point& point, const Scene& scene) {
  Point relevant = point;
  relevant.kernel = "null";
  relevant.execution = {};
  relevant.environment = {};
  relevant.cache = "warm";
  const std::string key = point_name(relevant);
  if (expected_.key != key) {
    const FrameSettings settings = point.settings();
    expected_ = {
        key, render_specification(scene, point.numeric, settings),
        render_in_double(scene.model.triangles, sized_camera(scene, settings), point.fill, point.near_rule)};
  }
  return expected_;
}

Json Verifier::judge(const Point& point, const Scene& scene) {
  constexpr std::uint64_t kPermutationSeed = 0x5eed;
  const FrameSettings settings = point.settings();
  const Expected& expect = expected(point, scene);
  Json answer;

  {
    const auto execution = make_execution(point.execution);
    const ObservedThreads observed = observe_threads(*execution);
    answer["threads_observed"] = observed.count;
    answer["failure"] = nullptr;
    if (observed.count < point.execution.threads)
      answer["failure"] = fmt::format("{} of {} threads ran", observed.count, point.execution.threads);
    else if (observed.denormals_flushed)
      answer["failure"] = "a worker flushes denormals (MXCSR): the mode's bits are not defined";
  }

  Picture drawn;
  FrameReport report;
  std::int64_t differing = 0;
  for (const std::uint64_t seed : {kPermutationSeed, std::uint64_t{0}}) {
    const auto renderer =
        make_renderer(point.kernel, point.numeric, {&scene, settings, point.execution, seed});
    // The second frame meets what the first left in the strategy's memory, as every timed frame does.
    for (int frame = 0; frame < 2; ++frame) {
      report = renderer->draw();
      drawn = picture_of(*renderer, settings);
      differing = std::max(differing, differing_pixels(drawn, expect.specification));
    }
    answer["frame_ms"] = report.seconds.total() * 1e3;
    answer["work"] = work_json(report.counts, expect.specification, renderer->bytes());
    answer["picture"] = picture_hash(*renderer);
  }

  const Comparison comparison =
      compare_with_double(expect.truth, drawn.ids, drawn.depths, scene.model.triangles,
                          sized_camera(scene, settings), point.near_rule, find_mode(point.numeric)->numbers);
  Json& verify = answer["verify"];
  verify["conforms"] = differing == 0;
  verify["checked_against"] = "scalar specification of the mode; screen triangles in order and permuted";
  verify["differing_pixels"] = differing;
  verify["oracle"] = comparison_json(comparison);
  verify["embree"] = nullptr;
  if (differing != 0)
    answer["failure"] = fmt::format("{} of {} pixels differ from the specification of {}", differing,
                                    settings.pixels(), point.numeric);
  else if (!comparison.within_bound())
    answer["failure"] = fmt::format(
        "{} pixels differ from the double renderer beyond the bound of {}, the first at x={} y={}",
        comparison.errors, point.numeric, comparison.worst_pixel % settings.width,
        comparison.worst_pixel / settings.width);
  return answer;
}

}  // namespace rasterbench
