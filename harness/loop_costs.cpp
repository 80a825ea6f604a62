#include "harness/loop_costs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/buffer.h"
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

/// The value that has as many below it as above (the lower one of two).
double lower_median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::size_t chunks_in(const TracedFrame& frame) {
  std::size_t sum = 0;
  for (const auto& of_worker : frame.chunks) sum += of_worker.size();
  return sum;
}

double loop_seconds(const TracedFrame& frame) {
  double sum = 0;
  for (const TracedLoop& loop : frame.loops) sum += loop.end - loop.begin;
  return sum;
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
  {
    LoopTrace loops(LoopTrace::Detail::kLoops);
    traced_renderer(point, scene, point.execution, &loops)->draw();
    if (loops.loops().empty()) throw Error(fmt::format("{} has no loop to trace", point.kernel));
    std::size_t iterations = 0;
    for (const TracedLoop& loop : loops.loops()) iterations += static_cast<std::size_t>(loop.iterations);
    checked_bytes(iterations, 3 * sizeof(TracedChunk),
                  "the chunks of a traced frame");  // the trace's, two kept
    // A chunk belongs to one loop, so that no more of them can be joined than a loop has.
    if (const std::size_t least = loops.loops().size() * static_cast<std::size_t>(point.execution.threads);
        loops.loops().size() > 1 && least > kMostEvents)
      throw InputError(
          {.field = "--kernel"},
          fmt::format("{} runs {} loops in a frame: a trace holds at most {} on {} threads", point.kernel,
                      loops.loops().size(), kMostEvents / static_cast<std::size_t>(point.execution.threads),
                      point.execution.threads));
  }
  LoopTrace trace(LoopTrace::Detail::kChunks);
  const auto renderer = traced_renderer(point, scene, point.execution, &trace);
  renderer->draw();  // makes room for the chunks of the others
  FramesNearMedian kept;
  for (int frame = 0; frame < frames; ++frame) {
    trace.clear();
    TracedFrame taken;
    taken.begin = LoopTrace::now();
    taken.seconds = renderer->draw().seconds.total();
    taken.untraced_seconds = result.untraced_seconds;
    taken.loops = trace.loops();
    taken.chunks = trace.chunks();
    kept.add(std::move(taken));
  }
  if (picture_hash(*renderer) != picture) throw Error("the traced frame differs from the others");
  return kept.take();
}

void FramesNearMedian::add(TracedFrame frame) {
  seconds_.push_back(loop_seconds(frame));
  bytes_ += chunks_in(frame) * sizeof(TracedChunk);
  kept_.push_back(std::move(frame));
  const double middle = lower_median(seconds_);
  while (kept_.size() > kMostFrames || (kept_.size() > 1 && bytes_ > kMostBytes)) {
    const auto farthest = std::max_element(kept_.begin(), kept_.end(), [&](const auto& a, const auto& b) {
      return std::abs(loop_seconds(a) - middle) < std::abs(loop_seconds(b) - middle);
    });
    bytes_ -= chunks_in(*farthest) * sizeof(TracedChunk);
    kept_.erase(farthest);
  }
}

TracedFrame FramesNearMedian::take() {
  const double middle = lower_median(seconds_);
  return std::move(*std::min_element(kept_.begin(), kept_.end(), [&](const auto& a, const auto& b) {
    return std::abs(loop_seconds(a) - middle) < std::abs(loop_seconds(b) - middle);
  }));
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

std::string trace_text(const Point& point, const LoopShape& shape, const TracedFrame& frame,
                       const Json& image) {
  const std::size_t total = chunks_in(frame);
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
  Json spans = Json::array();
  for (const TracedLoop& loop : frame.loops) {
    iterations += loop.iterations;
    spans.push_back({rounded_us(loop.begin - frame.begin), rounded_us(loop.end - frame.begin)});
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
                {"loop_us", rounded_us(loop_seconds(frame))},
                {"loop_spans_us", frame.loops.size() > 1 ? spans : Json()},
                {"chunks", total},
                {"chunks_an_event", together},
                {"chunks_found_by", chunks_found_by(execution)},
                {"git", fmt::format("{}{}", info::kCommit, info::kDirty ? "+dirty" : "")},
                {"image", image}};
  return text + "\n],\n\"metadata\":" + dump(metadata) + "}\n";
}

std::string costs_text(const Point& point, const std::string& scene_hash, const LoopShape& shape,
                       const LoopCosts& costs, const ScheduleCosts& schedules) {
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
            {"model", point.scene.model},
            {"scene_hash", scene_hash},
            {"schedule", to_string(point.execution)},
            {"threads", point.execution.threads},
            {"runtime", runtime_of(point.execution)},
            {"cpu", cpu_model()},
            {"stamp_us", rounded_us(costs.stamp_seconds)},
            {"serial_us", rounded_us(costs.serial_loop_seconds)}};
  const Json config = point_config(point);
  for (const char* axis : {"fill", "near", "isa", "techniques", "generality"}) head[axis] = config.at(axis);
  const auto us_or_null = [](const std::optional<double>& seconds) {
    return seconds ? Json(rounded_us(*seconds)) : Json();
  };
  head["steal_us"] = us_or_null(schedules.steal_seconds);
  for (const auto& [schedule, cost] : schedules.of) {
    head["dispatch_us"][schedule] = us_or_null(cost.chunk_seconds);
    head["start_us"][schedule] = us_or_null(cost.start_seconds);
  }
  std::string text = dump(head);
  text.pop_back();  // the closing brace
  return text + ",\"cost_us\":[" + list + "]}\n";
}

}  // namespace rasterbench
