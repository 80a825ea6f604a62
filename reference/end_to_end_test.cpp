#include "reference/end_to_end.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include "reference/end_to_end_testing.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

using end_to_end::BruteForce;
namespace fs = std::filesystem;

constexpr double kHalfSlope = 0.92729521800161219;  // tan(theta / 2) = 1/2, but for rounding

SceneParameters seen_from(const Vec3d& camera, double near_plane = 0.1, double far_plane = 10,
                          double theta = kHalfSlope) {
  SceneParameters p;
  p.camera = camera;
  p.theta = theta;
  p.near_plane = near_plane;
  p.far_plane = far_plane;
  return p;
}

Scene scene_of(std::vector<Triangle> triangles, const SceneParameters& parameters) {
  return {.model = {.name = "test", .triangles = std::move(triangles)}, .parameters = parameters};
}

Vec3 random_point(Random& random, double extent) {
  const auto coordinate = [&] { return static_cast<float>(random.uniform(-extent, extent)); };
  const float x = coordinate(), y = coordinate();
  return {x, y, coordinate()};
}

std::vector<Triangle> random_triangles(int count, double extent, std::uint64_t seed) {
  Random random(seed);
  std::vector<Triangle> triangles;
  for (int i = 0; i < count; ++i) {
    const Vec3 a = random_point(random, extent), b = random_point(random, extent);
    triangles.push_back({a, b, random_point(random, extent)});
  }
  return triangles;
}

// Triangles that share the corner `hub`, with a closed ring of `rim` around it.
std::vector<Triangle> fan(const Vec3& hub, const std::vector<Vec3>& rim) {
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < rim.size(); ++i) triangles.push_back({hub, rim[i], rim[(i + 1) % rim.size()]});
  return triangles;
}

// Two triangles per square of a grid over [-1, 1]^2 in the plane z.
std::vector<Triangle> grid(int squares, float z) {
  std::vector<Triangle> triangles;
  const auto at = [&](int i) { return static_cast<float>(2 * i) / static_cast<float>(squares) - 1; };
  for (int i = 0; i < squares; ++i) {
    for (int j = 0; j < squares; ++j) {
      const Vec3 a = {at(j), at(i), z}, b = {at(j + 1), at(i), z};
      const Vec3 c = {at(j + 1), at(i + 1), z}, d = {at(j), at(i + 1), z};
      triangles.push_back({a, b, c});
      triangles.push_back({c, d, a});
    }
  }
  return triangles;
}

// Compares with the brute force, in both fill rules and near rules; gives the number of pixels that the
// second stage decided.
std::int64_t expect_equal_to_brute_force(const Scene& scene, int width, int height) {
  std::int64_t by_multiprecision = 0;
  for (const FillRule fill : {FillRule::kClosed, FillRule::kTopLeft}) {
    for (const NearRule near_rule : {NearRule::kClip, NearRule::kOff}) {
      const IdImage expected = BruteForce(scene, width, height, fill, near_rule).draw();
      const EndToEndTruth truth = render_end_to_end(scene, width, height, fill, near_rule, 1);
      SCOPED_TRACE(std::string(fill == FillRule::kClosed ? "closed" : "top-left") +
                   (near_rule == NearRule::kClip ? ", clip" : ", off"));
      EXPECT_EQ(truth.ambiguous, 0);
      for (std::size_t p = 0; p < expected.ids.size() && !testing::Test::HasFailure(); ++p) {
        EXPECT_EQ(truth.truth.ids[p], expected.ids[p]) << "pixel " << p;
        const double scale = std::max(1.0, std::abs(expected.depths[p]));
        EXPECT_NEAR(truth.truth.depths[p], expected.depths[p], 0x1p-38 * scale) << "pixel " << p;
      }
      by_multiprecision += truth.by_multiprecision;
    }
  }
  return by_multiprecision;
}

TEST(EndToEnd, RandomTrianglesSeenFromOutsideAndInside) {
  std::uint64_t seed = 1;
  for (const Vec3d& camera : {Vec3d{0.7, 0.78, 1.51}, {-0.1, 0.05, 0.02}, {3, -1e-3, -2}, {0.3, 0, -0.4}}) {
    for (const double theta : {0.785398163, 2.5})
      expect_equal_to_brute_force(
          scene_of(random_triangles(30, 1, seed++), seen_from(camera, 0.01, 4, theta)), 12, 9);
  }
}

