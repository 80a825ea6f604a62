// The only file that is compiled against Embree: RayScene on top of it. Where Embree is not found,
// embree_missing.cpp takes its place.
//
// Embree is given a filter, which sees every hit of a ray that is not behind the best one by more than
// kRaySlack, and keeps the smallest (position, rank) in double precision. Embree's own distance only decides
// how far it goes on looking. With slack 0 the winner of a tie depended on the shape of the hierarchy; with
// 2^-20 and more, ids were those of a search that visits all hits, in all scenes tried and with permuted
// triangles, at no cost in time.
#include "reference/embree.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <type_traits>

#include "base/buffer.h"
#include "base/error.h"
#include "pipeline/frame.h"
#include "reference/ray_scene.h"

namespace rasterbench {
namespace {

constexpr std::size_t kCornerFloats = 9;  // of a triangle
constexpr std::size_t kPadding = 16;      // bytes: Embree reads a vertex of 12 bytes by 16

bool is_finite(const Triangle& t) {
  return std::ranges::all_of(std::array{t.a, t.b, t.c}, [](const Vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  });
}

bool has_area(const Triangle& t) {
  const Vec3d a = to_double(t.a), n = cross(to_double(t.b) - a, to_double(t.c) - a);
  return n.x != 0 || n.y != 0 || n.z != 0;
}

void check_range(std::span<const Triangle> slots, const SampleRays& rays) {
  const auto check = [](double coordinate, const char* what) {
    if (std::abs(coordinate) > RayScene::kMaxCoordinate)
      throw InputError({.field = what},
                       fmt::format("ray casting takes coordinates up to 2^40, and {} is one", coordinate));
  };
  check(rays.near_extent(), "near plane");
  for (const Triangle& t : slots) {
    if (!is_finite(t)) continue;
    for (const Vec3& p : {t.a, t.b, t.c})
      for (const float coordinate : {p.x, p.y, p.z}) check(coordinate, "triangle");
  }
}

// A query of one ray. Embree hands the context back to the filter.
struct Query {
  RTCIntersectContext context;  // first, so that a pointer to it is a pointer to the query
  const SampleRays* rays;
  const SampleRay* ray;
  std::span<const Triangle> slots;
  std::span<const std::uint32_t> ids;
  TieRule tie;
  bool cull_back_faces;
  double lead;      // from the float32 ray's origin to the near plane, world units
  double position;  // of the best hit so far
  std::uint32_t rank;
};

// How far Embree has to look for hits up to `distance` behind the near plane.
float search_end(double lead, double distance) {
  return static_cast<float>((1 + kRaySlack) * (lead + distance) + lead);
}

// Called by Embree for each hit, with the hit's distance in the ray's tfar. A hit that is accepted shortens
// the ray to tfar; one that is not leaves it as it was.
void keep_nearest(const RTCFilterFunctionNArguments* arguments) {
  Query& query = *reinterpret_cast<Query*>(arguments->context);
  const std::uint32_t slot = RTCHitN_primID(arguments->hit, 1, 0);
  const Triangle& triangle = query.slots[slot];
  const double position = query.rays->position(triangle, *query.ray);
  if (!(position >= 0 && position < 1) ||
      (query.cull_back_faces && SampleRays::is_back_face(triangle, *query.ray))) {
    arguments->valid[0] = 0;
    return;
  }
  const std::uint32_t id = query.ids.empty() ? slot : query.ids[slot];
  const std::uint32_t rank = swap_rank(query.tie, static_cast<std::int64_t>(query.slots.size()), id);
  if (position < query.position || (position == query.position && rank < query.rank)) {
    query.position = position;
    query.rank = rank;
  }
  RTCRayN_tfar(arguments->ray, 1, 0) = search_end(query.lead, query.position * query.ray->length);
}

struct Failure {
  RTCError code = RTC_ERROR_NONE;
  std::string message;
};

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release>;
using Hierarchy = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;

Device new_device(const std::string& config) {
  Device device(rtcNewDevice(config.c_str()));
  if (!device)
    throw Error(
        fmt::format("Embree cannot be started: error {}", static_cast<int>(rtcGetDeviceError(nullptr))));
  return device;
}

std::uint32_t checked_count(std::span<const Triangle> slots) {
  constexpr std::uint32_t kMost =
      std::numeric_limits<std::uint32_t>::max() / 3;  // corners have 32-bit indices
  if (slots.size() > kMost)
    throw InputError({.field = "model"},
                     fmt::format("ray casting holds up to {} triangles, not {}", kMost, slots.size()));
  return static_cast<std::uint32_t>(slots.size());
}

}  // namespace

struct RayScene::Embree {
  std::span<const Triangle> slots;
  std::span<const std::uint32_t> ids;
  SampleRays rays;
  RaySceneOptions options;
  std::uint32_t count;
  Buffer<float> vertices;
  Buffer<std::uint32_t> indices;
  Failure failure;
  std::size_t allowed = 0;  // bytes of the hierarchy
  std::atomic<std::ptrdiff_t> used{0};
  Device device;
  Device unlimited;  // see lift_limit()
  Hierarchy hierarchy;

  Embree(std::span<const Triangle> all, std::span<const std::uint32_t> all_ids, const Camera& camera,
         const RaySceneOptions& wanted)
      : slots(all),
        ids(all_ids),
        rays(camera),
        options(wanted),
        count(checked_count(all)),
        vertices(all.size() * kCornerFloats + kPadding / sizeof(float), "the copy for Embree"),
        indices(all.size() * 3 + 1, "the indices for Embree") {  // + 1: Embree wants an array even if empty
    check_range(slots, rays);
    for (std::uint32_t i = 0; i < 3 * count; ++i) indices[i] = i;
    const bool is_limit = options.threads < static_cast<int>(std::thread::hardware_concurrency());
    device = new_device(is_limit ? fmt::format("threads={}", options.threads) : "");
    if (is_limit) lift_limit();
    rtcSetDeviceErrorFunction(device.get(), &Embree::take_note, this);
    rtcSetDeviceMemoryMonitorFunction(device.get(), &Embree::allow, this);
  }

