// That a mode suffices is a proof: what its pictures get wrong never exceeds what was predicted, on scenes
// that are kind and on scenes that are not.
#include "advice/sufficiency.h"

#include <gtest/gtest.h>

#include "advice/measure.h"
#include "advice/recommendation.h"

namespace rasterbench {
namespace {

constexpr int kThreads = 2;

std::vector<ModeVerdict> verdicts_of(const Scene& scene, const FrameSettings& settings,
                                     const Tolerance& tolerance) {
  Judge judge(scene, settings, kThreads);
  return judge_modes(judge, tolerance, kThreads, [](double, std::string_view) {});
}

const ModeVerdict& of(const std::vector<ModeVerdict>& verdicts, std::string_view mode) {
  return *std::find_if(verdicts.begin(), verdicts.end(),
                       [&](const ModeVerdict& v) { return v.mode->name == mode; });
}

/// Walls whose depths are a few float32 steps apart, so that a float32 depth cannot tell which one is in
/// front.
Scene close_walls() {
  Scene scene;
  scene.parameters.camera = {0.3, 0.2, 3};
  scene.parameters.near_plane = 0.01;
  scene.parameters.far_plane = 1000;
  for (int wall = 0; wall < 6; ++wall) {
    const float z = static_cast<float>(wall * (wall % 2 == 0 ? 1 : -1)) * 3e-7f;
    scene.model.triangles.push_back({{-1, -1, z}, {1, -1, -z}, {0, 1, z / 2}});
  }
  return scene;
}

class Sufficiency : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scenes, Sufficiency,
                         testing::Values("teapot:triangles=500", "terrain:triangles=2000",
                                         "confetti:triangles=500,size=20,distribution=heavy",
                                         "layers:depth=3"),
                         [](const auto& scene) {
                           return std::string(scene.param).substr(0, std::string(scene.param).find(':'));
                         });

TEST_P(Sufficiency, FoundIsNeverMoreThanPredicted) {
  const Scene scene = open_scene(GetParam(), "");
  const auto verdicts = verdicts_of(scene, {.width = 128, .height = 96}, {.wrong_pixels = 3});
  ASSERT_EQ(verdicts.size(), mode_infos().size());
  int bounded = 0;
  for (const ModeVerdict& v : verdicts) {
    SCOPED_TRACE(v.mode->name);
    EXPECT_EQ(v.beyond_bound, 0);
    if (v.predicted < 0) {
      EXPECT_NE(v.standing, Standing::kSuffices);
      continue;
    }
    ++bounded;
    EXPECT_LE(v.found, v.predicted);
    EXPECT_LE(v.found_depth_error, v.depth_bound);
    EXPECT_EQ(v.standing == Standing::kSuffices, v.predicted <= 3);
    EXPECT_LE(std::max(v.by_edge, v.by_depth), v.predicted);
    EXPECT_LE(v.predicted, v.by_edge + v.by_depth);
  }
  EXPECT_GT(bounded, 10);
  EXPECT_EQ(of(verdicts, "exact").predicted, 0);
  EXPECT_EQ(of(verdicts, "two_product").standing, Standing::kUnbounded);
  EXPECT_GE(of(verdicts, "two_product").found, 0);
  EXPECT_EQ(of(verdicts, "ray_cast").standing, Standing::kCastsRays);
}

TEST(Sufficiency, WhatTheBoundsCannotTellApartIsLeftToExactModes) {
  const Scene scene = close_walls();
  const FrameSettings settings{.width = 96, .height = 96};
  const auto verdicts = verdicts_of(scene, settings, {});
  EXPECT_GT(of(verdicts, "f32").predicted, 500);  // otherwise the scene is too kind
  EXPECT_EQ(of(verdicts, "f32").standing, Standing::kTooManyPixels);
  EXPECT_EQ(of(verdicts, "exact").standing, Standing::kSuffices);
  for (const ModeVerdict& v : verdicts)
    EXPECT_TRUE(v.standing != Standing::kSuffices || v.found == 0) << v.mode->name;
}

TEST(Sufficiency, DepthErrorsCountWhereTheyAreAskedFor) {
  const Scene scene = open_scene("teapot:triangles=500", "");
  const FrameSettings settings{.width = 96, .height = 64};
  const std::int64_t any = std::int64_t{1} << 40;
  for (const ModeVerdict& v : verdicts_of(scene, settings, {any, {}}))
    EXPECT_EQ(v.standing == Standing::kSuffices, v.predicted >= 0) << v.mode->name;
  const auto strict = verdicts_of(scene, settings, {any, 1e-5});
  EXPECT_EQ(of(strict, "fixed_4").standing, Standing::kTooDeepAnError);
  EXPECT_EQ(of(strict, "filtered-f64").standing, Standing::kSuffices);
  const Tolerance impossible{0, 1e-12};
  const auto none = verdicts_of(scene, settings, impossible);
  for (const ModeVerdict& v : none) EXPECT_NE(v.standing, Standing::kSuffices) << v.mode->name;
  const ModeVerdict* nearest = nearest_to(impossible, none);
  ASSERT_NE(nearest, nullptr);
  EXPECT_EQ(nearest->predicted, 0);  // misses the depth alone, and by the least
  for (const ModeVerdict& v : none)
    EXPECT_TRUE(v.predicted != 0 || nearest->depth_bound <= v.depth_bound) << v.mode->name;
}

TEST(NearestTo, CountsPixelsBeyondTheTolerance) {
  std::vector<ModeVerdict> verdicts(3);
  verdicts[0].predicted = 100;
  verdicts[0].depth_bound = 1e-9;
  verdicts[1].predicted = 20;
  verdicts[1].depth_bound = 1;
  EXPECT_EQ(nearest_to({10, {}}, verdicts), &verdicts[1]);  // [2] promises nothing
  EXPECT_EQ(nearest_to({200, {}}, verdicts), &verdicts[0]);
  EXPECT_EQ(nearest_to({10, {}}, std::span(verdicts).last(1)), nullptr);
}

TEST(DepthBoundInWorld, CoversTheErrorAtEveryNearerDepth) {
  const Camera camera = look_at_origin({0, 0, 5}, 0.8, 0.1, 100, {64, 64});
  const double error = 1e-5;
  const double bound = depth_bound_in_world(F32::kInfo, camera, error, 0.99);
  for (const double d : {-1.0, 0.0, 0.9, 0.99})
    for (const double e : {-error, error})
      EXPECT_LE(std::abs(view_distance(camera, d + e) - view_distance(camera, d)), bound) << d;
  EXPECT_LT(bound, 1.001 * (view_distance(camera, 0.99 + error) - view_distance(camera, 0.99)));
  // What is not stored as float32 d is rounded on its way out.
  EXPECT_GT(depth_bound_in_world(F64::kInfo, camera, error, 0.99), bound);
  EXPECT_EQ(depth_bound_in_world(F32::kInfo, camera, 3, 0.99), std::numeric_limits<double>::infinity());
}

TEST(Measure, RecommendsWhatIsProvedAndVerified) {
  const Scene scene = open_scene("teapot:triangles=300", "");
  const FrameSettings settings{.width = 64, .height = 48};
  const Tolerance tolerance{5, {}};
  const auto verdicts = verdicts_of(scene, settings, tolerance);
  std::size_t sufficient = 0;
  for (const ModeVerdict& v : verdicts) sufficient += v.standing == Standing::kSuffices;
  const Measurements measured =
      measure(scene, settings, verdicts, {.threads = 1, .seconds = 0.5}, [](double, const std::string&) {});
  EXPECT_GE(measured.all.size() + measured.no_time, sufficient);
  std::size_t finalists = 0;
  for (const Measurement& m : measured.all) {
    EXPECT_TRUE(m.conforms) << name_of(m.candidate);
    EXPECT_EQ(m.candidate.verdict->standing, Standing::kSuffices);
    finalists += !m.rounds_ms.empty();
  }
  EXPECT_GE(finalists, 1u);
  EXPECT_LE(finalists, 4u);
  const auto recommendation = recommend(measured.all);
  ASSERT_TRUE(recommendation);
  const ModeVerdict& v = *recommendation->finalists[recommendation->chosen].measurement->candidate.verdict;
  EXPECT_LE(v.found, v.predicted);
  EXPECT_LE(v.predicted, tolerance.wrong_pixels);
}

TEST(Measure, ShowsNoTimeOfWhatDoesNotConform) {
  const Scene scene = open_scene("teapot:triangles=300", "");
  const FrameSettings settings{.width = 64, .height = 48};
  auto verdicts = verdicts_of(scene, settings, {1000, {}});
  for (ModeVerdict& v : verdicts)
    if (v.mode->name == "f32") v.fingerprint = "of another picture";
  const Measurements measured =
      measure(scene, settings, verdicts, {.threads = 1, .seconds = 0.2}, [](double, const std::string&) {});
  int failed = 0;
  for (const Measurement& m : measured.all) {
    if (m.candidate.verdict->mode->name != "f32") continue;
    ++failed;
    EXPECT_FALSE(m.conforms);
    EXPECT_EQ(m.trial_ms, 0);
    EXPECT_TRUE(m.rounds_ms.empty());
  }
  EXPECT_GE(failed, 1);
}

TEST(TriedExecutions, AreSerialForOneThread) {
  ASSERT_EQ(tried_executions(1).size(), 1u);
  EXPECT_EQ(tried_executions(1)[0].backend, "serial");
  for (const ExecutionConfig& e : tried_executions(2)) EXPECT_EQ(e.threads, 2);
  EXPECT_GE(tried_executions(2).size(), 2u);
}

}  // namespace
}  // namespace rasterbench
