#include "harness/limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "base/error.h"
#include "harness/statistics.h"
#include "machine/loops.h"

namespace rasterbench {
namespace {

constexpr int kRepetitions = 9;  // the fewest whose interval drops an outlier at either end

Json samples_json(const char* name, std::span<const double> samples, double best) {
  const auto interval = median_interval(samples);
  return {{name, median(samples)},
          {"interval", interval ? Json{interval->first, interval->second} : Json()},
          {"best", best}};
}

}  // namespace

Json time_json(const char* name, std::span<const double> times) {
  return samples_json(name, times, *std::min_element(times.begin(), times.end()));
}

Json rate_json(std::span<const double> rates) {
  std::vector<double> scaled;
  for (const double rate : rates) scaled.push_back(rate * 1e-9);
  return samples_json("gb_per_s", scaled, *std::max_element(scaled.begin(), scaled.end()));
}

LimitKey limit_of(const PointState& state, const Study& study) {
  const Point& point = state.planned->point;
  const auto triangles = static_cast<std::int64_t>(study.scenes.at(point.scene.name).model.triangles.size());
  return {std::min(point.execution.threads, available_cpus()),
          working_set_of(triangles, point.width, point.height)};
}

Json measure_limit(const LimitKey& key, double seconds) {
  Json entry{
      {"threads", key.threads}, {"read_bytes", key.set.read_bytes}, {"write_bytes", key.set.write_bytes}};
  try {
    const Bandwidth measured =
        measure_bandwidth(key.set, key.threads, {kRepetitions, seconds}, BandwidthLoops::kFloor);
    entry["huge_pages"] = measured.huge_pages;
    entry["repetitions"] = measured.read.size();
    entry["read"] = rate_json(measured.read);
    entry["streaming_write"] = rate_json(measured.streaming_write);
  } catch (const Error& error) {
    for (const char* result : {"huge_pages", "repetitions", "read", "streaming_write"})
      entry[result] = fmt::format("unavailable: {}", error.what());
  }
  return entry;
}

void Limits::add(const Json& entry) {
  const LimitKey key{entry.at("threads"), {entry.at("read_bytes"), entry.at("write_bytes")}};
  for (const char* rate : {"read", "streaming_write"})
    if (!entry.at(rate).is_string()) entry.at(rate).at("best").get<double>();
  entries_[key] = entry;
}

std::optional<double> Limits::floor_of(const LimitKey& key) const {
  const auto found = entries_.find(key);
  if (found == entries_.end() || found->second.at("read").is_string()) return std::nullopt;
  const auto rate = [&](const char* name) { return found->second.at(name).at("best").get<double>() * 1e9; };
  return floor_ms(key.set, rate("read"), rate("streaming_write"));
}

Json Limits::to_json() const {
  Json rates = Json::array();
  for (const auto& [key, entry] : entries_) rates.push_back(entry);
  return {{"floor", "read_bytes / best read + write_bytes / best streaming_write"},
          {"bytes_per_triangle", kTriangleBytes},
          {"bytes_per_pixel", kPixelBytes},
          {"threads_by", "std::thread, unbound"},
          {"instructions", loop_instructions()},
          {"rates", rates}};
}

std::vector<LimitKey> missing_limits(const std::vector<PointState>& states, const Study& study,
                                     const Limits& limits) {
  std::set<LimitKey> missing;
  for (const PointState& state : states) {
    if (!state.timed()) continue;
    const LimitKey key = limit_of(state, study);
    if (!limits.has(key)) missing.insert(key);
  }
  return {missing.begin(), missing.end()};
}

Limits replay_limits(const std::vector<Json>& events, const std::filesystem::path& file) {
  Limits limits;
  for (std::size_t line = 0; line < events.size(); ++line) {
    const Json& event = events[line];
    if (event.value("event", Json()) != "limit") continue;
    try {
      limits.add(event.at("rates"));
    } catch (const Json::exception& error) {
      throw InputError({.file = file.string(), .line = static_cast<std::int64_t>(line) + 1}, error.what());
    }
  }
  return limits;
}

}  // namespace rasterbench
