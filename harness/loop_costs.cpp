#include "harness/loop_costs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "build_info.h"
#include "harness/context.h"
#include "harness/statistics.h"
#include "harness/verify.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

// Files of at most 50 MB: an event takes up to 190 bytes, a cost about 8.
constexpr std::size_t kMostEvents = 250'000, kMostCosts = 4'000'000;

std::unique_ptr<Renderer> traced_renderer(const Point& point, const Scene& scene, ExecutionConfig execution,
                                          LoopTrace* trace) {
  execution.trace = trace;
  return make_renderer(
      point.kernel, point.numeric,
      {.scene = &scene, .settings = point.settings(), .execution = execution, .keeps_ids = false});
}

double loop_seconds(const LoopTrace& trace) {
  double sum = 0;
  for (const TracedLoop& loop : trace.loops()) sum += loop.end - loop.begin;
  return sum;
}

/// Index of the value that has as many below it as above (the lower one of two).
std::size_t median_index(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto middle = order.begin() + static_cast<std::ptrdiff_t>((order.size() - 1) / 2);
  std::nth_element(order.begin(), middle, order.end(),
                   [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  return *middle;
}

/// Microseconds with four digits behind the point: a clock has no more.
double rounded_us(double seconds) { return std::round(seconds * 1e10) / 1e4; }

Json schedule_json(const ExecutionConfig& execution) {
  return execution.schedule.empty() ? Json() : Json(execution.schedule);
}

Json tile_json(const Point& point, const LoopShape& shape) {
  return find_kernel(point.kernel).info().has_tiles ? Json(shape.width) : Json();
}

std::string runtime_of(const ExecutionConfig& execution) {
  if (execution.backend == "openmp") return openmp_runtime();
  if (execution.backend == "tbb") return fmt::format("oneTBB {}", build_info::kTbbVersion);
  return "none";
}

/// How the chunks of the file were seen, in words.
std::string chunks_found_by(const ExecutionConfig& execution) {
  if (execution.backend == "tbb") return "each is a range that oneTBB handed to the body";
  if (execution.backend == "serial") return "one: all iterations in order";
  const std::string found =
      "stamps around every iteration; a chunk is a run of consecutive iterations of one thread";
  if (execution.schedule == "dynamic" || (execution.schedule == "static" && execution.chunk))
    return found + ", cut at the multiples of the schedule's chunk";
  if (execution.schedule != "guided") return found;
  return found + (openmp_runtime() == "libgomp"
                      ? ", cut where libgomp's guided begins a chunk"
                      : ", so that two chunks in a row that follow each other are one");
}

struct Joined {
  TracedChunk chunk;
  std::int64_t chunks = 1, iterations = 0;
};

/// The chunks of a worker, `together` of one loop at a time.
std::vector<Joined> join(const std::vector<TracedChunk>& chunks, std::int64_t together) {
  std::vector<Joined> joined;
  for (const TracedChunk& chunk : chunks) {
    const std::int64_t iterations = chunk.last - chunk.first + 1;
    if (joined.empty() || joined.back().chunks == together || joined.back().chunk.loop != chunk.loop) {
      joined.push_back({chunk, 1, iterations});
      continue;
    }
    Joined& before = joined.back();
    before.chunk.first = std::min(before.chunk.first, chunk.first);
    before.chunk.last = std::max(before.chunk.last, chunk.last);
    before.chunk.end = chunk.end;
    before.chunks += 1;
    before.iterations += iterations;
  }
  return joined;
}

/// Seconds of loop(n) with an empty body: the shortest of many, since other load only lengthens it.
double empty_loop_seconds(Execution& execution, std::int64_t n) {
  constexpr int kRepetitions = 31;
  double shortest = std::numeric_limits<double>::infinity();
  for (int repetition = 0; repetition < kRepetitions; ++repetition) {
    execution.reset_tally();
    const double begin = LoopTrace::now();
    execution.loop(n, [](std::int64_t, int) {});
    shortest = std::min(shortest, LoopTrace::now() - begin);
  }
  return shortest;
}

double chunks_of(const Execution& execution) {
  std::int64_t sum = 0;
  for (const WorkerTally& tally : execution.tally()) sum += tally.chunks;
  return static_cast<double>(sum);
}

}  // namespace

LoopShape loop_shape(const Point& point) {
  const KernelInfo& info = find_kernel(point.kernel).info();
  const int tile = info.tile_side ? info.tile_side(point.tile) : point.tile;
  switch (info.unit) {
    case LoopUnit::kTriangle:
      return {"triangle"};
    case LoopUnit::kBoxRow:
      return {"row"};
    case LoopUnit::kPixel:
      return {"pixel", 1, 1, point.width};
    case LoopUnit::kRow:
      return {"row", point.width, info.rows, 1};
    case LoopUnit::kTile:
      return {"tile", tile, tile, (point.width + tile - 1) / tile};
  }
  throw std::logic_error("a loop unit without a shape");
}

TracedFrame trace_frames(const Point& point, const Scene& scene, int frames) {
  {
    const auto probe = make_execution(point.execution);
    if (const int count = observe_threads(*probe).count; count < point.execution.threads)
      throw Error(fmt::format("{} of {} threads ran", count, point.execution.threads));
  }
  TracedFrame result;
  std::string picture;
  {
    const auto untraced = traced_renderer(point, scene, point.execution, nullptr);
    untraced->draw();
    std::vector<double> seconds;
    for (int frame = 0; frame < frames; ++frame) seconds.push_back(untraced->draw().seconds.total());
    result.untraced_seconds = median(seconds);
    picture = picture_hash(*untraced);
  }
  LoopTrace trace(LoopTrace::Detail::kChunks);
  const auto renderer = traced_renderer(point, scene, point.execution, &trace);
  renderer->draw();  // makes room for the chunks of the others
  std::vector<double> seconds;
  std::vector<TracedFrame> traced;
  for (int frame = 0; frame < frames; ++frame) {
    trace.clear();
    TracedFrame& taken = traced.emplace_back();
    taken.begin = LoopTrace::now();
    taken.seconds = renderer->draw().seconds.total();
    taken.loops = trace.loops();
    taken.chunks = trace.chunks();
    seconds.push_back(loop_seconds(trace));
  }
  if (trace.loops().empty()) throw Error(fmt::format("{} has no loop to trace", point.kernel));
  if (picture_hash(*renderer) != picture) throw Error("the traced frame differs from the others");
  TracedFrame& chosen = traced[median_index(seconds)];
  chosen.untraced_seconds = result.untraced_seconds;
  return std::move(chosen);
}

LoopCosts measure_loop_costs(const Point& point, const Scene& scene, int frames) {
  const ExecutionConfig serial;
  LoopCosts costs;
  {
    LoopTrace trace(LoopTrace::Detail::kLoops);
    const auto renderer = traced_renderer(point, scene, serial, &trace);
    renderer->draw();
    std::vector<double> seconds;
    for (int frame = 0; frame < frames; ++frame) {
      trace.clear();
      renderer->draw();
      seconds.push_back(loop_seconds(trace));
    }
    if (trace.loops().empty()) throw Error(fmt::format("{} has no loop to trace", point.kernel));
    if (!trace.loops_alike())
      throw InputError({.field = "--kernel"},
                       fmt::format("{} runs {} loops of several lengths in a frame: its iterations have no "
                                   "costs of their own, and no --costs or --image",
                                   point.kernel, trace.loops().size()));
    costs.serial_loop_seconds = median(seconds);
  }
  LoopTrace trace(LoopTrace::Detail::kIterations);
  const auto renderer = traced_renderer(point, scene, serial, &trace);
  renderer->draw();
  const std::size_t n = trace.iteration_seconds().size();
  checked_bytes(n * static_cast<std::size_t>(frames), sizeof(float), "the costs of every iteration");
  std::vector<std::vector<float>> taken;
  for (int frame = 0; frame < frames; ++frame) {
    trace.clear();
    renderer->draw();
    taken.emplace_back(trace.iteration_seconds().begin(), trace.iteration_seconds().end());
  }
  const double loops = static_cast<double>(trace.loops().size());
  costs.stamp_seconds = loops * LoopTrace::stamp_seconds();
  std::vector<double> of_iteration(static_cast<std::size_t>(frames));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t frame = 0; frame < taken.size(); ++frame) of_iteration[frame] = taken[frame][i];
    costs.seconds.push_back(std::max(0.0, median(of_iteration) - costs.stamp_seconds));
  }
  costs.colours.assign(renderer->colours().begin(), renderer->colours().end());
  return costs;
}