TEST(EndToEnd, CameraOnTheYAxis) {
  const std::vector<Triangle> level =
      fan({0, 0, 0}, {{1, 0, 0}, {0.5f, 0, 0.5f}, {-0.25f, 0, 1}, {-1, 0, -1}, {0, 0, -1}});
  for (const double y : {1.7, -1.7}) {
    expect_equal_to_brute_force(scene_of(random_triangles(20, 1, 99), seen_from({0, y, 0}, 0.5, 3)), 15, 11);
    EXPECT_GT(expect_equal_to_brute_force(scene_of(level, seen_from({0, y, 0})), 15, 15), 4 * 15);
  }
}

// The origin is seen in the middle of the picture, which is a sample where width and height are odd: edges
// through it with these directions pass exactly through samples, whatever tan(theta/2) is.
TEST(EndToEnd, EdgesExactlyThroughSamples) {
  const std::vector<Vec3> rim = {{2, 0, 0},   {2, 2, 0},  {0, 2, 0},  {-2, 2, 0}, {-2, 0, 0},
                                 {-2, -2, 0}, {0, -2, 0}, {2, -2, 0}, {2, -1, 0}};
  std::vector<Triangle> front = fan({0, 0, 0}, rim);
  EXPECT_GT(expect_equal_to_brute_force(scene_of(front, seen_from({0, 0, 2})), 15, 15), 4 * 15);
  std::reverse(front.begin(), front.end());
  for (std::size_t i = 0; i < front.size(); i += 2) std::swap(front[i].b, front[i].c);
  EXPECT_GT(expect_equal_to_brute_force(scene_of(front, seen_from({0, 0, -2})), 21, 13), 4 * 15);

  // |M| is an integer (3), the distance from the Y axis is not; and neither is.
  for (const Vec3d& camera : {Vec3d{2, 1, 2}, {1, 1, 1}, {0.7, 0.78, 1.51}}) {
    Random random(5);
    std::vector<Vec3> spokes;
    for (int i = 0; i < 24; ++i) spokes.push_back(random_point(random, 1));
    // Above the look-at point, and to its right: seen on the middle column and on the middle row.
    spokes[3] = {0, 1, 0};
    spokes[9] = {static_cast<float>(camera.z), 0, static_cast<float>(-camera.x)};
    spokes[17] = {0, -1, 0};
    EXPECT_GT(expect_equal_to_brute_force(scene_of(fan({0, 0, 0}, spokes), seen_from(camera)), 11, 11), 8);
  }
}

// tan(theta/2) is 1/2 but for 1e-17, and the camera is off by 0 .. 1e-15: edges pass samples at distances at
// and below what double resolves.
TEST(EndToEnd, EdgesCloserToSamplesThanDoubleResolves) {
  for (const double offset : {0.0, 3e-17, 1e-15})
    for (const double tilt : {0.0, -2e-16})
      EXPECT_GT(expect_equal_to_brute_force(scene_of(grid(6, 0), seen_from({offset, tilt, 2})), 9, 9), 0);
}

TEST(EndToEnd, TiesInDepthGoToTheSmallestId) {
  // Triangles of one slanted plane, with duplicates in every order of the corners; the coordinates are exact.
  std::vector<Triangle> triangles;
  Random random(3);
  const auto point = [&] {
    const double x = std::floor(random.uniform(-32, 32)) / 32, y = std::floor(random.uniform(-32, 32)) / 32;
    return Vec3{static_cast<float>(x), static_cast<float>(y), static_cast<float>(0.25 * x - 0.5 * y)};
  };
  for (int i = 0; i < 8; ++i) triangles.push_back({point(), point(), point()});
  for (std::size_t i = 0; i < 4; ++i) {
    const Triangle t = triangles[i];
    for (const Triangle& copy : {Triangle{t.a, t.c, t.b}, {t.b, t.c, t.a}, t}) triangles.push_back(copy);
  }
  const Scene scene = scene_of(triangles, seen_from({0.3, 0.4, 2}));
  EXPECT_GT(expect_equal_to_brute_force(scene, 24, 20), 100);
  // By construction, without the brute force: of two copies the first one owns all.
  std::vector<Triangle> reversed(triangles.rbegin(), triangles.rend());
  const EndToEndTruth truth =
      render_end_to_end(scene_of(reversed, scene.parameters), 24, 20, FillRule::kClosed, NearRule::kClip, 1);
  EXPECT_EQ(truth.ambiguous, 0);
  for (const std::int32_t id : truth.truth.ids)  // 12 copies of the four that come last
    EXPECT_TRUE(id < 16) << id;

  // Two planes that intersect in a line through the view axis: the order changes at samples of the middle
  // column, where the depths are equal exactly.
  const std::vector<Triangle> crossing = {{{-9, -9, -9}, {9, -9, 9}, {0, 9, 0}},
                                          {{-9, -9, 9}, {9, -9, -9}, {0, 9, 0}}};
  EXPECT_EQ(expect_equal_to_brute_force(scene_of(crossing, seen_from({0, 0, 2})), 9, 9), 2 * 9);
}

