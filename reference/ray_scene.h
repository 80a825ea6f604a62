// A model as Embree holds it, and the one question that is asked of it: which triangle does a sample's ray
// meet first. Shared by the reference (embree.h) and by the kernel ray_cast, so that the kernel's conformance
// shows only that its executions agree; its correctness is shown by the judges, which share nothing with it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "numeric/screen.h"
#include "pipeline/geometry.h"
#include "reference/rays.h"
#include "scene/model.h"

namespace rasterbench {

/// How a RayScene is built and asked.
struct RaySceneOptions {
  bool robust = false;      ///< RTC_SCENE_FLAG_ROBUST: conservative boxes, Pluecker edge tests
  bool fast_build = false;  ///< a Morton-ordered hierarchy instead of the surface-area heuristic's
  int threads = 1;          ///< of the build
  TieRule tie = TieRule::kFirst;
  bool cull_back_faces = false;
  std::size_t max_bytes = SIZE_MAX;  ///< of the hierarchy; what the machine has left limits it as well
};

/// What a ray meets first: `id` is -1 where it meets nothing.
struct RayHit {
  std::int32_t id = -1;
  double position = 1;  ///< as in SampleRays
};

/// Triangles in the hands of Embree. Copy all, build, then ask from any number of threads.
class RayScene {
 public:
  /// World coordinates up to here; beyond it the products of Embree's float32 arithmetic can overflow, which
  /// would lose triangles silently.
  static constexpr double kMaxCoordinate = 0x1p40;

  /// `slots`: the triangles in the order in which Embree gets them, which must not matter; `ids`: those of
  /// the slots, or empty where slot i is triangle i. Both must outlive the object. Throws InputError for a
  /// triangle or a near plane beyond kMaxCoordinate, for what SampleRays refuses, and where this build has no
  /// Embree or the machine not the memory; Error where Embree cannot be started.
  RayScene(std::span<const Triangle> slots, std::span<const std::uint32_t> ids, const Camera& camera,
           const RaySceneOptions& options);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Copies slots first .. first + count - 1 for the next build, and counts what becomes of them. Triangles
  /// with a non-finite corner or without area in the world are left out. Safe for disjoint slots at once.
  void copy(std::size_t first, std::size_t count, GeometryCounts& counts);

  /// Builds the hierarchy of all slots afresh. Throws InputError where it does not fit into memory, Error for
  /// whatever else Embree reports. Leaves the floating-point modes of the threads as they were.
  void build();

  /// The first triangle on the ray from the near plane (included) to the far plane (excluded). Embree decides
  /// which triangles the ray meets, rounded once to float32; of these the smallest (SampleRays::position,
  /// rank) wins, whatever the shape of the hierarchy. Safe from many threads.
  RayHit nearest(const SampleRay& ray) const;

  /// The rays of the camera.
  const SampleRays& rays() const;

  /// Of the copies and the hierarchy.
  std::size_t bytes() const;

 private:
  struct Embree;
  std::unique_ptr<Embree> embree_;
};

/// float32 rays begin this far in front of the near plane and end as far behind the far plane, so that no
/// rounding hides what is on them; hits outside the two planes are left out in double. Also how much farther
/// than the best hit Embree goes on looking. As a share of the coordinates: 256 roundings.
inline constexpr double kRaySlack = 0x1p-16;

}  // namespace rasterbench
