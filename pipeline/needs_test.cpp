// What a scene needs: whatever fires in the general stage is needed, and leaving out the rest changes no bit.
#include "pipeline/needs.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <filesystem>
#include <limits>

#include "kernels/kernel.h"
#include "pipeline/corner.h"
#include "pipeline/frame.h"
#include "pipeline/geometry_testing.h"

namespace rasterbench {
namespace {

/// With these left out, a test that should fire does not.
constexpr SceneNeeds kNothing{false, false, false, false, false, false, false};

/// Of the coordinates and the ids alone: a triangle in double ends in bytes that mean nothing.
template <class Real>
void expect_same_bits(const std::vector<ScreenTriangle<Real>>& a,
                      const std::vector<ScreenTriangle<Real>>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    ASSERT_EQ(std::memcmp(&a[i], &b[i], offsetof(ScreenTriangle<Real>, id) + sizeof(a[i].id)), 0) << i;
}

/// Everything on and the needs alone give the same slots, extra pieces and counts, to the bit.
template <class Real>
void expect_same_result(const std::vector<Triangle>& triangles, const Camera& camera, GeometryOptions options,
                        const SceneNeeds& needs, DepthFunction function = DepthFunction::kNdc) {
  const auto run = [&](const SceneNeeds& made) {
    options.needs = made;
    GeometryResult<Real> result;
    result.slots.resize(triangles.size());
    transform_triangles<Real>(triangles, 0, make_screen_transform(camera, function), options,
                              result.slots.data(), result.extra, result.counts);
    return result;
  };
  const auto full = run({}), minimal = run(needs);
  expect_same_bits(full.slots, minimal.slots);
  expect_same_bits(full.extra, minimal.extra);
  EXPECT_EQ(std::memcmp(&full.counts, &minimal.counts, sizeof(GeometryCounts)), 0);
}

NeedsAnalysis analyse(const std::vector<Triangle>& triangles, const Camera& camera,
                      NearRule near_rule = NearRule::kClip, DepthFunction function = DepthFunction::kNdc) {
  return analyse_needs(triangles, make_screen_transform(camera, function), near_rule);
}

/// A cloud of triangles: `spread` about the origin, each of about `size`, seldom with a flaw.
std::vector<Triangle> random_cloud(Random& random, double spread, double size) {
  std::vector<Triangle> triangles;
  const auto near = [&](const Vec3& centre) {
    const auto moved = [&](float c) { return static_cast<float>(c + random.uniform(-size, size)); };
    const float x = moved(centre.x), y = moved(centre.y), z = moved(centre.z);
    return Vec3{x, y, z};
  };
  for (int i = 0; i < 40; ++i) {
    const auto somewhere = [&] { return static_cast<float>(random.uniform(-spread, spread)); };
    const float x = somewhere(), y = somewhere(), z = somewhere();
    const Vec3 centre{x, y, z}, a = near(centre), b = near(centre), c = near(centre);
    triangles.push_back({a, b, c});
  }
  if (random.uniform() < 0.1) triangles[3].b.y = std::numeric_limits<float>::quiet_NaN();
  if (random.uniform() < 0.1) triangles[5].c = triangles[5].a;
  return triangles;
}

TEST(Needs, ConservativeForRandomCamerasAndScenes) {
  // What the general stage counts must be needed, for every way in which a scene can lie about a camera.
  Random random(2);
  SceneNeeds ever{kNothing}, ever_left_out{kNothing};
  for (int trial = 0; trial < 3000; ++trial) {
    const auto triangles =
        random_cloud(random, std::pow(10, random.uniform(-1, 1.5)), std::pow(10, random.uniform(-2, 1)));
    const Vec3d position{random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)};
    const double near = std::pow(10, random.uniform(-3, 0.5)),
                 far = near + std::pow(10, random.uniform(-1, 2));
    const double theta =
        trial % 7 == 0 ? 1e-4 : random.uniform(0.1, 2.9);  // a telephoto reaches the guard band
    const Camera camera = trial % 5 == 0 ? orthographic_at_origin(position, 1, near, far, {64, 48})
                                         : look_at_origin(position, theta, near, far, {64, 48});
    const GeometryOptions options{trial % 3 == 0 ? NearRule::kOff : NearRule::kClip, trial % 2 == 0};
    const NeedsAnalysis analysis = analyse(triangles, camera, options.near_rule);
    const SceneNeeds& needs = analysis.needs;
    const auto full = run_geometry<double>(triangles, options, camera).counts;

    EXPECT_EQ(needs.finite_test, full.non_finite > 0);
    EXPECT_EQ(needs.zero_area_test, full.zero_area > 0);
    EXPECT_TRUE(needs.near_clip || full.near_clipped == 0);
    EXPECT_TRUE(needs.near_clip || needs.behind_reject || full.behind_near == 0);
    EXPECT_TRUE(needs.far_reject || full.beyond_far == 0);
    EXPECT_TRUE(needs.guard_clip || full.guard_clipped == 0);
    EXPECT_TRUE(needs.off_screen_reject || full.off_screen == 0);
    EXPECT_TRUE(options.near_rule == NearRule::kClip || !needs.near_clip);
    expect_same_result<float>(triangles, camera, options, needs);
    expect_same_result<double>(triangles, camera, options, needs);
    if (HasFatalFailure() || HasNonfatalFailure())
      FAIL() << "trial " << trial << "\n" << to_string(explain_needs(analysis, camera));

    for (bool SceneNeeds::*test :
         {&SceneNeeds::finite_test, &SceneNeeds::zero_area_test, &SceneNeeds::near_clip,
          &SceneNeeds::behind_reject, &SceneNeeds::far_reject, &SceneNeeds::guard_clip,
          &SceneNeeds::off_screen_reject}) {
      ever.*test |= needs.*test;
      ever_left_out.*test |= !(needs.*test);
    }
  }
  EXPECT_EQ(ever, SceneNeeds{});  // otherwise the trials say nothing of some test
  EXPECT_EQ(ever_left_out, SceneNeeds{});
}

TEST(Needs, EveryTestIsFoundByItself) {
  // plain_camera: near 1, far 9, 90 degrees, 8 x 8 px.
  const Triangle harmless{{-1, -1, -2}, {1, -1, -2}, {0, 1, -4}};
  const float nan = std::numeric_limits<float>::quiet_NaN();
  struct Case {
    Triangle triangle;
    SceneNeeds needs;
    NearRule near_rule = NearRule::kClip;
  };
  SceneNeeds after_near{}, of_near{kNothing}, of_finite{kNothing}, of_area{kNothing}, of_behind{kNothing},
      of_far{kNothing}, of_guard{kNothing}, of_screen{kNothing};
  after_near.finite_test = after_near.zero_area_test = false;
  of_near.near_clip = true;
  of_finite.finite_test = true;
  of_area.zero_area_test = true;
  of_behind.behind_reject = true;
  of_far.far_reject = true;
  of_guard.guard_clip = of_guard.off_screen_reject = true;
  of_screen.off_screen_reject = true;
  const Case cases[] = {
      {harmless, kNothing},
      {{{nan, -1, -2}, {1, -1, -2}, {0, 1, -4}}, of_finite},
      {{{1, -1, -2}, {1, -1, -2}, {0, 1, -4}}, of_area},
      {{{-1, -1, -0.5f}, {1, -1, -2}, {0, 1, -4}}, after_near},
      {{{-1, -1, -0.5f}, {1, -1, 2}, {0, 1, -0.9f}}, of_near},
      {{{-1, -1, -0.5f}, {1, -1, -2}, {0, 1, -4}}, kNothing, NearRule::kOff},  // drawn as it is
      {{{-1, -1, 1}, {1, -1, -2}, {0, 1, -4}}, of_behind, NearRule::kOff},
      {{{-1, -1, -9}, {1, -1, -10}, {0, 1, -11}}, of_far},
      {{{-1, -1, -2}, {1, -1, -10}, {0, 1, -11}}, kNothing},  // one corner before the far plane
      {{{-1e6f, -1, -2}, {1, -1, -2}, {0, 1, -4}}, of_guard},
      {{{-9, -1, -2}, {-8, -1, -2}, {-9, 1, -2}}, of_screen},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(&c - cases);
    const std::vector<Triangle> triangles{harmless, c.triangle, harmless};
    const Camera camera = plain_camera(kSide, kSide);
    EXPECT_EQ(analyse(triangles, camera, c.near_rule).needs, c.needs);
    expect_same_result<float>(triangles, camera, {.near_rule = c.near_rule}, c.needs);
  }
}

TEST(Needs, TheStageObeysThem) {
  // What is left out really is: otherwise there would be nothing to gain, and nothing to prove.
  const Triangle beyond_far{{-1, -1, -9}, {1, -1, -10}, {0, 1, -11}};
  const Triangle off_screen{{-9, -1, -2}, {-8, -1, -2}, {-9, 1, -2}};
  const Triangle no_area{{1, -1, -2}, {1, -1, -2}, {0, 1, -4}};
  const Triangle not_finite{{std::numeric_limits<float>::infinity(), -1, -2}, {1, -1, -2}, {0, 1, -4}};
  for (const Triangle& t : {beyond_far, off_screen, no_area, not_finite}) {
    EXPECT_EQ(run_geometry({t}).counts.drawn, 0);
    EXPECT_EQ(run_geometry({t}, {.needs = kNothing}).counts.drawn, 1);
  }
  const Triangle crossing{{-1, -1, -0.5f}, {1, -1, -2}, {0, 1, -4}};
  EXPECT_EQ(run_geometry({crossing}).counts.near_clipped, 1);
  EXPECT_EQ(run_geometry({crossing}, {.needs = kNothing}).counts.near_clipped, 0);
  const Triangle huge{{-1e6f, -1, -2}, {1e6f, -1, -2}, {0, 1e6f, -2}};
  EXPECT_EQ(run_geometry({huge}).counts.guard_clipped, 1);
  EXPECT_EQ(run_geometry({huge}, {.needs = kNothing}).counts.guard_clipped, 0);
}

TEST(Needs, NothingIsNeededOfNothing) {
  const NeedsAnalysis analysis = analyse({}, plain_camera(kSide, kSide));
  EXPECT_EQ(analysis.needs, kNothing);
  for (const NeedStatement& s : explain_needs(analysis, plain_camera(kSide, kSide))) {
    EXPECT_FALSE(s.kept);
    EXPECT_EQ(s.reason.find("inf"), std::string::npos) << s.reason;
  }
}

TEST(Needs, AreExplainedWithNumbers) {
  // Camera at (0, 0, 4), near 1.5, far 6: world z = 2 lies 0.5 behind the near plane, z = -1 1 before the far
  // one.
  const Camera camera = look_at_origin({0, 0, 4}, 1.2, 1.5, 6, {64, 48});
  const Triangle t{{0, 0, 2}, {0.25f, 0, -1}, {0, 0.25f, 0}};
  const auto lines = [&](const std::vector<Triangle>& triangles, NearRule rule = NearRule::kClip) {
    return to_string(explain_needs(analyse(triangles, camera, rule), camera));
  };
  const std::string text = lines({t});
  for (const char* words : {"near clip: left out, the nearest corner is 0.5 behind the near plane\n",
                            "far rejection: left out, the farthest corner is 1 before the far plane\n",
                            "off-screen rejection: left out, no triangle misses the image\n"})
    EXPECT_NE(text.find(words), std::string::npos) << words << "is not in\n" << text;
  const Triangle cut{{0, 0, 3}, {1, 0, -1}, {0, 1, -1}};
  EXPECT_NE(lines({t, cut}).find("near clip: kept, 1 triangle lies across the near plane, 0 before it\n"),
            std::string::npos);
  EXPECT_NE(lines({t, cut, cut}).find("near clip: kept, 2 triangles lie "), std::string::npos);
  EXPECT_NE(lines({t, cut}, NearRule::kOff).find("near clip: left out, switched off"), std::string::npos);
}

/// Both near rules, both formats, every depth function.
void expect_same_result_on(const Scene& scene) {
  const Camera camera = make_camera(scene.parameters);
  for (const NearRule near_rule : {NearRule::kClip, NearRule::kOff})
    for (const DepthFunction function :
         {DepthFunction::kNdc, DepthFunction::kReversed, DepthFunction::kInverseW}) {
      const SceneNeeds needs = analyse(scene.model.triangles, camera, near_rule, function).needs;
      expect_same_result<float>(scene.model.triangles, camera, {.near_rule = near_rule}, needs, function);
      expect_same_result<double>(scene.model.triangles, camera, {.near_rule = near_rule}, needs, function);
    }
}

TEST(Needs, AreEnoughForGeneratedScenes) {
  for (const Generator& generator : generators()) {
    SCOPED_TRACE(generator.name);
    expect_same_result_on(open_scene(generator.name + ":triangles=4000", ""));
  }
}

TEST(Needs, AreEnoughForRealScenes) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(__FILE__).parent_path().parent_path().parent_path() / "shared/scenes";
  if (!fs::exists(folder)) GTEST_SKIP() << "no folder ../shared/scenes beside the project";
  int scenes = 0;
  for (const char* name : {"dungeon/dungeon", "ldraw_racer/ldraw_racer", "spot/spot", "teapot/teapot"}) {
    const std::string base = (folder / name).string();
    if (!fs::exists(base + ".dat") || !fs::exists(base + ".txt")) continue;
    SCOPED_TRACE(name);
    expect_same_result_on(open_scene(base + ".dat", base + ".txt"));
    ++scenes;
  }
  EXPECT_GT(scenes, 0);
}

TEST(Needs, FramesAreTheSameWithAndWithoutThem) {
  for (const char* model :
       {"teapot:triangles=300", "terrain:triangles=2000", "confetti:triangles=300,size=40"}) {
    const Scene scene = open_scene(model, "");
    for (const char* mode : {"f32", "f64", "filtered-inverse_w"}) {
      FrameSettings settings{.width = 96, .height = 64};
      const auto minimal = make_renderer("row_parallel", mode, {&scene, settings, {}});
      settings.generality = Generality::kFull;
      const auto full = make_renderer("row_parallel", mode, {&scene, settings, {}});
      const GeometryCounts counts = minimal->draw().counts;
      EXPECT_EQ(std::memcmp(&counts, &full->draw().counts, sizeof(counts)), 0);
      EXPECT_EQ(minimal->ids(), full->ids());
      EXPECT_TRUE(std::equal(minimal->depths().begin(), minimal->depths().end(), full->depths().begin()));
    }
  }
}

}  // namespace
}  // namespace rasterbench
