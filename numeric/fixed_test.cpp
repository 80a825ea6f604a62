// Fixed point: snapping, and the symmetries and exactness that integers give.
#include <gtest/gtest.h>

#include <bit>

#include "numeric/coverage_testing.h"

namespace rasterbench {
namespace {

template <class Mode, int Bits>
struct FixedMode {
  using Type = Mode;
  static constexpr std::int32_t kOne = 1 << Bits;  ///< units per pixel
};

struct FixedNames {
  template <class Mode>
  static std::string GetName(int) {
    return std::string(Mode::Type::kInfo.name);
  }
};

template <class Mode>
class Fixed : public testing::Test {
 protected:
  static constexpr std::int32_t kOne = Mode::kOne;

  static Point pixels(const IntPoint& p) {
    return {static_cast<double>(p.x) / kOne, static_cast<double>(p.y) / kOne};
  }

  static IntPoint sample(std::int32_t x, std::int32_t y) {
    return {Int128{x} * kOne + kOne / 2, Int128{y} * kOne + kOne / 2};
  }

  /// Where `coordinate` px is snapped to, in units: read back from the corner that sorts first.
  static std::array<std::int32_t, 2> snapped(double coordinate) {
    const auto p = prepare<typename Mode::Type>({coordinate, coordinate}, {coordinate + 100, coordinate + 7},
                                                {coordinate + 50, coordinate + 90}, FillRule::kClosed);
    return {p.ax[0], p.ay[0]};
  }

