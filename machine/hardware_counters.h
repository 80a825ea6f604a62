// Hardware counters of the threads that draw, through perf_event_open(2): where the machine has them and lets
// this user read them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/function_ref.h"

namespace rasterbench {

/// What was counted, in the order of HardwareReport::events: of user space only, but for context switches,
/// which happen in the kernel, and task_clock.
struct HardwareReport {
  struct Event {
    std::string name;         ///< cycles, instructions, ...; task_clock is in nanoseconds of CPU time
    std::string unavailable;  ///< why the machine refuses it, or empty
  };
  /// `value` is scaled to the whole time where events took turns on the CPU's counters: by 1 / `share`, the
  /// share of the time in which this one was counted.
  struct Count {
    double value = 0, share = 1;
  };
  struct Thread {
    int id = 0;                                ///< of Linux
    std::vector<std::optional<Count>> counts;  ///< by event; empty where it was refused or never had its turn
  };

  std::vector<Event> events;
  std::vector<Thread> threads;  ///< those that ran at all

  /// Place of an event in `events`. Precondition: there is one of that name.
  std::size_t index_of(std::string_view name) const;

  /// The sum over all threads, or empty where it is not known of one.
  std::optional<double> total(std::string_view name) const;
};

/// The count of an event that was enabled for `enabled` ns and counted for `running` of them
/// (perf_event_open(2): multiplexing). Empty where it never had its turn; 0 where its thread did not run.
std::optional<HardwareReport::Count> scaled_count(std::uint64_t value, std::uint64_t enabled,
                                                  std::uint64_t running);

/// Runs `work` and counts what each thread of this process does meanwhile. Threads that start in `work` are
/// not counted: let pools start before. What the machine refuses is absent, with the reason; nothing fails
/// because of it.
HardwareReport count_hardware(FunctionRef<void()> work);

}  // namespace rasterbench
