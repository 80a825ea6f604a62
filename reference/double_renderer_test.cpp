#include "reference/double_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace rasterbench {
namespace {

// At z = 3, looking at the origin: x_px = (scale x / (3 - z) + 1) W / 2. With W = H = 8 and scale 3, the
// plane z = 0 shows x = -1 .. 1 on 0 .. 8, a pixel is 1/4 wide, and every product of these is exact.
Camera camera_at_3(int width, int height, double near_plane = 1, double far_plane = 5, double scale = 3) {
  const double n = near_plane, f = far_plane, a = (n + f) / (n - f), b = 2 * n * f / (n - f);
  return {.x = {scale, 0, 0, 0},
          .y = {0, scale, 0, 0},
          .z = {0, 0, a, b - 3 * a},
          .w = {0, 0, -1, 3},
          .near_distance = {0, 0, -1, 3 - n},
          .viewport = {.width = width, .height = height, .sampling = Sampling::kCentre}};
}

// The corner on the plane z that is seen at pixel position (x, y) of an 8 x 8 picture.
Vec3 at_pixel(double x, double y, double z = 0) {
  const double k = (3 - z) / 3;
  return {static_cast<float>((x / 4 - 1) * k), static_cast<float>((1 - y / 4) * k), static_cast<float>(z)};
}

std::int64_t count(const IdImage& image, std::int32_t id) {
  return std::count(image.ids.begin(), image.ids.end(), id);
}

IdImage draw(const std::vector<Triangle>& triangles, FillRule fill = FillRule::kClosed,
             NearRule near_rule = NearRule::kClip, const Camera& camera = camera_at_3(8, 8)) {
  return render_in_double(triangles, camera, fill, near_rule);
}

TEST(DoubleRenderer, DrawsATriangleCountedByHand) {
  // Corners on pixel corners; the slanted edge passes through the centres of a diagonal: 1 + 2 + ... + 8
  // closed.
  const std::vector<Triangle> half = {{at_pixel(0, 0), at_pixel(8, 8), at_pixel(0, 8)}};
  const IdImage closed = draw(half);
  EXPECT_EQ(count(closed, 0), 36);
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) EXPECT_EQ(closed.ids[static_cast<std::size_t>(8 * i + j)], j <= i ? 0 : -1);
  // Its slanted edge is a right edge.
  EXPECT_EQ(count(draw(half, FillRule::kTopLeft), 0), 28);
}

TEST(DoubleRenderer, DepthIsThatOfTheProjection) {
  // At w = 3: d = (n + f)/(f - n) - 2nf/((f - n) w) = 1.5 - 2.5 / 3.
  const IdImage flat = draw({{at_pixel(0, 0), at_pixel(8, 8), at_pixel(0, 8)}});
  EXPECT_NEAR(flat.depths[8], 1.5 - 2.5 / 3, 1e-15);
  EXPECT_EQ(flat.depths[1], 1);
  // Slanted: 1/w is linear on the screen. From w = 2 at y = 0 to w = 4 at y = 8.
  const IdImage slanted = draw({{at_pixel(0, 0, 1), at_pixel(8, 0, 1), at_pixel(0, 8, -1)}});
  for (int i = 0; i < 8; ++i) {
    const double inverse_w = 0.5 - 0.25 * (i + 0.5) / 8;
    EXPECT_NEAR(slanted.depths[static_cast<std::size_t>(8 * i)], 1.5 - 2.5 * inverse_w,
                1e-8);  // corners are floats
  }
}

