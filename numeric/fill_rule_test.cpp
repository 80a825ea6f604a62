// Who owns a pixel centre on a corner or an edge: closed gives it to every triangle there, top-left to
// exactly one.
#include <gtest/gtest.h>

#include <numbers>

#include "numeric/coverage_testing.h"

namespace rasterbench {
namespace {

template <class Mode>
class FillRules : public BoundedMode<Mode> {};
TYPED_TEST_SUITE(FillRules, ModeTypes, ModeNames);

/// The rim of a fan round `hub`: corners at `count` angles from `start`, on a square of half-side `radius`
/// so that they have short binary fractions, or on a circle.
std::vector<Point> square_rim(const Point& hub, double radius) {
  const double s = radius;
  std::vector<Point> rim;
  for (const auto& [x, y] :
       {std::pair{s, 0.0}, {s, s}, {0.0, s}, {-s, s}, {-s, 0.0}, {-s, -s}, {0.0, -s}, {s, -s}})
    rim.push_back({hub.x + x, hub.y + y});
  return rim;
}

std::vector<Point> circular_rim(const Point& hub, double radius, int count, double start) {
  std::vector<Point> rim;
  for (int i = 0; i < count; ++i) {
    const double angle = start + 2 * std::numbers::pi * i / count;
    rim.push_back({hub.x + radius * std::cos(angle), hub.y + radius * std::sin(angle)});
  }
  return rim;
}

template <class Mode>
void add_fan(Owners<Mode>& owners, const Point& hub, const std::vector<Point>& rim, bool reversed) {
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Point &a = rim[i], &b = rim[(i + 1) % rim.size()];
    reversed ? owners.add(b, a, hub) : owners.add(hub, a, b);
  }
}

// The case of piglit's triangle-rasterization test: eight triangles meet at a centre.
TYPED_TEST(FillRules, EightTrianglesRoundACentre) {
  const Point hub{8.5, 8.5};
  std::vector<std::vector<Point>> rims{square_rim(hub, 4), square_rim(hub, 3.5)};
  if constexpr (kIsZeroAtCorners<TypeParam>) {  // else only short binary fractions are exact at the hub
    rims.push_back(circular_rim(hub, 5, 8, 0.2));
    rims.push_back(circular_rim(hub, 5.3, 8, 1.1));
  }
  for (const bool reversed : {false, true})
    for (const auto& rim : rims) {
      Owners<TypeParam> closed(17, 17, FillRule::kClosed), top_left(17, 17, FillRule::kTopLeft);
      add_fan(closed, hub, rim, reversed);
      add_fan(top_left, hub, rim, reversed);
      EXPECT_EQ(closed.at(8, 8), 8);
      EXPECT_EQ(top_left.at(8, 8), 1);
      for (int y = 6; y <= 10; ++y)
        for (int x = 6; x <= 10; ++x) EXPECT_EQ(top_left.at(x, y), 1) << x << "," << y;
    }
}

TYPED_TEST(FillRules, TheSideThatOwnsAnEdge) {
  const auto at_centre = [](Point a, Point b, Point c) {  // is the centre of pixel (4, 4) covered?
    return covers<TypeParam>(prepare<TypeParam>(a, b, c, FillRule::kTopLeft), 4, 4);
  };
  // Edges through (4.5, 4.5); the third corner says on which side the triangle lies.
  EXPECT_TRUE(at_centre({2.5, 4.5}, {6.5, 4.5}, {4, 8})) << "top edge";
  EXPECT_FALSE(at_centre({2.5, 4.5}, {6.5, 4.5}, {4, 1})) << "bottom edge";
  EXPECT_TRUE(at_centre({4.5, 2.5}, {4.5, 6.5}, {8, 4})) << "left edge";
  EXPECT_FALSE(at_centre({4.5, 2.5}, {4.5, 6.5}, {1, 4})) << "right edge";
  EXPECT_TRUE(at_centre({2.5, 2.5}, {6.5, 6.5}, {8, 4})) << "left edge, falling";
  EXPECT_FALSE(at_centre({2.5, 2.5}, {6.5, 6.5}, {1, 6})) << "right edge, falling";
  EXPECT_TRUE(at_centre({2.5, 6.5}, {6.5, 2.5}, {8, 6})) << "left edge, rising";
  EXPECT_FALSE(at_centre({2.5, 6.5}, {6.5, 2.5}, {1, 2})) << "right edge, rising";
  // Corners on the centre: the whole neighbourhood just right of it, and below, has to be inside.
  EXPECT_TRUE(at_centre({4.5, 4.5}, {8.5, 4.5}, {4.5, 8.5})) << "top left corner";
  EXPECT_FALSE(at_centre({4.5, 4.5}, {0.5, 4.5}, {4.5, 8.5})) << "top right corner";
  EXPECT_FALSE(at_centre({4.5, 4.5}, {8.5, 4.5}, {4.5, 0.5})) << "bottom left corner";
  EXPECT_FALSE(at_centre({4.5, 4.5}, {0.5, 4.5}, {4.5, 0.5})) << "bottom right corner";
}

TYPED_TEST(FillRules, NeighboursAtAnEdgeThroughCentres) {
  // The shared edge, and a corner on each side of it. Slopes 0, infinity, 1, -1, 1/3, 3.
  const struct {
    Point from, to, left, right;
  } cases[] = {{{1.5, 8.5}, {13.5, 8.5}, {7, 2}, {7, 14}},   {{8.5, 1.5}, {8.5, 13.5}, {2, 7}, {14, 7}},
               {{2.5, 2.5}, {12.5, 12.5}, {2, 12}, {12, 2}}, {{2.5, 12.5}, {12.5, 2.5}, {2, 2}, {12, 13}},
               {{1.5, 6.5}, {13.5, 10.5}, {7, 14}, {7, 2}},  {{6.5, 1.5}, {10.5, 13.5}, {2, 7}, {14, 7}}};
  for (const auto& c : cases) {
    Owners<TypeParam> closed(16, 16, FillRule::kClosed), top_left(16, 16, FillRule::kTopLeft);
    for (auto* owners : {&closed, &top_left}) {
      owners->add(c.from, c.to, c.left);
      owners->add(c.right, c.to, c.from);
    }
    int on_edge = 0;
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 16; ++x) {
        const double px = x + 0.5 - c.from.x, py = y + 0.5 - c.from.y;
        const double ex = c.to.x - c.from.x, ey = c.to.y - c.from.y;
        const double along = (px * ex + py * ey) / (ex * ex + ey * ey);
        if (px * ey != py * ex || along <= 0 || along >= 1) continue;
        ++on_edge;
        EXPECT_EQ(closed.at(x, y), 2) << x << "," << y;
        EXPECT_EQ(top_left.at(x, y), 1) << x << "," << y;
      }
    EXPECT_GE(on_edge, 3);
  }
}