std::map<std::string, ScheduleCost> measure_schedules(int threads) {
  constexpr std::int64_t kIterations = 1 << 14;
  std::map<std::string, ScheduleCost> costs;
  struct Times {
    double start, whole, chunks;  // chunks: those of the whole loop beyond those of its start
  };
  const auto measure = [&](const ExecutionConfig& config) {
    const auto execution = make_execution(config);
    Times times;
    times.start = empty_loop_seconds(*execution, std::int64_t{threads} * config.chunk.value_or(1));
    times.chunks = -chunks_of(*execution);
    times.whole = empty_loop_seconds(*execution, kIterations);
    times.chunks += chunks_of(*execution);
    return times;
  };
  for (const Schedule& schedule : schedules()) {
    if (schedule.backend == "serial") continue;
    // The same loop with one chunk a thread: what the iterations themselves cost.
    const Times even = measure({schedule.backend, "static", {}, threads, nullptr});
    for (const std::optional<int> chunk :
         {std::optional<int>(), std::optional<int>(1), std::optional<int>(16)}) {
      if (chunk && schedule.chunk.empty()) continue;
      const ExecutionConfig config{schedule.backend, schedule.name, chunk, threads, nullptr};
      const Times times = measure(config);
      const double spent = threads * ((times.whole - times.start) - (even.whole - even.start));
      costs[to_string(config)] = {times.start, times.chunks > 0 ? std::max(0.0, spent / times.chunks) : 0.0};
    }
  }
  return costs;
}

