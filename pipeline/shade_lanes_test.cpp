// Vectorised shading equals the scalar one to the bit, on every instruction set of this CPU.
#include "pipeline/shade_lanes.h"

#include <gtest/gtest.h>

#include <vector>

#include "pipeline/resolve.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

std::vector<Triangle> triangles_of_every_shade() {
  Random random(5);
  std::vector<Triangle> triangles;
  for (int i = 0; i < 501; ++i) {
    const double size = i % 5 == 0 ? 1e-30 : i % 5 == 1 ? 1e30 : 1;
    const auto point = [&] {
      return Vec3{static_cast<float>(random.uniform(-size, size)),
                  static_cast<float>(random.uniform(-size, size)),
                  static_cast<float>(random.uniform(-size, size))};
    };
    triangles.push_back({point(), point(), point()});
  }
  triangles.push_back({{1, 1, 1}, {1, 1, 1}, {2, 3, 4}});            // no normal
  triangles.push_back({{0, 0, 0}, {1, -1, 0}, {0, 1, -1}});          // along the light
  triangles.push_back({{0, 0, 0}, {1e-45f, 0, 0}, {0, 1e-45f, 0}});  // a normal that vanishes in float32
  return triangles;
}

TEST(ShadeLanes, AreTheScalarShadingToTheBit) {
  const auto triangles = triangles_of_every_shade();
  const Rgb colour{255, 1, 140};
  for (const std::size_t n : {triangles.size(), std::size_t{0}, std::size_t{1}, std::size_t{9}}) {
    std::vector<std::uint32_t> ids(n), expected(n);
    for (std::size_t i = 0; i < n; ++i) {
      ids[i] = static_cast<std::uint32_t>(triangles.size() - 1 - i);
      expected[i] = shade_flat(triangles[ids[i]], colour);
    }
    for (const Isa isa : all_isas()) {
      if (!is_supported(isa)) continue;
      std::vector<std::uint32_t> shaded(n + 1, 77);
      shade_in_lanes(triangles, ids, colour, shaded.data(), isa);
      EXPECT_EQ(shaded.back(), 77u) << "written beyond the end";
      shaded.pop_back();
      EXPECT_EQ(shaded, expected) << to_string(isa);
    }
  }
}

}  // namespace
}  // namespace rasterbench
