#include "adopt/race_scene.h"

#include <gtest/gtest.h>

#include "adopt/judge_picture.h"
#include "reference/specification.h"

namespace rasterbench {
namespace {

FrameSettings settings_of(const Scene& scene) {
  FrameSettings settings;
  settings.width = scene.parameters.width;
  settings.height = scene.parameters.height;
  return settings;
}

TEST(RaceScene, TheLastTriangleOfEachStackIsSeen) {
  const Scene scene = race_scene();
  const PictureJudge judge(scene, settings_of(scene), 2);
  const std::size_t stacks = 40 * 22, size = scene.model.triangles.size();
  ASSERT_EQ(size, stacks * 32);
  std::int64_t covered = 0;
  for (const std::int32_t id : judge.owners()) {
    if (id < 0) continue;
    ++covered;
    EXPECT_GE(static_cast<std::size_t>(id), size - 2 * stacks);
    EXPECT_EQ(id % 2, 1);
  }
  EXPECT_GT(covered, 320 * 180 / 4);
}

TEST(RaceScene, NoRoundingExplainsALostUpdate) {
  const Scene scene = race_scene();
  PictureJudge judge(scene, settings_of(scene), 2);
  EXPECT_EQ(judge.judge(render_specification(scene, "f32", settings_of(scene)).colours).wrong(), 0);
  // Without the last of each pair, the one before it is seen: as if all of these updates had been lost.
  Scene lost = scene;
  for (std::size_t i = 1; i < lost.model.triangles.size(); i += 2)
    lost.model.triangles[i] = lost.model.triangles[i - 1];
  const PictureFindings findings = judge.judge(render_specification(lost, "f32", settings_of(scene)).colours);
  EXPECT_GT(findings.of(PixelFinding::kHidden), 320 * 180 / 8);
}

}  // namespace
}  // namespace rasterbench
