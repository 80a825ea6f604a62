#include "machine/cost_ladder.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/error.h"
#include "execution/execution.h"
#include "reference/specification.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

FrameSettings settings_of(int width, int height) {
  FrameSettings settings{.width = width, .height = height};
  settings.geometry.isa = best_isa();
  return settings;
}

const Rung& rung(const CostLadder& ladder, std::string_view name) {
  return *std::find_if(ladder.rungs.begin(), ladder.rungs.end(),
                       [&](const Rung& r) { return r.name == name; });
}

TEST(CostLadder, EachRungHandsOnWhatTheSpecificationHas) {
  Scene scene = generate("confetti:triangles=700,size=9,distribution=heavy,seed=3");
  scene.parameters.near_plane = 3;  // leaves some behind and cuts this one
  scene.model.triangles.push_back({{-3, -3, 3.5f}, {3, -3, -1}, {0, 3, 0}});
  for (const std::string_view mode : cost_ladder_modes()) {
    SCOPED_TRACE(mode);
    const FrameSettings settings = settings_of(150, 90);
    const Picture expected = render_specification(scene, mode, settings);
    ASSERT_GT(expected.counts.near_clipped, 0);
    int done = 0;
    const int threads = std::min(2, available_cpus());
    const CostLadder ladder =
        measure_cost_ladder(scene, mode, settings, threads, 3, [&](int repetition) { done = repetition; });
    EXPECT_EQ(done, 3);
    EXPECT_EQ(ladder.threads, threads);
    EXPECT_EQ(ladder.mode, mode);
    ASSERT_EQ(ladder.rungs.size(), 10u);
    for (const Rung& r : ladder.rungs) {
      ASSERT_EQ(r.seconds.size(), 3u) << r.name;
      EXPECT_TRUE(std::all_of(r.seconds.begin(), r.seconds.end(), [](double s) { return s > 0; })) << r.name;
      EXPECT_FALSE(r.meaning.empty() || r.unit.empty()) << r.name;
    }
    EXPECT_EQ(rung(ladder, "read").results, 701);
    EXPECT_EQ(rung(ladder, "transform").results, 701);
    EXPECT_LT(rung(ladder, "reject").results, 701);
    EXPECT_EQ(rung(ladder, "clip").results, expected.counts.pieces);
    EXPECT_EQ(rung(ladder, "set-up").results, expected.counts.pieces);
    EXPECT_LE(rung(ladder, "box").results, expected.counts.pieces);
    for (const char* name : {"coverage", "key", "keep"})
      EXPECT_EQ(rung(ladder, name).results, expected.samples_covered) << name;
    EXPECT_EQ(rung(ladder, "shade").results, 150 * 90);
  }
}

TEST(CostLadder, SaysWhichTestsAndCutsASceneNeeds) {
  const Scene whole = generate("teapot:triangles=300");
  const CostLadder none = measure_cost_ladder(whole, "fixed_8", settings_of(64, 48), 1, 1, [](int) {});
  EXPECT_EQ(rung(none, "clip").meaning, "nothing: no plane cuts a triangle of this scene");
  Scene near = whole;
  near.parameters.near_plane = 3;
  FrameSettings full = settings_of(64, 48);
  full.generality = Generality::kFull;
  const CostLadder all = measure_cost_ladder(near, "fixed_8", full, 1, 1, [](int) {});
  EXPECT_EQ(rung(all, "clip").meaning, "at the near plane and the guard band");
  EXPECT_NE(rung(all, "reject").meaning.find("zero area"), std::string::npos);
}

TEST(CostLadder, RefusesAnotherModeAndNoTriangles) {
  const Scene scene = generate("teapot:triangles=300");
  EXPECT_THROW(measure_cost_ladder(scene, "f64", settings_of(64, 48), 1, 1, [](int) {}), InputError);
  EXPECT_THROW(measure_cost_ladder(Scene{}, "f32", settings_of(64, 48), 1, 1, [](int) {}), InputError);
}

}  // namespace
}  // namespace rasterbench
