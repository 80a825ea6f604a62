#include "harness/counted_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/verify.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

Json or_null(const std::optional<std::int64_t>& value) { return value ? Json(*value) : Json(); }

Json bytes_json(const std::optional<StageBytes>& bytes) {
  return bytes ? Json{{"read", bytes->read}, {"written", bytes->written}} : Json();
}

Json sizes_json(const std::optional<SizeClasses>& sizes) {
  if (!sizes) return {};
  Json json{{"without_sample", sizes->without_sample}};
  for (std::size_t i = 0; i < SizeClasses::kLargestSide.size(); ++i)
    json[fmt::format("side_{}", SizeClasses::kLargestSide[i])] = sizes->by_side[i];
  json["larger"] = sizes->by_side.back();
  return json;
}

Json workers_json(const std::vector<WorkerWork>& workers) {
  if (workers.empty()) return {};
  Json json = Json::array();
  for (const WorkerWork& worker : workers)
    json.push_back({{"triangles", worker.triangles},
                    {"bin_entries", worker.bin_entries},
                    {"fragments_tested", worker.fragments_tested},
                    {"fragments_passed", worker.fragments_passed},
                    {"bytes", worker.bytes}});
  return json;
}

}  // namespace

CountedFrames count_frames(const Point& point, const Scene& scene) {
  RendererSetup setup{.scene = &scene, .settings = point.settings(), .execution = point.execution};
  CountedFrames result;
  {
    setup.keeps_ids = false;
    const auto timed = make_renderer(point.kernel, point.numeric, setup);
    timed->draw();  // starts the threads and touches the buffers
    result.hardware = count_hardware([&] { timed->draw(); });
  }
  setup.keeps_ids = setup.count = true;
  const auto counting = make_renderer(point.kernel, point.numeric, setup);
  result.report = counting->draw();
  result.picture = picture_hash(*counting);
  return result;
}

Json work_counters_json(const WorkCounters& c) {
  return {{"sizes", sizes_json(c.sizes)},
          {"samples_in_boxes", or_null(c.samples_in_boxes)},
          {"fragments_tested", or_null(c.fragments_tested)},
          {"edge_tests", or_null(c.edge_tests)},
          {"fragments_passed", or_null(c.fragments_passed)},
          {"covered_pixels", or_null(c.covered_pixels)},
          {"visible_triangles", or_null(c.visible_triangles)},
          {"tiles", or_null(c.tiles)},
          {"tiles_touched", or_null(c.tiles_touched)},
          {"bin_entries", or_null(c.bin_entries)},
          {"hidden_entries", or_null(c.hidden_entries)},
          {"binned_fragments", or_null(c.binned_fragments)},
          {"merges", or_null(c.merges)},
          {"per_thread", workers_json(c.per_worker)},
          {"bytes",
           {{"clear", bytes_json(c.clear_bytes)},
            {"geometry", bytes_json(c.geometry_bytes)},
            {"raster", bytes_json(c.raster_bytes)},
            {"resolve", bytes_json(c.resolve_bytes)}}}};
}

Json hardware_json(const HardwareReport& report) {
  Json threads = Json::array(), shares = Json::object(), unavailable = Json::object();
  for (const HardwareReport::Thread& thread : report.threads) {
    Json counts;
    for (std::size_t event = 0; event < report.events.size(); ++event) {
      const auto& count = thread.counts[event];
      counts[report.events[event].name] = count ? Json(std::llround(count->value)) : Json();
    }
    threads.push_back(counts);
  }
  for (std::size_t event = 0; event < report.events.size(); ++event) {
    const auto& [name, reason] = report.events[event];
    if (!reason.empty()) {
      unavailable[name] = reason;
      continue;
    }
    double least = 1;
    for (const HardwareReport::Thread& thread : report.threads)
      least = std::min(least, thread.counts[event]->share);
    shares[name] = least;
  }
  return {{"per_thread", threads}, {"least_share", shares}, {"unavailable", unavailable}};
}

}  // namespace rasterbench