std::string trace_text(const Point& point, const LoopShape& shape, const TracedFrame& frame,
                       const Json& image) {
  std::size_t total = 0;
  for (const auto& of_worker : frame.chunks) total += of_worker.size();
  const auto together =
      static_cast<std::int64_t>(std::max<std::size_t>(1, (total + kMostEvents - 1) / kMostEvents));
  const auto us = [&](double seconds) { return 1e6 * (seconds - frame.begin); };

  std::string text = "{\"traceEvents\":[\n";
  for (std::size_t worker = 0; worker < frame.chunks.size(); ++worker)
    text += fmt::format(
        "{}{{\"name\":\"thread_name\",\"ph\":\"M\",\"pid\":0,\"tid\":{},\"args\":{{\"name\":\"thread "
        "{}\"}}}}",
        worker == 0 ? "" : ",\n", worker, worker);
  for (std::size_t worker = 0; worker < frame.chunks.size(); ++worker)
    for (const Joined& joined : join(frame.chunks[worker], together)) {
      const TracedChunk& chunk = joined.chunk;
      text += fmt::format(
          ",\n{{\"name\":\"chunk\",\"cat\":\"raster\",\"ph\":\"X\",\"ts\":{:.3f},\"dur\":{:.3f},\"pid\":0,"
          "\"tid\":{},\"args\":{{\"first\":{},\"last\":{}",
          us(chunk.begin), 1e6 * (chunk.end - chunk.begin), worker, chunk.first, chunk.last);
      if (frame.loops.size() > 1) text += fmt::format(",\"loop\":{}", chunk.loop);
      if (together > 1)
        text += fmt::format(",\"chunks\":{},\"iterations\":{}", joined.chunks, joined.iterations);
      text += "}}";
    }
  std::int64_t iterations = 0;
  double loops = 0;
  for (const TracedLoop& loop : frame.loops) {
    iterations += loop.iterations;
    loops += loop.end - loop.begin;
  }
  namespace info = build_info;
  const ExecutionConfig& execution = point.execution;
  const Json config = point_config(point);
  Json metadata{{"schema", 1},
                {"model", point.scene.model},
                {"scene", point.scene.parameters.empty() ? Json() : Json(point.scene.parameters)},
                {"size", {point.width, point.height}},
                {"kernel", point.kernel},
                {"numeric", point.numeric},
                {"fill", config.at("fill")},
                {"backend", execution.backend},
                {"schedule", schedule_json(execution)},
                {"chunk", config.at("chunk")},
                {"threads", execution.threads},
                {"tile", tile_json(point, shape)},
                {"iterations", iterations},
                {"unit", shape.unit},
                {"runtime", runtime_of(execution)},
                {"cpu", cpu_model()},
                {"frame_us", rounded_us(frame.seconds)},
                {"untraced_frame_us", rounded_us(frame.untraced_seconds)},
                {"loops", frame.loops.size()},
                {"loop_begin_us", rounded_us(frame.loops.front().begin - frame.begin)},
                {"loop_end_us", rounded_us(frame.loops.back().end - frame.begin)},
                {"loop_us", rounded_us(loops)},
                {"chunks", total},
                {"chunks_an_event", together},
                {"chunks_found_by", chunks_found_by(execution)},
                {"git", fmt::format("{}{}", info::kCommit, info::kDirty ? "+dirty" : "")},
                {"image", image}};
  return text + "\n],\n\"metadata\":" + dump(metadata) + "}\n";
}

std::string costs_text(const Point& point, const LoopShape& shape, const LoopCosts& costs,
                       const std::map<std::string, ScheduleCost>& schedules) {
  const std::size_t n = costs.seconds.size(),
                    block = std::max<std::size_t>(1, (n + kMostCosts - 1) / kMostCosts);
  std::string list;
  for (std::size_t first = 0; first < n; first += block) {
    double sum = 0;
    for (std::size_t i = first; i < std::min(first + block, n); ++i) sum += costs.seconds[i];
    list += fmt::format("{}{}", first == 0 ? "" : ",", rounded_us(sum));
  }
  Json head{{"schema", 1},
            {"unit", shape.unit},
            {"iterations", n},
            {"iterations_a_cost", block},
            {"columns", shape.columns},
            {"tile", tile_json(point, shape)},
            {"size", {point.width, point.height}},
            {"kernel", point.kernel},
            {"numeric", point.numeric},
            {"schedule", to_string(point.execution)},
            {"threads", point.execution.threads},
            {"runtime", runtime_of(point.execution)},
            {"cpu", cpu_model()},
            {"stamp_us", rounded_us(costs.stamp_seconds)},
            {"serial_us", rounded_us(costs.serial_loop_seconds)}};
  for (const auto& [schedule, cost] : schedules) {
    head["dispatch_us"][schedule] = rounded_us(cost.chunk_seconds);
    head["start_us"][schedule] = rounded_us(cost.start_seconds);
  }
  std::string text = dump(head);
  text.pop_back();  // the closing brace
  return text + ",\"cost_us\":[" + list + "]}\n";
}

}  // namespace rasterbench
