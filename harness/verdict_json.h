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

/// The same for a peer's picture, which has no specification and no screen triangles of ours: `end_to_end`,
/// judged by llvmpipe_bound(), `bound` and `failure`; the other verdicts are null. Every colour must be the
/// one that the pixel's id has, so that the ids are known to be those of the timed picture.
Json judge_peer_picture(Judge& judge, const Picture& picture);

/// {"renderer", "version"}: verify.peer of records.md.
Json peer_json(const LlvmpipeVersion& version);

}  // namespace rasterbench
