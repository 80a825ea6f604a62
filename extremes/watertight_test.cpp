// Gaps and overlaps are counted, and modes of exact edges have none.
#include "extremes/watertight.h"

#include <gtest/gtest.h>

#include <array>

#include "extremes/constructions.h"

namespace rasterbench::extremes {
namespace {

constexpr std::array<std::string_view, 4> kModes{"f32", "fixed_8", "filtered", "two_product"};

/// A wall of two triangles far larger than the image; without the second one, half of it is open.
Scene wall(bool whole) {
  Scene scene;
  scene.model.triangles = {{{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}}, {{-9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}};
  if (!whole) scene.model.triangles.pop_back();
  scene.parameters.camera = {0, 0, 3};
  scene.parameters.near_plane = 1;
  scene.parameters.far_plane = 10;
  scene.parameters.width = scene.parameters.height = 32;
  return scene;
}

TEST(Watertight, AWholeWallHasNoGap) {
  for (const WatertightCount& count : count_gaps_and_overlaps(wall(true), kModes, 2)) {
    EXPECT_EQ(count.gaps, 0) << count.mode;
    if (count.mode == "two_product") {
      EXPECT_EQ(count.overlaps, 32);  // it knows the closed rule only: the diagonal belongs to both
    } else {
      EXPECT_EQ(count.overlaps, 0) << count.mode;
    }
  }
}

TEST(Watertight, HalfAWallIsHalfAGap) {
  for (const WatertightCount& count : count_gaps_and_overlaps(wall(false), kModes, 2)) {
    EXPECT_GE(count.gaps, 32 * 31 / 2) << count.mode;
    EXPECT_LE(count.gaps, 32 * 33 / 2) << count.mode;
  }
}

TEST(Watertight, IsPromisedWhereEdgesAreExact) {
  EXPECT_TRUE(is_watertight_by_construction(*find_mode("fixed_4")));
  EXPECT_TRUE(is_watertight_by_construction(*find_mode("filtered-unorm16")));
  EXPECT_FALSE(is_watertight_by_construction(*find_mode("two_product")));
}

}  // namespace
}  // namespace rasterbench::extremes
