// oneTBB: parallel_for over a blocked_range with each of its partitioners.
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>
#include <oneapi/tbb/task_scheduler_observer.h>
#include <sched.h>

#include <algorithm>

#include "execution/binding.h"
#include "execution/execution.h"
#include "execution/loop_trace.h"
#include "execution/stamp_clock.h"

namespace rasterbench {
namespace {

using Range = oneapi::tbb::blocked_range<std::int64_t>;

/// Binds every thread that comes into an arena as OpenMP would bind the thread of its number. oneTBB has no
/// binding of its own finer than a NUMA node, and its workers inherit the mask of the thread that starts
/// them, which OMP_PROC_BIND has narrowed to one place: unbound, all of them would share it.
class Binder final : public oneapi::tbb::task_scheduler_observer {
 public:
  Binder(oneapi::tbb::task_arena& arena, int threads) : task_scheduler_observer(arena) {
    for (const std::vector<int>& cpus : bound_cpus(threads)) {
      cpu_set_t& mask = masks_.emplace_back();
      CPU_ZERO(&mask);
      for (const int cpu : cpus) CPU_SET(static_cast<std::size_t>(cpu), &mask);
    }
    if (!masks_.empty()) observe(true);
  }
  ~Binder() override { observe(false); }
  Binder(const Binder&) = delete;
  Binder& operator=(const Binder&) = delete;

  void on_scheduler_entry(bool) override {
    const auto slot = static_cast<std::size_t>(oneapi::tbb::this_task_arena::current_thread_index());
    if (slot >= masks_.size()) return;
    // A worker comes and goes with each loop, mostly into the slot that it had: no system call then.
    thread_local cpu_set_t bound{};
    if (CPU_EQUAL(&bound, &masks_[slot])) return;
    // What it refuses shows: a study looks where its threads run.
    if (sched_setaffinity(0, sizeof bound, &masks_[slot]) == 0) bound = masks_[slot];
  }

 private:
  std::vector<cpu_set_t> masks_;  // by slot; empty: no binding
};

template <class Partitioner>
class Tbb final : public Execution {
 public:
  explicit Tbb(const ExecutionConfig& config)
      : Execution(config),
        // Without it an arena never gets more workers than there are CPUs (--oversubscribe).
        parallelism_(oneapi::tbb::global_control::max_allowed_parallelism,
                     static_cast<std::size_t>(std::max(config.threads, available_cpus()))),
        arena_(config.threads),
        binder_(arena_, config.threads),
        stamps_(static_cast<std::size_t>(config.threads)) {}

  void run_loop(std::int64_t n, LoopBody body) override {
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
        const double begin = StampClock::now();
        stamp = {.epoch = epoch_, .ranges = 0, .stamped_ranges = 0, .first = begin, .last = begin};
        sightings_of(worker).look();
      }
      for (std::int64_t i = range.begin(); i != range.end(); ++i) body(i, worker);
      tally.iterations += static_cast<std::int64_t>(range.size());
      ++tally.chunks;
      const bool are_short =
          stamp.last - stamp.first < kShortRange * static_cast<double>(stamp.stamped_ranges);
      if (++stamp.ranges > 16 && are_short && stamp.ranges % 16 != 0) return;
      sightings_of(worker).look();
      tally.cpu = sightings_of(worker).last;
      const double end = StampClock::now();
      tally.busy_seconds += end - stamp.last;
      stamp.last = end;
      stamp.stamped_ranges = stamp.ranges;
    };
    arena_.execute([&] { oneapi::tbb::parallel_for(Range(0, n, grain), chunk, partitioner); });
  }

  oneapi::tbb::global_control parallelism_;
  oneapi::tbb::task_arena arena_;
  Binder binder_;
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
