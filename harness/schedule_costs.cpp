#include "harness/schedule_costs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "execution/execution.h"
#include "execution/stamp_clock.h"
#include "harness/replay.h"
#include "harness/statistics.h"

namespace rasterbench {
namespace {

constexpr int kRepetitions = 9;

/// A loop with an empty body: the shortest of several, since other load only lengthens it.
struct EmptyLoop {
  double seconds = std::numeric_limits<double>::infinity();
  double chunks = 0;  // 0: not counted
};

EmptyLoop time_empty_loop(Execution& execution, std::int64_t n) {
  EmptyLoop shortest;
  for (int repetition = 0; repetition < kRepetitions; ++repetition) {
    execution.reset_tally();
    const double begin = StampClock::now();
    execution.loop(n, [](std::int64_t, int) {});
    const double seconds = StampClock::now() - begin;
    double chunks = 0;
    for (const WorkerTally& tally : execution.tally()) chunks += static_cast<double>(tally.chunks);
    if (seconds < shortest.seconds) shortest = {seconds, chunks};
  }
  return shortest;
}

void spin(double seconds) {
  const double begin = StampClock::now();
  while (StampClock::now() - begin < seconds) {
  }
}

/// Seconds that oneTBB takes beyond one iteration for a loop of one a thread, the shortest of several. The
/// iterations are long enough for its workers to come; a repetition that left one out does not count (those
/// of OpenMP spin for some ms after their last loop, and take the CPUs), and where few others are left
/// nothing is known.
std::optional<double> time_tbb_start(const ExecutionConfig& config) {
  constexpr double kIteration = 1e-4;
  constexpr int kLeastRepetitions = 3;
  constexpr double kPatience = 0.05;
  const auto execution = make_execution(config);
  const std::int64_t chunk = config.chunk.value_or(1);
  int counted = 0;
  double shortest = std::numeric_limits<double>::infinity();
  const double first = StampClock::now();
  while (counted < kRepetitions && StampClock::now() - first < kPatience) {
    // A worker may have come for the iterations alone that do not spin.
    std::vector<char> spun(static_cast<std::size_t>(config.threads), 0);
    const double begin = StampClock::now();
    execution->loop(config.threads * chunk, [&](std::int64_t i, int worker) {
      if (i % chunk != 0) return;
      spin(kIteration);
      spun[static_cast<std::size_t>(worker)] = 1;
    });
    const double seconds = StampClock::now() - begin - kIteration;
    if (std::count(spun.begin(), spun.end(), 1) < config.threads) continue;
    shortest = std::min(seconds, shortest);
    ++counted;
  }
  return counted < kLeastRepetitions ? std::nullopt : std::optional(shortest);
}

/// See ScheduleCosts::steal_seconds: what lies between two iterations of a thread is longer where the second
/// one does not follow on the first. Worker 0 is slow, so that the others run out of ranges again and again,
/// and it has some to steal.
std::optional<double> time_tbb_steal(int threads) {
  constexpr std::int64_t kIterations = 1024;
  constexpr double kSlow = 2e-5, kFast = 1e-6;
  constexpr int kLoops = 50;
  constexpr std::size_t kLeastSteals = 50;
  struct alignas(64) Worker {
    std::int64_t last = -1;
    double end = 0;
    std::vector<double> own, stolen;  // seconds between iterations
  };
  std::vector<Worker> workers(static_cast<std::size_t>(threads));
  const auto execution = make_execution({"tbb", "simple", 1, threads, nullptr});
  for (int loop = 0; loop < kLoops; ++loop) {
    for (Worker& worker : workers) {
      worker.last = -1;
      worker.own.reserve(worker.own.size() + kIterations);
      worker.stolen.reserve(worker.stolen.size() + kIterations);
    }
    execution->loop(kIterations, [&](std::int64_t i, int index) {
      Worker& worker = workers[static_cast<std::size_t>(index)];
      const double begin = StampClock::now();
      if (worker.last >= 0) (i == worker.last + 1 ? worker.own : worker.stolen).push_back(begin - worker.end);
      spin(index == 0 ? kSlow : kFast);
      worker.last = i;
      worker.end = StampClock::now();
    });
  }
  std::vector<double> own, stolen;
  for (const Worker& worker : workers) {
    own.insert(own.end(), worker.own.begin(), worker.own.end());
    stolen.insert(stolen.end(), worker.stolen.begin(), worker.stolen.end());
  }
  if (own.empty() || stolen.size() < kLeastSteals) return {};
  return std::max(0.0, median(stolen) - median(own));
}

/// Chunks of a loop: by the rule of the OpenMP runtime where it is known, else as they were seen.
double chunks_of(const ExecutionConfig& config, std::int64_t n, const EmptyLoop& seen) {
  const auto borders = chunk_borders(config, openmp_runtime(), n);
  return borders.empty() ? seen.chunks : static_cast<double>(borders.size() - 1);
}

/// One round of measuring a schedule.
struct EmptyLoops {
  double start, further;  // seconds of the short loop, and of the long one beyond it
  double chunks;          // of the long one
  double more_chunks;     // of it beyond those of the short one
};

EmptyLoops time_empty_loops(Execution& execution, std::int64_t n) {
  const ExecutionConfig& config = execution.config();
  const std::int64_t least = std::int64_t{config.threads} * config.chunk.value_or(1);
  const EmptyLoop start = time_empty_loop(execution, least), whole = time_empty_loop(execution, n);
  const double chunks = chunks_of(config, n, whole);
  return {start.seconds, whole.seconds - start.seconds, chunks, chunks - chunks_of(config, least, start)};
}

ScheduleCost measure_schedule(const Schedule& schedule, std::optional<int> chunk, int threads) {
  constexpr std::int64_t kIterations = 1 << 14;
  constexpr int kMostRounds = 25;
  // The loops of two partitioners differ by more than their ranges: that is spread over this many at least.
  constexpr double kLeastRanges = 100;
  // oneTBB leaves the ranges of a loop to the thread that split them. Another one steals, which is no
  // hand-out, and an empty loop is over before it comes: what a range costs is told by one thread.
  const bool is_tbb = schedule.backend == "tbb";
  const int handed = is_tbb ? 1 : threads;
  // The same loop with one chunk a thread: what the iterations themselves cost.
  const auto even = make_execution({schedule.backend, "static", {}, handed, nullptr});
  const auto execution = make_execution({schedule.backend, schedule.name, chunk, handed, nullptr});
  ScheduleCost cost;
  if (is_tbb) cost.start_seconds = time_tbb_start({schedule.backend, schedule.name, chunk, threads, nullptr});
  std::vector<double> rounds;  // seconds of a chunk
  for (int round = 0; round < kMostRounds && !cost.chunk_seconds; ++round) {
    const EmptyLoops of_even = time_empty_loops(*even, kIterations),
                     own = time_empty_loops(*execution, kIterations);
    if (!is_tbb) cost.start_seconds = std::min(own.start, cost.start_seconds.value_or(own.start));
    if (own.chunks == 0) break;  // nobody counts them
    if (own.more_chunks <= 0) {
      cost.chunk_seconds = 0;  // more iterations make no more chunks
      break;
    }
    if (is_tbb && own.more_chunks < kLeastRanges) break;
    rounds.push_back(handed * (own.further - of_even.further) / own.more_chunks);
    cost.chunk_seconds = beyond_noise(rounds);
  }
  return cost;
}

}  // namespace

std::optional<double> beyond_noise(const std::vector<double>& rounds) {
  constexpr std::size_t kLeastRounds = 7;
  constexpr double kTimesTheNoise = 4, kErrorOfMedian = 1.2533, kDeviationOfMad = 1.4826;
  if (rounds.size() < kLeastRounds) return {};
  const double middle = median(rounds);
  std::vector<double> distances;
  for (const double value : rounds) distances.push_back(std::abs(value - middle));
  const double noise =
      kErrorOfMedian * kDeviationOfMad * median(distances) / std::sqrt(static_cast<double>(rounds.size()));
  return middle > kTimesTheNoise * noise ? std::optional(middle) : std::nullopt;
}

ScheduleCosts measure_schedules(int threads) {
  ScheduleCosts costs;
  bool has_tbb = false;
  for (const Schedule& schedule : schedules()) {
    if (schedule.backend == "serial") continue;
    has_tbb = has_tbb || schedule.backend == "tbb";
    for (const std::optional<int> chunk :
         {std::optional<int>(), std::optional<int>(1), std::optional<int>(16)}) {
      if (chunk && schedule.chunk.empty()) continue;
      costs.of[to_string({schedule.backend, schedule.name, chunk, threads, nullptr})] =
          measure_schedule(schedule, chunk, threads);
    }
  }
  if (has_tbb && threads > 1) costs.steal_seconds = time_tbb_steal(threads);
  return costs;
}

}  // namespace rasterbench
