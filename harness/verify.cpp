#include "harness/verify.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/hash.h"
#include "harness/counted_frames.h"
#include "harness/study.h"
#include "harness/verdict_json.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

std::int64_t covered_pixels(const Picture& picture) {
  return std::count_if(picture.ids.begin(), picture.ids.end(), [](std::int32_t id) { return id >= 0; });
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
  work["covered_pixels"] = covered_pixels(specification);
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

Conformance check_conformance(const std::string& kernel, const std::string& mode, RendererSetup setup,
                              const Picture& specification) {
  constexpr std::uint64_t kPermutationSeed = 0x5eed;
  Conformance result;
  for (const std::uint64_t seed : {kPermutationSeed, std::uint64_t{0}}) {
    setup.permutation_seed = seed;
    const auto renderer = make_renderer(kernel, mode, setup);
    for (int frame = 0; frame < 2; ++frame) {
      result.report = renderer->draw();
      result.differing =
          std::max(result.differing, differing_pixels(picture_of(*renderer, setup.settings), specification));
    }
    result.bytes = renderer->bytes();
    result.picture = picture_hash(*renderer);
  }
  return result;
}

Judge& Verifier::judge_of(const Point& point, const Scene& scene) {
  constexpr std::size_t kKept = 2;  // a study varies the fill rule within a mode; more would only cost memory
  Point relevant = point;
  relevant.cache = "warm";
  const std::string key = trade_of(relevant);
  const auto found =
      std::find_if(judges_.begin(), judges_.end(), [&](const auto& entry) { return entry.first == key; });
  if (found != judges_.end()) return *found->second;
  judges_.emplace_front(key, std::make_unique<Judge>(scene, point.settings(), available_cpus()));
  if (judges_.size() > kKept) judges_.pop_back();
  return *judges_.front().second;
}

const Verifier::Expected& Verifier::expected(const Point& point, const Scene& scene) {
  Point relevant = point;
  relevant.cache = "warm";
  const std::string key = comparison_of(relevant);
  if (expected_.key != key) {
    expected_ = {key, render_specification(scene, point.numeric, point.settings()), {}};
    expected_.verdicts = judge_picture(judge_of(point, scene), expected_.specification,
                                       available_mode(point.numeric, "numeric"));
  }
  return expected_;
}

Json Verifier::judge_peer(const Point& point, const Scene& scene) {
  const FrameSettings settings = point.settings();
  const auto renderer = make_llvmpipe_renderer(scene, settings);
  renderer->draw();  // compiles the shaders
  Json answer;
  answer["frame_ms"] = renderer->draw().seconds.total() * 1e3;
  answer["threads_observed"] = observed_llvmpipe_threads();
  const Picture picture = picture_of(*renderer, settings);
  answer["picture"] = picture_hash(*renderer);
  answer["work"] = {{"triangles", scene.model.triangles.size()},
                    {"covered_pixels", covered_pixels(picture)},
                    {"bytes", renderer->bytes()},
                    {"counted", nullptr}};
  const Json verdicts = judge_peer_picture(judge_of(point, scene), picture);
  Json& verify = answer["verify"];
  verify["conforms"] = nullptr;
  verify["checked_against"] = "end-to-end truth, by the peer's own bound; colours against ids";
  verify["differing_pixels"] = nullptr;
  for (const char* verdict : kVerdicts) verify[verdict] = verdicts.at(verdict);
  verify["peer"] = peer_json(llvmpipe_version());
  answer["failure"] = verdicts.at("failure");
  if (const int observed = answer["threads_observed"]; observed < point.execution.threads)
    answer["failure"] = fmt::format("{} of {} threads ran", observed, point.execution.threads);
  return answer;
}

Json Verifier::time_unjudged(const Point& point, const Scene& scene) {
  const FrameSettings settings = point.settings();
  Json answer;
  answer["threads_observed"] = observe_threads(*make_execution(point.execution)).count;
  const auto renderer = make_renderer(point.kernel, point.numeric,
                                      {.scene = &scene, .settings = settings, .execution = point.execution});
  renderer->draw();
  const FrameReport& report = renderer->draw();  // the first one met cold buffers
  answer["frame_ms"] = report.seconds.total() * 1e3;
  answer["picture"] = picture_hash(*renderer);
  answer["work"] = {{"triangles", report.counts.triangles},
                    {"drawn", report.counts.drawn},
                    {"bytes", renderer->bytes()},
                    {"counted", nullptr}};
  answer["hardware"] = nullptr;
  Json& verify = answer["verify"];
  verify["conforms"] = nullptr;
  verify["checked_against"] =
      "nothing: a program compiled with -ffast-math has no specification and no oracle";
  verify["differing_pixels"] = nullptr;
  for (const char* verdict : kVerdicts) verify[verdict] = nullptr;
  answer["failure"] = nullptr;
  return answer;
}

Json Verifier::judge(const Point& point, const Scene& scene) {
  if (is_peer(point)) return judge_peer(point, scene);
  if (!can_judge()) return time_unjudged(point, scene);
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

  const Conformance drawn = check_conformance(
      point.kernel, point.numeric, {.scene = &scene, .settings = settings, .execution = point.execution},
      expect.specification);
  answer["frame_ms"] = drawn.report.seconds.total() * 1e3;
  answer["work"] = work_json(drawn.report.counts, expect.specification, drawn.bytes);
  answer["work"]["counted"] = answer["hardware"] = nullptr;
  answer["picture"] = drawn.picture;

  Json& verify = answer["verify"];
  verify["conforms"] = drawn.differing == 0;
  verify["checked_against"] = "scalar specification of the mode; screen triangles in order and permuted";
  verify["differing_pixels"] = drawn.differing;
  for (const char* verdict : kVerdicts) verify[verdict] = expect.verdicts.at(verdict);
  if (drawn.differing != 0)
    answer["failure"] = fmt::format("{} of {} pixels differ from the specification of {}", drawn.differing,
                                    settings.pixels(), point.numeric);
  else if (answer["failure"].is_null())
    answer["failure"] = expect.verdicts.at("failure");
  if (answer["failure"].is_null()) {
    const CountedFrames counted = count_frames(point, scene);
    answer["work"]["counted"] = work_counters_json(counted.report.counters);
    answer["hardware"] = hardware_json(counted.hardware);
    if (counted.picture != drawn.picture)
      answer["failure"] = "the counted frame differs from the verified one";
  }
  return answer;
}

}  // namespace rasterbench
