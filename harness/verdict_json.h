// Verdicts as JSON: records and the command verify write them alike (records.md, verify).
#pragma once

#include "harness/point.h"
#include "reference/judge.h"

namespace rasterbench {

/// The keys of the verdicts on a picture, in the order in which records hold them.
inline constexpr const char* kVerdicts[] = {"oracle", "end_to_end", "embree", "embree_robust", "bound"};

/// What one mode's picture of one scene is judged to be: by the oracle, the end-to-end truth and ray casting.
/// Keys kVerdicts as in records.md; "failure": text, or null where nothing contradicts the mode's bound.
Json judge_picture(Judge& judge, const Picture& picture, const ModeInfo& mode);

}  // namespace rasterbench
