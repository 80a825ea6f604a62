#include "harness/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "base/hash.h"
#include "harness/hypothesis.h"
#include "harness/placement.h"
#include "harness/statistics.h"

namespace rasterbench {
namespace {

std::string text_or(const Json& object, const char* key) {
  return object.contains(key) && object.at(key).is_string() ? object.at(key).get<std::string>()
                                                            : std::string();
}

/// Median over samples of each worker's times and of what held it up, with the last sample's other counts.
Json per_thread(const PointState& state) {
  Json threads = Json::array();
  if (state.samples.empty()) return threads;
  const Json& last = state.samples.back().answer.at("per_thread");
  for (std::size_t worker = 0; worker < last.size(); ++worker) {
    const auto median_of = [&](const char* key) {
      std::vector<double> values;
      for (const Sample& sample : state.samples)
        values.push_back(sample.answer.at("per_thread").at(worker).at(key));
      return median(values);
    };
    threads.push_back({{"busy_ms", median_of("busy_ms")},
                       {"idle_ms", median_of("idle_ms")},
                       {"iterations", last.at(worker).at("iterations")},
                       {"chunks", last.at(worker).at("chunks")},
                       {"failed_exchanges", median_of("failed_exchanges")},
                       {"contended_locks", median_of("contended_locks")},
                       {"lock_wait_ms", median_of("lock_wait_ms")},
                       {"cpu", last.at(worker).at("cpu")},
                       {"cpus", samples_by_cpu(state, worker)},
                       {"migrations", migrations_of(state, worker)}});
  }
  return threads;
}

/// How the raster stage was shared, within each sample and then as medians: the longest thread of a frame may
/// be another one in the next. Null where no thread of a loop is known (peers).
Json raster_loop(const PointState& state) {
  std::vector<double> mean, longest, imbalance, outside, lock_wait, contended, failed;
  for (const Sample& sample : state.samples) {
    const Json& threads = sample.answer.at("per_thread");
    if (threads.empty()) return {};
    double sum = 0, most = 0, least_idle = std::numeric_limits<double>::infinity();
    double waited = 0, locks = 0, exchanges = 0;
    for (const Json& thread : threads) {
      const double busy = thread.at("busy_ms");
      sum += busy;
      most = std::max(most, busy);
      least_idle = std::min(least_idle, thread.at("idle_ms").get<double>());
      waited += thread.at("lock_wait_ms").get<double>();
      locks += thread.at("contended_locks").get<double>();
      exchanges += thread.at("failed_exchanges").get<double>();
    }
    mean.push_back(
        std::min(most, sum / static_cast<double>(threads.size())));  // no mean is above, but for rounding
    longest.push_back(most);
    imbalance.push_back(most - mean.back());
    outside.push_back(least_idle);
    lock_wait.push_back(waited);
    contended.push_back(locks);
    failed.push_back(exchanges);
  }
  if (mean.empty()) return {};
  return {{"busy_mean_ms", median(mean)},      {"busy_longest_ms", median(longest)},
          {"imbalance_ms", median(imbalance)}, {"outside_ms", median(outside)},
          {"lock_wait_ms", median(lock_wait)}, {"contended_locks", median(contended)},
          {"failed_exchanges", median(failed)}};
}

/// What decides how points are sampled; the time limit is not in it, so that --resume may give more time.
Json sampling_of(const Study& study) {
  const SamplingPlan& plan = study.sampling;
  return {plan.target,   plan.min_samples, plan.max_samples,  plan.point_seconds,
          plan.launches, study.seed,       plan.frame_seconds};
}

}  // namespace

std::vector<double> PointState::times_ms() const {
  std::vector<double> times;
  for (const Sample& sample : samples) times.push_back(sample.ms);
  return times;
}

std::vector<PointState> initial_states(const Study& study, const std::string& build) {
  std::vector<PointState> states;
  for (const PlannedPoint& planned : study.points) {
    PointState state;
    state.planned = &planned;
    state.id =
        hash_bytes(dump(point_config(planned.point)) + study.hashes.at(planned.point.scene.name) + build);
    state.skip = planned.skip;
    states.push_back(std::move(state));
  }
  return states;
}

std::string family_id(const Study& study, const std::vector<PointState>& states) {
  std::string plan = study.name + dump(sampling_of(study));
  for (const PointState& state : states) {
    if (state.planned->family != states.front().planned->family)
      throw InputError({.field = "--family"},
                       fmt::format("needs --shard I/{}, which has one family each", study.families));
    plan += state.id;
  }
  return hash_bytes(plan);
}

Json start_event(const Study& study, const std::vector<PointState>& states, const std::string& build) {
  std::string plan;
  for (const PointState& state : states) plan += state.id + state.skip + "\n";
  Json event;
  event["event"] = "start";
  event["schema"] = 1;
  event["study"] = study.name;
  event["build"] = build;
  event["scenes"] = study.hashes;
  event["plan"] = hash_bytes(plan);
  event["sampling"] = sampling_of(study);
  // In the journal before the first sample: what is claimed later is no hypothesis.
  if (!study.hypotheses.empty()) event["hypotheses"] = hypotheses_to_json(study.hypotheses);
  return event;
}

void replay(const std::vector<Json>& events, const Json& start, const std::filesystem::path& file,
            std::vector<PointState>& states) {
  if (events.empty() || text_or(events.front(), "event") != "start")
    throw InputError({.file = file.string(), .line = 1}, "does not start with a start event");
  for (const char* key : {"schema", "build", "study", "scenes", "plan", "sampling", "hypotheses"})
    if (events.front().value(key, Json()) != start.value(key, Json()))
      throw InputError({.file = file.string(), .line = 1, .field = key},
                       "differs from this study: --resume continues only what it started");
  std::map<std::string, PointState*> by_id;
  for (PointState& state : states) by_id[state.id] = &state;
  for (std::size_t line = 1; line < events.size(); ++line) {
    const auto found = by_id.find(text_or(events[line], "id"));
    if (found == by_id.end()) continue;  // "resume" events belong to no point
    try {
      apply_event(events[line], *found->second);
    } catch (const Json::exception& error) {
      throw InputError({.file = file.string(), .line = static_cast<std::int64_t>(line) + 1}, error.what());
    }
  }
}

void apply_event(const Json& event, PointState& state) {
  const std::string kind = event.at("event");
  if (kind == "verify") {
    state.judgement = event.at("judgement");
    state.frames = event.at("frames");
    state.failure = text_or(state.judgement, "failure");
  } else if (kind == "fail") {
    state.failure = event.at("reason");
  } else if (kind == "skip") {
    state.skip = event.at("reason");
  } else if (kind == "stop") {
    state.stop = event.at("reason");
  } else if (kind == "sample") {
    state.samples.push_back(
        {event.at("block"), event.at("launch"), event.at("answer").at("ms"), event.at("answer")});
    state.spent_ms += state.samples.back().ms * state.frames;
  }
}

Json make_record(const PointState& state, const Study& study, std::optional<double> floor_ms,
                 const Topology& topology, const std::string& context_id) {
  const Point& point = state.planned->point;
  Json record;
  record["schema"] = 1;
  record["id"] = state.id;
  record["name"] = state.planned->name;
  Json& config = record["config"] = point_config(point);
  config["scene_hash"] = study.hashes.at(point.scene.name);
  const bool ok = state.timed() && !state.samples.empty();
  record["status"] = !state.skip.empty() ? "skipped" : ok ? "ok" : "failed";
  if (!ok)
    record["reason"] = !state.skip.empty()      ? state.skip
                       : !state.failure.empty() ? state.failure
                                                : "the study's time limit left no time for a sample";

  // A point that failed shows no speed, even where it was timed before it did.
  Json launches = Json::array(), blocks = Json::array(), loops = Json::array(), stages;
  const std::vector<double> times = ok ? state.times_ms() : std::vector<double>{};
  for (const char* stage : {"clear", "geometry", "raster", "resolve"}) stages[stage] = Json::array();
  if (ok)
    for (const Sample& sample : state.samples) {
      launches.push_back(sample.launch);
      blocks.push_back(sample.block);
      const Json& loop = sample.answer.at("loop_ms");
      loop.is_null() ? (void)(loops = nullptr) : loops.push_back(loop);
      for (auto& [stage, values] : stages.items()) {
        const Json& part = sample.answer.at("stages").at(stage);
        part.is_null() ? (void)(values = nullptr) : values.push_back(part);  // an absent stage is so in all
      }
    }
  record["launches"] = launches;
  record["blocks"] = blocks;
  record["frames_per_sample"] = state.frames;
  record["samples_ms"] = times;
  record["stages_ms"] = stages;
  record["loop_ms"] = loops;
  const auto interval = median_interval(times);
  const auto p95 = percentile_95(times);
  record["median_ms"] = ok ? Json(median(times)) : Json();
  record["interval_ms"] = interval ? Json{interval->first, interval->second} : Json();
  record["p95_ms"] = p95 ? Json(*p95) : Json();
  record["min_ms"] = ok ? Json(*std::min_element(times.begin(), times.end())) : Json();
  record["max_ms"] = ok ? Json(*std::max_element(times.begin(), times.end())) : Json();
  record["floor_ms"] = ok && floor_ms ? Json(*floor_ms) : Json();
  record["stop"] = ok ? Json(state.stop.empty() ? "time_limit" : state.stop) : Json();
  record["verify"] = state.judgement.is_null() ? Json() : state.judgement.value("verify", Json());
  record["work"] = state.judgement.is_null() ? Json() : state.judgement.value("work", Json());
  record["hardware"] = state.judgement.is_null() ? Json() : state.judgement.value("hardware", Json());
  record["threads_observed"] =
      state.judgement.is_null() ? Json() : state.judgement.value("threads_observed", Json());
  record["runtime_observed"] = ok ? state.samples.back().answer.value("runtime_observed", Json()) : Json();
  record["per_thread"] = ok ? per_thread(state) : Json::array();
  record["placement"] = ok ? placement_of(state, topology) : Json();
  record["raster_loop"] = ok ? raster_loop(state) : Json();
  if (ok && state.samples.back().answer.contains("counters"))
    record["counters"] = state.samples.back().answer.at("counters");
  record["context"] = context_id;
  return record;
}

int frames_per_sample(double frame_ms) {
  constexpr double kShortFrameMs = 0.5;
  return frame_ms < kShortFrameMs ? static_cast<int>(std::clamp(1.0 / frame_ms, 1.0, 1000.0)) : 1;
}

std::string stop_reason(const SamplingPlan& plan, std::span<const double> times_ms, double spent_ms) {
  const auto n = static_cast<int>(times_ms.size());
  const bool enough = n >= plan.min_samples && n >= plan.launches;
  const auto interval = median_interval(times_ms);
  if (enough && interval && (interval->second - interval->first) / 2 <= plan.target * median(times_ms))
    return "target";
  if (n >= plan.max_samples) return "max_samples";
  return enough && spent_ms >= plan.point_seconds * 1e3 ? "point_seconds" : "";
}

std::string summary_table(const std::vector<PointState>& states) {
  std::size_t width = 5;
  for (const PointState& state : states) width = std::max(width, state.planned->name.size());
  std::string table = fmt::format("{:<{}}  {:>10}  {:>21}  {:>4}  {}\n", "point", width, "median ms",
                                  "95 % interval", "n", "stop");
  for (const PointState& state : states) {
    const std::vector<double> times = state.times_ms();
    if (!state.timed() || times.empty()) {
      const bool skipped = !state.skip.empty();
      table += fmt::format("{:<{}}  {}: {}\n", state.planned->name, width, skipped ? "skipped" : "FAILED",
                           skipped                 ? state.skip
                           : state.failure.empty() ? "no sample"
                                                   : state.failure);
      continue;
    }
    const auto interval = median_interval(times);
    table += fmt::format("{:<{}}  {:>10.3f}  {:>21}  {:>4}  {}\n", state.planned->name, width, median(times),
                         interval ? fmt::format("[{:.3f}, {:.3f}]", interval->first, interval->second) : "-",
                         times.size(), state.stop.empty() ? "time_limit" : state.stop);
  }
  return table;
}

}  // namespace rasterbench
