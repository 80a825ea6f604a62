// Runs of pixels equal their pixels, whatever their start and length: what makes a mode with runs independent
// of tiles and strategies.
#include <gtest/gtest.h>

#include <bit>

#include "numeric/coverage_testing.h"

namespace rasterbench {
namespace {

template <class Mode>
class Runs : public EveryMode<Mode> {};
TYPED_TEST_SUITE(Runs, ModeTypes, ModeNames);

constexpr int kWidth = 192;  // three blocks of 64

/// A triangle about the first rows of an image: large, thin, or small.
std::array<Point, 3> random_triangle(Random& random, int i) {
  if (i % 3 == 0) return random_sliver(random, 150);
  std::array<Point, 3> t;
  for (Point& p : t) p = {random.uniform(-40, kWidth + 40), random.uniform(-30, 60), random.uniform(-1, 1)};
  if (i % 3 == 1) t[1] = {t[0].x + random.uniform(-9, 9), t[0].y + random.uniform(-9, 9), 0.5};
  return t;
}

TYPED_TEST(Runs, EqualTheirPixelsForEveryStartAndLength) {
  if constexpr (!RunMode<TypeParam>) {
    GTEST_SKIP() << TypeParam::kInfo.name << " has no runs";
  } else {
    Random random(91);
    int inside = 0, outside = 0;
    for (int i = 0; i < 36; ++i) {
      const auto t = random_triangle(random, i);
      const auto prepared = prepare<TypeParam>(t[0], t[1], t[2], kFillRules[i % 2]);
      const int y = static_cast<int>(t[0].y + (t[2].y - t[0].y) * random.uniform());
      if (y < 0) continue;
      std::array<bool, kWidth> pixels;
      std::array<std::uint32_t, kWidth> depths;
      for (int x = 0; x < kWidth; ++x) {
        const auto at = static_cast<std::size_t>(x);
        pixels[at] = TypeParam::inside(prepared, x, y);
        depths[at] = std::bit_cast<std::uint32_t>(TypeParam::depth(prepared, x, y));
        ++(pixels[at] ? inside : outside);
      }
      for (int first = 0; first < kWidth; ++first)
        for (int n = 1; n <= 64 - first % 64; ++n) {
          const std::uint64_t run = TypeParam::inside_run(prepared, first, y, n);
          std::array<float, 65> run_depths;
          run_depths[static_cast<std::size_t>(n)] = 77;
          TypeParam::depth_run(prepared, first, y, n, run_depths.data());
          ASSERT_EQ(run_depths[static_cast<std::size_t>(n)], 77) << "written beyond the run";
          if (n < 64) {
            ASSERT_EQ(run >> n, 0u);
          }
          for (int k = 0; k < n; ++k) {
            const auto at = static_cast<std::size_t>(first + k);
            ASSERT_EQ((run >> k & 1) != 0, pixels[at]) << i << ": " << first << " + " << k << " of " << n;
            ASSERT_EQ(std::bit_cast<std::uint32_t>(run_depths[static_cast<std::size_t>(k)]), depths[at])
                << i << ": " << first << " + " << k << " of " << n;
          }
        }
    }
    EXPECT_GT(inside, 200);
    EXPECT_GT(outside, 300);
  }
}

TYPED_TEST(Runs, AreOfThreeEdges) {
  if (!TypeParam::kInfo.numbers.bounded) GTEST_SKIP() << "the compiler may arrange each expression anew";
  Random random(92);
  for (int i = 0; i < 60; ++i) {
    const auto t = random_triangle(random, i);
    const auto prepared = prepare<TypeParam>(t[0], t[1], t[2], kFillRules[i % 2]);
    const PixelBox box = intersect(prepared.box, {0, 0, kWidth, 40});
    for (int y = box.y0; y < box.y1; y += 3)
      for (int x = box.x0; x < box.x1; ++x) {
        bool all = true;
        for (int e = 0; e < 3; ++e) all = TypeParam::inside_edge(prepared, e, x, y) && all;
        ASSERT_EQ(TypeParam::inside(prepared, x, y), all);
      }
  }
}

TEST(Incremental, AddsFromTheLastColumnOf64) {
  // The sum of every pixel of a row, written down: the value at a column of 64, then one addition a pixel.
  Random random(93);
  int differing = 0;
  for (int i = 0; i < 60; ++i) {
    const auto t = random_triangle(random, i);
    const auto prepared = prepare<F32Incremental>(t[0], t[1], t[2], FillRule::kClosed);
    const int y = 3 + i % 17;
    for (int e = 0; e < 3; ++e) {
      float sum = 0;
      for (int x = 0; x < kWidth; ++x) {
        const float direct = CrossEdges<float>::value(prepared, e, x, y);
        sum = x % 64 == 0 ? direct : sum - prepared.dy[e];
        ASSERT_EQ(std::bit_cast<std::uint32_t>(F32Incremental::edge_value(prepared, e, x, y)),
                  std::bit_cast<std::uint32_t>(sum))
            << x;
        ASSERT_EQ(F32Incremental::inside_edge(prepared, e, x, y), sum >= 0);
        differing += sum != direct;
      }
    }
  }
  EXPECT_GT(differing, 1000);  // it does round on the way
}

}  // namespace
}  // namespace rasterbench
