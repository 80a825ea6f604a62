// What a scene needs of the geometry stage: the tests that fire for some triangle. The others can be left
// out.
//
// One pass over the triangles evaluates the stage's own expressions in its own order (corner.h), so that its
// rounding errors are those of the frame: a test that fires for no triangle here fires for none there. That
// costs about one geometry stage on one thread and is paid once per point, before anything is timed, since
// neither the camera nor the triangles change between the frames of a point.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "pipeline/geometry.h"

namespace rasterbench {

/// How much of the general pipeline a frame runs. Never changes the picture.
enum class Generality {
  kMinimal,  ///< the tests that the scene needs
  kFull,     ///< every test, whatever the scene
};

/// What one pass over the triangles found. Each triangle is counted by the first test that fires for it.
struct NeedsAnalysis {
  SceneNeeds needs;
  NearRule near_rule = NearRule::kClip;
  std::int64_t triangles = 0;
  std::int64_t non_finite = 0;
  std::int64_t zero_area = 0;
  std::int64_t before_near = 0;   ///< every corner in front of the near plane; 0 with NearRule::kOff
  std::int64_t across_near = 0;   ///< some corner in front of it and some not; 0 with NearRule::kOff
  std::int64_t behind = 0;        ///< of the others, some corner at w <= 0
  std::int64_t beyond_far = 0;    ///< of the others, no corner before the far plane
  std::int64_t beyond_guard = 0;  ///< of the others, some corner outside the guard band
  std::int64_t off_screen = 0;    ///< of the others, the box misses the image
  /// Smallest and largest distance of a corner behind the near plane, in world units along the view axis.
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = -std::numeric_limits<double>::infinity();
  double outermost = 0;  ///< largest |x| or |y| in pixels of the corners of triangles that no plane cuts
};

/// Where a triangle lies across the near plane or the guard band, the tests that follow are kept without a
/// look at what the cut leaves of it.
NeedsAnalysis analyse_needs(std::span<const Triangle> triangles, const ScreenTransform& transform,
                            NearRule near_rule);

/// One test of the stage: whether it is kept, and why, in words with numbers.
struct NeedStatement {
  std::string test;
  bool kept;
  std::string reason;
};

/// A statement for every test, in the order of the stage. `camera` is the one that was analysed.
std::vector<NeedStatement> explain_needs(const NeedsAnalysis& analysis, const Camera& camera);

/// The statements as lines: "near clip: left out, the nearest corner is 0.83 behind the near plane".
std::string to_string(const std::vector<NeedStatement>& statements);

}  // namespace rasterbench
