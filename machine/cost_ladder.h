// The cost ladder of a scene: how long the front part of a frame takes up to each of its steps.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/function_ref.h"
#include "pipeline/frame.h"

namespace rasterbench {

/// One rung: everything up to its step.
struct Rung {
  std::string name;                  ///< of the step: "read", "transform", ...
  std::string meaning;               ///< what is run besides the rung below
  std::string unit;                  ///< of `results`: "triangles", "samples", ...
  std::int64_t results = 0;          ///< what goes on to the next rung
  std::vector<double> seconds = {};  ///< of the whole front part up to here, one a repetition
};

struct CostLadder {
  int threads = 0;
  std::string mode;  ///< numeric mode of the set-up, the tests and the depths
  std::vector<Rung> rungs;
};

/// The modes that measure_cost_ladder() takes.
std::vector<std::string_view> cost_ladder_modes();

/// Times the front parts of a frame of `scene` on a Team of `threads` threads that take batches of 128
/// triangles as they come free: geometry with settings.geometry.isa, everything after it one sample at a
/// time, as the simple kernels have it. Repetitions go through all rungs in turn, after an untimed one;
/// `progress` is told how many of them are done. settings.geometry.needs is taken from the scene where the
/// generality is minimal. Throws InputError for a scene without triangles or another mode, Error where the
/// threads cannot be had.
CostLadder measure_cost_ladder(const Scene& scene, std::string_view mode, const FrameSettings& settings,
                               int threads, int repetitions, FunctionRef<void(int done)> progress);

}  // namespace rasterbench
