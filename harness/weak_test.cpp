#include "harness/weak.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace rasterbench {
namespace {

TEST(Weak, TrianglesGrowWithTheThreads) {
  const SceneReference named{"load", "confetti:size=4,triangles=2.5e4*threads,seed=2", ""};
  EXPECT_EQ(scene_for_threads(named, 1).model, "confetti:size=4,triangles=25000,seed=2");
  EXPECT_EQ(scene_for_threads(named, 8).model, "confetti:size=4,triangles=200000,seed=2");
  EXPECT_EQ(scene_for_threads(named, 8).name, "load-x8");
  const SceneReference unnamed = parse_scene_reference("teapot:triangles=300*threads");
  EXPECT_EQ(scene_for_threads(unnamed, 3).name, "teapot:triangles=900");
  for (const std::string model : {"teapot", "teapot:triangles=300", "confetti:size=4*threads", "a.dat",
                                  "confetti:triangles=3*threads,size=4*threads", "teapot:triangles=*threads",
                                  "teapot:triangles=3x*threads"})
    EXPECT_THROW(scene_for_threads(parse_scene_reference(model), 2), InputError) << model;
}

TEST(Weak, PixelsGrowWithTheThreadsAndTheViewStays) {
  EXPECT_EQ(size_for_threads({960, 540}, 1), (std::pair{960, 540}));
  EXPECT_EQ(size_for_threads({960, 540}, 4), (std::pair{1920, 1080}));
  for (int threads = 2; threads <= 64; ++threads) {
    const auto [width, height] = size_for_threads({960, 540}, threads);
    EXPECT_NEAR(static_cast<double>(width) * height / (960.0 * 540 * threads), 1, 1.0 / 960 + 1.0 / 540);
    EXPECT_NEAR(static_cast<double>(width) / height, 16.0 / 9, 0.003);
  }
  EXPECT_THROW(size_for_threads({40000, 10}, 4), InputError);
}

TEST(Weak, ASeriesHasItsPicturesOnly) {
  const WeakSeries series{"triangles", "load", "8x6", {{1, {"load-x1", 8, 6}}, {2, {"load-x2", 8, 6}}}};
  Point point;
  point.scene.name = "load-x2";
  point.width = 8;
  point.height = 6;
  point.execution.threads = 2;
  EXPECT_TRUE(series.has(point));
  point.execution.threads = 1;
  EXPECT_FALSE(series.has(point)) << "a serial point on the picture of two threads";
  point.execution.threads = 2;
  point.width = 9;
  EXPECT_FALSE(series.has(point));
}

}  // namespace
}  // namespace rasterbench