  /// A random triangle on units within a 32 x 32 image and a margin.
  static std::array<Point, 3> random_triangle(Random& random) {
    std::array<Point, 3> t;
    for (Point& p : t) {
      const auto coordinate = [&] {
        return static_cast<double>(random.bits() % (48 * std::uint64_t{kOne})) / kOne - 8;
      };
      p = {coordinate(), coordinate(), random.uniform(-1, 1)};
      if (random.bits() % 2 == 0) p = {std::floor(p.x) + 0.5, std::floor(p.y) + 0.5, p.d};  // on a centre
    }
    return t;
  }
};
using FixedModes = testing::Types<FixedMode<Fixed4, 4>, FixedMode<Fixed8, 8>, FixedMode<Fixed12, 12>,
                                  FixedMode<Fixed8Unorm24, 8>>;
TYPED_TEST_SUITE(Fixed, FixedModes, FixedNames);

TYPED_TEST(Fixed, SnapsToTheNearestAndTiesToEven) {
  const auto expect = [](double numerator, std::int32_t units) {  // numerator units
    EXPECT_EQ(TestFixture::snapped(numerator / TestFixture::kOne), (std::array{units, units})) << numerator;
  };
  expect(128, 128);
  expect(128.25, 128);
  expect(128.75, 129);
  expect(128.5, 128);
  expect(129.5, 130);
  expect(0.5, 0);
  expect(1.5, 2);
  expect(-0.5, 0);
  expect(-1.5, -2);
  expect(-1.25, -1);
  expect(-1.75, -2);
}

TYPED_TEST(Fixed, SnappingDecidesACentreNearAnEdge) {
  using M = typename TypeParam::Type;
  constexpr double kUnit = 1.0 / TestFixture::kOne;
  const auto covers_centre = [](double left) {
    return covers<M>(prepare<M>({left, 0}, {left, 8}, {8, 4}, FillRule::kTopLeft), 3, 3);
  };
  EXPECT_TRUE(covers_centre(3.5));
  EXPECT_TRUE(covers_centre(3.5 + 0.5 * kUnit));    // a tie: to even, that is onto the centre
  EXPECT_FALSE(covers_centre(3.5 + 0.75 * kUnit));  // to the next unit
}

TYPED_TEST(Fixed, EqualsExactIntegersUpToTheGuardBand) {
  using M = typename TypeParam::Type;
  constexpr std::int64_t kUnit = TestFixture::kOne, kBand = 131072 * kUnit;
  constexpr std::int64_t kFloatStep = std::max<std::int64_t>(1, kUnit / 128);  // of a float32 below 2^17 px
  Random random(31);
  const auto within = [&](std::int64_t extent) {
    return static_cast<std::int64_t>(random.bits() % static_cast<std::uint64_t>(2 * extent + 1)) - extent;
  };
  std::int64_t covered = 0, on_edges = 0;
  for (int i = 0; i < 2000; ++i) {
    // Corners up to +-2^17 px or within 512 px, as fine as float32 is there, or on halves, so that edges run
    // through centres.
    const std::int64_t extent = i % 2 == 0 ? kBand : 512 * kUnit;
    const std::int64_t grid = i % 4 < 2 ? kUnit / 2 : i % 2 == 0 ? kFloatStep : 1;
    IntTriangle t;
    for (IntPoint& p : t) p = {within(extent / grid) * grid, within(extent / grid) * grid};
    if (i % 16 == 0)  // the corners of the guard band: the largest products of all
      for (IntPoint& p : t) p = {within(1) < 0 ? -kBand : kBand, within(1) < 0 ? -kBand : kBand};
    for (const FillRule fill : kFillRules) {
      const auto prepared =
          prepare<M>(TestFixture::pixels(t[0]), TestFixture::pixels(t[1]), TestFixture::pixels(t[2]), fill);
      for (int k = 0; k < 40; ++k) {
        // Pixels around corners, along edges, and anywhere.
        const IntPoint &a = t[static_cast<std::size_t>(k % 3)], &b = t[static_cast<std::size_t>((k + 1) % 3)];
        const double s = k < 10 ? 0 : random.uniform();
        auto x = static_cast<std::int32_t>(
            std::floor((static_cast<double>(a.x) + s * static_cast<double>(b.x - a.x)) / kUnit));
        auto y = static_cast<std::int32_t>(
            std::floor((static_cast<double>(a.y) + s * static_cast<double>(b.y - a.y)) / kUnit));
        x = std::clamp(x + static_cast<std::int32_t>(within(1)), -131072, 131071);
        y = std::clamp(y + static_cast<std::int32_t>(within(1)), -131072, 131071);
        const IntPoint sample = TestFixture::sample(x, y);
        ASSERT_EQ(covers<M>(prepared, x, y), exactly_covers(t, sample, fill)) << i << ": " << x << "," << y;
        covered += exactly_covers(t, sample, fill);
        on_edges +=
            exactly_covers(t, sample, FillRule::kClosed) != exactly_covers(t, sample, FillRule::kTopLeft);
      }
    }
  }
  EXPECT_GT(covered, 25000);
  EXPECT_GT(on_edges, 250);
}

TYPED_TEST(Fixed, ShiftsByWholePixels) {
  using M = typename TypeParam::Type;
  // As far as float32 holds the fraction bits.
  constexpr int kFar = TestFixture::kOne > 256 ? 4000 : 65000;
  Random random(32);
  for (int i = 0; i < 100; ++i) {
    const auto t = TestFixture::random_triangle(random);
    const int dx = i % 2 == 0 ? 17 : kFar, dy = i % 4 < 2 ? -5 : kFar - 100;
    const auto moved = [&](const Point& p) { return Point{p.x + dx, p.y + dy, p.d}; };
    for (const FillRule fill : kFillRules) {
      const auto here = prepare<M>(t[0], t[1], t[2], fill);
      const auto there = prepare<M>(moved(t[0]), moved(t[1]), moved(t[2]), fill);
      for (int y = -8; y < 40; ++y)
        for (int x = -8; x < 40; ++x) {
          ASSERT_EQ(covers<M>(there, x + dx, y + dy), covers<M>(here, x, y)) << i;
          if (covers<M>(here, x, y)) {
            ASSERT_EQ(std::bit_cast<std::uint64_t>(depth_at<M>(there, x + dx, y + dy)),
                      std::bit_cast<std::uint64_t>(depth_at<M>(here, x, y)));
          }
        }
    }
  }
}

TYPED_TEST(Fixed, IsSymmetricInAMirrorButForTheTiesOfTopLeft) {
  using M = typename TypeParam::Type;
  Random random(33);
  for (int i = 0; i < 100; ++i) {
    const auto t = TestFixture::random_triangle(random);
    const auto mirrored = [&](const Point& p) { return Point{32 - p.x, p.y, p.d}; };
    const auto flipped = [&](const Point& p) { return Point{p.x, 32 - p.y, p.d}; };
    const auto here = prepare<M>(t[0], t[1], t[2], FillRule::kClosed);
    const auto left_right = prepare<M>(mirrored(t[0]), mirrored(t[1]), mirrored(t[2]), FillRule::kClosed);
    const auto up_down = prepare<M>(flipped(t[0]), flipped(t[1]), flipped(t[2]), FillRule::kClosed);
    for (int y = -8; y < 40; ++y)
      for (int x = -8; x < 40; ++x) {
        ASSERT_EQ(covers<M>(left_right, 31 - x, y), covers<M>(here, x, y)) << i;
        ASSERT_EQ(covers<M>(up_down, x, 31 - y), covers<M>(here, x, y)) << i;
      }
  }
}

}  // namespace
}  // namespace rasterbench