TYPED_TEST(FillRules, QuadWithItsDiagonalThroughCentres) {
  for (const bool other_diagonal : {false, true}) {
    const Point a{2.5, 3.5}, b{10.5, 3.5}, c{10.5, 11.5}, d{2.5, 11.5};
    Owners<TypeParam> owners(14, 14, FillRule::kTopLeft);
    if (other_diagonal) {
      owners.add(a, b, d);
      owners.add(b, c, d);
    } else {
      owners.add(a, b, c);
      owners.add(c, d, a);
    }
    // Its own border lies on centres, too: the left and the upper one are its own.
    for (int y = 0; y < 14; ++y)
      for (int x = 0; x < 14; ++x)
        EXPECT_EQ(owners.at(x, y), x >= 2 && x < 10 && y >= 3 && y < 11 ? 1 : 0) << x << "," << y;
  }
}

TYPED_TEST(FillRules, LatticeOnCentresIsAPartition) {
  // Corners on centres, cells of 1 to 3 pixels, either diagonal, either winding.
  Owners<TypeParam> owners(32, 32, FillRule::kTopLeft);
  std::vector<double> at{0.5};
  for (int i = 0; at.back() < 28; ++i) at.push_back(at.back() + 1 + i % 3);
  for (std::size_t i = 0; i + 1 < at.size(); ++i)
    for (std::size_t j = 0; j + 1 < at.size(); ++j) {
      const Point a{at[j], at[i]}, b{at[j + 1], at[i]}, c{at[j + 1], at[i + 1]}, d{at[j], at[i + 1]};
      if ((i + j) % 2 == 0) {
        owners.add(a, b, c);
        owners.add(a, c, d);
      } else {
        owners.add(d, b, a);
        owners.add(b, d, c);
      }
    }
  const int end = static_cast<int>(at.back() - 0.5);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) EXPECT_EQ(owners.at(x, y), x < end && y < end ? 1 : 0) << x << "," << y;
}

