// The geometry stage: world triangles -> screen triangles. View, near clip, guard-band clip, projection,
// rejection.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/isa.h"
#include "numeric/screen.h"
#include "pipeline/screen_batch.h"
#include "scene/camera.h"
#include "scene/model.h"

namespace rasterbench {

/// A camera with its viewport folded in, computed once per frame in double: rows of an affine map from world
/// points to (x w, y w, z, w), x and y in pixels and z / w the depth, and the distance in front of the near
/// plane.
struct ScreenTransform {
  AffineRow x, y, z, w, near_distance;
  double near_w;                 ///< Camera::near_w
  double near_depth, far_depth;  ///< the depth function's values on the near and the far plane
  double width, height;          ///< of the image in pixels
};
/// Throws Error for DepthFunction::kInverseW of a camera without perspective.
ScreenTransform make_screen_transform(const Camera& camera, DepthFunction function = DepthFunction::kNdc);

/// How the depth d of the course contract follows from the values of a depth function.
DepthMap depth_map(const Camera& camera, DepthFunction function);

/// Which of its tests the stage makes. One that fires for no triangle of a scene can be left out; the result
/// is the same to the bit. See needs.h for how that is known.
struct SceneNeeds {
  bool finite_test = true;        ///< some coordinate is not finite
  bool zero_area_test = true;     ///< some triangle has no area
  bool near_clip = true;          ///< some triangle reaches in front of the near plane
  bool behind_reject = true;      ///< some corner may have w <= 0, and so no place on the screen
  bool far_reject = true;         ///< some triangle may lie wholly beyond the far plane
  bool guard_clip = true;         ///< some corner may lie outside the guard band
  bool off_screen_reject = true;  ///< some triangle may miss the image

  bool operator==(const SceneNeeds&) const = default;
};

/// Choices of the stage.
struct GeometryOptions {
  NearRule near_rule = NearRule::kClip;
  bool cull_back_faces = false;  ///< back faces occlude by default (accuracy.md, section 1)
  SceneNeeds needs = {};         ///< all by default, which suits every scene
  Isa isa = Isa::kBaseline;      ///< of the vectorised loops; never changes the result
};

/// What became of the triangles; the fields before `drawn` count triangles that draw nothing, each once.
struct GeometryCounts {
  std::int64_t triangles = 0;
  std::int64_t non_finite = 0;  ///< a coordinate is NaN or infinite
  std::int64_t zero_area = 0;   ///< the cross product of two edges is exactly zero in double
  std::int64_t behind_near =
      0;  ///< wholly in front of the near plane (or, with NearRule::kOff, a corner at w <= 0)
  std::int64_t beyond_far = 0;   ///< every corner on or beyond the far plane
  std::int64_t off_screen = 0;   ///< the box of its corners misses the image
  std::int64_t back_facing = 0;  ///< counted only when culled
  std::int64_t drawn = 0;
  std::int64_t near_clipped = 0;   ///< drawn ones that were cut by the near plane
  std::int64_t guard_clipped = 0;  ///< drawn ones that were cut by the guard band
  std::int64_t pieces = 0;         ///< screen triangles made of the drawn ones

  GeometryCounts& operator+=(const GeometryCounts& other);
};

/// Transforms `triangles`, whose first one has id `first_id`. The first piece of triangle i goes to slots[i]
/// (a triangle that draws nothing leaves id -1 there); a clipped triangle's further pieces are appended to
/// `extra` with the same id. All arithmetic is in double; corners are rounded once to Real. Clipping always
/// interpolates from the inside corner to the outside one, so that neighbours agree, and fans start at the
/// corner that is smallest in (x, y), so that a flipped duplicate gives the same pieces. Sutherland &
/// Hodgman, Reentrant polygon clipping, CACM 1974.
template <class Real>
void transform_triangles(std::span<const Triangle> triangles, std::int32_t first_id,
                         const ScreenTransform& transform, const GeometryOptions& options,
                         ScreenTriangle<Real>* slots, std::vector<ScreenTriangle<Real>>& extra,
                         GeometryCounts& counts);

/// The same into one batch: at most ScreenBatch::kSize triangles; slots beyond them draw nothing.
void transform_triangles(std::span<const Triangle> triangles, std::int32_t first_id,
                         const ScreenTransform& transform, const GeometryOptions& options,
                         ScreenBatch<float>& batch, std::vector<ScreenTriangle<float>>& extra,
                         GeometryCounts& counts);

}  // namespace rasterbench
