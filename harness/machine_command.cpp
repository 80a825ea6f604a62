#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "base/buffer.h"
#include "base/error.h"
#include "harness/commands.h"
#include "harness/limits.h"
#include "harness/option_checks.h"
#include "harness/progress.h"
#include "machine/bandwidth.h"
#include "machine/geometry_rate.h"
#include "machine/loops.h"

namespace rasterbench {
namespace {

/// A mesh whose triangles are all drawn: what rejects less work than this costs more.
constexpr const char* kGeometryModel = "terrain:triangles=100000";

struct MachineOptions {
  std::string size = "1920x1080";
  std::int64_t triangles = 1000000;
  std::vector<int> threads;  ///< empty: 1 to all
  int repetitions = 15;
  bool json = false;
};

std::vector<int> thread_counts(const MachineOptions& options) {
  const int most = available_cpus();
  std::vector<int> counts = options.threads;
  if (counts.empty()) {
    counts.resize(static_cast<std::size_t>(most));
    std::iota(counts.begin(), counts.end(), 1);
  }
  std::sort(counts.begin(), counts.end());
  counts.erase(std::unique(counts.begin(), counts.end()), counts.end());
  if (counts.back() > most)
    throw InputError({.field = "--threads"}, fmt::format("at most the {} CPUs of this process", most));
  return counts;
}

/// Refuses a point that does not fit, before anything is measured.
WorkingSet point_set(const MachineOptions& options) {
  const auto [width, height] = parse_size(options.size, "--size");
  const WorkingSet set = working_set_of(options.triangles, width, height);
  checked_bytes(set.read_bytes + set.write_bytes, 1, "--triangles and --size: the point");
  return set;
}

Json bandwidth_json(const char* name, const Bandwidth& measured) {
  return {{"working_set", name},
          {"threads", measured.threads},
          {"read_bytes", measured.set.read_bytes},
          {"write_bytes", measured.set.write_bytes},
          {"huge_pages", measured.huge_pages},
          {"read", rate_json(measured.read)},
          {"write", rate_json(measured.write)},
          {"streaming_write", rate_json(measured.streaming_write)},
          {"triad", rate_json(measured.triad)}};
}

/// The floor of the point on `threads` threads from the rates at its own working set, beside the arithmetic
/// of its geometry stage.
Json floor_json(const WorkingSet& set, std::int64_t triangles, const Json& bandwidth, const Json& geometry) {
  const auto rate = [&](const char* name) { return bandwidth.at(name).at("best").get<double>() * 1e9; };
  return {
      {"threads", bandwidth.at("threads")},
      {"floor_ms", floor_ms(set, rate("read"), rate("streaming_write"))},
      {"geometry_ms", 1e-6 * static_cast<double>(triangles) * geometry.at("ns_per_triangle").get<double>()}};
}

Json measure_machine(const MachineOptions& options) {
  const std::vector<int> counts = thread_counts(options);
  const WorkingSet point = point_set(options);
  const std::size_t cache = last_level_cache_bytes();
  const WorkingSet beyond = beyond_cache_set(cache, available_memory());
  const Scene scene = open_scene(kGeometryModel, "");
  const auto [width, height] = parse_size(options.size, "--size");

  Json result;
  result["instructions"] = loop_instructions();
  result["threads_by"] = "std::thread, unbound";
  result["repetitions"] = options.repetitions;
  result["last_level_cache_bytes"] = cache > 0 ? Json(cache) : Json("unavailable: hwloc knows no cache");
  result["point"] = {{"size", {width, height}},
                     {"triangles", options.triangles},
                     {"read_bytes", point.read_bytes},
                     {"write_bytes", point.write_bytes}};
  Json bandwidth = Json::array(), geometry = Json::array(), floors = Json::array();
  Progress progress;
  int done = 0;
  const auto show = [&](const std::string& what, int threads) {
    progress.show("machine", done++, 3.0 * static_cast<double>(counts.size()),
                  fmt::format("{}, threads: {}", what, threads));
  };
  for (const int threads : counts) {
    const auto measure = [&](const char* name, const WorkingSet& set) {
      show(fmt::format("bandwidth, {}", name), threads);
      return bandwidth_json(
          name, measure_bandwidth(set, threads, {.least = options.repetitions}, BandwidthLoops::kAll));
    };
    const Json at_point = measure("point", point);
    bandwidth.push_back(at_point);
    bandwidth.push_back(measure("beyond_cache", beyond));
    show("geometry", threads);
    const GeometryRate rate = measure_geometry(scene, threads, options.repetitions);
    Json entry{{"threads", threads},
               {"model", kGeometryModel},
               {"batch_triangles", rate.triangles},
               {"isa", to_string(best_isa())}};
    entry.update(time_json("ns_per_triangle", rate.ns_per_triangle));
    geometry.push_back(entry);
    floors.push_back(floor_json(point, options.triangles, at_point, entry));
  }
  result["bandwidth"] = bandwidth;
  result["geometry"] = geometry;
  result["floor"] = floors;
  return result;
}

/// "12.3 [12.1, 12.4] 12.5": median, interval and best.
std::string with_spread(const Json& measured, const char* name) {
  const auto said = [](const Json& number) {
    const double value = number.get<double>();
    return fmt::format("{:.{}f}", value, value < 100 ? 1 : 0);
  };
  const Json& interval = measured.at("interval");
  return fmt::format("{} [{}, {}] {}", said(measured.at(name)), said(interval.at(0)), said(interval.at(1)),
                     said(measured.at("best")));
}

std::string mebibytes(const Json& bytes) { return fmt::format("{:.1f}", bytes.get<double>() / 1048576); }

void print_machine(const Json& result) {
  fmt::print(
      "GB/s (10^9 bytes per second): median [95 % interval] best of {} repetitions; {} loops, threads: {}\n",
      result.at("repetitions").get<int>(), result.at("instructions").get<std::string>(),
      result.at("threads_by").get<std::string>());
  fmt::print("{:<13}{:>8}{:>10}{:>10}", "working set", "threads", "read MiB", "write MiB");
  const auto loops = {"read", "write", "streaming_write", "triad"};
  for (const char* loop : loops) fmt::print("{:>26}", loop);
  for (const char* set : {"point", "beyond_cache"})
    for (const Json& row : result.at("bandwidth")) {
      if (row.at("working_set") != set) continue;
      fmt::print("\n{:<13}{:>8}{:>10}{:>10}", set, row.at("threads").get<int>(),
                 mebibytes(row.at("read_bytes")), mebibytes(row.at("write_bytes")));
      for (const char* loop : loops) fmt::print("{:>26}", with_spread(row.at(loop), "gb_per_s"));
    }
  const Json& point = result.at("point");
  fmt::print(
      "\n\npoint: {} triangles of {} bytes read, {} x {} pixels of {} bytes written\n"
      "floor: those bytes at the best read and streaming_write rates of the point\n"
      "geometry: transform + reject of {} triangles in L1 cache ({}; {}), wall time over those of all "
      "threads\n"
      "{:>8}{:>12}{:>26}{:>20}\n",
      point.at("triangles").get<std::int64_t>(), kTriangleBytes, point.at("size").at(0).get<int>(),
      point.at("size").at(1).get<int>(), kPixelBytes,
      result.at("geometry").at(0).at("batch_triangles").get<int>(), kGeometryModel, to_string(best_isa()),
      "threads", "floor ms", "geometry ns/triangle", "geometry ms");
  for (std::size_t i = 0; i < result.at("floor").size(); ++i) {
    const Json& floor = result.at("floor").at(i);
    fmt::print(
        "{:>8}{:>12.3f}{:>26}{:>20.3f}\n", floor.at("threads").get<int>(), floor.at("floor_ms").get<double>(),
        with_spread(result.at("geometry").at(i), "ns_per_triangle"), floor.at("geometry_ms").get<double>());
  }
}

}  // namespace

void add_machine_command(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("machine", "what this machine can do: memory bandwidth, and the floor of a point");
  const auto options = std::make_shared<MachineOptions>();
  command->add_option("--size", options->size, "WxH of the point in pixels, each 1 to 65536")
      ->capture_default_str();
  command->add_option("--triangles", options->triangles, "triangles of the point")
      ->capture_default_str()
      ->check(whole_number_check(1, kMaxTriangles));
  command
      ->add_option("--threads", options->threads,
                   "number of threads; may be repeated (default: each number from 1 to all CPUs)")
      ->allow_extra_args(false)
      ->check(whole_number_check(1, 65536));
  command
      ->add_option("--repetitions", options->repetitions, "of each measurement; below 6 no interval exists")
      ->capture_default_str()
      ->check(whole_number_check(6, 10000));
  command->add_flag("--json", options->json, "one JSON object in place of the tables");
  command->footer(
      "Bandwidth is measured at the point's working set (36 bytes per triangle read, 8 per pixel written)\n"
      "and at four times the last-level cache, or an eighth of the available memory if that is less.");
  command->callback([options] {
    const Json result = measure_machine(*options);
    if (options->json)
      fmt::print("{}\n", dump(result, 2));
    else
      print_machine(result);
  });
}

}  // namespace rasterbench
