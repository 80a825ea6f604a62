// Runs cases of the catalogue in many modes: what `rasterbench extremes` prints and the tests check.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "extremes/catalogue.h"
#include "extremes/verdict.h"
#include "extremes/watertight.h"

namespace rasterbench::extremes {

struct CaseResult {
  /// The case is about reading a file: the same in any mode, so that there is one finding.
  bool in_any_mode = false;
  std::vector<Finding> findings;            ///< in the order of the modes
  std::vector<WatertightCount> watertight;  ///< in the order of the modes; empty where nothing was counted
};

/// The modes that this CPU can run and that `kernel` can carry, in the order of the list.
std::vector<std::string_view> runnable_modes(std::string_view kernel);

/// Whether a gap or an overlap of this mode is wrong.
bool must_be_watertight(const Must& must, std::string_view mode);

/// What to run of a case.
enum class Part { kAll, kWatertight };

/// Runs `one` in each of `modes` with `kernel` on `threads` threads. Throws InputError where a case cannot be
/// run at all (memory).
CaseResult run_case(const Case& one, std::span<const std::string_view> modes, std::string_view kernel,
                    Part part, int threads);

}  // namespace rasterbench::extremes
