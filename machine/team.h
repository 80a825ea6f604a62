// Threads that start a piece of work together and are timed together.
#pragma once

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "base/function_ref.h"

namespace rasterbench {

/// A team of the calling thread (0) and `threads` - 1 further std::threads, which are not bound to CPUs. Not
/// the loops of execution/: these would add what an OpenMP runtime does, and its threads spin at their
/// barriers, which on a machine with other load costs whole time slices. Threads of a team yield while they
/// wait.
class Team {
 public:
  /// Throws Error where the process has fewer CPUs than `threads`, or where threads cannot be started.
  explicit Team(int threads);
  ~Team();
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  int threads() const { return static_cast<int>(shifts_.size()); }

  /// Every thread runs `work`(its number) once all are there. Seconds from the first's begin to the last's
  /// end.
  double run(FunctionRef<void(int thread)> work);

 private:
  using Clock = std::chrono::steady_clock;
  struct alignas(64) Shift {
    Clock::time_point begin, end;
  };

  void serve(int thread);
  void work_as(int thread);
  /// Until all threads wait here, or the team is dissolved.
  void wait();
  void dissolve();

  std::vector<Shift> shifts_;
  std::vector<std::thread> others_;
  std::atomic<int> arrived_{0};
  std::atomic<int> generation_{0};
  std::atomic<bool> dissolved_{false};
  const FunctionRef<void(int)>* work_ = nullptr;
};

}  // namespace rasterbench
