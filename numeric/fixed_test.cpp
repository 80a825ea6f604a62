// fixed_8: snapping, and the symmetries and exactness that integers give.
#include <gtest/gtest.h>

#include <bit>

#include "numeric/coverage_testing.h"
#include "numeric/fixed_8.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

/// Where `coordinate` px is snapped to, in 1/256 px: read back from the corner that sorts first.
std::array<std::int32_t, 2> snapped(double coordinate) {
  const auto p = prepare<Fixed8>({coordinate, coordinate}, {coordinate + 100, coordinate + 7},
                                 {coordinate + 50, coordinate + 90}, FillRule::kClosed);
  return {p.ax[0], p.ay[0]};
}

TEST(Fixed8, SnapsToTheNearestAndTiesToEven) {
  const auto expect = [](double numerator, std::int32_t units) {  // numerator / 256 px
    EXPECT_EQ(snapped(numerator / 256), (std::array{units, units})) << numerator;
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

TEST(Fixed8, SnappingDecidesACentreNearAnEdge) {
  const auto covers_centre = [](double left) {
    return covers<Fixed8>(prepare<Fixed8>({left, 0}, {left, 8}, {8, 4}, FillRule::kTopLeft), 3, 3);
  };
  EXPECT_TRUE(covers_centre(3.5));
  EXPECT_TRUE(covers_centre(3.5 + 1.0 / 512));   // a tie: to even, that is onto the centre
  EXPECT_FALSE(covers_centre(3.5 + 1.5 / 512));  // to the next 1/256
}

TEST(Fixed8, EqualsExactIntegersUpToTheGuardBand) {
  constexpr std::int64_t kBand = std::int64_t{131072} * 256;
  Random random(31);
  const auto within = [&](std::int64_t extent) {
    return static_cast<std::int64_t>(random.bits() % static_cast<std::uint64_t>(2 * extent + 1)) - extent;
  };
  std::int64_t covered = 0, on_edges = 0;
  for (int i = 0; i < 4000; ++i) {
    // Corners up to +-2^17 px, on every second 1/256 px, as float32 is there, or on halves, so that edges run
    // through centres.
    const std::int64_t extent = i % 2 == 0 ? kBand : std::int64_t{512} * 256;
    const std::int64_t grid = i % 4 < 2 ? 128 : 2;
    IntTriangle t;
    for (IntPoint& p : t) p = {within(extent / grid) * grid, within(extent / grid) * grid};
    const auto pixels = [](const IntPoint& p) {
      return Point{static_cast<double>(p.x) / 256, static_cast<double>(p.y) / 256};
    };
    for (const FillRule fill : kFillRules) {
      const auto prepared = prepare<Fixed8>(pixels(t[0]), pixels(t[1]), pixels(t[2]), fill);
      for (int k = 0; k < 40; ++k) {
        // Pixels around corners, along edges, and anywhere.
        const IntPoint &a = t[static_cast<std::size_t>(k % 3)], &b = t[static_cast<std::size_t>((k + 1) % 3)];
        const double s = k < 10 ? 0 : random.uniform();
        auto x = static_cast<std::int32_t>(
            std::floor((static_cast<double>(a.x) + s * static_cast<double>(b.x - a.x)) / 256));
        auto y = static_cast<std::int32_t>(
            std::floor((static_cast<double>(a.y) + s * static_cast<double>(b.y - a.y)) / 256));
        x += static_cast<std::int32_t>(within(1));
        y += static_cast<std::int32_t>(within(1));
        const IntPoint sample{std::int64_t{x} * 256 + 128, std::int64_t{y} * 256 + 128};
        ASSERT_EQ(covers<Fixed8>(prepared, x, y), exactly_covers(t, sample, fill))
            << i << ": " << x << "," << y;
        covered += exactly_covers(t, sample, fill);
        on_edges +=
            exactly_covers(t, sample, FillRule::kClosed) != exactly_covers(t, sample, FillRule::kTopLeft);
      }
    }
  }
  EXPECT_GT(covered, 50000);
  EXPECT_GT(on_edges, 500);
}

/// A random triangle on 1/256 px within a 32 x 32 image and a margin.
std::array<Point, 3> random_triangle(Random& random) {
  std::array<Point, 3> t;
  for (Point& p : t) {
    p.x = static_cast<double>(random.bits() % (48 * 256)) / 256 - 8;
    p.y = static_cast<double>(random.bits() % (48 * 256)) / 256 - 8;
    if (random.bits() % 2 == 0) p = {std::floor(p.x) + 0.5, std::floor(p.y) + 0.5};  // on a centre
    p.d = random.uniform(-1, 1);
  }
  return t;
}

TEST(Fixed8, ShiftsByWholePixels) {
  Random random(32);
  for (int i = 0; i < 200; ++i) {
    const auto t = random_triangle(random);
    const int dx = i % 2 == 0 ? 17 : 65000, dy = i % 4 < 2 ? -5 : 64000;
    const auto moved = [&](const Point& p) { return Point{p.x + dx, p.y + dy, p.d}; };
    for (const FillRule fill : kFillRules) {
      const auto here = prepare<Fixed8>(t[0], t[1], t[2], fill);
      const auto there = prepare<Fixed8>(moved(t[0]), moved(t[1]), moved(t[2]), fill);
      for (int y = -8; y < 40; ++y)
        for (int x = -8; x < 40; ++x) {
          ASSERT_EQ(covers<Fixed8>(there, x + dx, y + dy), covers<Fixed8>(here, x, y)) << i;
          if (covers<Fixed8>(here, x, y)) {
            ASSERT_EQ(std::bit_cast<std::uint32_t>(Fixed8::depth(there, x + dx, y + dy)),
                      std::bit_cast<std::uint32_t>(Fixed8::depth(here, x, y)));
          }
        }
    }
  }
}

TEST(Fixed8, IsSymmetricInAMirrorButForTheTiesOfTopLeft) {
  Random random(33);
  for (int i = 0; i < 200; ++i) {
    const auto t = random_triangle(random);
    const auto mirrored = [&](const Point& p) { return Point{32 - p.x, p.y, p.d}; };
    const auto flipped = [&](const Point& p) { return Point{p.x, 32 - p.y, p.d}; };
    const auto here = prepare<Fixed8>(t[0], t[1], t[2], FillRule::kClosed);
    const auto left_right =
        prepare<Fixed8>(mirrored(t[0]), mirrored(t[1]), mirrored(t[2]), FillRule::kClosed);
    const auto up_down = prepare<Fixed8>(flipped(t[0]), flipped(t[1]), flipped(t[2]), FillRule::kClosed);
    for (int y = -8; y < 40; ++y)
      for (int x = -8; x < 40; ++x) {
        ASSERT_EQ(covers<Fixed8>(left_right, 31 - x, y), covers<Fixed8>(here, x, y)) << i;
        ASSERT_EQ(covers<Fixed8>(up_down, x, 31 - y), covers<Fixed8>(here, x, y)) << i;
      }
  }
}

}  // namespace
}  // namespace rasterbench
