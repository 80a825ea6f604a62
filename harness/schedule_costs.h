// What starting a loop and handing out its chunks cost, schedule by schedule, in loops whose iterations do
// nothing.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace rasterbench {

struct ScheduleCost {
  /// Of a loop with one chunk for each thread: to start it and to wait for all. Empty where oneTBB never
  /// used all threads, or seldom.
  std::optional<double> start_seconds;
  /// That a thread spends on a further chunk beyond what the iterations take under the backend's static
  /// schedule: of OpenMP while all others do the same, of oneTBB on its own, since its threads take from each
  /// other by stealing only. 0 where more iterations do not make more chunks, so that all their cost is in
  /// start_seconds. Empty where it is not several times the noise, where there are too few ranges to tell
  /// (oneTBB's auto and affinity on one thread), and for oneTBB without stamps, which count its ranges.
  std::optional<double> chunk_seconds;
};

struct ScheduleCosts {
  /// By to_string(ExecutionConfig): every schedule of this build that has threads, with its own chunk and
  /// with 1 and 16.
  std::map<std::string, ScheduleCost> of;
  /// That a thread of oneTBB spends on a range which it takes from another one, beyond what a range of its
  /// own costs. Empty on one thread, in a build without oneTBB, and where few ranges were stolen.
  std::optional<double> steal_seconds;
};

/// The median of repeated differences, if it is several times the standard error of that median, estimated by
/// their median absolute deviation; empty also for fewer than seven.
std::optional<double> beyond_noise(const std::vector<double>& rounds);

/// Takes a few seconds.
ScheduleCosts measure_schedules(int threads);

}  // namespace rasterbench
