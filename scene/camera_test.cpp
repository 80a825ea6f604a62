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

/// -n (f - w) / ((f - n) w) at the distance w of `p` along the view axis, in long double.
long double reversed_depth(const Vec3d& m, const Vec3d& p, long double n, long double f, bool perspective) {
  const long double distance = std::hypot(static_cast<long double>(m.x), m.y, m.z);
  const long double w =
      distance - (m.x * static_cast<long double>(p.x) + m.y * static_cast<long double>(p.y) +
                  m.z * static_cast<long double>(p.z)) /
                     distance;
  return perspective ? -n * (f - w) / ((f - n) * w) : -(f - w) / (f - n);
}

TEST(Camera, ReversedDepthIsThatOfLongDouble) {
  const Viewport viewport{.width = 64, .height = 64};
  for (const Vec3d& m : kPositions)
    for (const auto& [n, f] : {std::pair{1.0, 9.0}, {0.1, 1e4}, {1e-9, 1e9}, {3.0, 3.0000001}}) {
      const Camera c = look_at_origin(m, kRightAngle, n, f, viewport);
      const Camera flat = orthographic_at_origin(m, 2, n, f, viewport);
      EXPECT_EQ(c.near_plane, n);
      EXPECT_EQ(c.far_plane, f);
      EXPECT_TRUE(c.perspective);
      EXPECT_EQ(flat.near_plane, n);
      EXPECT_EQ(flat.far_plane, f);
      EXPECT_FALSE(flat.perspective);
      for (const Vec3d& p : {Vec3d{0, 0, 0}, Vec3d{0.3, -0.7, 0.4}, Vec3d{-40, 25, -1e3}}) {
        const double w = at(c.w, p), size = std::hypot(m.x, m.y, m.z) + std::hypot(p.x, p.y, p.z);
        if (w < 0.1 * size) continue;  // behind, or where w itself is mostly rounding
        // The terms of f - w are rounded, and w: each to the size of what it is summed from.
        const auto expected = static_cast<double>(reversed_depth(m, p, n, f, true));
        const double tolerance = 1e-14 * (n / (f - n) * (f + size) / w + std::abs(expected) * size / w);
        EXPECT_NEAR(at(c.reversed_z, p) / w, expected, tolerance) << n << " " << f;
        EXPECT_NEAR(at(flat.reversed_z, p), static_cast<double>(reversed_depth(m, p, n, f, false)),
                    1e-14 * (f + size) / (f - n));
        // And that it is (d - 1) / 2, as far as d has digits left.
        EXPECT_NEAR(at(c.reversed_z, p) / w, (at(c.z, p) / w - 1) / 2,
                    tolerance + 1e-14 * ((n + f) * size + 2 * n * f) / (f - n) / w);
      }
    }
}

TEST(Camera, ReversedDepthKeepsWhatDLoses) {
  // With n = 1e-9 and f = 1e9, what is about 5 away has 1 - d = 4e-10: nine digits are lost beside 1.
  const Vec3d m{0, 0, 5}, p{0, 0, -0.3};
  const Camera c = look_at_origin(m, kRightAngle, 1e-9, 1e9, {.width = 64, .height = 64});
  const auto expected = static_cast<double>(reversed_depth(m, p, 1e-9L, 1e9L, true));
  EXPECT_NEAR(at(c.reversed_z, p) / at(c.w, p) / expected, 1, 1e-14);
  EXPECT_GT(std::abs((at(c.z, p) / at(c.w, p) - 1) / 2 / expected - 1), 1e-9);
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
