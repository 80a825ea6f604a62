// Filtered edges make no coverage error: every mode that has them against whole numbers of any size, on
// triangles that are chosen to leave the float32 sign uncertain.
#include <gtest/gtest.h>

#include <limits>

#include "numeric/exact_testing.h"

namespace rasterbench {
namespace {

template <class Mode>
class FilteredCoverage : public testing::Test {};
using FilteredModes =
    testing::Types<Filtered, ExactMode, FilteredF64, FilteredF64r, FilteredUnorm<16>, FilteredUnorm<24>,
                   FilteredUnorm<32>, FilteredReversed, FilteredInverseW>;
TYPED_TEST_SUITE(FilteredCoverage, FilteredModes, ModeNames);

using Corners = std::array<std::array<float, 2>, 3>;

ScreenTriangle<float> screen_triangle(const Corners& c) {
  return {{c[0][0], c[1][0], c[2][0]}, {c[0][1], c[1][1], c[2][1]}, {0.25f, 0.5f, 0.75f}, 0};
}

/// How many samples were asked for, and what about them made the test worth its time.
struct Tally {
  int asked = 0, covered = 0;
  int on_edges = 0;   ///< the fill rule decides
  int uncertain = 0;  ///< an edge in the box whose float32 value is within its error of zero
};

template <class Mode>
void expect_exact(const ScreenTriangle<float>& t, std::int32_t x, std::int32_t y, Tally& tally) {
  const auto corners = big_triangle(t);
  const IntegerPoint<Big> sample{big_sample(x), big_sample(y)};
  bool answers[2];
  for (const FillRule fill : kFillRules) {
    const auto prepared = Mode::prepare(t, fill, 0);
    const bool expected = exactly_covers(corners, sample, fill);
    answers[fill == FillRule::kClosed] = expected;
    ASSERT_EQ(covers<Mode>(prepared, x, y), expected)
        << std::hexfloat << "(" << t.x[0] << ", " << t.y[0] << ") (" << t.x[1] << ", " << t.y[1] << ") ("
        << t.x[2] << ", " << t.y[2] << ") at " << x << ", " << y
        << (fill == FillRule::kClosed ? " closed" : " top-left");
    ++tally.asked;
    tally.covered += expected;
    if (!prepared.box.contains(x, y)) continue;
    const FilteredEdges::Setup& edges = prepared;
    for (int e = 0; e < 3; ++e) {
      tally.uncertain += std::abs(FilteredEdges::value(edges, e, x, y)) <= edges.error;
      // Each edge alone, as a kernel asks that walks along them.
      const std::size_t a = static_cast<std::size_t>(kEdgeFrom[e]), b = static_cast<std::size_t>(kEdgeTo[e]);
      const auto sorted = big_triangle(canonical(t));
      const int side = cross(sorted[a], sorted[b], sample).sign() * edges.sign[e];
      ASSERT_EQ(Mode::inside_edge(prepared, e, x, y), side >= edges.least[e]);
    }
  }
  tally.on_edges += answers[0] != answers[1];
}

/// Asks about pixels along the edges, around the corners, and in the middle.
template <class Mode>
void expect_exact_along_edges(const Corners& corners, Random& random, Tally& tally) {
  const ScreenTriangle<float> t = screen_triangle(corners);
  for (int k = 0; k < 12; ++k) {
    const auto &a = corners[static_cast<std::size_t>(k % 3)],
               &b = corners[static_cast<std::size_t>((k + 1) % 3)];
    const double s = k < 3 ? 0 : random.uniform();
    const auto pixel = [&](std::size_t axis) {
      const double at = a[axis] + s * (double{b[axis]} - a[axis]) + (k == 11 ? random.uniform(-2, 2) : 0);
      return static_cast<std::int32_t>(std::clamp(std::floor(at), -131072.0, 131071.0));
    };
    ASSERT_NO_FATAL_FAILURE(expect_exact<Mode>(t, pixel(0), pixel(1), tally));
  }
}

float as_float(double v) { return static_cast<float>(v); }

TYPED_TEST(FilteredCoverage, OnRandomTrianglesAndSlivers) {
  Random random(71);
  Tally tally;
  for (const double extent : {8.0, 300.0, 5000.0, 131072.0})
    for (int i = 0; i < 150; ++i) {
      Corners c;
      if (i % 3 == 0) {
        for (auto& p : c)
          p = {as_float(random.uniform(-extent, extent)), as_float(random.uniform(-extent, extent))};
      } else {
        const auto p = random_sliver(random, extent);
        for (std::size_t k = 0; k < 3; ++k) c[k] = {as_float(p[k].x), as_float(p[k].y)};
      }
      ASSERT_NO_FATAL_FAILURE(expect_exact_along_edges<TypeParam>(c, random, tally));
    }
  EXPECT_GT(tally.covered, 2000);
  EXPECT_GT(tally.uncertain, 200);
}

TYPED_TEST(FilteredCoverage, OnALattice) {
  Random random(72);
  Tally tally;
  for (int i = 0; i < 300; ++i) {
    // Halves of pixels near the origin, and far from it, where float32 has few bits left for them.
    const double far = i % 3 == 0 ? 60000 : 0;
    Corners c;
    for (auto& p : c)
      for (float& v : p) v = as_float(far + static_cast<double>(random.bits() % 24) / 2 - 2);
    ASSERT_NO_FATAL_FAILURE(expect_exact_along_edges<TypeParam>(c, random, tally));
  }
  EXPECT_GT(tally.on_edges, 400);
  EXPECT_GT(tally.uncertain, 1000);
}

TYPED_TEST(FilteredCoverage, OnDenormalsSignedZerosAndHugeRatios) {
  Random random(73);
  Tally tally;
  for (int i = 0; i < 600; ++i) {
    // An edge through a centre, or near it: from m - k (p, q) to m + k (p, q).
    const double mx = static_cast<double>(random.bits() % 3) + 0.5,
                 my = static_cast<double>(random.bits() % 3) + 0.5;
    const double p = static_cast<double>(random.bits() % 5) / 2,
                 q = static_cast<double>(random.bits() % 5) / 2;
    const double k = i % 4 == 0 ? 0x1p14 : 1;
    Corners c{{{as_float(mx - k * p), as_float(my - k * q)},
               {as_float(mx + k * p), as_float(my + k * q)},
               {as_float(random.uniform(-4, 8)), as_float(random.uniform(-4, 8))}}};
    // A coordinate that is zero becomes a denormal, a tiny number or the other zero.
    const auto disturb = [&](float& v) {
      if (v != 0 || i % 3 == 0) return;
      const float sizes[] = {0.0f, std::numeric_limits<float>::denorm_min(), 0x1p-130f, 1e-30f, 1e-20f};
      v = std::copysign(sizes[random.bits() % 5], random.bits() % 2 == 0 ? 1.0f : -1.0f);
    };
    for (auto& corner : c)
      for (float& v : corner) disturb(v);
    if (i % 5 == 0) c[2] = {-131072, as_float(random.uniform(-1, 1))};
    if (i % 5 == 1) c[2] = {as_float(random.uniform(-1, 1) * 1e-40), 131072};
    const ScreenTriangle<float> t = screen_triangle(c);
    ASSERT_NO_FATAL_FAILURE(
        expect_exact<TypeParam>(t, static_cast<std::int32_t>(mx), static_cast<std::int32_t>(my), tally));
    ASSERT_NO_FATAL_FAILURE(expect_exact_along_edges<TypeParam>(c, random, tally));
  }
  EXPECT_GT(tally.on_edges, 100);
  EXPECT_GT(tally.uncertain, 1000);
}

TYPED_TEST(FilteredCoverage, OnAreasOfOneLastBit) {
  Random random(74);
  Tally tally;
  int flat = 0;
  for (int i = 0; i < 600; ++i) {
    // Three points of one line, one of them moved by the last bit of one coordinate, or not at all.
    const double x = static_cast<double>(random.bits() % 64), y = static_cast<double>(random.bits() % 64);
    const double dx = static_cast<double>(random.bits() % 32) / 2,
                 dy = static_cast<double>(random.bits() % 32) / 2;
    Corners c;
    for (std::size_t k = 0; k < 3; ++k) {
      const double at = static_cast<double>(random.bits() % 16);
      c[k] = {as_float(x + 0.5 + at * dx), as_float(y + 0.5 + at * dy)};
    }
    if (i % 4 != 0) {
      float& moved = c[random.bits() % 3][random.bits() % 2];
      moved = std::nextafter(moved, random.bits() % 2 == 0 ? -1.0f : 1e6f);
    }
    flat += Filtered::prepare(screen_triangle(c), FillRule::kClosed, 0).box.empty();
    ASSERT_NO_FATAL_FAILURE(expect_exact_along_edges<TypeParam>(c, random, tally));
  }
  EXPECT_GT(flat, 100);
  EXPECT_GT(tally.covered, 500);
  EXPECT_GT(tally.uncertain, 5000);
}

TYPED_TEST(FilteredCoverage, OnAreasThatADoubleRounds) {
  // One corner next to the origin, where float32 is finer than the last bit of a double elsewhere, the others
  // on a line from it through centres: the sign of the area is below the rounding of its products.
  Random random(76);
  Tally tally;
  for (int i = 0; i < 400; ++i) {
    const double p = static_cast<double>(random.bits() % 4) * 2 + 1,
                 q = static_cast<double>(random.bits() % 4) * 2 + 1;
    const double tiny = std::pow(10.0, random.uniform(-30, -6));
    const double k = static_cast<double>(random.bits() % 8) + 0.5,
                 m = k + 1 + static_cast<double>(random.bits() % 60);
    Corners c{{{as_float(tiny * p), as_float(tiny * q)},
               {as_float(k * p), as_float(k * q)},
               {as_float(m * p), as_float(m * q)}}};
    float& moved = c[0][random.bits() % 2];
    if (i % 4 != 0) moved = std::nextafter(moved, i % 4 == 1 ? 1.0f : -1.0f);
    ASSERT_NO_FATAL_FAILURE(expect_exact_along_edges<TypeParam>(c, random, tally));
    for (double at = k; at < m; at += 1 + static_cast<double>(random.bits() % 3))
      ASSERT_NO_FATAL_FAILURE(expect_exact<TypeParam>(screen_triangle(c), static_cast<std::int32_t>(at * p),
                                                      static_cast<std::int32_t>(at * q), tally));
  }
  EXPECT_GT(tally.covered, 500);
  EXPECT_GT(tally.uncertain, 5000);
}

TEST(FilteredEdges, RarelyNeedExactArithmeticOnRandomTriangles) {
  // What "nearly the cost of float32" rests on.
  Random random(75);
  std::int64_t tests = 0, uncertain = 0;
  for (int i = 0; i < 300; ++i) {
    Corners c;
    for (auto& p : c) p = {as_float(random.uniform(0, 1920)), as_float(random.uniform(0, 1080))};
    const auto prepared = Filtered::prepare(screen_triangle(c), FillRule::kClosed, 0);
    for (int y = prepared.box.y0; y < prepared.box.y1; y += 7)
      for (int x = prepared.box.x0; x < prepared.box.x1; x += 3)
        for (int e = 0; e < 3; ++e) {
          ++tests;
          uncertain += std::abs(Filtered::edge_value(prepared, e, x, y)) <= prepared.error;
        }
  }
  EXPECT_GT(tests, 1000000);
  EXPECT_LT(static_cast<double>(uncertain), 1e-5 * static_cast<double>(tests));
}

}  // namespace
}  // namespace rasterbench
