// What disturbed a study while it was sampling: other programs, the hypervisor, a changing clock.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/point.h"
#include "machine/cpu_times.h"

namespace rasterbench {

/// From these values on a study says that its machine was noisy.
inline constexpr double kNoisyOtherCpus = 0.25;        ///< CPUs that other programs kept busy, median
inline constexpr double kNoisyOtherCpusOnce = 1.0;     ///< and in the worst window
inline constexpr double kNoisySteal = 0.02;            ///< share of stolen CPU time, median
inline constexpr double kNoisyStealOnce = 0.10;        ///< and in the worst window
inline constexpr double kNoisyFrequencyChange = 0.10;  ///< of the fastest CPU, of its highest frequency

/// Reads the system's counters between blocks. Blocks shorter than half a second are joined to a window,
/// because /proc/stat counts in hundredths of a second.
class NoiseWatch {
 public:
  /// Sampling begins with `block`; `own_cpu` are the CPU seconds of the study's own processes so far.
  void begin(int block, double own_cpu);

  /// The journal's noise event when a window is complete, or with `is_last` whatever is left of one.
  std::optional<Json> end_of_block(int block, double own_cpu, bool is_last);

 private:
  struct State {
    int block = 0;
    double at = 0, own_cpu = 0;  // seconds
    std::optional<CpuTimes> machine;
    Reading throttled;
  };
  static State now(int block, double own_cpu);

  State start_;
};

/// `noise` of context.json, from the events of a journal. `has_unbound`: several threads ran without a
/// binding.
Json summarise_noise(const std::vector<Json>& events, bool has_unbound);

/// One line for stderr, or empty where nothing was noisy.
std::string noise_warning(const Json& summary);

}  // namespace rasterbench