TEST(EndToEnd, NearAndFarPlane) {
  // Exactly on the planes: d = -1 is drawn, d = 1 is not; and one float to either side.
  for (const float z : {1.0f, std::nextafter(1.0f, 2.0f), std::nextafter(1.0f, 0.0f), -1.0f,
                        std::nextafter(-1.0f, -2.0f), std::nextafter(-1.0f, 0.0f)}) {
    const Scene scene = scene_of({{{-9, -9, z}, {9, -9, z}, {0, 9, z}}}, seen_from({0, 0, 2}, 1, 3));
    expect_equal_to_brute_force(scene, 5, 5);
    const EndToEndTruth truth = render_end_to_end(scene, 5, 5, FillRule::kClosed, NearRule::kClip, 1);
    EXPECT_EQ(truth.truth.ids[12], z <= 1 && z > -1 ? 0 : -1) << z;
    EXPECT_TRUE(z != 1 || (truth.truth.depths[12] == -1 && truth.by_multiprecision == 25));
  }
  // Through the near plane, the camera's plane and the far plane, wide and thin, and with corners on them.
  std::vector<Triangle> triangles = {{{-1, -100, 50}, {-1, 100, 50}, {-1, 0, -1e6f}},
                                     {{-1000, -1, 50}, {1000, -1, 50}, {0, -1, -1e4f}},
                                     {{0, 0, 2}, {1, 1, -1}, {-1, 1, -1}},
                                     {{0, 0.5f, 2}, {1, -1, 2}, {0, 0, -9}},
                                     {{-1, 0, 1}, {1, 0, 1}, {0, 1, -1}},
                                     {{3, 0, 3}, {-3, 0, 2.5f}, {0, 1, 2.25f}}};
  for (const Triangle& t : random_triangles(20, 6, 11)) triangles.push_back(t);
  expect_equal_to_brute_force(scene_of(triangles, seen_from({0, 0, 2}, 1, 3)), 17, 17);
  expect_equal_to_brute_force(scene_of(triangles, seen_from({0, 0, 2}, 1e-9, 1e9)), 17, 17);
  expect_equal_to_brute_force(scene_of(triangles, seen_from({1e-3, 2e-3, 2}, 1e-6, 3)), 17, 17);
  expect_equal_to_brute_force(scene_of(triangles, seen_from({0.5, 0.5, 2}, 1.5, 1.5 + 1e-9)), 17, 17);
}

TEST(EndToEnd, DrawsNothingOfWhatIsNoTriangleOrSeenEdgeOn) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const Vec3 a = {-1, -1, 0}, b = {1, -1, 0}, c = {0, 1, 0};
  const std::vector<Triangle> nothing = {
      {{nan, 0, 0}, b, c},
      {a, {0, inf, 0}, c},
      {a, b, {0, 0, -inf}},
      {a, a, b},
      {a, a, a},
      {{-0.75f, -0.5f, 0.25f}, {0, 0, 0}, {0.75f, 0.5f, -0.25f}},
      {{0, -1, 0.5f}, {0, 1, 0.5f}, {0, 0, -1}},       // in the plane x = 0, which holds the camera
      {{0.5f, 0, 0}, {1.5f, 0, 1}, {-1, 0, -1.25f}}};  // in the plane y = 0
  const Scene scene = scene_of(nothing, seen_from({0, 0, 2}));
  expect_equal_to_brute_force(scene, 9, 9);
  const EndToEndTruth truth = render_end_to_end(scene, 9, 9, FillRule::kClosed, NearRule::kClip, 1);
  EXPECT_EQ(std::count(truth.truth.ids.begin(), truth.truth.ids.end(), -1), 81);
  EXPECT_EQ(
      render_end_to_end(scene_of({}, scene.parameters), 3, 2, FillRule::kClosed, NearRule::kOff, 2).truth.ids,
      std::vector<std::int32_t>(6, -1));
  // The cross product of this one's edges is zero in double. Its longest edge passes through nine samples.
  const Scene sliver = scene_of({{{1, 1, 0}, {0x1p-60f, 0, 0}, {-1, -1, 0}}}, seen_from({0, 0, 2}));
  expect_equal_to_brute_force(sliver, 9, 9);
  const EndToEndTruth line = render_end_to_end(sliver, 9, 9, FillRule::kClosed, NearRule::kClip, 1);
  EXPECT_EQ(std::count(line.truth.ids.begin(), line.truth.ids.end(), 0), 9);
}

