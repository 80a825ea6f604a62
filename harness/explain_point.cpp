#include "harness/explain_point.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "base/error.h"
#include "harness/bound.h"
#include "harness/counted_frames.h"
#include "harness/limits.h"
#include "harness/progress.h"
#include "harness/statistics.h"
#include "harness/verify.h"
#include "kernels/kernel.h"
#include "machine/cost_ladder.h"

namespace rasterbench {
namespace {

constexpr double kLimitSeconds = 1;    // of measuring bandwidth
constexpr double kWideInterval = 0.2;  // of a median
constexpr double kManySwitches = 2;    // a thread and frame

/// The times of a point's frames in milliseconds, one a sample.
struct Times {
  std::vector<double> frame, busy_mean, busy_longest, imbalance, serial;
  std::vector<double> lock_wait, contended_locks,
      failed_exchanges;                       // of all threads; the last two are counts
  std::array<std::vector<double>, 4> stages;  // empty: the kernel has no such stage
  std::vector<std::vector<double>> busy;      // by worker
};
constexpr std::array kStages{"clear", "geometry", "raster", "resolve"};

Times time_frames(const Point& point, const Scene& scene, int samples, Progress& progress) {
  const auto renderer = make_renderer(
      point.kernel, point.numeric,
      {.scene = &scene, .settings = point.settings(), .execution = point.execution, .keeps_ids = false});
  renderer->draw();  // touches the buffers; the second frame meets them warm
  renderer->draw();
  Times times;
  times.busy.resize(static_cast<std::size_t>(point.execution.threads));
  for (int sample = 0; sample < samples; ++sample) {
    progress.show("samples", sample, samples, point.kernel);
    const FrameReport& report = renderer->draw();
    const StageSeconds& s = report.seconds;
    times.frame.push_back(1e3 * s.total());
    const std::array seconds{s.clear, s.geometry, s.raster, s.resolve};
    for (std::size_t stage = 0; stage < seconds.size(); ++stage)
      if (seconds[stage]) times.stages[stage].push_back(1e3 * *seconds[stage]);
    double sum = 0, longest = 0;
    Contention contention;
    for (std::size_t worker = 0; worker < report.raster_tally.size(); ++worker) {
      const double busy = 1e3 * report.raster_tally[worker].busy_seconds;
      times.busy[worker].push_back(busy);
      sum += busy;
      longest = std::max(longest, busy);
      contention += report.raster_tally[worker].contention;
    }
    times.lock_wait.push_back(1e3 * contention.lock_wait_seconds);
    times.contended_locks.push_back(static_cast<double>(contention.contended_locks));
    times.failed_exchanges.push_back(static_cast<double>(contention.failed_exchanges));
    const double mean = sum / point.execution.threads;
    times.busy_mean.push_back(mean);
    times.busy_longest.push_back(longest);
    times.imbalance.push_back(longest - mean);
    times.serial.push_back(std::max(0.0, 1e3 * s.raster.value_or(0) - longest));
  }
  return times;
}

Json median_json(const std::vector<double>& ms) {
  const auto interval = median_interval(ms);
  return {{"median_ms", median(ms)},
          {"interval_ms", interval ? Json{interval->first, interval->second} : Json()}};
}

/// What was verified: its picture, and the samples that any kernel of the mode has to find.
struct Verified {
  std::string picture;
  std::int64_t samples_in_boxes = 0, samples_inside = 0;
};

/// A point that does not conform has no time to explain.
Verified verify_point(const Point& point, const Scene& scene) {
  const auto execution = make_execution(point.execution);
  if (const ObservedThreads observed = observe_threads(*execution); observed.count < point.execution.threads)
    throw Error(fmt::format("{} of {} threads ran", observed.count, point.execution.threads));
  const Picture specification = render_specification(scene, point.numeric, point.settings());
  const Conformance drawn = check_conformance(
      point.kernel, point.numeric,
      {.scene = &scene, .settings = point.settings(), .execution = point.execution}, specification);
  if (drawn.differing != 0)
    throw Error(fmt::format("{} does not conform: {} of {} pixels differ from the specification of {}",
                            point.kernel, drawn.differing, point.settings().pixels(), point.numeric));
  return {drawn.picture, specification.samples_tested, specification.samples_covered};
}

/// Milliseconds in which the bytes of a stage pass at the rates of `limit`, or empty where one is unknown.
std::optional<double> stage_floor_ms(const std::optional<StageBytes>& bytes, const Json& limit) {
  if (!bytes || limit.at("read").is_string()) return {};
  const auto rate = [&](const char* name) { return limit.at(name).at("best").get<double>() * 1e9; };
  return floor_ms({static_cast<std::size_t>(bytes->read), static_cast<std::size_t>(bytes->written)},
                  rate("read"), rate("streaming_write"));
}

Json stages_json(const Times& times, const WorkCounters& counters, const Json& limit) {
  const std::array bytes{counters.clear_bytes, counters.geometry_bytes, counters.raster_bytes,
                         counters.resolve_bytes};
  Json stages;
  for (std::size_t i = 0; i < kStages.size(); ++i) {
    if (times.stages[i].empty()) {
      stages[kStages[i]] = nullptr;
      continue;
    }
    Json stage = median_json(times.stages[i]);
    const double ms = stage.at("median_ms");
    stage["share"] = ms / median(times.frame);
    stage["bytes"] = bytes[i] ? Json{{"read", bytes[i]->read}, {"written", bytes[i]->written}} : Json();
    const auto floor = stage_floor_ms(bytes[i], limit);
    stage["floor_ms"] = floor ? Json(*floor) : Json();
    stage["gb_per_s"] = bytes[i] && ms > 0
                            ? Json(1e-6 * static_cast<double>(bytes[i]->read + bytes[i]->written) / ms)
                            : Json();
    stages[kStages[i]] = stage;
  }
  return stages;
}

Json raster_loop_json(const Times& times) {
  Json busy = Json::array();
  for (const auto& of_worker : times.busy)
    busy.push_back(of_worker.empty() ? Json() : Json(median(of_worker)));
  const double mean = median(times.busy_mean), longest = median(times.busy_longest);
  return {{"busy_ms", busy},
          {"busy_mean_ms", mean},
          {"busy_longest_ms", longest},
          {"longest_over_mean", mean > 0 ? Json(longest / mean) : Json()},
          {"imbalance_ms", median(times.imbalance)},
          {"serial_ms", median(times.serial)},
          {"lock_wait_ms", median(times.lock_wait)},
          {"contended_locks", median(times.contended_locks)},
          {"failed_exchanges", median(times.failed_exchanges)}};
}

/// Instructions per cycle, and misses per triangle and per sample inside one; null where one is unknown.
Json hardware_rates_json(const HardwareReport& hardware, std::int64_t triangles, std::int64_t fragments) {
  const auto per = [&](const char* event, double count) {
    const auto total = hardware.total(event);
    return total && count > 0 ? Json(*total / count) : Json();
  };
  Json rates;
  rates["instructions_per_cycle"] = per("instructions", hardware.total("cycles").value_or(0));
  rates["branch_miss_share"] = per("branch_misses", hardware.total("branches").value_or(0));
  for (const char* event :
       {"instructions", "branch_misses", "l1d_read_misses", "llc_misses", "dtlb_read_misses"}) {
    rates["per_triangle"][event] = per(event, static_cast<double>(triangles));
    rates["per_fragment"][event] = per(event, static_cast<double>(fragments));
  }
  return rates;
}

Json ladder_json(const Point& point, const Scene& scene, int samples, const std::optional<double>& floor,
                 Progress& progress) {
  const auto modes = cost_ladder_modes();
  if (std::find(modes.begin(), modes.end(), point.numeric) == modes.end())
    return fmt::format("unavailable: no ladder in mode {}, but in {}", point.numeric, fmt::join(modes, ", "));
  if (scene.model.triangles.empty()) return "unavailable: the scene has no triangles";
  if (point.execution.threads > available_cpus())
    return fmt::format("unavailable: {} threads on {} CPUs", point.execution.threads, available_cpus());
  CostLadder ladder;
  try {
    ladder =
        measure_cost_ladder(scene, point.numeric, point.settings(), point.execution.threads, samples,
                            [&](int done) { progress.show("cost ladder", done, samples, point.numeric); });
  } catch (const Error& error) {  // threads that a binding denies it: the rest of the explanation holds
    return fmt::format("unavailable: {}", error.what());
  }
  Json rungs = Json::array();
  double below = 0;
  for (const Rung& rung : ladder.rungs) {
    std::vector<double> ms;
    for (const double seconds : rung.seconds) ms.push_back(1e3 * seconds);
    Json json{{"rung", rung.name}, {"meaning", rung.meaning}, {"results", rung.results}, {"unit", rung.unit}};
    json.update(median_json(ms));
    const double here = median(ms);
    json["step_ms"] = here - below;
    json["times_floor"] = floor ? Json(here / *floor) : Json();
    below = here;
    rungs.push_back(json);
  }
  return {{"threads", ladder.threads}, {"numeric", ladder.mode}, {"repetitions", samples}, {"rungs", rungs}};
}

/// The step of the ladder that adds most, in words; null without a ladder.
Json largest_step(const Json& ladder) {
  if (ladder.is_string()) return {};
  const Json& rungs = ladder.at("rungs");
  const auto largest = std::max_element(rungs.begin(), rungs.end(), [](const Json& a, const Json& b) {
    return a.at("step_ms").get<double>() < b.at("step_ms").get<double>();
  });
  return fmt::format("{}, {:.3f} of {:.3f} ms", largest->at("rung").get<std::string>(),
                     largest->at("step_ms").get<double>(), rungs.back().at("median_ms").get<double>());
}

/// What makes the verdict doubtful, or null.
Json caution(const std::vector<double>& frame_ms, const HardwareReport& hardware) {
  std::vector<std::string> reasons;
  const auto interval = median_interval(frame_ms);
  if (interval && interval->second - interval->first > kWideInterval * median(frame_ms))
    reasons.push_back(fmt::format("the interval of the median is {:.0f} % of it wide (more than {:g} %)",
                                  100 * (interval->second - interval->first) / median(frame_ms),
                                  100 * kWideInterval));
  const double switches = hardware.total("context_switches").value_or(0);
  if (switches > kManySwitches * static_cast<double>(hardware.threads.size()))
    reasons.push_back(fmt::format("{:.0f} context switches in the counted frame", switches));
  if (reasons.empty()) return {};
  return fmt::format("{}: other load, or threads that sleep while they wait", fmt::join(reasons, ", and "));
}

Json triangles_json(const GeometryCounts& c) {
  return {{"triangles", c.triangles},
          {"drawn", c.drawn},
          {"pieces", c.pieces},
          {"rejected",
           {{"non_finite", c.non_finite},
            {"zero_area", c.zero_area},
            {"behind_near", c.behind_near},
            {"beyond_far", c.beyond_far},
            {"off_screen", c.off_screen},
            {"back_facing", c.back_facing}}},
          {"near_clipped", c.near_clipped},
          {"guard_clipped", c.guard_clipped}};
}

}  // namespace

Json explain_point(const Point& point, const Scene& scene, int samples) {
  if (is_peer(point))
    throw InputError({.field = "kernel"}, fmt::format("{} is a peer: its frame has no stages", point.kernel));
  Progress progress;
  progress.show("verify", 0, 1, point.kernel);
  const Verified verified = verify_point(point, scene);
  progress.show("bandwidth", 0, 1, "");
  const auto triangle_count = static_cast<std::int64_t>(scene.model.triangles.size());
  const LimitKey key{std::min(point.execution.threads, available_cpus()),
                     working_set_of(triangle_count, point.width, point.height)};
  Limits limits;
  const Json limit = measure_limit(key, kLimitSeconds);
  limits.add(limit);
  const std::optional<double> floor = limits.floor_of(key);
  const Times times = time_frames(point, scene, samples, progress);
  progress.show("counters", 0, 1, point.kernel);
  const CountedFrames counted = count_frames(point, scene);
  if (counted.picture != verified.picture) throw Error("the counted frame differs from the verified one");

  const WorkCounters& work = counted.report.counters;
  Json json;
  json["point"] = point_name(point);
  json["config"] = point_config(point);
  json["samples"] = samples;
  json.update(median_json(times.frame));
  json["floor_ms"] = floor ? Json(*floor) : Json();
  json["times_floor"] = floor ? Json(median(times.frame) / *floor) : Json();
  json["rates"] = limit;
  json["stages"] = stages_json(times, work, limit);
  json["raster_loop"] = raster_loop_json(times);
  json["geometry"] = triangles_json(counted.report.counts);
  json["specification"] = {{"samples_in_boxes", verified.samples_in_boxes},
                           {"samples_inside", verified.samples_inside}};
  json["counted"] = work_counters_json(work);
  json["hardware"] = hardware_json(counted.hardware);
  json["hardware_rates"] = hardware_rates_json(counted.hardware, triangle_count, verified.samples_inside);
  json["cost_ladder"] = ladder_json(point, scene, samples, floor, progress);

  const auto stage_median = [&](std::size_t stage) {
    return times.stages[stage].empty() ? 0.0 : median(times.stages[stage]);
  };
  PointCosts costs{.frame = median(times.frame),
                   .clear = stage_median(0),
                   .geometry = stage_median(1),
                   .raster = stage_median(2),
                   .resolve = stage_median(3),
                   .raster_imbalance = median(times.imbalance),
                   .raster_serial = median(times.serial),
                   .floor = floor,
                   .own_bytes = 0.0,
                   .ipc = {}};
  for (const auto& [name, stage] : json["stages"].items())
    if (stage.is_null())
      continue;
    else if (stage.at("floor_ms").is_null())
      costs.own_bytes.reset();
    else if (costs.own_bytes)
      *costs.own_bytes += stage.at("floor_ms").get<double>();
  if (const Json& ipc = json["hardware_rates"]["instructions_per_cycle"]; !ipc.is_null()) costs.ipc = ipc;
  const Bound bound = find_bound(costs);
  json["own_bytes_ms"] = costs.own_bytes ? Json(*costs.own_bytes) : Json();
  json["bound"] = {{"name", bound.name},
                   {"text", bound.text},
                   {"measures", bound.measures},
                   {"largest_step", largest_step(json["cost_ladder"])},
                   {"caution", caution(times.frame, counted.hardware)}};
  return json;
}

}  // namespace rasterbench
