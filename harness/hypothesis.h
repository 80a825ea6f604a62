// Hypotheses: the [[hypothesis]] tables of a study file, and the points that they select.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/study.h"
#include "harness/study_reader.h"

namespace rasterbench {

/// What hypotheses select from: all points that a study spans, whatever the filter and the shard.
struct Selectable {
  std::vector<PlannedPoint> points;
  std::vector<WeakSeries> weak;
  bool replaced = false;  ///< whether the command line replaced scenes or sizes
};

/// The [[hypothesis]] tables of `text`. Each side selects one point by the values of its axes, or with
/// best = true several, of which the fastest is meant. A key that is no axis, a value that no point has, a
/// side that selects nothing or too much, and a comparison of a point with itself are InputErrors that name
/// file, line and key; where only this machine or the command line is to blame, Hypothesis::untested says so
/// instead.
std::vector<Hypothesis> read_hypotheses(const std::filesystem::path& file, const std::string& text,
                                        const PlanTarget& target, const Selectable& from);

/// The hypotheses as context.json has them (records.md).
Json hypotheses_to_json(const std::vector<Hypothesis>& hypotheses);

}  // namespace rasterbench
