#include "scene/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace rasterbench {
namespace {

constexpr double kRightAngle = std::numbers::pi / 2;

double at(const AffineRow& row, const Vec3d& p) { return row.x * p.x + row.y * p.y + row.z * p.z + row.w; }

Vec3d project(const Camera& camera, const Vec3d& p) {
  const double w = at(camera.w, p);
  return {at(camera.x, p) / w, at(camera.y, p) / w, at(camera.z, p) / w};
}

double dot(const AffineRow& a, const AffineRow& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

void expect_near(const Vec3d& a, const Vec3d& b, double tolerance = 1e-12) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

const std::vector<Vec3d> kPositions = {{0, 0, 5},       {3, 0, 4},         {1, 2, 3},      {-1, -2, -3},
                                       {0, 7, 0},       {0, -7, 0},        {-4, 1, 0},     {1e-9, 5, 0},
                                       {1e5, 1e5, 1e5}, {0.7, 0.78, 1.51}, {-0.0, 2, -0.0}};

TEST(Camera, FromTheZAxisByHand) {
  const Camera camera = look_at_origin({0, 0, 5}, kRightAngle, 1, 9, {.width = 200, .height = 100});
  // S_y = 1, S_x = 1/2; z_view = z - 5; slope = -10/8, offset = -18/8.
  EXPECT_NEAR(camera.y.y, 1, 1e-15);
  EXPECT_NEAR(camera.x.x, 0.5, 1e-15);
  EXPECT_DOUBLE_EQ(at(camera.w, {0, 0, 0}), 5);
  EXPECT_DOUBLE_EQ(at(camera.z, {0, 0, 0}), -2.25 - 1.25 * -5);
  EXPECT_DOUBLE_EQ(at(camera.near_distance, {0, 0, 0}), 4);
  EXPECT_EQ(camera.viewport.width, 200);
  EXPECT_EQ(camera.viewport.height, 100);
  EXPECT_EQ(camera.viewport.sampling, Sampling::kCentre);
  // The corner of the frustum 3 in front of the camera: u = 2 * 3, v = 3.
  expect_near(project(camera, {6, 3, 2}), {1, 1, (-1.25 * -3 - 2.25) / 3});
}

TEST(Camera, AnObliqueFrameByHand) {
  // M = (3, 0, 4): e_U = (4, 0, -3)/5, e_V = (0, 1, 0), e_W = (3, 0, 4)/5.
  const Camera camera = look_at_origin({3, 0, 4}, kRightAngle, 1, 9, {.width = 100, .height = 100});
  expect_near({camera.x.x, camera.x.y, camera.x.z}, {0.8, 0, -0.6});
  expect_near({camera.y.x, camera.y.y, camera.y.z}, {0, 1, 0});
  expect_near({camera.w.x, camera.w.y, camera.w.z}, {-0.6, 0, -0.8});
  // M = (2, 3, 6), D = 7, D_g = sqrt(40): e_V = (-6, 40, -18)/(7 sqrt(40)).
  const Camera other = look_at_origin({2, 3, 6}, kRightAngle, 1, 9, {.width = 100, .height = 100});
  const double length = 7 * std::sqrt(40.0);
  expect_near({other.y.x, other.y.y, other.y.z}, {-6 / length, 40 / length, -18 / length});
}

TEST(Camera, TheBasisIsOrthonormalAndRightHanded) {
  for (const Vec3d& m : kPositions) {
    const Camera c = look_at_origin(m, kRightAngle, 1, 9, {.width = 64, .height = 64});
    EXPECT_NEAR(dot(c.x, c.x), 1, 1e-14);
    EXPECT_NEAR(dot(c.y, c.y), 1, 1e-14);
    EXPECT_NEAR(dot(c.w, c.w), 1, 1e-14);
    EXPECT_NEAR(dot(c.x, c.y), 0, 1e-14);
    EXPECT_NEAR(dot(c.y, c.w), 0, 1e-14);
    EXPECT_NEAR(dot(c.w, c.x), 0, 1e-14);
    // e_U x e_V = e_W = -(row w)
    expect_near({c.x.y * c.y.z - c.x.z * c.y.y, c.x.z * c.y.x - c.x.x * c.y.z, c.x.x * c.y.y - c.x.y * c.y.x},
                {-c.w.x, -c.w.y, -c.w.z});
    EXPECT_GE(c.y.y, 0) << "y is up";
    expect_near(project(c, {0, 0, 0}), {0, 0, project(c, {0, 0, 0}).z});
  }
}

TEST(Camera, OnTheYAxisBothSigns) {
  const Camera above = look_at_origin({0, 7, 0}, kRightAngle, 1, 9, {.width = 64, .height = 64});
  expect_near({above.x.x, above.x.y, above.x.z}, {1, 0, 0});
  expect_near({above.y.x, above.y.y, above.y.z}, {0, 0, -1});
  expect_near({above.w.x, above.w.y, above.w.z}, {0, -1, 0});
  const Camera below = look_at_origin({0, -7, 0}, kRightAngle, 1, 9, {.width = 64, .height = 64});
  expect_near({below.x.x, below.x.y, below.x.z}, {1, 0, 0});
  expect_near({below.y.x, below.y.y, below.y.z}, {0, 0, 1});
  expect_near({below.w.x, below.w.y, below.w.z}, {0, 1, 0});
}

TEST(Camera, NearFarAndTheCornersOfTheFrustum) {
  const double theta = 0.9, near_plane = 0.5, far_plane = 20;
  const Viewport viewport{.width = 1920, .height = 1080};
  for (const Vec3d& m : kPositions) {
    const Camera c = look_at_origin(m, theta, near_plane, far_plane, viewport);
    const Camera unit = look_at_origin(m, kRightAngle, near_plane, far_plane, {.width = 1, .height = 1});
    for (const double depth : {near_plane, 3.0, far_plane}) {
      const double v = depth * std::tan(theta / 2), u = v * 1920 / 1080;
      for (const double sx : {-1.0, 1.0}) {
        for (const double sy : {-1.0, 1.0}) {
          const Vec3d p{m.x + depth * unit.w.x + sx * u * unit.x.x + sy * v * unit.y.x,
                        m.y + depth * unit.w.y + sx * u * unit.x.y + sy * v * unit.y.y,
                        m.z + depth * unit.w.z + sx * u * unit.x.z + sy * v * unit.y.z};
          const double size = std::hypot(m.x, m.y, m.z) + depth;
          const Vec3d s = project(c, p);
          EXPECT_NEAR(s.x, sx, 1e-14 * size);
          EXPECT_NEAR(s.y, sy, 1e-14 * size);
          EXPECT_NEAR(at(c.w, p), depth, 1e-14 * size);
          EXPECT_NEAR(at(c.near_distance, p), depth - near_plane, 1e-14 * size);
          const double d = depth == near_plane ? -1 : 1;
          if (depth != 3.0) {
            EXPECT_NEAR(s.z, d, 1e-13 * size);
          }
        }
      }
    }
    EXPECT_LT(at(c.w, {2 * m.x, 2 * m.y, 2 * m.z}), 0) << "behind the camera";
  }
}

TEST(Camera, NoAngleMirrorsThePicture) {
  for (const double theta : {1e-300, 1e-6, 3.14159265, std::nextafter(std::numbers::pi, 0.0)}) {
    const Camera c = look_at_origin({1, 2, 3}, theta, 0.1, 10, {.width = 64, .height = 64});
    EXPECT_GT(c.y.y, 0);
    EXPECT_TRUE(std::isfinite(c.y.y));
  }
}

TEST(Camera, ThePictureOfAnExtremeRatio) {
  const Camera c = look_at_origin({0, 0, 5}, kRightAngle, 1, 9, {.width = 65536, .height = 1});
  EXPECT_DOUBLE_EQ(c.x.x * 65536, c.y.y);
}

TEST(Camera, OrthographicByHand) {
  const Camera c = orthographic_at_origin({0, 0, 5}, 2, 1, 9, {.width = 200, .height = 100});
  EXPECT_EQ(at(c.w, {3, 4, 5}), 1);
  expect_near(project(c, {4, 2, 4}), {1, 1, -1});
  expect_near(project(c, {-4, -2, -4}), {-1, -1, 1});
  expect_near(project(c, {0, 0, 0}), {0, 0, 0});
  EXPECT_DOUBLE_EQ(at(c.near_distance, {0, 0, 0}), 4);
}

}  // namespace
}  // namespace rasterbench
