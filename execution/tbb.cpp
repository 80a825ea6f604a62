// oneTBB: parallel_for over a blocked_range with each of its partitioners.
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>
#include <sched.h>

#include <algorithm>

#include "execution/execution.h"
#include "execution/loop_trace.h"

namespace rasterbench {
namespace {

using Range = oneapi::tbb::blocked_range<std::int64_t>;

template <class Partitioner>
class Tbb final : public Execution {
 public:
  explicit Tbb(const ExecutionConfig& config)
      : Execution(config),
        // Without it an arena never gets more workers than there are CPUs (--oversubscribe).
        parallelism_(oneapi::tbb::global_control::max_allowed_parallelism,
                     static_cast<std::size_t>(std::max(config.threads, available_cpus()))),
        arena_(config.threads),
        stamps_(static_cast<std::size_t>(config.threads)) {}

  void loop(std::int64_t n, LoopBody body) override {
    run(n, static_cast<std::size_t>(config().chunk.value_or(1)), body, partitioner_, config().trace);
  }
  void uniform_loop(std::int64_t n, LoopBody body) override {
    oneapi::tbb::static_partitioner even;
    run(n, 1, body, even, nullptr);
  }

 private:
  /// When a worker was last seen in the loop `epoch`. Every range ends with a stamp, but where ranges are so
  /// short that the clock would show (kShortRange), only every sixteenth after the first sixteen: the end is
  /// then known to within 30 us.
  struct alignas(64) Stamp {
    std::int64_t epoch = -1;
    std::int64_t ranges = 0;          // since the loop began
    std::int64_t stamped_ranges = 0;  // until `last`
    double first = 0, last = 0;
  };
  static constexpr double kShortRange = 2e-6;  // seconds

  template <class AnyPartitioner>
  void run(std::int64_t n, std::size_t grain, LoopBody body, AnyPartitioner& partitioner, LoopTrace* trace) {
    ++epoch_;
    const auto chunk = [&](const Range& range) {
      const int worker = oneapi::tbb::this_task_arena::current_thread_index();
      if (trace) trace->begin_chunk(worker);
      if (!is_stamped()) {
        for (std::int64_t i = range.begin(); i != range.end(); ++i) body(i, worker);
        return;
      }
      Stamp& stamp = stamps_[static_cast<std::size_t>(worker)];
      WorkerTally& tally = tally_of(worker);
      if (stamp.epoch != epoch_) {
        const double begin = now();
        stamp = {.epoch = epoch_, .ranges = 0, .stamped_ranges = 0, .first = begin, .last = begin};
        tally.cpu = sched_getcpu();
      }
      for (std::int64_t i = range.begin(); i != range.end(); ++i) body(i, worker);
      tally.iterations += static_cast<std::int64_t>(range.size());
      ++tally.chunks;
      const bool are_short =
          stamp.last - stamp.first < kShortRange * static_cast<double>(stamp.stamped_ranges);
      if (++stamp.ranges > 16 && are_short && stamp.ranges % 16 != 0) return;
      const double end = now();
      tally.busy_seconds += end - stamp.last;
      stamp.last = end;
      stamp.stamped_ranges = stamp.ranges;
    };
    arena_.execute([&] { oneapi::tbb::parallel_for(Range(0, n, grain), chunk, partitioner); });
  }

  oneapi::tbb::global_control parallelism_;
  oneapi::tbb::task_arena arena_;
  // Lives as long as the point: affinity learns over its frames, and over no others.
  Partitioner partitioner_;
  std::vector<Stamp> stamps_;
  std::int64_t epoch_ = 0;
};

template <class Partitioner>
Schedule schedule(std::string name, std::string meaning) {
  return {.backend = "tbb",
          .name = std::move(name),
          .meaning = std::move(meaning),
          .chunk = "grain: ranges of at most this many iterations are not split; default 1",
          .make = [](const ExecutionConfig& config) -> std::unique_ptr<Execution> {
            return std::make_unique<Tbb<Partitioner>>(config);
          }};
}

const ScheduleRegistration kAuto(
    schedule<oneapi::tbb::auto_partitioner>("auto", "splits a range when a thread comes to steal"));
const ScheduleRegistration kSimple(
    schedule<oneapi::tbb::simple_partitioner>("simple", "splits down to the grain, always"));
const ScheduleRegistration kStatic(schedule<oneapi::tbb::static_partitioner>(
    "static", "one range per thread, divided before the loop starts"));
const ScheduleRegistration kAffinity(schedule<oneapi::tbb::affinity_partitioner>(
    "affinity", "like auto, and gives each thread the range that it had in the frame before"));

}  // namespace
}  // namespace rasterbench
