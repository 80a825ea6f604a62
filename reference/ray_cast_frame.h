// What the kernel ray_cast and its specification have in common: which settings they know, and the key of a
// sample.
#pragma once

#include <algorithm>

#include "numeric/mode.h"
#include "pipeline/frame.h"
#include "reference/ray_scene.h"
#include "reference/specification.h"

namespace rasterbench {

/// Throws InputError naming the option that rays cannot follow.
void check_ray_cast_settings(const FrameSettings& settings);

/// Every frame builds its hierarchy afresh. The fast builder saves two thirds of the build and costs a third
/// of the tracing: over a frame, 10 to 45 % less where there is a triangle for every four pixels or more, up
/// to 18 % more where there are fewer (four scenes at 1920x1080).
inline RaySceneOptions ray_cast_options(const FrameSettings& settings, std::size_t triangle_count,
                                        int threads) {
  return {.robust = false,
          .fast_build = triangle_count >= settings.pixels() / 4,
          .threads = threads,
          .tie = settings.tie,
          .cull_back_faces = settings.geometry.cull_back_faces};
}

/// The key of what a ray meets first: d rounded once to float32, then the rank. A hit whose d rounds to 1 is
/// not drawn, as in the other modes of that depth.
inline PackedKeys::Key ray_cast_key(const RayScene& scene, const SampleRay& ray,
                                    const FrameSettings& settings, std::size_t triangle_count) {
  const RayHit hit = scene.nearest(ray);
  if (hit.id < 0) return PackedKeys::kClear;
  const std::uint32_t rank =
      swap_rank(settings.tie, static_cast<std::int64_t>(triangle_count), static_cast<std::uint32_t>(hit.id));
  return std::min(PackedKeys::kClear, PackedKeys::key(scene.rays().depth(ray, hit.position), rank));
}

/// The picture of the mode ray_cast: a serial loop over the pixels, on a hierarchy that one thread built.
/// Throws InputError as check_ray_cast_settings() and RayScene do. samples_tested and samples_covered stay 0.
Picture render_ray_cast_specification(const Scene& scene, const FrameSettings& settings);

}  // namespace rasterbench
