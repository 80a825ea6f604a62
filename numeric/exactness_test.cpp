// Coverage of every mode: exact where nothing rounds, monotone along rows, blind to the order of corners.
#include <gtest/gtest.h>

#include "numeric/coverage_testing.h"

namespace rasterbench {
namespace {

template <class Mode>
class Exactness : public BoundedMode<Mode> {};
TYPED_TEST_SUITE(Exactness, ModeTypes, ModeNames);

TYPED_TEST(Exactness, OnAGridOfQuartersEveryModeIsExact) {
  constexpr int kUnit = 4;  // per pixel: every mode holds and multiplies such coordinates without rounding
  Random random(11);
  int on_an_edge = 0;
  for (int i = 0; i < 1500; ++i) {
    const bool on_halves = i % 2 == 0;  // centres lie on corners and edges often
    const auto coordinate = [&] {
      const auto c = static_cast<std::int64_t>(random.bits() % 97) - 16;
      return on_halves ? c / 2 * 2 : c;
    };
    IntTriangle t;
    for (IntPoint& p : t) p = {coordinate(), coordinate()};
    const auto pixels = [](const IntPoint& p) {
      return Point{static_cast<double>(p.x) / kUnit, static_cast<double>(p.y) / kUnit};
    };
    for (const FillRule fill : kFillRules) {
      const auto prepared = prepare<TypeParam>(pixels(t[0]), pixels(t[1]), pixels(t[2]), fill);
      // The whole image, so that a box that is too small shows.
      for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) {
          const IntPoint sample{x * kUnit + kUnit / 2, y * kUnit + kUnit / 2};
          ASSERT_EQ(covers<TypeParam>(prepared, x, y), exactly_covers(t, sample, fill))
              << "triangle " << i << " at " << x << "," << y;
          on_an_edge += fill == FillRule::kTopLeft && exactly_covers(t, sample, FillRule::kClosed) &&
                        !exactly_covers(t, sample, FillRule::kTopLeft);
        }
    }
  }
  EXPECT_GT(on_an_edge, 250);  // else the grid does not ask what it is here to ask
}

/// How often the answer of edge `e` changes along pixels first <= x < last of a row.
template <class Mode>
int changes_along_row(const typename Mode::Prepared& prepared, int e, int y, int first, int last) {
  if (first >= last) return 0;
  int changes = 0;
  bool before = Mode::inside_edge(prepared, e, first, y);
  for (int x = first + 1; x < last; ++x) {
    const bool now = Mode::inside_edge(prepared, e, x, y);
    changes += now != before;
    before = now;
  }
  return changes;
}

TYPED_TEST(Exactness, EachEdgeIsAHalfLineAlongARow) {
  if constexpr (!MonotoneMode<TypeParam>) GTEST_SKIP() << TypeParam::kInfo.name << " is not monotone";
  Random random(13);
  int changed = 0;
  for (const double extent : {64.0, 2000.0, 65536.0, 131072.0})
    for (int i = 0; i < 60; ++i) {
      auto corners = random_sliver(random, extent);
      if (i % 2 == 0) {
        // An edge that hardly rises and runs along a row of centres: many pixels with an uncertain sign.
        const double y = std::floor(corners[0].y) + 0.5;
        const double slope = std::pow(10.0, random.uniform(-9, -2));
        corners[0].y = y - slope * random.uniform() * std::abs(corners[1].x - corners[0].x);
        corners[1].y = y + slope * random.uniform() * std::abs(corners[1].x - corners[0].x);
        if (i % 4 == 0) corners[0].x -= extent;  // the guard band has two sides
      }
      if (i % 4 == 1) {
        // A short edge, nearly level, and rows far from it: its line is crossed slowly, by small differences
        // of large products.
        corners[1] = {corners[0].x + random.uniform(1, 30), corners[0].y + random.uniform(-0.1, 0.1)};
        corners[2] = {random.uniform(1, extent), corners[0].y + random.uniform(-0.01, 0.01) * extent};
      }
      for (const FillRule fill : kFillRules) {
        const auto prepared = prepare<TypeParam>(corners[0], corners[1], corners[2], fill);
        for (std::size_t k = 0; k < 9; ++k) {
          // About where the line of an edge crosses the centres of a row, where products are nearly equal: a
          // row of the edge itself, or one of the triangle that may be far from the edge.
          const Point &a = corners[k % 3], &b = corners[(k + 1) % 3], &c = corners[(k + 2) % 3];
          const double to = k < 3 ? b.y : c.y;
          const int y = static_cast<int>(std::floor(a.y + random.uniform() * (to - a.y)));
          const double crossing = a.x + (y + 0.5 - a.y) / (b.y - a.y) * (b.x - a.x);
          if (!(std::abs(crossing) < kGuardBand)) continue;
          const int x = static_cast<int>(crossing);
          // A mode answers for its box only.
          const PixelBox box = intersect(prepared.box, {x - 300, y, x + 300, y + 1});
          if (box.empty()) continue;
          for (int e = 0; e < 3; ++e) {
            const int changes = changes_along_row<TypeParam>(prepared, e, y, box.x0, box.x1);
            ASSERT_LE(changes, 1) << "extent " << extent << ", triangle " << i << ", edge " << e << ", row "
                                  << y;
            changed += changes;
          }
        }
      }
    }
  EXPECT_GT(changed, 500);  // the rows do cross edges
}

TYPED_TEST(Exactness, TheOrderOfTheCornersDoesNotMatter) {
  constexpr int kOrders[5][3] = {{1, 2, 0}, {2, 0, 1}, {2, 1, 0}, {1, 0, 2}, {0, 2, 1}};
  Random random(14);
  int covered = 0;
  for (int i = 0; i < 150; ++i) {
    std::array<Point, 3> p;
    if (i % 3 == 0) {
      p = random_sliver(random, 40);
    } else {
      for (Point& corner : p)
        corner = {random.uniform(-8, 48), random.uniform(-8, 48), random.uniform(-1, 1)};
      if (i % 3 == 1) p[1].x = p[0].x;  // the order of the corners is decided by y
    }
    for (const FillRule fill : kFillRules) {
      const auto first = prepare<TypeParam>(p[0], p[1], p[2], fill);
      for (const auto& order : kOrders) {
        const auto other =
            prepare<TypeParam>(p[static_cast<std::size_t>(order[0])], p[static_cast<std::size_t>(order[1])],
                               p[static_cast<std::size_t>(order[2])], fill);
        ASSERT_EQ(other.box.x1, first.box.x1);
        const PixelBox box = intersect(first.box, {0, 0, 40, 40});
        for (int y = box.y0; y < box.y1; ++y)
          for (int x = box.x0; x < box.x1; ++x) {
            ASSERT_EQ(covers<TypeParam>(other, x, y), covers<TypeParam>(first, x, y)) << i;
            if (!covers<TypeParam>(first, x, y)) continue;
            ++covered;
            ASSERT_EQ(encode(depth_at<TypeParam>(other, x, y)), encode(depth_at<TypeParam>(first, x, y)))
                << i;
          }
      }
    }
  }
  EXPECT_GT(covered, 5000);
}

TYPED_TEST(Exactness, TheExtensionOfAnEdgeIsOutside) {
  // Two products accept the whole line AB (two_product_test.cpp): here centres lie on its extension.
  for (const Point& c : {Point{5, 7}, Point{11, 7}, Point{-1, 7}}) {
    const auto prepared = prepare<TypeParam>({3.5, 3.5}, {6.5, 3.5}, c, FillRule::kClosed);
    for (int x = 0; x < 12; ++x) EXPECT_EQ(covers<TypeParam>(prepared, x, 3), x >= 3 && x <= 6) << x;
  }
}

}  // namespace
}  // namespace rasterbench
