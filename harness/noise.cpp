#include "harness/noise.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>

#include "harness/statistics.h"

namespace rasterbench {
namespace {

constexpr double kWindowSeconds = 0.5;

Json to_json(const Reading& reading) {
  return std::visit([](const auto& value) { return Json(value); }, reading);
}

/// One reading of all windows.
struct Series {
  std::vector<double> values;
  std::vector<const Json*> windows;  // of each value
  std::string unavailable;           // why there are no values
};

Series series_of(const std::vector<Json>& events, const char* key) {
  Series series{.values = {}, .windows = {}, .unavailable = "unavailable: no sample was taken"};
  for (const Json& event : events) {
    if (event.value("event", Json()) != "noise") continue;
    const Json& value = event.at(key);
    if (value.is_string()) {
      series.unavailable = value;
      continue;
    }
    series.values.push_back(value);
    series.windows.push_back(&event);
  }
  return series;
}

Json extremes_json(const Series& series) {
  if (series.values.empty()) return series.unavailable;
  const auto worst = std::max_element(series.values.begin(), series.values.end());
  const Json& window = *series.windows[static_cast<std::size_t>(worst - series.values.begin())];
  return {{"median", median(series.values)}, {"worst", *worst}, {"worst_blocks", window.at("blocks")}};
}

/// "blocks 4 to 7", "block 4".
std::string said_blocks(const Json& blocks) {
  const int first = blocks.at(0), last = blocks.at(1);
  return first == last ? fmt::format("block {}", first) : fmt::format("blocks {} to {}", first, last);
}

bool exceeds(const Json& extremes, double usual, double once) {
  return extremes.is_object() &&
         (extremes.at("median").get<double>() > usual || extremes.at("worst").get<double>() > once);
}

}  // namespace

NoiseWatch::State NoiseWatch::now(int block, double own_cpu) {
  return {.block = block,
          .at = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(),
          .own_cpu = own_cpu,
          .machine = read_cpu_times(),
          .throttled = read_throttle_count()};
}

void NoiseWatch::begin(int block, double own_cpu) { start_ = now(block, own_cpu); }

std::optional<Json> NoiseWatch::end_of_block(int block, double own_cpu, bool is_last) {
  const double shortest = is_last ? 0.1 : kWindowSeconds;  // less would be noise of its own
  const State end = now(block, own_cpu);
  const double seconds = end.at - start_.at;
  if (seconds < shortest) return std::nullopt;
  Json event{{"event", "noise"},
             {"blocks", {std::min(start_.block, block), block}},
             {"seconds", seconds},
             {"other_load_cpus", "unavailable: no /proc/stat"},
             {"steal_share", "unavailable: no /proc/stat"},
             {"load_average", to_json(read_load_average())},
             {"frequency_mhz", to_json(read_frequency_mhz())},
             {"throttled", to_json(end.throttled)}};
  if (start_.machine && end.machine) {
    const double busy = end.machine->busy - start_.machine->busy;
    const double stolen = end.machine->stolen - start_.machine->stolen;
    event["other_load_cpus"] = std::max(0.0, busy - (end.own_cpu - start_.own_cpu)) / seconds;
    event["steal_share"] = busy + stolen > 0 ? stolen / (busy + stolen) : 0.0;
  }
  const double* before = std::get_if<double>(&start_.throttled);
  const double* after = std::get_if<double>(&end.throttled);
  if (before && after) event["throttled"] = *after - *before;
  start_ = end;
  start_.block = block + 1;
  return event;
}

Json summarise_noise(const std::vector<Json>& events, bool has_unbound) {
  double seconds = 0;
  std::int64_t windows = 0;
  for (const Json& event : events)
    if (event.value("event", Json()) == "noise") {
      seconds += event.at("seconds").get<double>();
      ++windows;
    }
  const Json other = extremes_json(series_of(events, "other_load_cpus"));
  const Json steal = extremes_json(series_of(events, "steal_share"));
  const Series frequency = series_of(events, "frequency_mhz"), throttled = series_of(events, "throttled");
  std::vector<std::string> warnings;
  if (exceeds(other, kNoisyOtherCpus, kNoisyOtherCpusOnce))
    warnings.push_back(fmt::format("other programs kept {:.2f} CPUs busy in the median and {:.2f} in {}",
                                   other.at("median").get<double>(), other.at("worst").get<double>(),
                                   said_blocks(other.at("worst_blocks"))));
  if (exceeds(steal, kNoisySteal, kNoisyStealOnce))
    warnings.push_back(
        fmt::format("the hypervisor kept {:.1f} % of the CPU time in the median and {:.1f} % in {}",
                    100 * steal.at("median").get<double>(), 100 * steal.at("worst").get<double>(),
                    said_blocks(steal.at("worst_blocks"))));
  Json frequency_json = frequency.unavailable, throttled_json = throttled.unavailable;
  if (!frequency.values.empty()) {
    const auto [low, high] = std::minmax_element(frequency.values.begin(), frequency.values.end());
    frequency_json = {{"min", *low}, {"max", *high}};
    if (*low < (1 - kNoisyFrequencyChange) * *high)
      warnings.push_back(fmt::format("the fastest CPU ran at {:.0f} to {:.0f} MHz", *low, *high));
  }
  if (!throttled.values.empty()) {
    double times = 0;
    for (const double value : throttled.values) times += value;
    throttled_json = times;
    if (times > 0)
      warnings.push_back(fmt::format("CPUs were throttled {:g} times because they were hot", times));
  }
  std::vector<std::string> remarks;
  if (has_unbound)
    remarks.push_back("threads were not bound: other load moves them; binding = [\"close\"] binds them");
  return {{"windows", windows},
          {"seconds", seconds},
          {"other_load_cpus", other},
          {"steal_share", steal},
          {"load_average", extremes_json(series_of(events, "load_average"))},
          {"frequency_mhz", frequency_json},
          {"throttled", throttled_json},
          {"warnings", warnings},
          {"remarks", remarks}};
}

std::string noise_warning(const Json& summary) {
  if (summary.at("warnings").empty()) return {};
  std::vector<std::string> said = summary.at("warnings");
  for (const Json& remark : summary.at("remarks")) said.push_back(remark);
  return fmt::format("noisy machine: {}", fmt::join(said, "; "));
}

}  // namespace rasterbench
