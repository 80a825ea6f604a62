#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <regex>

#include "harness/adopt.h"
#include "harness/statistics.h"
#include "machine/cpu_times.h"

namespace rasterbench {
namespace {

struct TimedPoint {
  RunSetting setting;
  std::vector<double> seconds = {}, cpu_seconds = {}, own = {};
};

Json interval_json(const std::optional<std::pair<double, double>>& interval, double factor) {
  return interval ? Json{interval->first * factor, interval->second * factor} : Json();
}

/// Half the interval as a share of the median; infinite without one.
double uncertainty(const std::vector<double>& values) {
  const auto interval = median_interval(values);
  return interval ? (interval->second - interval->first) / 2 / median(values) : INFINITY;
}

std::vector<double> scaled(const std::vector<double>& values, double factor) {
  std::vector<double> result;
  for (const double value : values) result.push_back(value * factor);
  return result;
}

Json point_json(const TimedPoint& point, const TimedPoint* base) {
  Json json{{"threads", point.setting.threads},
            {"schedule", point.setting.schedule.empty() ? Json() : Json(point.setting.schedule)},
            {"samples_ms", scaled(point.seconds, 1e3)},
            {"median_ms", 1e3 * median(point.seconds)},
            {"interval_ms", interval_json(median_interval(point.seconds), 1e3)}};
  const auto p95 = percentile_95(point.seconds);
  json["p95_ms"] = p95 ? Json(1e3 * *p95) : Json();
  json["min_ms"] = 1e3 * *std::min_element(point.seconds.begin(), point.seconds.end());
  json["max_ms"] = 1e3 * *std::max_element(point.seconds.begin(), point.seconds.end());
  std::vector<double> busy, ratios;
  for (std::size_t i = 0; i < point.seconds.size(); ++i)
    busy.push_back(point.cpu_seconds[i] / point.seconds[i]);
  json["cpus_busy"] = median(busy);
  json["own_times"] = point.own;
  if (base != nullptr)
    for (std::size_t i = 0; i < point.seconds.size(); ++i)
      ratios.push_back(base->seconds[i] / point.seconds[i]);
  json["speedup"] = ratios.empty() ? Json() : Json(median(ratios));
  json["speedup_interval"] =
      ratios.empty() || base == &point ? Json() : interval_json(median_interval(ratios), 1);
  return json;
}

}  // namespace

std::optional<Json> time_program(const AdoptOptions& options, const std::vector<int>& threads,
                                 const std::vector<std::string>& schedules, const AdoptWorkplace& workplace,
                                 AdoptVerdict& verdict, Progress& progress) {
  std::vector<TimedPoint> points;
  for (const std::string& schedule : schedules)
    for (const int count : threads) points.push_back({.setting = {count, schedule}});
  std::vector<std::size_t> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;

  const std::regex own_time(options.own_time);
  std::mt19937_64 random(1);
  const auto begin = std::chrono::steady_clock::now();
  const std::optional<CpuTimes> machine_before = read_cpu_times();
  const double own_before = own_cpu_seconds();
  std::vector<std::uint32_t> pixels;
  std::string stop;
  for (int block = 0; stop.empty(); ++block) {
    std::shuffle(order.begin(), order.end(), random);
    for (std::size_t done = 0; done < order.size(); ++done) {
      TimedPoint& point = points[order[done]];
      progress.show("timing",
                    static_cast<double>(block * static_cast<int>(order.size()) + static_cast<int>(done)),
                    static_cast<double>(options.max_samples * static_cast<int>(order.size())),
                    fmt::format("block {}, {} thread{}, {}", block + 1, point.setting.threads,
                                point.setting.threads == 1 ? "" : "s",
                                point.setting.schedule.empty() ? "as compiled" : point.setting.schedule));
      const JudgedRun run = workplace.run(point.setting, false, pixels);
      verdict.add(run, pixels);
      if (!verdict.is_correct()) return std::nullopt;  // a failed check shows no speed
      point.seconds.push_back(run.result.seconds);
      point.cpu_seconds.push_back(run.result.cpu_seconds);
      std::smatch match;
      if (!options.own_time.empty() && std::regex_search(run.result.output, match, own_time))
        point.own.push_back(std::strtod(match[1].str().c_str(), nullptr));
    }
    const int taken = block + 1;
    const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (taken >= options.max_samples)
      stop = "max_samples";
    else if (taken >= options.min_samples &&
             std::all_of(points.begin(), points.end(),
                         [&](const TimedPoint& p) { return uncertainty(p.seconds) <= options.target; }))
      stop = "target";
    else if (elapsed > options.seconds)
      stop = "seconds";
  }

  Json timing{
      {"region",
       "the whole process, from before it is started until it has ended: loading, reading the model, "
       "drawing, writing the picture; its files are in the page cache"},
      {"order", "randomised complete blocks: every point once a block; each sample is a process of its own"},
      {"base", "the same program and OMP_SCHEDULE with OMP_NUM_THREADS=1"},
      {"blocks", points.front().seconds.size()},
      {"target", options.target},
      {"stop", stop},
      {"own_time", options.own_time.empty() ? Json() : Json(options.own_time)}};
  const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  // Here stolen time counts as others': the machine gave it to them. The programs are children that were
  // waited for.
  const auto taken_by_all = [](const CpuTimes& times) { return times.busy + times.stolen; };
  const std::optional<CpuTimes> machine_after = read_cpu_times();
  timing["other_load_cpus"] =
      machine_before && machine_after
          ? Json(std::max(0.0, taken_by_all(*machine_after) - taken_by_all(*machine_before) -
                                   (own_cpu_seconds() - own_before)) /
                 elapsed)
          : Json("unavailable: /proc/stat cannot be read");
  for (const TimedPoint& point : points) {
    const auto base = std::find_if(points.begin(), points.end(), [&](const TimedPoint& other) {
      return other.setting.threads == 1 && other.setting.schedule == point.setting.schedule;
    });
    timing["points"].push_back(point_json(point, base == points.end() ? nullptr : &*base));
  }
  return timing;
}

}  // namespace rasterbench
