// Mode exact: the nearest triangle is that of rational arithmetic, and its error bound holds.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "numeric/exact_testing.h"

namespace rasterbench {
namespace {

using Screen = ScreenTriangle<float>;

float as_float(double v) { return static_cast<float>(v); }

Screen permuted(const Screen& t, Random& random) {
  std::array<std::size_t, 3> order{0, 1, 2};
  for (std::size_t k = 2; k > 0; --k) std::swap(order[k], order[random.bits() % (k + 1)]);
  Screen p = t;
  for (std::size_t k = 0; k < 3; ++k) {
    p.x[k] = t.x[order[k]];
    p.y[k] = t.y[order[k]];
    p.d[k] = t.d[order[k]];
  }
  return p;
}

/// In the plane d = (p x + q y + r) / 3072, with corners where that is a short fraction: at a sample it is
/// none, so that set-ups of the same plane round differently.
Screen in_plane(Random& random, int p, int q, int r) {
  Screen t{};
  for (int k = 0; k < 3; ++k) {
    const int a = static_cast<int>(random.bits() % 24) - 4, b = static_cast<int>(random.bits() % 24) - 4;
    t.x[k] = as_float(3 * a);
    t.y[k] = as_float(3 * b);
    t.d[k] = as_float((p * a + q * b + r) / 1024.0);
  }
  return t;
}

Screen anywhere(Random& random, double extent) {
  Screen t{};
  for (int k = 0; k < 3; ++k) {
    t.x[k] = as_float(random.uniform(-0.2, 1.2) * extent);
    t.y[k] = as_float(random.uniform(-0.2, 1.2) * extent);
    t.d[k] = as_float(random.uniform(-1, 1));
  }
  return t;
}

Screen sliver(Random& random, double extent) {
  const auto p = random_sliver(random, extent);
  return screen_triangle<float>(p[0], p[1], p[2]);
}

/// Two triangles of one of the kinds whose order is hard to tell.
std::array<Screen, 2> hard_pair(Random& random, int kind) {
  const auto small = [&](int n) { return static_cast<int>(random.bits() % static_cast<std::uint64_t>(n)); };
  if (kind == 0) return {anywhere(random, 40), anywhere(random, 40)};  // interpenetrating
  if (kind == 1) {                                                     // one plane
    const int p = small(15) - 7, q = small(15) - 7;
    return {in_plane(random, p, q, 5), in_plane(random, p, q, 5)};
  }
  if (kind == 2) {  // planes that cross in a line of samples: x = 4.5 or y = 4.5
    const int p = small(7) + 1, q = small(15) - 7, r = small(9);
    return {in_plane(random, p, q, r), in_plane(random, -p, q, r + 3 * p)};
  }
  if (kind == 3) {  // drawn twice
    const Screen t = small(2) == 0 ? anywhere(random, 40) : sliver(random, 40);
    return {t, permuted(t, random)};
  }
  if (kind == 4) {  // drawn twice but for the last bit of a depth, or of a denormal one
    const Screen t = anywhere(random, 40);
    Screen u = permuted(t, random);
    float& moved = u.d[small(3)];
    moved = std::nextafter(moved, small(2) == 0 ? -2.0f : 2.0f);
    return {t, u};
  }
  if (kind == 5) {  // both flat, at depths that a sum would lose
    Screen t = anywhere(random, 40), u = anywhere(random, 40);
    const float depths[] = {0.0f, -0.0f, 1e-45f, -1e-45f, 1e-38f, std::nextafter(1.0f, 0.0f), 1.0f};
    std::fill_n(t.d, 3, depths[small(7)]);
    std::fill_n(u.d, 3, depths[small(7)]);
    return {t, u};
  }
  // Slivers along one line, of other depths.
  const Screen t = sliver(random, 40);
  Screen u = t;
  u.x[2] += as_float(random.uniform(-1e-3, 1e-3));
  for (float& d : u.d) d = as_float(random.uniform(-1, 1));
  return {t, u};
}
constexpr int kKinds = 7;

/// A key of each triangle that covers the sample, and its exact depth.
struct Fragment {
  ExactMode::Key key;
  BigQuotient depth;
};

Fragment fragment(const Screen& t, std::uint32_t rank, std::int32_t x, std::int32_t y) {
  const auto prepared = ExactMode::prepare(t, FillRule::kClosed, rank);
  return {ExactMode::key(ExactMode::depth(prepared, x, y), rank), exact_plane_depth(t, x, y)};
}

/// Samples of 40 x 40 pixels that all of `triangles` cover, some of them.
std::vector<std::pair<int, int>> common_samples(std::span<const Screen> triangles, Random& random) {
  std::vector<std::pair<int, int>> samples;
  for (int tries = 0; tries < 60 && samples.size() < 6; ++tries) {
    // Towards the first triangle's middle, so that slivers are hit at all.
    const Screen& t = triangles.front();
    const double a = random.uniform(), b = random.uniform(0, 1 - a);
    const int x = static_cast<int>(std::floor(t.x[0] + a * (t.x[1] - t.x[0]) + b * (t.x[2] - t.x[0])));
    const int y = static_cast<int>(std::floor(t.y[0] + a * (t.y[1] - t.y[0]) + b * (t.y[2] - t.y[0])));
    if (std::all_of(triangles.begin(), triangles.end(),
                    [&](const Screen& u) { return exactly_covers(u, x, y, FillRule::kClosed); }))
      samples.emplace_back(x, y);
  }
  return samples;
}

TEST(ExactWinner, IsThatOfRationals) {
  Random random(81);
  std::array<int, kKinds> asked{}, ties{}, undecided{};
  for (int i = 0; i < 3500; ++i) {
    const auto kind = static_cast<std::size_t>(i % kKinds);
    const auto pair = hard_pair(random, i % kKinds);
    for (const auto& [x, y] : common_samples(pair, random)) {
      const Fragment a = fragment(pair[0], 7, x, y), b = fragment(pair[1], 8, x, y);
      const int order = a.depth.compare(b.depth);
      ASSERT_EQ(a.key < b.key, order <= 0) << "kind " << kind << ", pair " << i;  // the smaller rank on a tie
      ASSERT_EQ(b.key<a.key, order> 0) << "kind " << kind << ", pair " << i;
      const Fragment last = fragment(pair[0], 9, x, y);  // of a larger rank than b
      ASSERT_EQ(last.key < b.key, order < 0) << "kind " << kind << ", pair " << i;
      ++asked[kind];
      ties[kind] += order == 0;
      undecided[kind] += std::abs(a.key.depth.value - b.key.depth.value) <=
                         double{a.key.depth.error} + double{b.key.depth.error};
    }
  }
  for (std::size_t kind = 0; kind < kKinds; ++kind) EXPECT_GT(asked[kind], 50) << kind;
  EXPECT_EQ(ties[1], asked[1]);
  EXPECT_EQ(ties[3], asked[3]);
  EXPECT_GT(ties[2], 10);
  EXPECT_GT(ties[5], 50);
  EXPECT_LT(ties[5], asked[5]);
  // What the rationals are for, and that they are not asked where doubles decide.
  EXPECT_EQ(undecided[1], asked[1]);
  EXPECT_LT(undecided[0], asked[0] / 50);
  EXPECT_GT(undecided[5], ties[5]);
}

TEST(ExactWinner, IsTheSameInAnyOrderForPiecesOfOneTriangle) {
  // Pieces of a clipped triangle have one rank. Where they meet, exactly equal depths can have values that
  // differ in the last bit; which of them is kept must not depend on which came first.
  Random random(82);
  int differing = 0;
  for (int i = 0; i < 3000; ++i) {
    const std::array pair{in_plane(random, 5, -3, 1), in_plane(random, 5, -3, 1)};
    for (const auto& [x, y] : common_samples(pair, random)) {
      const auto a = fragment(pair[0], 7, x, y).key, b = fragment(pair[1], 7, x, y).key;
      const auto kept = [](ExactMode::Key pixel, const ExactMode::Key& key) {
        if (key < pixel) pixel = key;
        return ExactMode::value(pixel);
      };
      ASSERT_EQ(kept(a, b), kept(b, a));
      differing += a.depth.value != b.depth.value;
    }
  }
  EXPECT_GT(differing, 50);
}

TEST(ExactKeys, AreAStrictWeakOrderWithTheClearKeyBelowTheFarPlane) {
  Random random(83);
  int drawn = 0, on_far = 0, beyond = 0;
  for (int i = 0; i < 60; ++i) {
    std::vector<Screen> triangles;
    for (int k = 0; k < 7; ++k) {
      Screen t = k < 2 ? in_plane(random, 3, 2, 1) : anywhere(random, 40);
      for (float& v : t.x) v = 2 * v - 20;
      for (float& v : t.y) v = 2 * v - 20;
      if (k == 2 || k == 3) std::fill_n(t.d, 3, 1.0f);  // on the far plane
      if (k == 4) std::fill_n(t.d, 3, 1.25f);
      if (k == 5) t.d[0] = 3;  // crosses it
      triangles.push_back(t);
    }
    for (int k = 0; k < 40; ++k) {
      const int x = static_cast<int>(random.bits() % 40), y = static_cast<int>(random.bits() % 40);
      std::vector<ExactMode::Key> keys{ExactMode::kClear};
      for (std::size_t t = 0; t < triangles.size(); ++t) {
        if (!exactly_covers(triangles[t], x, y, FillRule::kClosed)) continue;
        const Fragment f = fragment(triangles[t], static_cast<std::uint32_t>(t), x, y);
        const int side = f.depth.compare({1, 1});
        ASSERT_EQ(f.key < ExactMode::kClear, side < 0);
        ASSERT_EQ(ExactMode::kClear < f.key, side >= 0);  // as with keys of one word
        drawn += side < 0;
        on_far += side == 0;
        beyond += side > 0;
        keys.push_back(f.key);
      }
      for (const auto& a : keys) {
        EXPECT_FALSE(a < a);
        for (const auto& b : keys) {
          EXPECT_FALSE(a < b && b < a);
          // No two are equivalent, so that transitivity is all there is left.
          EXPECT_TRUE(a < b || b < a || a == b);
          for (const auto& c : keys)
            if (a < b && b < c) {
              EXPECT_TRUE(a < c);
            }
        }
      }
    }
  }
  EXPECT_GT(drawn, 100);
  EXPECT_GT(on_far, 50);
  EXPECT_GT(beyond, 50);
}

TEST(ExactKeys, KeepWhatResolveNeeds) {
  const Screen t{{0, 8, 0}, {0, 0, 8}, {0.25f, 0.25f, 0.25f}, 3};
  const auto key = fragment(t, 41, 1, 1).key;
  EXPECT_EQ(ExactMode::rank(key), 41u);
  EXPECT_EQ(ExactMode::value(key), 0.25);
  EXPECT_EQ(ExactMode::output_depth(key, {}), 0.25f);
  EXPECT_FALSE(key == ExactMode::kClear);
  EXPECT_EQ(ExactMode::rank(ExactMode::kClear), 0xffffffffu);
  EXPECT_EQ(ExactMode::value(ExactMode::kClear), 1);
  EXPECT_EQ(ExactMode::output_depth(ExactMode::kClear, {}), 1.0f);
}

TEST(ExactDepthError, BoundsTheErrorOfTheValue) {
  Random random(84);
  int asked = 0, unknown = 0;
  double worst = 0;  // error / bound
  for (int i = 0; i < 6000; ++i) {
    const double extent = std::array{8.0, 200.0, 4096.0, 131072.0}[static_cast<std::size_t>(i / 7 % 4)];
    Screen t = i % 7 < 3   ? sliver(random, extent)
               : i % 7 < 5 ? anywhere(random, extent)
                           : hard_pair(random, i % kKinds)[0];
    if (i % 11 == 0) t.d[0] = as_float(-std::pow(10.0, random.uniform(0, 30)));  // as without the near clip
    if (i % 13 == 0) t.d[2] = as_float(random.uniform(-1, 1) * 1e-42);
    if (i % 17 == 0) t.x[1] = as_float(random.uniform(-1, 1) * 1e-39);
    for (const auto& [x, y] : common_samples(std::span(&t, 1), random)) {
      const auto prepared = ExactMode::prepare(t, FillRule::kClosed, 0);
      const ExactDepth depth = ExactMode::depth(prepared, x, y);
      ++asked;
      if (std::isinf(depth.error)) {
        ++unknown;
        continue;
      }
      const double error = exact_plane_depth(t, x, y).distance(depth.value);
      ASSERT_LE(error, depth.error) << i;
      worst = std::max(worst, error / depth.error);
    }
  }
  EXPECT_GT(asked, 15000);
  EXPECT_LT(unknown, asked / 5);
  EXPECT_GT(worst, 0.02);  // a bound that is never neared would send everything to the rationals
}

TEST(ExactDepthError, IsSmallWhereTheTriangleIsHealthy) {
  Random random(85);
  int healthy = 0;
  for (int i = 0; i < 2000; ++i) {
    const Screen t = anywhere(random, 500);
    const auto prepared = ExactMode::prepare(t, FillRule::kClosed, 0);
    const double area = std::abs((double{t.x[1]} - t.x[0]) * (double{t.y[2]} - t.y[0]) -
                                 (double{t.y[1]} - t.y[0]) * (double{t.x[2]} - t.x[0]));
    if (area < 2500) continue;
    ++healthy;
    EXPECT_LT(ExactMode::depth(prepared, 9, 9).error, 1e-10f);
  }
  EXPECT_GT(healthy, 1000);
}

TEST(ExactDepthError, IsInfiniteWhereNothingIsKnown) {
  const Screen flat{{-1e-20f, 1, 0.5f}, {0, 1, 0.5f}, {0, 1, 0}, 0};  // in double its area is zero
  const Screen deep{{0, 8, 0}, {0, 0, 8}, {-1e30f, 0, 0}, 0};
  for (const Screen& t : {flat, deep}) {
    const auto prepared = ExactMode::prepare(t, FillRule::kClosed, 0);
    EXPECT_TRUE(covers<ExactMode>(prepared, 0, 0));
    EXPECT_EQ(ExactMode::depth(prepared, 0, 0).error, std::numeric_limits<float>::infinity());
  }
}

}  // namespace
}  // namespace rasterbench
