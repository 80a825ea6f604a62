#include "harness/replay.h"

#include <fmt/format.h>
#include <sys/prctl.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <numeric>
#include <queue>

#include "base/error.h"
#include "harness/point.h"

namespace rasterbench {
namespace {

constexpr std::int64_t kMostIterations = 10'000'000;  // an hour of the shortest sleeps on a thread
constexpr double kNanoseconds = 1e9;

double now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec) / kNanoseconds;
}

/// Sleeps until `deadline`, in seconds of now(); returns 0 or an error number.
int sleep_until(double deadline) {
  const double whole = std::floor(deadline);
  const timespec t{static_cast<time_t>(whole), static_cast<long>((deadline - whole) * kNanoseconds)};
  int error = 0;
  do {
    error = clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
  } while (error == EINTR);
  return error;
}

const Json& field(const Json& json, const std::string& path, const char* name) {
  const auto found = json.find(name);
  if (found == json.end()) throw InputError({.file = path, .field = name}, "missing");
  return *found;
}

std::string text_of(const Json& json, const std::string& path, const char* name) {
  const Json& value = field(json, path, name);
  if (!value.is_string()) throw InputError({.file = path, .field = name}, "is not text");
  return value.get<std::string>();
}

std::int64_t count_of(const Json& value, const std::string& path, const char* name) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() < 1 ||
      value.get<std::uint64_t>() > static_cast<std::uint64_t>(kMostIterations))
    throw InputError({.file = path, .field = name},
                     fmt::format("is not a whole number from 1 to {}", kMostIterations));
  return value.get<std::int64_t>();
}

std::vector<std::int64_t> even_borders(std::int64_t begin, std::int64_t n, std::int64_t chunk,
                                       std::vector<std::int64_t> borders = {}) {
  for (; begin < n; begin += chunk) borders.push_back(begin);
  borders.push_back(n);
  return borders;
}

std::vector<std::int64_t> guided_libgomp(std::int64_t n, std::int64_t threads, std::int64_t chunk) {
  std::vector<std::int64_t> borders;
  std::int64_t begin = 0;
  for (; n - begin > chunk * threads; begin += (n - begin + threads - 1) / threads) borders.push_back(begin);
  return even_borders(begin, n, chunk, std::move(borders));
}

std::vector<std::int64_t> guided_libomp(std::int64_t n, std::int64_t threads, std::int64_t chunk) {
  if (threads == 1) return {0, n};
  std::vector<std::int64_t> borders;
  std::int64_t begin = 0;
  if ((2 * chunk + 1) * threads < n) {
    const double share = 0.5 / static_cast<double>(threads);  // in double, as there: rounding is part of it
    while (n - begin >= 2 * threads * (chunk + 1)) {
      borders.push_back(begin);
      begin += static_cast<std::int64_t>(static_cast<double>(n - begin) * share);
    }
  }
  return even_borders(begin, n, chunk, std::move(borders));
}

}  // namespace

CostsFile read_costs(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw InputError({.file = path}, "cannot be opened: " + std::string(std::strerror(errno)));
  Json json;
  try {
    json = Json::parse(file);
  } catch (const Json::parse_error& error) {
    throw InputError({.file = path, .byte = static_cast<std::int64_t>(error.byte)}, "is not JSON");
  }
  if (!json.is_object()) throw InputError({.file = path}, "is not an object");
  if (const Json& schema = field(json, path, "schema"); schema != Json(1))
    throw InputError({.file = path, .field = "schema"},
                     fmt::format("is {}, this program reads 1", dump(schema)));
  CostsFile costs{.unit = text_of(json, path, "unit"),
                  .kernel = text_of(json, path, "kernel"),
                  .numeric = text_of(json, path, "numeric"),
                  .microseconds = {}};
  const std::int64_t n = count_of(field(json, path, "iterations"), path, "iterations");
  const std::int64_t block =
      json.contains("iterations_a_cost") ? count_of(json["iterations_a_cost"], path, "iterations_a_cost") : 1;
  const Json& list = field(json, path, "cost_us");
  if (!list.is_array() || list.size() != static_cast<std::size_t>((n + block - 1) / block))
    throw InputError({.file = path, .field = "cost_us"},
                     fmt::format("does not hold {} costs", (n + block - 1) / block));
  double sum = 0;
  costs.microseconds.reserve(static_cast<std::size_t>(n));
  for (const Json& cost : list) {
    if (!cost.is_number() || !(cost.get<double>() >= 0) || !std::isfinite(cost.get<double>()))
      throw InputError({.file = path, .field = "cost_us"}, "holds what is not a number from 0 on");
    sum += cost.get<double>();
    const std::int64_t share = std::min(block, n - std::ssize(costs.microseconds));
    costs.microseconds.insert(costs.microseconds.end(), static_cast<std::size_t>(share),
                              cost.get<double>() / static_cast<double>(share));
  }
  if (!std::isfinite(sum)) throw InputError({.file = path, .field = "cost_us"}, "adds up to infinity");
  return costs;
}

std::vector<double> sleeps_of(const CostsFile& costs, double scale) {
  std::vector<double> sleeps(costs.microseconds.size());
  std::transform(costs.microseconds.begin(), costs.microseconds.end(), sleeps.begin(),
                 [scale](double us) { return std::max(kShortestSleep, us * 1e-6 * scale); });
  return sleeps;
}