TEST(EndToEnd, ExtremeNumbers) {
  Random random(17);
  std::vector<Triangle> triangles;
  const auto power = [&](int low, int high) {
    return static_cast<float>(std::ldexp(random.uniform(-1, 1), static_cast<int>(random.uniform(low, high))));
  };
  const auto point = [&] { return Vec3{power(-140, 127), power(-140, 127), power(-140, 127)}; };
  for (int i = 0; i < 20; ++i) triangles.push_back({point(), point(), point()});
  expect_equal_to_brute_force(scene_of(triangles, seen_from({0.7, 0.78, 1.51})), 9, 9);
  // Slivers, and a wall from corners 1e30 away.
  std::vector<Triangle> slivers = {{{0, -1e30f, 0}, {0, 1e30f, 0}, {-1e30f, 0, 0}}};
  for (int i = 0; i < 30; ++i) {
    const Vec3 a = random_point(random, 1), b = random_point(random, 1);
    slivers.push_back({a, b, {b.x + power(-24, -20), b.y + power(-24, -20), b.z + power(-24, -20)}});
  }
  for (const Vec3d& camera : {Vec3d{0, 0, 2}, {1e-12, 0, 2}, {0.3, 0.4, 2}})
    expect_equal_to_brute_force(scene_of(slivers, seen_from(camera)), 15, 15);
  // Telephoto from far away; next to nothing in view; nearly half of the world in view; a microscopic world.
  const std::vector<Triangle> objects = random_triangles(20, 1, 23);
  expect_equal_to_brute_force(scene_of(objects, seen_from({1e6, 2e6, 5e5}, 1e6, 1e7, 1e-6)), 9, 9);
  expect_equal_to_brute_force(scene_of(objects, seen_from({1, 2, 0.5}, 0.1, 9, 1e-300)), 5, 5);
  expect_equal_to_brute_force(scene_of(objects, seen_from({1, 2, 0.5}, 0.1, 9, 3.14159265358979)), 9, 9);
  expect_equal_to_brute_force(scene_of(objects, seen_from({1e-200, 2e-200, 0}, 1e-210, 1e100)), 9, 9);
  expect_equal_to_brute_force(scene_of(objects, seen_from({1e70, 1e70, 0}, 1e60, 1e71, 1e-70)), 5, 5);
  expect_equal_to_brute_force(
      scene_of(random_triangles(20, 1e-30, 29), seen_from({1e-30, 2e-30, 2e-30}, 1e-31, 1e-29)), 9, 9);
}

TEST(EndToEnd, OnePixelAndUnequalSides) {
  const std::vector<Triangle> triangles = random_triangles(12, 1, 31);
  for (const auto& [width, height] : {std::pair(1, 1), {1, 40}, {40, 1}, {2, 33}})
    expect_equal_to_brute_force(scene_of(triangles, seen_from({0.7, 0.78, 1.51})), width, height);
}

// A scene with hidden surfaces, shared edges, a near plane that cuts, and exact ties.
Scene mixed_scene() {
  Scene scene = generate("teapot:triangles=2000");
  for (const Triangle& t : grid(6, 0.25f)) scene.model.triangles.push_back(t);
  const std::vector<Triangle> first(scene.model.triangles.begin(), scene.model.triangles.begin() + 100);
  for (const Triangle& t : first) scene.model.triangles.push_back({t.b, t.a, t.c});
  for (const Triangle& t : random_triangles(20, 3, 37)) scene.model.triangles.push_back(t);
  scene.parameters.near_plane = 1.4;
  return scene;
}

