// The compute bound of transform + reject: the geometry stage's own arithmetic where memory does not matter.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/scene.h"

namespace rasterbench {

/// Triangles of a batch: with the screen triangles made of them they take 10 KiB, a third of the smallest L1
/// data caches in use.
inline constexpr std::int64_t kGeometryBatch = 128;

/// What was measured. A thread's time per triangle is `threads` times that.
struct GeometryRate {
  int threads = 0;
  std::int64_t triangles = 0;           ///< of a thread's batch
  std::vector<double> ns_per_triangle;  ///< wall time over the triangles of all threads, one a repetition
};

/// Times transform_triangles<float> on the best instruction set, with the tests that `scene` needs, on
/// kGeometryBatch triangles taken evenly from it (all, where it has fewer). Each thread of a Team goes
/// through a copy of its own, again and again. Throws InputError for a scene without triangles, Error where
/// the threads cannot be had.
GeometryRate measure_geometry(const Scene& scene, int threads, int repetitions);

}  // namespace rasterbench
