// Gaps and overlaps: modes with exact edges have none, and the counts see those of others.
#include "extremes/watertight.h"

#include <gtest/gtest.h>

#include "extremes/meshes.h"
#include "extremes/run.h"

namespace rasterbench::extremes {
namespace {

std::vector<std::string_view> all_modes() {
  std::vector<std::string_view> modes;
  for (const ModeInfo& info : mode_infos())
    if (info.unavailable.empty() && info.has_screen_triangles) modes.push_back(info.name);
  return modes;
}

std::vector<WatertightCount> counted(const std::vector<ScreenCorners>& mesh, int width, int height,
                                     const std::vector<std::string_view>& modes = all_modes()) {
  return count_gaps_and_overlaps(screen_scene(mesh, width, height), modes, 2);
}

TEST(Watertight, ModesWithExactEdgesAreSo) {
  const std::vector<std::vector<ScreenCorners>> meshes{
      fan(2000, 1, kFlatW, 0, 32, 32),
      fan(1000, 10000, kFlatW, 0.1, 32, 32),  // cut by the guard band
      fan(1000, 4, 0.5, 0.1, 32, 32),         // cut by the near plane
      lattice(3, 64, 64),
      jittered_plane(4000, 0.3, 0, 1, 64, 64),
      jittered_plane(500, 0.25, 2, 1, 64, 64),
      refined_plane(0.5, 0.05, 64, 64)};
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const int side = i < 3 ? 32 : 64;
    int exact = 0;
    for (const WatertightCount& count : counted(meshes[i], side, side))
      if (is_watertight_by_construction(*find_mode(count.mode))) {
        ++exact;
        EXPECT_EQ(count.gaps + count.overlaps, 0) << count.mode << ", mesh " << i;
      }
    EXPECT_GE(exact, 10);
  }
}

TEST(Watertight, GapsAndOverlapsAreSeen) {
  auto mesh = lattice(4, 64, 64);
  const auto all = counted(mesh, 64, 64, {"f32", "f64", "exact"});
  for (const WatertightCount& count : all) EXPECT_EQ(count.gaps + count.overlaps, 0);

  // One triangle less, and one twice. Of a square of 4 px, the half that owns the diagonal has 10 samples.
  mesh.erase(mesh.begin() + 100);
  mesh.push_back(mesh[200]);
  for (const WatertightCount& count : counted(mesh, 64, 64, {"f32", "f64", "exact"})) {
    EXPECT_TRUE(count.gaps == 6 || count.gaps == 10) << count.gaps;
    EXPECT_TRUE(count.overlaps == 6 || count.overlaps == 10) << count.overlaps;
  }
}

TEST(Watertight, TheLiteralProgramOverlapsOnSamples) {
  // It knows the closed rule only: on a lattice of samples each of its edges is drawn twice.
  EXPECT_FALSE(is_watertight_by_construction(*find_mode("two_product")));
  const auto count = counted(lattice(4, 64, 64), 64, 64, {"two_product"}).at(0);
  EXPECT_EQ(count.gaps, 0);
  EXPECT_GT(count.overlaps, 1000);
}

TEST(Watertight, NamedModesMustBeSoToo) {
  Must must;
  EXPECT_FALSE(must_be_watertight(must, "exact"));
  must.watertight = {"f32"};
  EXPECT_TRUE(must_be_watertight(must, "f32"));
  EXPECT_TRUE(must_be_watertight(must, "fixed_8"));
  EXPECT_FALSE(must_be_watertight(must, "f64"));
}

TEST(Watertight, AGapIsWrongWhereNoneMayBe) {
  // Half of the image is bare.
  const auto cases = read_catalogue(
      "[[case]]\nnumber = 46\nname = \"half\"\nscreen = [[-1,-1,2, 65,-1,2, -1,65,2]]\n"
      "must = { watertight = [\"f32\"] }",
      "c.toml");
  const std::vector<std::string_view> modes{"f32", "f64", "exact"};
  const CaseResult result = run_case(cases.at(0), modes, "tile_parallel", Part::kWatertight, 1);
  ASSERT_EQ(result.watertight.size(), 3u);
  EXPECT_GT(result.watertight[0].gaps, 1900);
  EXPECT_EQ(result.findings[0].verdict, Verdict::kWrong);
  EXPECT_EQ(result.findings[1].verdict, Verdict::kReported);
  EXPECT_EQ(result.findings[2].verdict, Verdict::kWrong);
}

}  // namespace
}  // namespace rasterbench::extremes
