#include "reference/rays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "scene/test_folder.h"

namespace rasterbench {
namespace {

double along(const AffineRow& row, const Vec3d& p) { return row.x * p.x + row.y * p.y + row.z * p.z + row.w; }

TEST(SampleRays, RunFromTheNearToTheFarPlaneThroughTheSamples) {
  struct Case {
    Vec3d position;
    double theta, n, f;
  };
  for (const Case& c : {Case{{0.7, 0.78, 1.51}, 0.8, 0.1, 10}, Case{{0, 5, 0}, 0.8, 1, 10},
                        Case{{7071, 0, 7071}, 2e-4, 9998, 10002}, Case{{1, 2, 3}, 3.0, 1e-9, 1e9}})
    for (const Sampling sampling : {Sampling::kCentre, Sampling::kCorner})
      for (const bool perspective : {true, false}) {
        const Viewport viewport{.width = 1920, .height = 1080, .sampling = sampling};
        const Camera camera = perspective ? look_at_origin(c.position, c.theta, c.n, c.f, viewport)
                                          : orthographic_at_origin(c.position, 2, c.n, c.f, viewport);
        const SampleRays rays(camera);
        const double span_x = sampling == Sampling::kCentre ? 1920 : 1919;
        const double span_y = sampling == Sampling::kCentre ? 1080 : 1079;
        for (const auto& [x, y] : {std::pair{0, 0}, {1919, 0}, {5, 1079}, {960, 540}}) {
          const SampleRay ray = rays.row(y).at(x);
          const Vec3d end = ray.origin + ray.length * ray.direction;
          const double size = length(ray.origin) + length(c.position);
          const double pixels =
              1920 * (1 + std::abs(camera.x.x) + std::abs(camera.x.z) + std::abs(camera.y.y));
          EXPECT_NEAR(length(ray.direction), 1, 1e-15);
          EXPECT_NEAR(along(camera.near_distance, ray.origin), 0, 1e-14 * size);
          EXPECT_NEAR(along(camera.near_distance, end) / (c.f - c.n), 1, 1e-12);
          for (const Vec3d& p : {ray.origin, end}) {
            const double w = along(camera.w, p), error = 1e-15 * pixels * (1 + (size + length(p)) / w);
            const double offset = sampling == Sampling::kCentre ? 0.5 : 0;
            EXPECT_NEAR((along(camera.x, p) / w + 1) / 2 * span_x, x + offset, error);
            EXPECT_NEAR((1 - along(camera.y, p) / w) / 2 * span_y, y + offset, error);
          }
          EXPECT_EQ(rays.depth(ray, 0), -1);
          EXPECT_NEAR(rays.depth(ray, 0.5),
                      along(camera.z, ray.origin + ray.length / 2 * ray.direction) /
                          along(camera.w, ray.origin + ray.length / 2 * ray.direction),
                      1e-9);
          EXPECT_LT(rays.depth(ray, std::nextafter(1, 0)), 1);
          EXPECT_EQ(rays.depth(ray, 1), 1);
        }
      }
}

TEST(SampleRays, RefuseWhatHasNoView) {
  EXPECT_EQ(input_error([] {
              SampleRays(look_at_origin({0, 0, 3}, 1, 1, 5,
                                        {.width = 1, .height = 9, .sampling = Sampling::kCorner}));
            }),
            "size: sampling at the image's corners needs two rows and columns");
  Camera singular = look_at_origin({0, 0, 3}, 1, 1, 5, {.width = 4, .height = 4});
  singular.y = singular.x;
  EXPECT_ANY_THROW(SampleRays{singular});
}

TEST(SampleRays, TellBackFaces) {
  const SampleRays rays(look_at_origin({0, 0, 3}, 1, 1, 5, {.width = 1, .height = 1}));
  const SampleRay ray = rays.row(0).at(0);
  EXPECT_FALSE(SampleRays::is_back_face({{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}, ray));
  EXPECT_TRUE(SampleRays::is_back_face({{-1, -1, 0}, {0, 1, 0}, {1, -1, 0}}, ray));
}

TEST(SampleRays, PositionIsThePlanesWhateverTheOrderOfTheCorners) {
  const SampleRays rays(look_at_origin({0, 0, 3}, 1, 1, 5, {.width = 8, .height = 8}));
  const SampleRay ray = rays.row(2).at(5);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(-1, 1);
  const auto point = [&] { return Vec3{unit(random), unit(random), unit(random)}; };
  for (int i = 0; i < 200; ++i) {
    const Triangle t{point(), point(), point()};
    const double position = rays.position(t, ray);
    for (const Triangle& same : {Triangle{t.b, t.c, t.a}, Triangle{t.c, t.b, t.a}, Triangle{t.a, t.c, t.b}})
      EXPECT_EQ(rays.position(same, ray), position);
  }
  // z = 3 - 1 - 4 position for any ray: near plane, middle, far plane; and a plane along the ray.
  EXPECT_EQ(rays.position({{-9, -9, 2}, {9, -9, 2}, {0, 9, 2}}, ray), 0);
  EXPECT_NEAR(rays.position({{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}}, ray), 0.5, 1e-15);
  EXPECT_EQ(rays.position({{-9, -9, -2}, {9, -9, -2}, {0, 9, -2}}, ray), 1);
  // Almost along the ray: the plane is met far away, the triangle is not.
  const SampleRay other = rays.row(2).at(4);
  const Vec3d p = other.origin + 1e-3 * other.direction, q = other.origin + 2e-3 * other.direction;
  const auto rounded = [](const Vec3d& v) {
    return Vec3{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  };
  for (const float offset : {-1e-7f, 1e-7f}) {
    const Triangle thin{rounded(p), rounded(q), {rounded(q).x, rounded(q).y + offset, rounded(q).z}};
    EXPECT_NEAR(rays.position(thin, other), 1.5e-3 / other.length, 1e-3 / other.length);
  }
  const SampleRays middle(look_at_origin({0, 0, 3}, 1, 1, 5, {.width = 1, .height = 1}));
  EXPECT_TRUE(std::isnan(middle.position({{0, -1, 0}, {0, 1, 0}, {0, 0, 1}}, middle.row(0).at(0))));
}

}  // namespace
}  // namespace rasterbench
