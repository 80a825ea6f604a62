// In the place of embree.cpp where Embree was not found: says so.
#include "base/error.h"
#include "reference/embree.h"
#include "reference/ray_scene.h"

namespace rasterbench {

struct RayScene::Embree {};

namespace {
[[noreturn]] void refuse() { throw InputError({.field = "--embree"}, embree_version()); }
}  // namespace

RayScene::RayScene(std::span<const Triangle>, std::span<const std::uint32_t>, const Camera&,
                   const RaySceneOptions&) {
  refuse();
}
RayScene::~RayScene() = default;
void RayScene::copy(std::size_t, std::size_t, GeometryCounts&) { refuse(); }
void RayScene::build() { refuse(); }
RayHit RayScene::nearest(const SampleRay&) const { refuse(); }
const SampleRays& RayScene::rays() const { refuse(); }
std::size_t RayScene::bytes() const { refuse(); }

bool has_embree() { return false; }

std::string embree_version() { return "Embree was not found at build time"; }

}  // namespace rasterbench
