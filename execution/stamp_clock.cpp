#include "execution/stamp_clock.h"

#include <fstream>
#include <mutex>
#include <string>

namespace rasterbench {

#if defined(__x86_64__)
namespace {

using Clock = std::chrono::steady_clock;

/// The kernel has made sure that the counter neither stops nor changes its rate, and is the same on all CPUs.
bool kernel_uses_counter() {
  std::ifstream file("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  std::string name;
  return file >> name && name == "tsc";
}

/// Both clocks at one moment.
struct Moment {
  std::int64_t ticks;
  Clock::time_point time;
};

/// Of several readings that with the fewest ticks between its ends, since an interrupt may fall into one.
Moment moment() {
  Moment best{};
  std::int64_t shortest = INT64_MAX;
  for (int reading = 0; reading < 10; ++reading) {
    const auto before = static_cast<std::int64_t>(__rdtsc());
    const Clock::time_point time = Clock::now();
    const auto after = static_cast<std::int64_t>(__rdtsc());
    if (after - before >= shortest) continue;
    shortest = after - before;
    best = {before + shortest / 2, time};
  }
  return best;
}

}  // namespace
#endif

void StampClock::calibrate() {
#if defined(__x86_64__)
  static std::once_flag once;
  std::call_once(once, [] {
    if (!kernel_uses_counter()) return;
    // Readings are good to some 20 ns, so that the rate is good to 1e-5.
    constexpr std::chrono::milliseconds kWait(4);
    const Moment first = moment();
    while (Clock::now() - first.time < kWait) {
    }
    const Moment last = moment();
    if (last.ticks <= first.ticks) return;
    origin_ = first.ticks;
    seconds_per_tick_ = std::chrono::duration<double>(last.time - first.time).count() /
                        static_cast<double>(last.ticks - first.ticks);
  });
#endif
}

}  // namespace rasterbench