void expect_agreement_with_double(const Scene& scene, int width, int height) {
  SceneParameters p = scene.parameters;
  p.width = width;
  p.height = height;
  for (const FillRule fill : {FillRule::kClosed, FillRule::kTopLeft}) {
    const EndToEndTruth truth = render_end_to_end(scene, width, height, fill, NearRule::kClip, 2);
    const IdImage image = render_in_double(scene.model.triangles, make_camera(p), fill, NearRule::kClip);
    EXPECT_EQ(truth.ambiguous, 0);
    EXPECT_EQ(truth.by_multiprecision,
              std::count(truth.decided.begin(), truth.decided.end(), DecidedBy::kMultiprecision));
    EXPECT_LT(truth.by_multiprecision, width * height / 10);
    for (std::size_t i = 0; i < image.ids.size(); ++i) {
      if (truth.decided[i] != DecidedBy::kDouble) continue;
      ASSERT_EQ(truth.truth.ids[i], image.ids[i]) << i;
      ASSERT_NEAR(truth.truth.depths[i], image.depths[i], 0x1p-36) << i;
    }
  }
}

TEST(EndToEnd, AgreesWithTheDoubleRendererWhereDoubleDecides) {
  expect_agreement_with_double(mixed_scene(), 320, 180);
  expect_agreement_with_double(generate("terrain:triangles=20000"), 320, 180);
  expect_agreement_with_double(generate("layers:triangles=2000"), 321, 181);
}

TEST(EndToEnd, AgreesWithTheDoubleRendererOnSharedScenes) {
  const fs::path scenes = fs::path(__FILE__).parent_path().parent_path().parent_path() / "shared" / "scenes";
  if (!fs::exists(scenes)) GTEST_SKIP() << "no folder ../shared/scenes beside the project";
  for (const std::string name : {"spot/spot", "mech_drone/mech_drone", "dungeon/dungeon"}) {
    const std::string path = (scenes / name).string();
    expect_agreement_with_double(open_scene(path + ".dat", path + ".txt"), 320, 180);
  }
}

TEST(EndToEnd, DoesNotDependOnTheNumberOfThreads) {
  const Scene scene = mixed_scene();
  const EndToEndTruth one = render_end_to_end(scene, 200, 150, FillRule::kClosed, NearRule::kClip, 1);
  EXPECT_GT(one.by_multiprecision, 0);
  for (const int threads : {2, 3, 64}) {
    const EndToEndTruth other =
        render_end_to_end(scene, 200, 150, FillRule::kClosed, NearRule::kClip, threads);
    EXPECT_EQ(one.truth.ids, other.truth.ids);
    EXPECT_EQ(one.truth.depths, other.truth.depths);
    EXPECT_EQ(one.decided, other.decided);
  }
}

// The edges of this grid miss the samples by about 1e-17 of the picture, which 32 bits do not resolve: such
// pixels are reported, and nothing else changes.
TEST(EndToEnd, WhatThePrecisionDoesNotDecideIsAmbiguous) {
  const Scene scene = scene_of(grid(8, 0), seen_from({0, 0, 2}));
  const EndToEndTruth full = render_end_to_end(scene, 16, 16, FillRule::kTopLeft, NearRule::kClip, 1);
  const EndToEndTruth coarse = render_end_to_end(scene, 16, 16, FillRule::kTopLeft, NearRule::kClip, 1, 32);
  EXPECT_EQ(full.ambiguous, 0);
  EXPECT_GT(coarse.ambiguous, 0);
  EXPECT_EQ(coarse.ambiguous,
            std::count(coarse.decided.begin(), coarse.decided.end(), DecidedBy::kAmbiguous));
  for (std::size_t i = 0; i < full.decided.size(); ++i) {
    if (coarse.decided[i] == DecidedBy::kAmbiguous) {
      EXPECT_EQ(full.decided[i], DecidedBy::kMultiprecision);
      EXPECT_LE(coarse.truth.ids[i], full.truth.ids[i]);
      EXPECT_GE(coarse.truth.ids[i], 0);
    } else {
      EXPECT_EQ(coarse.truth.ids[i], full.truth.ids[i]);
    }
  }
}

}  // namespace
}  // namespace rasterbench