TYPED_TEST(FillRules, AFanHasNoGapsAndNoOverlaps) {
  const Point hub{100.5, 100.5};
  constexpr double kRadius = 94;
  for (const bool reversed : {false, true}) {
    Owners<TypeParam> owners(201, 201, FillRule::kTopLeft);
    add_fan(owners, hub, circular_rim(hub, kRadius, 700, 0), reversed);
    int gaps = 0, overlaps = 0;
    for (int y = 0; y < 201; ++y)
      for (int x = 0; x < 201; ++x) {
        // Both triangles at a spoke see the same number, so that all modes agree but where spokes meet.
        if (x == 100 && y == 100 && !kIsZeroAtCorners<TypeParam>) continue;
        overlaps += owners.at(x, y) > 1;
        gaps += std::hypot(x - 100.0, y - 100.0) < kRadius - 1 && owners.at(x, y) == 0;
      }
    EXPECT_EQ(gaps, 0);
    EXPECT_EQ(overlaps, 0);
    EXPECT_GT(owners.sum(), 27000);  // pi 93^2
  }
}

TYPED_TEST(FillRules, SubpixelTriangles) {
  for (const FillRule fill : kFillRules) {
    Owners<TypeParam> missing(8, 8, fill), hitting(8, 8, fill);
    missing.add({3.0625, 3.0625}, {3.375, 3.125}, {3.125, 3.4375});
    missing.add({3.5625, 3.0625}, {4.4375, 3.125}, {4.375, 3.9375});  // between four centres
    hitting.add({3.4375, 3.375}, {3.625, 3.5}, {3.4375, 3.625});
    EXPECT_EQ(missing.sum(), 0);
    EXPECT_EQ(hitting.sum(), 1);
    EXPECT_EQ(hitting.at(3, 3), 1);
  }
}

TYPED_TEST(FillRules, DegenerateTrianglesCoverNothing) {
  const Point a{2.5, 2.5}, b{9.5, 2.5}, c{2.5, 9.5}, d{9.5, 9.5}, middle{5.5, 5.5}, far{40.5, 40.5};
  const std::array<std::array<Point, 3>, 8> triangles{
      {{a, a, a},           // a point on a centre
       {a, a, d},           // A = B
       {d, a, d},           // A = C
       {a, d, d},           // B = C
       {a, b, {4.5, 2.5}},  // collinear, level, through centres
       {a, c, {2.5, 5.5}},  // upright
       {a, middle, d},      // diagonal
       {far, a, d}}};
  for (const auto& t : triangles)
    for (const FillRule fill : kFillRules) {
      const auto prepared = prepare<TypeParam>(t[0], t[1], t[2], fill);
      EXPECT_TRUE(prepared.box.empty());  // so that no kernel scans the screen for it
      for (int y = 0; y < 12; ++y)
        for (int x = 0; x < 12; ++x) EXPECT_FALSE(covers<TypeParam>(prepared, x, y)) << x << "," << y;
    }
}

}  // namespace
}  // namespace rasterbench
