// What holds a worker up besides its own work: other workers, at a lock or at an atomic word.
#pragma once

#include <cstdint>
#include <mutex>

#include "execution/stamp_clock.h"

namespace rasterbench {

/// How often one worker was held up by others. Written only where that happens, so that counting costs
/// nothing where nobody is in the way, and is on in every frame.
struct Contention {
  std::int64_t failed_exchanges = 0;  ///< compare-exchanges that found a value of somebody else
  std::int64_t contended_locks = 0;   ///< locks that somebody else held
  double lock_wait_seconds = 0;       ///< until these were free

  Contention& operator+=(const Contention& other) {
    failed_exchanges += other.failed_exchanges;
    contended_locks += other.contended_locks;
    lock_wait_seconds += other.lock_wait_seconds;
    return *this;
  }
};

/// Takes the lock of `mutex`; where another worker holds it, counts that and how long it takes.
inline std::unique_lock<std::mutex> lock_counted(std::mutex& mutex, Contention& contention) {
  std::unique_lock lock(mutex, std::try_to_lock);
  if (!lock.owns_lock()) {
    const double begin = StampClock::now();
    lock.lock();
    // The clock is read while the lock is held: others wait for it that much longer.
    contention.lock_wait_seconds += StampClock::now() - begin;
    ++contention.contended_locks;
  }
  return lock;
}

}  // namespace rasterbench
