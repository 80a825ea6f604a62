// Measures the configurations that could draw a scene: kernels x sufficient modes x executions, each verified
// against its mode's specification first, and timed in interleaved rounds.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "advice/sufficiency.h"
#include "execution/execution.h"
#include "pipeline/frame.h"

namespace rasterbench {

/// A way to draw the scene.
struct Candidate {
  std::string kernel;
  const ModeVerdict* verdict = nullptr;  ///< of its numeric mode; outlives the candidate
  ExecutionConfig execution;
};

/// What came of a candidate.
struct Measurement {
  Candidate candidate = {};
  bool conforms = false;  ///< drew its specification's picture, to the bit; if not, there are no times
  double trial_ms = 0;    ///< fastest of a few frames, right after the verification
  std::vector<double> rounds_ms = {};  ///< frame times of the final rounds, one a round: entry i of every
                                       ///< finalist belongs to round i; empty for what did not reach them
};

struct MeasuringPlan {
  int threads = 1;
  double seconds = 20;  ///< for everything here; a frame that has begun is finished
  std::uint64_t seed = 1;
};

struct Measurements {
  std::vector<Measurement> all;  ///< in the order in which they were tried
  std::size_t no_time = 0;       ///< configurations that were left out for lack of time
  std::size_t hopeless = 0;      ///< left out because their kernel was several times slower than the fastest
};

/// The executions that are tried: serial for one thread, otherwise loops dealt dynamically, evenly and by
/// oneTBB.
std::vector<ExecutionConfig> tried_executions(int threads);

/// First every sufficient mode under one kernel; then the fastest modes under every kernel and execution,
/// while half of the time lasts; then rounds of fresh frames of the fastest few, in random order, for the
/// rest of it. So the final times are no part of what chose the finalists.
Measurements measure(const Scene& scene, const FrameSettings& settings, std::span<const ModeVerdict> verdicts,
                     const MeasuringPlan& plan,
                     const std::function<void(double, const std::string&)>& progress);

/// "tile_parallel filtered openmp:dynamic".
std::string name_of(const Candidate& candidate);

}  // namespace rasterbench
