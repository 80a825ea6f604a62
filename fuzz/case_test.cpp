// Cases: what the generators reach, what shrinking does, and how a case is written down.
#include "fuzz/case.h"

#include <gtest/gtest.h>

#include <cstring>

#include "fuzz/exact_arithmetic.h"
#include "fuzz/generate.h"
#include "fuzz/relation.h"
#include "fuzz/shrink.h"
#include "pipeline/geometry.h"
#include "scene/dat.h"
#include "scene/test_folder.h"

namespace rasterbench::fuzz {
namespace {

bool same(const FuzzCase& a, const FuzzCase& b) {
  return a.parameters.width == b.parameters.width && a.parameters.theta == b.parameters.theta &&
         a.seed == b.seed && a.triangles.size() == b.triangles.size() &&
         std::memcmp(a.triangles.data(), b.triangles.data(), a.triangles.size() * sizeof(Triangle)) == 0;
}

TEST(Generator, CasesFollowFromSeedAndNumber) {
  for (const Space space : {Space::kScreen, Space::kWorld})
    for (int i = 0; i < 20; ++i) {
      const FuzzCase once = make_case(5, i, space);
      EXPECT_TRUE(same(once, make_case(5, i, space)));
      EXPECT_FALSE(same(once, make_case(5, i + 1, space)));
      EXPECT_FALSE(same(once, make_case(6, i, space)));
    }
}

TEST(Generator, ScreenCasesAreWithinTheGuardBandAndReachWhatIsHard) {
  int on_edges = 0, tied = 0, slivers = 0, denormals = 0, far = 0, top_left = 0, wide = 0;
  const Subject& exact = find_subject("exact");
  for (int i = 0; i < 400; ++i) {
    const FuzzCase c = make_case(1, i, Space::kScreen);
    bool is_far = false, is_denormal = false, is_sliver = false;
    for (const auto& t : screen_input(c).triangles) {
      for (int k = 0; k < 3; ++k)
        for (const float v : {t.x[k], t.y[k]}) {
          ASSERT_LE(std::abs(v), kGuardBand);
          is_far = is_far || std::abs(v) > 1e4f;
          is_denormal = is_denormal || (v != 0 && std::abs(v) < std::numeric_limits<float>::min());
        }
      const double area2 = (double{t.x[1]} - t.x[0]) * (double{t.y[2]} - t.y[0]) -
                           (double{t.y[1]} - t.y[0]) * (double{t.x[2]} - t.x[0]);
      const double length = std::hypot(double{t.x[1]} - t.x[0], double{t.y[1]} - t.y[0]);
      is_sliver = is_sliver || (area2 != 0 && std::abs(area2) < 1e-3 * length);
    }
    const ScreenPicture picture = exact.draw(screen_input(c));
    ScreenInput other = screen_input(c);
    other.fill = c.fill == FillRule::kClosed ? FillRule::kTopLeft : FillRule::kClosed;
    on_edges += picture.counts != exact.draw(other).counts;
    tied += std::find(picture.tied.begin(), picture.tied.end(), true) != picture.tied.end();
    far += is_far;
    denormals += is_denormal;
    slivers += is_sliver;
    top_left += c.fill == FillRule::kTopLeft;
    wide += c.parameters.width > 64;
  }
  EXPECT_GT(on_edges, 80);
  EXPECT_GT(tied, 40);
  EXPECT_GT(slivers, 80);
  EXPECT_GT(denormals, 40);
  EXPECT_GT(far, 80);
  EXPECT_GT(top_left, 100);
  EXPECT_GT(wide, 5);
}

TEST(Generator, WorldCasesAreScenesAndReachTheClipping) {
  GeometryCounts counts;
  for (int i = 0; i < 300; ++i) {
    const FuzzCase c = make_case(1, i, Space::kWorld);
    const Scene scene = scene_of(c);  // throws where the camera is none
    std::vector<ScreenTriangle<float>> slots(scene.model.triangles.size()), extra;
    transform_triangles<float>(scene.model.triangles, 0,
                               make_screen_transform(sized_camera(scene, settings_of(c))),
                               settings_of(c).geometry, slots.data(), extra, counts);
  }
  EXPECT_GT(counts.drawn, 2000);
  EXPECT_GT(counts.near_clipped, 100);
  EXPECT_GT(counts.guard_clipped, 50);
  EXPECT_GT(counts.behind_near, 100);
  EXPECT_GT(counts.beyond_far, 20);
  EXPECT_GT(counts.zero_area, 20);
  EXPECT_GT(counts.non_finite, 2);
}

TEST(ExactArithmetic, SaysWhatIsRounded) {
  EXPECT_EQ(exact_sum(0.5f, 3), 3.5f);
  EXPECT_EQ(exact_sum(0x1p-30f, 1), std::nullopt);
  EXPECT_EQ(exact_sum(0x1p24f, 1), std::nullopt);
  EXPECT_EQ(exact_sum(0x1p24f, 2), 0x1p24f + 2);
  EXPECT_EQ(exact_midpoint(1, 2), 1.5f);
  EXPECT_EQ(exact_midpoint(0x1p-149f, 0), std::nullopt);
  EXPECT_EQ(exact_midpoint(1, std::nextafter(1.0f, 2.0f)), std::nullopt);
}

FuzzCase many_triangles() {
  FuzzCase c;
  for (int i = 0; i < 13; ++i) {
    const auto v = static_cast<float>(i) * 0.7f;
    c.triangles.push_back({{v, 1.1f, 0.3f}, {v + 2, 5.3f, 0.2f}, {3.7f, v * 2, 0.1f}});
  }
  c.parameters.width = 37;
  c.seed = 555;
  c.fill = FillRule::kTopLeft;
  return c;
}

TEST(Shrink, KeepsWhatMattersAndNothingElse) {
  const auto fails = [](const FuzzCase& c) {
    return std::any_of(c.triangles.begin(), c.triangles.end(),
                       [](const Triangle& t) { return t.a.x > 4.3f && t.c.y > 2; });
  };
  const FuzzCase minimal = shrink(many_triangles(), fails, 2000);
  ASSERT_EQ(minimal.triangles.size(), 1u);
  const Triangle& t = minimal.triangles[0];
  EXPECT_TRUE(fails(minimal));
  EXPECT_LE(complexity(t.a.x), complexity(6));
  EXPECT_LE(complexity(t.c.y), complexity(3));
  for (const float v : {t.a.y, t.a.z, t.b.x, t.b.y, t.b.z, t.c.x, t.c.z}) EXPECT_EQ(v, 0);
  EXPECT_EQ(minimal.parameters.width, 1);
  EXPECT_EQ(minimal.parameters.height, 1);
  EXPECT_EQ(minimal.seed, 0u);
  EXPECT_EQ(minimal.fill, FillRule::kClosed);
}

TEST(Shrink, KeepsPairsThatAreApart) {
  const FuzzCase minimal = shrink(
      many_triangles(),
      [](const FuzzCase& c) {
        int low = 0, high = 0;
        for (const Triangle& t : c.triangles) {
          low += t.a.x < 0.5f;
          high += t.a.x > 8;
        }
        return low > 0 && high > 0;
      },
      2000);
  EXPECT_EQ(minimal.triangles.size(), 2u);
}

TEST(Shrink, AsksNoMoreThanItMay) {
  int questions = 0;
  shrink(
      many_triangles(), [&](const FuzzCase&) { return ++questions, true; }, 17);
  EXPECT_LE(questions, 17);
}

TEST(Shrink, SimplerNumbersAreLessComplex) {
  const std::vector<double> ascending{0, 1, 2, 3, 3.25, 3.3};
  for (std::size_t i = 1; i < ascending.size(); ++i)
    EXPECT_LT(complexity(ascending[i - 1]), complexity(ascending[i])) << ascending[i];
  EXPECT_LT(complexity(2), complexity(-2));
  EXPECT_LT(complexity(0.5), complexity(0x1p-100));
  EXPECT_GT(complexity(std::numeric_limits<double>::quiet_NaN()), complexity(0.1));
}

TEST(AsTest, IsSourceTextOfTheSameCase) {
  FuzzCase c;
  c.parameters.width = 3;
  c.parameters.height = 2;
  c.fill = FillRule::kTopLeft;
  c.seed = 9;
  c.triangles = {{{0.5f, -0.0f, 0x1p-149f}, {1, 2, 3}, {0.1f, 0, 0}}};
  EXPECT_EQ(as_test(c, "Name", "turn", "f32", {}),
            "TEST(Fuzz, Name) {\n"
            "  const FuzzCase fuzz_case{\n"
            "      .space = Space::kScreen,\n"
            "      .parameters = {.height = 2, .width = 3},\n"
            "      .fill = FillRule::kTopLeft,\n"
            "      .seed = 9u,\n"
            "      .triangles = {{{0x1p-1f, -0x0p+0f, 0x1p-149f}, {0x1p+0f, 0x1p+1f, 0x1.8p+1f}, "
            "{0x1.99999ap-4f, 0x0p+0f, 0x0p+0f}}}};\n"
            "  EXPECT_EQ(violation(\"turn\", \"f32\", fuzz_case), \"\");\n"
            "}\n");
}

// As as_test() prints them: this has to compile, and to hold.
TEST(Fuzz, PrintedOnTheScreen) {
  const FuzzCase fuzz_case{.space = Space::kScreen,
                           .parameters = {.height = 2, .width = 3},
                           .fill = FillRule::kTopLeft,
                           .seed = 9u,
                           .triangles = {{{0x1p-1f, -0x0p+0f, 0x1p-149f},
                                          {0x1p+0f, 0x1p+1f, 0x1.8p+1f},
                                          {0x1.99999ap-4f, 0x0p+0f, 0x0p+0f}}}};
  EXPECT_EQ(violation("turn", "f32", fuzz_case), "");
}

TEST(Fuzz, PrintedInTheWorld) {
  const FuzzCase fuzz_case{
      .space = Space::kWorld,
      .parameters = {.camera = {0x0p+0, 0x0p+0, 0x1p+1},
                     .height = 4,
                     .width = 4,
                     .theta = 0x1p+0,
                     .near_plane = 0x1p-1,
                     .far_plane = 0x1p+3},
      .near_rule = NearRule::kOff,
      .seed = 0u,
      .triangles = {
          {{-0x1p+0f, -0x1p+0f, 0x0p+0f},
           {0x1p+0f, -0x1p+0f, 0x0p+0f},
           {std::numeric_limits<float>::quiet_NaN(), 0x1p+0f, 0x0p+0f}},
          {{-0x1p+0f, -0x1p+0f, 0x0p+0f}, {0x1p+0f, -0x1p+0f, 0x0p+0f}, {0x0p+0f, 0x1p+0f, 0x0p+0f}}}};
  EXPECT_EQ(violation("kernels", "f32", fuzz_case, {"tile_parallel", "scanline"}), "");
  EXPECT_NE(violation("kernels", "f32", fuzz_case, {"null"}), "");
}

TEST(WritePair, IsTheSceneOfTheCase) {
  const TestFolder folder;
  FuzzCase c;
  c.parameters.width = c.parameters.height = 8;
  c.triangles = {{{0.5f, 0.5f, -1}, {7.5f, 0.25f, -1}, {3, 6, -1}}};
  EXPECT_TRUE(write_pair(c, folder / "exact"));
  const Scene scene = open_scene((folder / "exact.dat").string(), (folder / "exact.txt").string());
  EXPECT_EQ(scene.parameters.width, 8);
  std::vector<ScreenTriangle<float>> slots(1), extra;
  GeometryCounts counts;
  transform_triangles<float>(scene.model.triangles, 0, make_screen_transform(make_camera(scene.parameters)),
                             {}, slots.data(), extra, counts);
  EXPECT_EQ(slots[0].x[0], 0.5f);
  EXPECT_EQ(slots[0].y[2], 6);
  EXPECT_EQ(slots[0].d[1], -1);

  c.triangles[0].a = {0.1f, 0.3f, 0.123f};
  EXPECT_FALSE(write_pair(c, folder / "nearly"));
  c.space = Space::kWorld;
  EXPECT_TRUE(write_pair(c, folder / "world"));
  EXPECT_EQ(read_dat(folder / "world.dat").triangles[0].a.z, 0.123f);
}

}  // namespace
}  // namespace rasterbench::fuzz
