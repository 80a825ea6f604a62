// Facts about scenes whose answers can be counted by hand.
#include "advice/scene_facts.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rasterbench {
namespace {

/// A camera on the Z axis that sees 8 x 8 world units at z = 0, one to a pixel: x_px = 4 + x, y_px = 4 - y
/// there.
Scene eight_by_eight() {
  Scene scene;
  scene.parameters.camera = {0, 0, 16};
  scene.parameters.theta = 2 * std::atan(0.25);
  scene.parameters.near_plane = 8;
  scene.parameters.far_plane = 24;
  scene.parameters.width = scene.parameters.height = 8;
  return scene;
}

SceneFacts facts_of(const Scene& scene) {
  Judge judge(scene, {.width = 8, .height = 8}, 2);
  return scene_facts(judge, 2);
}

TEST(SceneFacts, OfTwoLayers) {
  Scene scene = eight_by_eight();
  // A right-angled triangle over the lower left half, its edges off all samples, a small one before its
  // middle, and one that is smaller than a pixel and between the samples.
  scene.model.triangles = {{{-3.75f, -3.75f, 0}, {3.5f, -3.75f, 0}, {-3.75f, 3.5f, 0}},
                           {{-2.25f, -2.25f, 1}, {-0.25f, -2.25f, 1}, {-2.25f, -0.25f, 1}},
                           {{2.6f, 2.6f, 0}, {2.9f, 2.6f, 0}, {2.6f, 2.9f, 0}}};
  const SceneFacts facts = facts_of(scene);
  EXPECT_EQ(facts.triangles, 3);
  EXPECT_EQ(facts.counts.drawn, 3);
  EXPECT_EQ(facts.counts.pieces, 3);
  EXPECT_EQ(facts.subpixel, 1);
  EXPECT_FLOAT_EQ(static_cast<float>(facts.low_x), 0.25f);
  EXPECT_FLOAT_EQ(static_cast<float>(facts.high_y), 7.75f);
  EXPECT_NEAR(facts.edge_length.least, 0.3, 1e-5);
  EXPECT_NEAR(facts.edge_length.largest, 7.25 * std::sqrt(2), 1e-5);
  // Samples at half-integers: 7 + 6 + ... of the large triangle, the diagonal x + y <= -0.25 included.
  EXPECT_EQ(facts.covered_pixels, 28);
  EXPECT_EQ(facts.most_layers, 2);
  EXPECT_GT(facts.mean_layers, 1);
  EXPECT_LT(facts.mean_layers, 1.25);
  EXPECT_NEAR(facts.nearest, 15, 1e-4);
  EXPECT_NEAR(facts.farthest, 16, 1e-4);
  EXPECT_EQ(facts.depth_ties, 0);
  EXPECT_EQ(facts.on_edge, 0);
  EXPECT_GT(facts.edge_margin.least, 0.05);
}

TEST(SceneFacts, TiesAndSamplesOnEdges) {
  Scene scene = eight_by_eight();
  // Twice the same triangle, one edge through the samples at x = -0.5.
  const Triangle t{{-0.5f, -3.25f, 0}, {3.25f, 0.25f, 0}, {-0.5f, 3.25f, 0}};
  scene.model.triangles = {t, t};
  const SceneFacts facts = facts_of(scene);
  EXPECT_EQ(facts.depth_ties, facts.covered_pixels);
  EXPECT_GE(facts.on_edge, 6);
  EXPECT_TRUE(std::isnan(facts.depth_gap.least));
  EXPECT_DOUBLE_EQ(facts.mean_layers, 2);
}

TEST(SceneFacts, OfNothing) {
  const SceneFacts facts = facts_of(eight_by_eight());
  EXPECT_EQ(facts.covered_pixels, 0);
  EXPECT_EQ(facts.mean_layers, 0);
  EXPECT_TRUE(std::isnan(facts.edge_length.median));
}

TEST(SpreadOf, IsByNearestRanks) {
  std::vector<double> values;
  for (int i = 200; i >= 1; --i) values.push_back(i);
  const Spread spread = spread_of(values);
  EXPECT_EQ(spread.least, 1);
  EXPECT_EQ(spread.first_percent, 2);
  EXPECT_EQ(spread.median, 100);
  EXPECT_EQ(spread.largest, 200);
  std::vector<double> one{3};
  EXPECT_EQ(spread_of(one).first_percent, 3);
}

TEST(ViewDistance, InvertsTheDepth) {
  for (const double far : {10.0, 1e6, 1e12}) {
    const Camera camera = look_at_origin({0, 0, 5}, 0.8, 0.5, far, {64, 64});
    EXPECT_DOUBLE_EQ(view_distance(camera, -1), 0.5);
    EXPECT_DOUBLE_EQ(view_distance(camera, 1), far);
    for (const double w : {0.5, 1.0, 4.0, 9.5}) {
      const double z = 5 - w;  // of the world point at distance w before the camera
      const double d = (camera.z.z * z + camera.z.w) / (camera.w.z * z + camera.w.w);
      EXPECT_NEAR(view_distance(camera, d), w, 1e-6 * w);
    }
  }
  EXPECT_EQ(view_distance(look_at_origin({0, 0, 5}, 0.8, 1, 2, {64, 64}), 4), INFINITY);
  EXPECT_DOUBLE_EQ(view_distance(orthographic_at_origin({0, 0, 5}, 1, 2, 6, {64, 64}), 0), 4);
}

}  // namespace
}  // namespace rasterbench