TEST(DoubleRenderer, SampleOnAnEdgeHasOneOwnerInTopLeft) {
  // A quad of two triangles whose outline and diagonal pass through centres, in all orders of the corners.
  const Vec3 a = at_pixel(1.5, 1.5), b = at_pixel(5.5, 1.5), c = at_pixel(5.5, 5.5), d = at_pixel(1.5, 5.5);
  for (const auto& quad :
       {std::vector<Triangle>{{a, b, c}, {a, c, d}}, std::vector<Triangle>{{c, b, a}, {d, a, c}},
        std::vector<Triangle>{{b, c, d}, {d, b, a}}}) {
    const IdImage first = draw({quad[0]}, FillRule::kTopLeft), second = draw({quad[1]}, FillRule::kTopLeft);
    const IdImage both = draw(quad, FillRule::kTopLeft);
    for (std::size_t p = 0; p < 64; ++p) {
      const bool inside = p / 8 >= 1 && p / 8 < 5 && p % 8 >= 1 && p % 8 < 5;
      EXPECT_EQ((first.ids[p] == 0) + (second.ids[p] == 0), inside ? 1 : 0) << p;
      EXPECT_EQ(both.ids[p] >= 0, inside) << p;
    }
    const IdImage closed = draw(quad);
    EXPECT_EQ(count(closed, 0), 15);  // the smaller id has the diagonal
    EXPECT_EQ(count(closed, 1), 10);
  }
}

TEST(DoubleRenderer, NearestIsDrawnAndTheSmallestIdWinsATie) {
  const Triangle near_one = {at_pixel(0, 0, 1), at_pixel(8, 0, 1), at_pixel(0, 8, 1)};
  const Triangle far_one = {at_pixel(0, 0), at_pixel(8, 0), at_pixel(0, 8)};
  EXPECT_EQ(count(draw({far_one, near_one}), 1), 36);
  EXPECT_EQ(count(draw({near_one, far_one}), 0), 36);
  EXPECT_EQ(count(draw({near_one, near_one}), 0), 36);
  const Triangle back_face = {near_one.a, near_one.c, near_one.b};
  EXPECT_EQ(count(draw({far_one, back_face}), 1), 36);
}

TEST(DoubleRenderer, NearPlaneCutsAndFarPlaneHides) {
  // A wall beside the axis along z: x = -1, from behind the camera to far away, higher than the picture. The
  // near plane w = 1 shows x = -1 at pixel -8, w = 5 at pixel 1.6, w = 3 at pixel 0: columns 0 and 1 (1.5
  // < 1.6).
  const std::vector<Triangle> wall = {{{-1, -100, 50}, {-1, 100, 50}, {-1, 0, -1e6f}}};
  const IdImage image = draw(wall);
  EXPECT_EQ(count(image, 0), 16);
  for (std::size_t p = 0; p < 64; ++p) EXPECT_EQ(image.ids[p], p % 8 < 2 ? 0 : -1);
  EXPECT_EQ(count(draw(wall, FillRule::kClosed, NearRule::kOff), 0), 0);
  // A floor y = -1 shows from w = 3 (pixel 8) to the far plane at w = 5 (pixel 6.4): rows 6 (6.5) and 7.
  const IdImage floor = draw({{{-1000, -1, 50}, {1000, -1, 50}, {0, -1, -1e4f}}});
  EXPECT_EQ(count(floor, 0), 16);
  EXPECT_NEAR(floor.depths[7 * 8], 1.5 - 2.5 / (12 / 3.5), 1e-12);  // at y = 7.5, w = 12 / (y - 4)
  // Facing the camera: just behind the near plane, on it (d = -1, exact), and just in front of it.
  for (const float z : {1.9375f, 2.0f, 2.0625f}) {
    const std::vector<Triangle> one = {{{-9, -9, z}, {9, -9, z}, {0, 9, z}}};
    EXPECT_EQ(count(draw(one), 0), z <= 2 ? 64 : 0);
    EXPECT_EQ(count(draw(one, FillRule::kClosed, NearRule::kOff), 0), 64);
    EXPECT_TRUE(z != 2 || draw(one).depths[0] == -1);
  }
  // On the far plane: d = 1 is not drawn.
  EXPECT_EQ(count(draw({{{-99, -99, -2}, {99, -99, -2}, {0, 99, -2}}}), 0), 0);
}

