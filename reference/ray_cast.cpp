// Pictures by ray casting: the reference, and the specification of the kernel ray_cast.
#include "base/buffer.h"
#include "base/error.h"
#include "pipeline/frame.h"
#include "pipeline/resolve.h"
#include "reference/bands.h"
#include "reference/embree.h"
#include "reference/ray_cast_frame.h"
#include "reference/ray_scene.h"

namespace rasterbench {

RayCastPicture ray_cast(std::span<const Triangle> triangles, const Camera& camera, bool robust, int threads) {
  const int width = camera.viewport.width, height = camera.viewport.height;
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  checked_bytes(pixels, sizeof(std::int32_t) + sizeof(double), "the ray-cast picture");
  RayScene scene(triangles, {}, camera, {.robust = robust, .threads = threads});
  RayCastPicture result{.picture = {.width = width,
                                    .height = height,
                                    .ids = std::vector<std::int32_t>(pixels, -1),
                                    .depths = std::vector<double>(pixels, 1.0)}};
  result.build_seconds = seconds_of([&] {
    GeometryCounts counts;
    scene.copy(0, triangles.size(), counts);
    scene.build();
  });
  constexpr int kRows = 8;  // of a band: enough bands to balance, few enough to cost nothing
  result.trace_seconds = seconds_of([&] {
    reference::for_each_band((height + kRows - 1) / kRows, threads, [&](int band) {
      for (int y = band * kRows; y < std::min(height, (band + 1) * kRows); ++y) {
        const SampleRays::Row row = scene.rays().row(y);
        for (int x = 0; x < width; ++x) {
          const SampleRay ray = row.at(x);
          const RayHit hit = scene.nearest(ray);
          if (hit.id < 0) continue;
          const std::size_t pixel =
              static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
          result.picture.ids[pixel] = hit.id;
          result.picture.depths[pixel] = scene.rays().depth(ray, hit.position);
        }
      }
    });
  });
  return result;
}

void check_ray_cast_settings(const FrameSettings& settings) {
  if (settings.fill != FillRule::kClosed)
    throw InputError({.field = "--fill"}, "ray_cast knows closed only: a ray on an edge meets both sides");
  if (settings.geometry.near_rule != NearRule::kClip)
    throw InputError({.field = "--near"}, "ray_cast knows clip only: its rays begin on the near plane");
}

Picture render_ray_cast_specification(const Scene& scene, const FrameSettings& settings) {
  check_ray_cast_settings(settings);
  const auto& triangles = scene.model.triangles;
  checked_bytes(settings.pixels(), sizeof(PackedKeys::Key) + 20, "the specification's picture");
  RayScene rays(triangles, {}, sized_camera(scene, settings),
                ray_cast_options(settings, triangles.size(), 1));
  Picture picture{.width = settings.width, .height = settings.height};
  rays.copy(0, triangles.size(), picture.counts);
  rays.build();
  const std::uint32_t background = pack_rgba(scene.parameters.background);
  for (int y = 0; y < settings.height; ++y) {
    const SampleRays::Row row = rays.rays().row(y);
    for (int x = 0; x < settings.width; ++x) {
      const PackedKeys::Key key = ray_cast_key(rays, row.at(x), settings, triangles.size());
      const bool drawn = key < PackedKeys::kClear;
      const auto id = static_cast<std::size_t>(
          swap_rank(settings.tie, static_cast<std::int64_t>(triangles.size()), PackedKeys::rank(key)));
      picture.ids.push_back(drawn ? static_cast<std::int32_t>(id) : -1);
      picture.depths.push_back(PackedKeys::output_depth(key));
      picture.values.push_back(PackedKeys::value(key));
      picture.colours.push_back(drawn ? shade_flat(triangles[id], scene.parameters.object) : background);
    }
  }
  return picture;
}

}  // namespace rasterbench
