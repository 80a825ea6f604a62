// OpenMP worksharing loops: schedule(static | dynamic | guided | auto), chosen at run time.
#include <omp.h>

#include <algorithm>

#include "execution/execution.h"
#include "execution/stamp_clock.h"

namespace rasterbench {
namespace {

class OpenMp final : public Execution {
 public:
  OpenMp(const ExecutionConfig& config, omp_sched_t kind) : Execution(config), kind_(kind) {
    omp_set_dynamic(0);  // never fewer threads than asked for without saying so
  }

  void run_loop(std::int64_t n, LoopBody body) override { run(n, body, kind_, config().chunk.value_or(0)); }
  void uniform_loop(std::int64_t n, LoopBody body) override { run(n, body, omp_sched_static, 0); }

 private:
  void run(std::int64_t n, LoopBody body, omp_sched_t kind, int chunk) {
    // libgomp's auto is static with the chunk of whatever loop ran before: reset that first (measuring.md).
    omp_set_schedule(omp_sched_static, 0);
    omp_set_schedule(kind, chunk);
#pragma omp parallel num_threads(threads())
    {
      const int worker = omp_get_thread_num();
      if (is_stamped()) {
        const double begin = StampClock::now();
        Sightings& sightings = sightings_of(worker);
        sightings.look();
        std::int64_t iterations = 0, runs = 0, next = -1;
#pragma omp for schedule(runtime) nowait
        for (std::int64_t i = 0; i < n; ++i) {
          body(i, worker);
          ++iterations;
          runs += i != next;
          next = i + 1;
        }
        WorkerTally& tally = tally_of(worker);
        tally.busy_seconds += StampClock::now() - begin;
        tally.iterations += iterations;
        tally.chunks += chunks_of(iterations, runs, kind, chunk);
        sightings.look();
        tally.cpu = sightings.last;
      } else {
#pragma omp for schedule(runtime) nowait
        for (std::int64_t i = 0; i < n; ++i) body(i, worker);
      }
    }
  }

  /// Only the last chunk of a loop is smaller than the others, so that a thread's iterations tell its chunks
  /// where these have a size; elsewhere what is seen of them is runs of consecutive iterations.
  static std::int64_t chunks_of(std::int64_t iterations, std::int64_t runs, omp_sched_t kind, int chunk) {
    if (kind == omp_sched_dynamic || (kind == omp_sched_static && chunk > 0)) {
      const std::int64_t size = std::max(chunk, 1);
      return (iterations + size - 1) / size;
    }
    return runs;
  }

  omp_sched_t kind_;
};

Schedule schedule(std::string name, omp_sched_t kind, std::string meaning, std::string chunk) {
  return {.backend = "openmp",
          .name = std::move(name),
          .meaning = std::move(meaning),
          .chunk = std::move(chunk),
          .make = [kind](const ExecutionConfig& config) -> std::unique_ptr<Execution> {
            return std::make_unique<OpenMp>(config, kind);
          }};
}

const ScheduleRegistration kStatic(
    schedule("static", omp_sched_static, "iterations are divided before the loop starts",
             "iterations dealt round-robin in blocks of this many; default n/threads"));
const ScheduleRegistration kDynamic(schedule("dynamic", omp_sched_dynamic,
                                             "a free thread takes the next chunk",
                                             "iterations per chunk; default 1"));
const ScheduleRegistration kGuided(schedule("guided", omp_sched_guided,
                                            "a free thread takes a share of what is left, so chunks shrink",
                                            "smallest chunk in iterations; default 1"));
const ScheduleRegistration kAuto(schedule("auto", omp_sched_auto, "the runtime chooses (libgomp: static)",
                                          ""));

}  // namespace
}  // namespace rasterbench