Replay replay(Execution& execution, std::span<const double> sleeps) {
  Replay result{.seconds = 0,
                .started = std::vector<double>(sleeps.size()),
                .slept = std::vector<double>(sleeps.size()),
                .workers = std::vector<int>(sleeps.size(), -1)};
  std::atomic<int> failed = 0;
  double loop_begin = 0;
  const auto body = [&](std::int64_t i, int worker) {
    thread_local const int slack = prctl(PR_SET_TIMERSLACK, 1);  // nanoseconds instead of 50 us
    static_cast<void>(slack);  // where it is refused, sleeps are later, which `slept` shows
    const auto index = static_cast<std::size_t>(i);
    const double begin = now();
    if (const int error = sleep_until(begin + sleeps[index]); error != 0) failed = error;
    result.slept[index] = now() - begin;
    result.started[index] = begin - loop_begin;
    result.workers[index] = worker;
  };
  loop_begin = now();
  execution.loop(std::ssize(sleeps), body);
  result.seconds = now() - loop_begin;
  if (failed != 0) throw Error(fmt::format("clock_nanosleep: {}", std::strerror(failed)));
  return result;
}

std::vector<std::int64_t> chunk_borders(const ExecutionConfig& config, const std::string& runtime,
                                        std::int64_t n) {
  if (config.backend != "openmp" || (runtime != "libgomp" && runtime != "libomp")) return {};
  const std::int64_t threads = config.threads, chunk = config.chunk.value_or(1);
  if (config.schedule == "static" && !config.chunk) {
    std::vector<std::int64_t> borders;
    for (std::int64_t t = 0; t <= std::min(threads, n); ++t)
      borders.push_back(t * (n / threads) + std::min(t, n % threads));
    return borders;
  }
  if (config.schedule == "static" || config.schedule == "dynamic") return even_borders(0, n, chunk);
  if (config.schedule != "guided") return {};
  return runtime == "libgomp" ? guided_libgomp(n, threads, chunk) : guided_libomp(n, threads, chunk);
}

double simulated_seconds(const ExecutionConfig& config, std::span<const std::int64_t> borders,
                         std::span<const double> seconds) {
  std::vector<double> ends;  // of the chunks
  for (std::size_t k = 0; k + 1 < borders.size(); ++k)
    ends.push_back(std::accumulate(seconds.begin() + borders[k], seconds.begin() + borders[k + 1], 0.0));
  const auto threads = static_cast<std::size_t>(config.threads);
  if (config.schedule == "static") {
    for (std::size_t k = threads; k < ends.size(); ++k) ends[k] += ends[k - threads];
  } else {
    std::priority_queue<double, std::vector<double>, std::greater<>> free;
    for (double& end : ends) {
      if (free.size() == threads) {
        end += free.top();
        free.pop();
      }
      free.push(end);
    }
  }
  return *std::max_element(ends.begin(), ends.end());
}

std::optional<std::int64_t> contradiction(const ExecutionConfig& config,
                                          std::span<const std::int64_t> borders,
                                          std::span<const int> workers) {
  for (std::size_t k = 0; k + 1 < borders.size(); ++k)
    for (std::int64_t i = borders[k]; i < borders[k + 1]; ++i) {
      const int expected = config.schedule == "static"
                               ? static_cast<int>(k % static_cast<std::size_t>(config.threads))
                               : workers[static_cast<std::size_t>(borders[k])];
      if (workers[static_cast<std::size_t>(i)] != expected) return i;
    }
  return {};
}

bool can_be_contradicted(const ExecutionConfig& config, std::span<const std::int64_t> borders) {
  if (config.schedule == "static") return config.threads > 1;
  for (std::size_t k = 0; k + 1 < borders.size(); ++k)
    if (borders[k + 1] - borders[k] > 1) return config.threads > 1;
  return false;
}

std::optional<std::int64_t> order_contradiction(const ExecutionConfig& config,
                                                std::span<const std::int64_t> borders, const Replay& run) {
  if (config.schedule == "static" || borders.size() < 2) return {};
  const std::size_t chunks = borders.size() - 1;
  // The earliest start of any later chunk: as a thread stamps after it was given a chunk, all that a stamp
  // tells is that the chunk had been handed out by then.
  std::vector<double> later(chunks, std::numeric_limits<double>::infinity());
  for (std::size_t k = chunks - 1; k > 0; --k)
    later[k - 1] = std::min(later[k], run.started[static_cast<std::size_t>(borders[k])]);
  // By the start stamps of each worker, what it ran before.
  std::vector<std::size_t> order(chunks);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto first_of = [&](std::size_t k) { return static_cast<std::size_t>(borders[k]); };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return run.started[first_of(a)] < run.started[first_of(b)];
  });
  std::vector<double> asked(static_cast<std::size_t>(config.threads), 0.0);
  std::optional<std::int64_t> found;
  for (const std::size_t k : order) {
    double& of_worker = asked.at(static_cast<std::size_t>(run.workers[first_of(k)]));
    if (of_worker > later[k] && (!found || borders[k] < *found)) found = borders[k];
    const auto last = static_cast<std::size_t>(borders[k + 1] - 1);
    of_worker = run.started[last] + run.slept[last];
  }
  return found;
}

}  // namespace rasterbench