  // Embree's threads are oneTBB's, and a device's "threads" limits those of the whole process, other loops'
  // as well, as long as no other device allows more. So there is another one except during builds.
  void lift_limit() { unlimited = new_device(""); }

  // The first error says what happened, later ones follow from it.
  static void take_note(void* self, RTCError code, const char* message) {
    Failure& failure = static_cast<Embree*>(self)->failure;
    if (failure.code == RTC_ERROR_NONE) failure = {code, message != nullptr ? message : ""};
  }

  // Embree turns a refusal into its out-of-memory error instead of being killed by the system.
  static bool allow(void* self, ssize_t bytes, bool /*after*/) {
    Embree& embree = *static_cast<Embree*>(self);
    const std::ptrdiff_t used = embree.used += bytes;
    return bytes <= 0 || used <= 0 || static_cast<std::size_t>(used) <= embree.allowed;
  }

  void check() const {
    if (failure.code == RTC_ERROR_NONE) return;
    if (failure.code == RTC_ERROR_OUT_OF_MEMORY)
      throw InputError(
          fmt::format("the ray-casting hierarchy of {} triangles does not fit into memory", count));
    throw Error(fmt::format("Embree: {} (error {})", failure.message, static_cast<int>(failure.code)));
  }
};

RayScene::RayScene(std::span<const Triangle> slots, std::span<const std::uint32_t> ids, const Camera& camera,
                   const RaySceneOptions& options)
    : embree_(std::make_unique<Embree>(slots, ids, camera, options)) {}
RayScene::~RayScene() = default;

void RayScene::copy(std::size_t first, std::size_t count, GeometryCounts& counts) {
  // Embree leaves out what is not finite, and a triangle that is left out must not shift the others.
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr Triangle kNothing{{kNan, kNan, kNan}, {kNan, kNan, kNan}, {kNan, kNan, kNan}};
  counts.triangles += static_cast<std::int64_t>(count);
  for (std::size_t slot = first; slot < first + count; ++slot) {
    const Triangle& triangle = embree_->slots[slot];
    std::int64_t& became = !is_finite(triangle)  ? counts.non_finite
                           : !has_area(triangle) ? counts.zero_area
                                                 : counts.drawn;
    ++became;
    std::memcpy(embree_->vertices.data() + slot * kCornerFloats,
                &became == &counts.drawn ? &triangle : &kNothing, sizeof triangle);
  }
}

void RayScene::build() {
  Embree& embree = *embree_;
  embree.hierarchy.reset();
  embree.failure = {};
  embree.allowed = std::min(embree.options.max_bytes, available_memory());
  const RTCDevice device = embree.device.get();
  const RTCBuildQuality quality =
      embree.options.fast_build ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM;

  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryBuildQuality(geometry, quality);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, embree.vertices.data(),
                             0, 3 * sizeof(float), std::size_t{3} * embree.count);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, embree.indices.data(), 0,
                             3 * sizeof(std::uint32_t), embree.count);
  rtcCommitGeometry(geometry);

  embree.hierarchy.reset(rtcNewScene(device));
  const RTCScene scene = embree.hierarchy.get();
  const auto robust = embree.options.robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE;
  rtcSetSceneFlags(scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION | robust));
  rtcSetSceneBuildQuality(scene, quality);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  const bool is_limit = embree.unlimited != nullptr;
  embree.unlimited.reset();
  rtcCommitScene(scene);
  if (is_limit) embree.lift_limit();
  embree.check();
}

RayHit RayScene::nearest(const SampleRay& ray) const {
  const Embree& embree = *embree_;
  const double lead = kRaySlack * embree.rays.near_extent();
  Query query{.context = {},
              .rays = &embree.rays,
              .ray = &ray,
              .slots = embree.slots,
              .ids = embree.ids,
              .tie = embree.options.tie,
              .cull_back_faces = embree.options.cull_back_faces,
              .lead = lead,
              .position = 1,
              .rank = std::numeric_limits<std::uint32_t>::max()};
  rtcInitIntersectContext(&query.context);
  query.context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  query.context.filter = keep_nearest;
  const auto rounded = [](double v) { return static_cast<float>(v); };
  const Vec3d start = ray.origin - lead * ray.direction;
  RTCRayHit hit{};
  hit.ray.org_x = rounded(start.x), hit.ray.org_y = rounded(start.y), hit.ray.org_z = rounded(start.z);
  hit.ray.dir_x = rounded(ray.direction.x), hit.ray.dir_y = rounded(ray.direction.y),
  hit.ray.dir_z = rounded(ray.direction.z);
  hit.ray.tfar = search_end(lead, ray.length);
  hit.ray.mask = ~0u;
  hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(embree.hierarchy.get(), &query.context, &hit);
  if (query.rank == std::numeric_limits<std::uint32_t>::max()) return {};
  const std::uint32_t id = swap_rank(query.tie, static_cast<std::int64_t>(query.slots.size()), query.rank);
  return {static_cast<std::int32_t>(id), query.position};
}

const SampleRays& RayScene::rays() const { return embree_->rays; }

std::size_t RayScene::bytes() const {
  return embree_->vertices.bytes() + embree_->indices.bytes() +
         static_cast<std::size_t>(std::max<std::ptrdiff_t>(embree_->used, 0));
}

bool has_embree() { return true; }

std::string embree_version() { return RTC_VERSION_STRING; }

}  // namespace rasterbench
