// Depth functions: what the geometry stage makes of each, the way back to the d of the course contract, and
// the far plane in every mode.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "base/error.h"
#include "numeric/coverage_testing.h"
#include "pipeline/geometry_testing.h"

namespace rasterbench {
namespace {

constexpr DepthFunction kFunctions[] = {DepthFunction::kNdc, DepthFunction::kReversed,
                                        DepthFunction::kInverseW};

template <class Real>
std::vector<ScreenTriangle<Real>> transformed(const std::vector<Triangle>& triangles, const Camera& camera,
                                              DepthFunction function) {
  std::vector<ScreenTriangle<Real>> slots(triangles.size()), extra;
  GeometryCounts counts;
  transform_triangles<Real>(triangles, 0, make_screen_transform(camera, function), {}, slots.data(), extra,
                            counts);
  slots.insert(slots.end(), extra.begin(), extra.end());
  return slots;
}

TEST(DepthFunctions, OfTheSamePlacesAreTheSameD) {
  Random random(101);
  std::vector<Triangle> triangles;
  for (int i = 0; i < 3000; ++i) triangles.push_back(random_triangle(random, i % 4 == 0));
  // random_triangle puts corners about the origin; the first camera is there, too.
  const Viewport viewport{.width = 64, .height = 48};
  std::vector<Camera> cameras{plain_camera(64, 48)};
  for (const auto& [n, f] : {std::pair{1.0, 9.0}, {0.1, 1e4}, {1e-9, 1e9}, {2.5, 2.5625}})
    cameras.push_back(look_at_origin({3, 4, 5}, 1.2, n, f, viewport));
  int on_near = 0;
  for (const Camera& camera : cameras) {
    const auto ndc = transformed<double>(triangles, camera, DepthFunction::kNdc);
    for (const DepthFunction function : kFunctions) {
      const DepthMap map = depth_map(camera, function);
      const auto other = transformed<double>(triangles, camera, function);
      ASSERT_EQ(other.size(), ndc.size());
      int corners = 0;
      for (std::size_t i = 0; i < ndc.size(); ++i) {
        ASSERT_EQ(other[i].id, ndc[i].id);
        if (ndc[i].id < 0) continue;
        for (int k = 0; k < 3; ++k) {
          ++corners;
          ASSERT_EQ(other[i].x[k], ndc[i].x[k]);  // only the depth depends on the function
          ASSERT_EQ(other[i].y[k], ndc[i].y[k]);
          // z's coefficients are of the size of (f+n)/(f-n), and so are its rounding errors.
          const double size = (camera.far_plane + camera.near_plane) / (camera.far_plane - camera.near_plane);
          const double d = map.offset + map.scale * other[i].d[k];
          ASSERT_NEAR(d, ndc[i].d[k], 1e-11 * size * std::max(1.0, std::abs(ndc[i].d[k]))) << i;
          if (ndc[i].d[k] != -1) continue;
          ++on_near;
          if (function == DepthFunction::kReversed) {
            ASSERT_EQ(other[i].d[k], -1);
          }
          if (function == DepthFunction::kInverseW) {
            ASSERT_NEAR(other[i].d[k] * camera.near_plane / camera.far_plane, -1, 1e-15);
          }
        }
      }
      EXPECT_GT(corners, 300);
    }
  }
  EXPECT_GT(on_near, 300);
}

TEST(DepthFunctions, GrowWithTheDistance) {
  for (const auto& [n, f] : {std::pair{1.0, 9.0}, {1e-6, 1e6}}) {
    const Camera camera = look_at_origin({0, 0, 2}, 1, n, f, {.width = 8, .height = 8});
    for (const DepthFunction function : kFunctions) {
      std::vector<Triangle> triangles;  // facing the camera, ever farther away
      for (double z = 1.01 * n; z < 0.99 * f; z *= 1.25)
        triangles.push_back({at_pixel(0, 0, z), at_pixel(8, 0, z), at_pixel(0, 8, z)});
      for (Triangle& t : triangles)
        for (Vec3* p : {&t.a, &t.b, &t.c}) p->z += 2;
      const auto screen = transformed<double>(triangles, camera, function);
      for (std::size_t i = 1; i < screen.size(); ++i) {
        // Moving by 2 rounds the nearest ones to the same place.
        if (triangles[i].a.z == triangles[i - 1].a.z) continue;
        if (screen[i].id < 0 || screen[i - 1].id < 0) continue;
        EXPECT_LE(screen[i - 1].d[0], screen[i].d[0]) << i;
        EXPECT_LT(screen[i].d[0], far_value(function));
      }
    }
  }
}

TEST(DepthFunctions, OneOverWNeedsPerspective) {
  const Camera flat = orthographic_at_origin({0, 0, 5}, 2, 1, 9, {.width = 8, .height = 8});
  EXPECT_THROW(make_screen_transform(flat, DepthFunction::kInverseW), Error);
  // Reversed z needs none: at the origin, 5 in front of the camera, it is -(9 - 5)/8.
  const auto t =
      transformed<double>({Triangle{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}, flat, DepthFunction::kReversed);
  EXPECT_EQ(t[0].d[0], -0.5);
  EXPECT_EQ(t[0].d[1], -0.5);
}

template <class Mode>
class FarPlane : public EveryMode<Mode> {};
TYPED_TEST_SUITE(FarPlane, ModeTypes, ModeNames);

TYPED_TEST(FarPlane, HidesWhatLiesOnItOrBeyond) {
  using Real = typename TypeParam::Real;
  // A wall from z = 5 on the left to z = 20 on the right; the far plane at z = 9 cuts it. 1/z is linear on
  // the screen: 0.2 at x = 0 and 0.05 at x = 64.
  const Camera camera = plain_camera(64, 64);
  const auto corner = [](double x, double y, double z) {
    return Vec3{static_cast<float>((x - 32) / 32 * z), static_cast<float>((32 - y) / 32 * z),
                static_cast<float>(-z)};
  };
  const std::vector<Triangle> wall{{corner(0, 0, 5), corner(64, 0, 20), corner(0, 64, 5)}};
  const auto screen = transformed<Real>(wall, camera, TypeParam::kDepthFunction);
  const DepthMap map = depth_map(camera, TypeParam::kDepthFunction);
  const auto prepared = TypeParam::prepare(screen[0], SampleGrid{FillRule::kClosed, 64, 64}, 0);
  const ModeBound& bound = TypeParam::kInfo.numbers;
  // Corners are floats, and fixed_4 moves them: a pixel of the wall is 0.0053 deep.
  const double tolerance = 1e-6 + bound.depth_step + 2 * bound.reciprocal_error + 0.006 * bound.snap;
  int drawn = 0, hidden = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 63 - y; ++x) {
      ASSERT_TRUE(covers<TypeParam>(prepared, x, y));
      const double d = 1.25 - 2.25 * (0.2 - 0.15 * (x + 0.5) / 64);
      const auto key = TypeParam::key(TypeParam::depth(prepared, x, y), 0);
      if (std::abs(d - 1) < tolerance) continue;
      ASSERT_EQ(key < TypeParam::kClear, d < 1) << x << "," << y;
      ++(d < 1 ? drawn : hidden);
      if (d > 1) continue;
      EXPECT_NEAR(TypeParam::output_depth(key, map), d, tolerance) << x << "," << y;
      EXPECT_NEAR(map.offset + map.scale * TypeParam::value(key), d, tolerance);
    }
  EXPECT_GT(drawn, 900);
  EXPECT_GT(hidden, 100);
}

TYPED_TEST(FarPlane, HidesNothingThatTheFormatTellsApartFromIt) {
  using Real = typename TypeParam::Real;
  // Level triangles just in front of the far plane; d differs from 1 by 2.25/z - 0.25, about 0.25 (9/z - 1).
  const Camera camera = plain_camera(8, 8);
  const DepthMap map = depth_map(camera, TypeParam::kDepthFunction);
  const double step = std::max(TypeParam::kInfo.numbers.depth_step, 0x1p-23);
  for (const double relative : {0x1p-10, 0x1p-13, 0x1p-18, 0x1p-20}) {
    const double z = 9 * (1 - relative);  // a float
    const std::vector<Triangle> level{{at_pixel(-9, -9, z), at_pixel(30, -9, z), at_pixel(-9, 30, z)}};
    const auto screen = transformed<Real>(level, camera, TypeParam::kDepthFunction);
    ASSERT_EQ(screen[0].id, 0);
    const auto prepared = TypeParam::prepare(screen[0], SampleGrid{FillRule::kClosed, 8, 8}, 0);
    const auto key = TypeParam::key(TypeParam::depth(prepared, 4, 4), 0);
    const double gap = 2.25 / z - 0.25;
    // Formats with few bits round what is nearer than half a step to the far plane: it is not drawn.
    EXPECT_EQ(key<TypeParam::kClear, gap> step / 2) << relative;
    EXPECT_NEAR(TypeParam::output_depth(key, map), 1 - gap, step) << relative;
  }
}

}  // namespace
}  // namespace rasterbench
