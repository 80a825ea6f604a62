// From verdicts and measurements to an answer: the fastest configuration that keeps the tolerance by its
// bound.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "advice/measure.h"

namespace rasterbench {

/// A finalist beside the fastest one.
struct Ranked {
  const Measurement* measurement = nullptr;
  double median_ms = 0;
  std::optional<std::pair<double, double>> interval_ms;  ///< 95 %, of the median; empty below 6 rounds
  /// 95 % interval of the median of its time over the fastest one's in the same round; empty for the fastest
  /// itself and below 6 rounds.
  std::optional<std::pair<double, double>> slower_by;
  bool is_distinguishable = false;  ///< from the fastest: the whole interval lies above 1
};

struct Recommendation {
  std::vector<Ranked> finalists;  ///< by their medians, the fastest first
  std::size_t chosen = 0;         ///< index of the recommended one
};

/// Of the finalists that cannot be told from the fastest, the one that can get the fewest pixels wrong, then
/// the one that was found to, then the fastest. Empty where nothing was measured.
std::optional<Recommendation> recommend(std::span<const Measurement> measurements);

/// The command that draws with `candidate`; words are quoted for a POSIX shell where they need it.
std::string command_line(const Candidate& candidate, const std::string& model, const std::string& scene_file,
                         const FrameSettings& settings);

}  // namespace rasterbench
