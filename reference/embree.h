// Visibility by ray casting with Embree: an answer by another method and another team's code.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "numeric/screen.h"
#include "reference/double_renderer.h"
#include "scene/camera.h"
#include "scene/model.h"

namespace rasterbench {

/// Whether this build has Embree, and its version or the reason why not ("Embree was not found at build
/// time").
bool has_embree();
std::string embree_version();

/// What the rays saw.
struct RayCastPicture {
  IdImage picture;           ///< ids; depths d in [-1, 1), 1 = background
  double build_seconds = 0;  ///< acceleration structure
  double trace_seconds = 0;  ///< all rays
};

/// One ray through each pixel's sample, from the near plane to the far plane, origin and direction computed
/// in double and rounded once to float32. Embree says which triangles a ray meets; of these the nearest one
/// is shown, of equal distances the smallest id. Distances are those of the exact ray from the triangle's
/// plane, in double (ray_scene.h). `robust`: RTC_SCENE_FLAG_ROBUST. Back faces are shown; triangles with a
/// non-finite corner or without area in the world are not. Throws InputError naming --embree where
/// has_embree() is false, and for coordinates or sizes that ray casting cannot hold.
RayCastPicture ray_cast(std::span<const Triangle> triangles, const Camera& camera, bool robust, int threads);

/// A picture against another one by ray casting. Every pixel is in exactly one class.
struct RayComparison {
  std::int64_t pixels = 0;
  std::int64_t identical = 0;    ///< same id
  std::int64_t edge_ties = 0;    ///< the sample is within the bounds of an edge of one of the two
  std::int64_t depth_ties = 0;   ///< both cover the sample, their distances within the bounds of each other
  std::int64_t errors = 0;       ///< nothing explains it
  double max_edge_distance = 0;  ///< pixels; of an edge tie's sample from the nearest edge of the two
  double max_depth_difference = 0;     ///< of d, over pixels of equal id
  std::int64_t worst_pixel = -1;       ///< the first error, or -1
  std::vector<PixelVerdict> verdicts;  ///< per pixel
};

/// Classifies where `rays` disagree with `ids` and `depths` (of d), drawn with NearRule::kClip by a mode that
/// keeps to `bound`. What float32 rays may do is derived in ray_comparison.cpp. A picture of rays that come
/// from elsewhere is judged just as well. Throws Error if the sizes do not match.
RayComparison compare_with_rays(const RayCastPicture& rays, std::span<const std::int32_t> ids,
                                std::span<const double> depths, std::span<const Triangle> triangles,
                                const Camera& camera, const ModeBound& bound);

}  // namespace rasterbench