TEST(DoubleRenderer, DrawsNothingOfWhatIsBehindOrDegenerate) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const Vec3 a = at_pixel(0, 0), b = at_pixel(8, 0), c = at_pixel(0, 8);
  EXPECT_EQ(count(draw({}), -1), 64);
  EXPECT_EQ(count(draw({{{-9, -9, 4}, {9, -9, 4}, {0, 9, 7}}}), 0), 0);
  EXPECT_EQ(count(draw({{{nan, 0, 0}, b, c}, {a, {0, inf, 0}, c}, {a, b, {0, 0, -inf}}}), -1), 64);
  EXPECT_EQ(
      count(draw({{a, a, b}, {a, a, a}, {at_pixel(0.5, 0.5), at_pixel(3.5, 3.5), at_pixel(7.5, 7.5)}}), -1),
      64);
}

TEST(DoubleRenderer, OnePixelAndCornerSampling) {
  const std::vector<Triangle> large = {{{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}}};
  EXPECT_EQ(count(draw(large, FillRule::kTopLeft, NearRule::kClip, camera_at_3(1, 1)), 0), 1);
  Camera corners = camera_at_3(9, 9);
  corners.viewport.sampling = Sampling::kCorner;  // the outermost samples are x, y = -1 and 1, on the outline
  const std::vector<Triangle> quad = {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}},
                                      {{-1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}};
  EXPECT_EQ(count(draw(quad, FillRule::kClosed, NearRule::kClip, corners), -1), 0);
  EXPECT_EQ(count(draw(quad, FillRule::kTopLeft, NearRule::kClip, corners), -1), 17);
}

TEST(DoubleRenderer, HugeAndTinyCoordinatesEndAndAreExact) {
  // The left half of the picture, from corners 1e30 away.
  const std::vector<Triangle> huge = {{{0, -1e30f, 0}, {0, 1e30f, 0}, {-1e30f, 0, 0}}};
  EXPECT_EQ(count(draw(huge), 0), 32);
  // The floor again. From 1e30 on its height is lost to rounding, but it still ends.
  for (const float far : {1e9f, 1e30f}) {
    const std::vector<Triangle> floor = {{{-far, -1, far}, {far, -1, far}, {0, -1, -far}}};
    const std::int64_t drawn = count(draw(floor), 0);
    EXPECT_TRUE(far > 1e9f || drawn == 16) << drawn;
  }
  const float tiny = std::numeric_limits<float>::denorm_min();
  EXPECT_LE(count(draw({{{0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}}}), 0), 1);
  const Camera strip = camera_at_3(kMaxImageSide, 1);
  EXPECT_EQ(count(draw(huge, FillRule::kTopLeft, NearRule::kClip, strip), 0), kMaxImageSide / 2);
}

TEST(DoubleRenderer, MeshWithoutGapsOrOverlapsInTopLeft) {
  // A fan with its hub on a centre, partly in front of the near plane: every centre once, with random spokes.
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(0, 6.283185307179586);
  std::vector<double> angles = {0, 1.6, 3.1, 4.7};
  for (int i = 0; i < 500; ++i) angles.push_back(angle(random));
  std::sort(angles.begin(), angles.end());
  std::vector<Triangle> fan;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const auto rim = [](double t) {
      return Vec3{static_cast<float>(30 * std::cos(t)), static_cast<float>(30 * std::sin(t)),
                  static_cast<float>(3 * std::cos(t))};
    };
    fan.push_back({at_pixel(4.5, 4.5), rim(angles[i]), rim(angles[(i + 1) % angles.size()])});
  }
  std::vector<int> times(64 * 64, 0);
  for (const Triangle& t : fan) {
    const IdImage image = draw({t}, FillRule::kTopLeft, NearRule::kClip, camera_at_3(64, 64, 0.5, 1e3));
    for (std::size_t p = 0; p < times.size(); ++p) times[p] += image.ids[p] == 0;
  }
  EXPECT_EQ(std::count(times.begin(), times.end(), 1), 64 * 64);
}

}  // namespace
}  // namespace rasterbench
