// Depth: the plane through the corners, never outside of their depths.
#include <gtest/gtest.h>

#include <limits>

#include "numeric/coverage_testing.h"

namespace rasterbench {
namespace {

template <class Mode>
class Depth : public BoundedMode<Mode> {};
TYPED_TEST_SUITE(Depth, ModeTypes, ModeNames);

TYPED_TEST(Depth, OfAPlaneThatNeedsNoRounding) {
  // d = 0.25 + x/64 - y/32, with corners at short binary fractions.
  const auto plane = [](double x, double y) { return 0.25 + x / 64 - y / 32; };
  const auto corner = [&](double x, double y) { return Point{x, y, plane(x, y)}; };
  const auto prepared =
      prepare<TypeParam>(corner(1.25, 0.5), corner(15.5, 4.25), corner(3.75, 14), FillRule::kClosed);
  // The gradients are quotients: exact up to the last bits of the coarsest format on the way. Neither term
  // exceeds one half, so that an approximate reciprocal's error is less than doubled.
  const ModeBound& bound = TypeParam::kInfo.numbers;
  const double allowed = 4 * std::max(bound.depth_unit, bound.gradient_unit) + bound.reciprocal_error;
  int covered = 0;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) {
      if (!covers<TypeParam>(prepared, x, y)) continue;
      ++covered;
      EXPECT_NEAR(depth_at<TypeParam>(prepared, x, y), plane(x + 0.5, y + 0.5), allowed);
    }
  EXPECT_GT(covered, 70);
}

TYPED_TEST(Depth, OfAFlatTriangleIsThatOfItsCornersToTheBit) {
  const auto prepared =
      prepare<TypeParam>({1.1, 0.7, 0.3}, {14.9, 3.3, 0.3}, {4.2, 13.6, 0.3}, FillRule::kClosed);
  for (int y = 2; y < 8; ++y)
    EXPECT_EQ(depth_at<TypeParam>(prepared, 4, y), double{static_cast<typename TypeParam::Real>(0.3)});
}

/// What the others promise, too.
template <class Mode>
class DepthRange : public EveryMode<Mode> {};
TYPED_TEST_SUITE(DepthRange, ModeTypes, ModeNames);

TYPED_TEST(DepthRange, StaysWithinTheCorners) {
  using Real = typename TypeParam::Real;
  Random random(21);
  std::int64_t covered = 0;
  for (int i = 0; i < 1000; ++i) {
    // Slivers along a diagonal: their gradients are huge, and rounding would leave the range.
    const double x = random.uniform(-4, 40), y = random.uniform(-4, 40), length = random.uniform(5, 60);
    const double width = std::pow(10.0, random.uniform(-6, 0.5));
    const Point a{x, y, random.uniform(-1, 1)}, b{x + length, y + length, random.uniform(-1, 1)},
        c{x + length / 3, y + length / 3 + width, random.uniform(-1, 1)};
    const auto prepared = prepare<TypeParam>(a, b, c, FillRule::kClosed);
    const double low = static_cast<Real>(std::min({a.d, b.d, c.d})),
                 high = static_cast<Real>(std::max({a.d, b.d, c.d}));
    const PixelBox box = intersect(prepared.box, {0, 0, 48, 48});
    for (int py = box.y0; py < box.y1; ++py)
      for (int px = box.x0; px < box.x1; ++px) {
        const double depth = depth_at<TypeParam>(prepared, px, py);  // anywhere in the box, covered or not
        ASSERT_GE(depth, low);
        ASSERT_LE(depth, high);
        covered += covers<TypeParam>(prepared, px, py);
      }
  }
  EXPECT_GT(covered, 1000);
}

TYPED_TEST(DepthRange, GradientsThatOverflowStayWithinTheCorners) {
  // Without the near clip a corner close to the camera's plane has a depth towards minus infinity.
  using Real = typename TypeParam::Real;
  const double huge = 0.9 * std::numeric_limits<Real>::max();
  for (const auto& d : {std::array{-huge, 0.5, huge}, {huge, -huge, huge}, {-huge, huge, 0.25}}) {
    const auto prepared =
        prepare<TypeParam>({0.5, 0.5, d[0]}, {14.5, 2.5, d[1]}, {2.5, 14.5, d[2]}, FillRule::kClosed);
    for (int y = 0; y < 15; ++y)
      for (int x = 0; x < 15; ++x) {
        const double depth = depth_at<TypeParam>(prepared, x, y);
        ASSERT_TRUE(depth >= static_cast<Real>(-huge) && depth <= static_cast<Real>(huge)) << depth;
      }
  }
}

TEST(DepthPlanes, ANumberThatIsNoneBecomesTheLowerEnd) {
  constexpr float inf = std::numeric_limits<float>::infinity();
  const DepthPlane<float> plane{.d0 = 0.5f, .gx = inf, .gy = -inf, .low = 0.25f, .high = 0.75f};
  EXPECT_EQ(plane.at(0, 1), 0.25f);  // inf * 0
  EXPECT_EQ(plane.at(1, 1), 0.25f);  // inf - inf
  EXPECT_EQ(plane.at(1, -1), 0.75f);
  EXPECT_EQ(plane.at(-1, 1), 0.25f);
}

}  // namespace
}  // namespace rasterbench
