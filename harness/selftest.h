// The A/A self-test: one point under two labels, compared as if they were two. How often do they come out
// different?
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/function_ref.h"
#include "harness/study.h"

namespace rasterbench {

/// What one label was sampled to.
struct LabelSamples {
  std::vector<double> times_ms;
  std::vector<int> blocks;
  std::string stop;  ///< stop_reason()
};

/// One comparison of a point with itself.
struct SelfComparison {
  std::array<LabelSamples, 2> labels;
  double ratio = 1;                                   ///< median of a's time / b's over their common blocks
  std::optional<std::pair<double, double>> interval;  ///< 95 %, by order statistics; empty below 6 pairs

  /// A false difference: the interval excludes 1.
  bool differs() const { return interval && (interval->first > 1 || interval->second < 1); }
};

/// The least number of `comparisons` whose exact 95 % interval lies above `stated_rate` if so many came out
/// different: what so many comparisons can find. None if not even all of them would.
std::optional<int> least_found(int comparisons, double stated_rate);

/// Samples both labels as a study samples two points (randomised blocks, each label until the stopping rule
/// closes it) and compares them. `sample(label, block)` takes one sample, the mean of `frames` frames, in
/// milliseconds. `seed` decides the order within the blocks.
SelfComparison compare_with_itself(const SamplingPlan& plan, std::uint64_t seed, int frames,
                                   FunctionRef<double(int label, int block)> sample);

}  // namespace rasterbench
