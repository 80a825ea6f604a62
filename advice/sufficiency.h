// Which numeric modes keep a tolerance on one scene, by their a-priori error bounds: a proof, not a sample.
// The pixels that a mode can get wrong are those whose exact margins (to the nearest edge, to the next depth)
// are within its bound; everywhere else every implementation of the mode draws the exact owner.
//
// "Wrong" is against exact arithmetic on the screen triangles that the mode is given (accuracy.md, level 1).
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "advice/scene_facts.h"
#include "reference/judge.h"

namespace rasterbench {

struct Tolerance {
  std::int64_t wrong_pixels = 0;  ///< >= 0
  /// > 0; in world units along the view axis, of the float32 depth that a frame hands over, in every pixel
  /// whose owner is certain. Empty: any.
  std::optional<double> depth_error = {};
};

/// Why a mode keeps a tolerance by its bound, or does not.
enum class Standing {
  kSuffices,
  kTooManyPixels,   ///< can get more pixels wrong than allowed
  kTooDeepAnError,  ///< can err more in depth than allowed
  kUnbounded,       ///< promises nothing
  kCastsRays,       ///< has no screen triangles, so that their margins say nothing of it
  kUnavailable,     ///< this CPU or this build cannot run it
};
/// "suffices", "too many pixels", ...
std::string_view to_string(Standing standing);

/// One mode on one scene: what its bound promises, and what its specification did.
struct ModeVerdict {
  const ModeInfo* mode = nullptr;
  Standing standing = Standing::kUnavailable;
  std::int64_t predicted = -1;  ///< pixels that it can get wrong; -1: nothing is promised
  std::int64_t by_edge = 0;     ///< of those, by a sample near an edge
  std::int64_t by_depth = 0;    ///< of those, by two depths near each other
  double depth_bound = std::numeric_limits<double>::infinity();  ///< of the depth's error, world units
  std::int64_t found = -1;        ///< pixels that its specification gets wrong; -1: not drawn
  std::int64_t beyond_bound = 0;  ///< pixels whose owner or depth contradicts its bound: a defect
  double found_depth_error = 0;   ///< world units, over the pixels with the exact owner
  std::string fingerprint;        ///< of the specification's picture, or empty
};

/// A picture's ids, depths and colours as one hash: equal for equal pictures.
std::string fingerprint(const Picture& picture);

/// A verdict on every mode of the list, in its order. Draws specifications on `threads` threads; calls
/// progress(share, mode) as it goes.
std::vector<ModeVerdict> judge_modes(Judge& judge, const Tolerance& tolerance, int threads,
                                     const std::function<void(double, std::string_view)>& progress);

/// Of the modes that promise something, the one that misses the tolerance by the least: by the fewest pixels
/// beyond it, then by the smallest depth error. Null where no mode promises anything.
const ModeVerdict* nearest_to(const Tolerance& tolerance, std::span<const ModeVerdict> verdicts);

/// An upper bound, in world units along the view axis, of the error of the float32 d that a frame hands over,
/// from one of the mode's own depth values. `farthest_d` is the largest exact d among the pixels that it
/// holds for.
double depth_bound_in_world(const ModeInfo& mode, const Camera& camera, double value_error,
                            double farthest_d);

}  // namespace rasterbench
