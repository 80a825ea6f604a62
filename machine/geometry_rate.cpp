#include "machine/geometry_rate.h"

#include <algorithm>

#include "base/error.h"
#include "machine/team.h"
#include "pipeline/geometry.h"
#include "pipeline/needs.h"
#include "scene/camera.h"

namespace rasterbench {
namespace {

// Per thread and repetition: about a millisecond.
constexpr std::int64_t kTrianglesPerRepetition = 65536;

/// What one thread works on; aligned, so that no cache line belongs to two threads.
struct alignas(64) Batch {
  std::vector<Triangle> triangles;
  std::vector<ScreenTriangle<float>> slots, extra;
  GeometryCounts counts;
};

std::vector<Triangle> sampled(const std::vector<Triangle>& all) {
  const auto count = std::min<std::size_t>(all.size(), kGeometryBatch);
  std::vector<Triangle> chosen;
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(all[all.size() * i / count]);
  return chosen;
}

}  // namespace

GeometryRate measure_geometry(const Scene& scene, int threads, int repetitions) {
  const std::vector<Triangle> chosen = sampled(scene.model.triangles);
  if (chosen.empty()) throw InputError({.file = scene.model.name}, "has no triangles to measure geometry on");
  const ScreenTransform transform = make_screen_transform(make_camera(scene.parameters));
  GeometryOptions options{.isa = best_isa()};
  options.needs = analyse_needs(scene.model.triangles, transform, options.near_rule).needs;

  Team team(threads);
  std::vector<Batch> batches(static_cast<std::size_t>(threads));
  const auto size = static_cast<std::int64_t>(chosen.size());
  const std::int64_t passes = std::max<std::int64_t>(1, kTrianglesPerRepetition / size);

  GeometryRate result{.threads = threads, .triangles = size, .ns_per_triangle = {}};
  for (int repetition = -1; repetition < repetitions; ++repetition) {
    const double seconds = team.run([&](int thread) {
      Batch& batch = batches[static_cast<std::size_t>(thread)];
      if (batch.triangles.empty()) {  // in the untimed repetition: each thread touches its own memory first
        batch.triangles = chosen;
        batch.slots.resize(chosen.size());
      }
      for (std::int64_t pass = 0; pass < passes; ++pass) {
        batch.extra.clear();
        transform_triangles<float>(batch.triangles, 0, transform, options, batch.slots.data(), batch.extra,
                                   batch.counts);
      }
    });
    if (repetition >= 0)
      result.ns_per_triangle.push_back(1e9 * seconds / static_cast<double>(passes * size * threads));
  }
  return result;
}

}  // namespace rasterbench
