// The clock of stamps: those around loops are always on, and some kernels have a loop for each triangle, so
// that what reading the clock takes must not show.
#pragma once

#include <chrono>
#include <cstdint>
#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace rasterbench {

/// Monotonic seconds since some moment of this process: of the CPU's time-stamp counter where the kernel
/// itself keeps time by it (9 ns a reading, against 23 ns of clock_gettime), else of
/// std::chrono::steady_clock. The counter is read without a fence: neighbouring instructions may move past
/// it, by some ns.
class StampClock {
 public:
  static double now() {
#if defined(__x86_64__)
    if (seconds_per_tick_ > 0)
      return seconds_per_tick_ * static_cast<double>(static_cast<std::int64_t>(__rdtsc()) - origin_);
#endif
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

  /// Finds out, once in a process and in 4 ms, how long a tick is; before, now() is the slower clock, whose
  /// origin is another. Called before the threads of a loop start.
  static void calibrate();

 private:
  static inline double seconds_per_tick_ = 0;  // 0: the counter is not used
  static inline std::int64_t origin_ = 0;      // ticks
};

}  // namespace rasterbench
