// Serial: one thread, iterations in order. The base of every speedup.
#include "execution/execution.h"
#include "execution/stamp_clock.h"

namespace rasterbench {
namespace {

class Serial final : public Execution {
 public:
  using Execution::Execution;

  void run_loop(std::int64_t n, LoopBody body) override {
    const double begin = is_stamped() ? StampClock::now() : 0;
    if (is_stamped()) sightings_of(0).look();
    for (std::int64_t i = 0; i < n; ++i) body(i, 0);
    if (!is_stamped()) return;
    WorkerTally& tally = tally_of(0);
    tally.busy_seconds += StampClock::now() - begin;
    tally.iterations += n;
    tally.chunks += n > 0;
    sightings_of(0).look();
    tally.cpu = sightings_of(0).last;
  }

  void uniform_loop(std::int64_t n, LoopBody body) override { run_loop(n, body); }
};

const ScheduleRegistration kSerial({.backend = "serial",
                                    .name = "",
                                    .meaning = "one thread, iterations in order",
                                    .chunk = "",
                                    .make = [](const ExecutionConfig& config) -> std::unique_ptr<Execution> {
                                      return std::make_unique<Serial>(config);
                                    }});

}  // namespace
}  // namespace rasterbench
