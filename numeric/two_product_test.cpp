// two_product against a literal program of its own, and the defects that it is known for.
#include "numeric/two_product.h"

#include <gtest/gtest.h>

#include <bit>

#include "numeric/coverage_testing.h"

namespace rasterbench {
namespace {

constexpr int kWidth = 80, kHeight = 48;

/// The course text (INFO0939) as a program in float32: normalised device coordinates, the edge functions of
/// the three sides at P, two products, barycentric depth.
struct Course {
  struct Vertex {
    float x, y, d;
  };

  static Vertex ndc(float x_px, float y_px, float d) {
    return {static_cast<float>(2.0 * x_px / kWidth - 1.0), static_cast<float>(1.0 - 2.0 * y_px / kHeight), d};
  }

  static float edge(const Vertex& a, const Vertex& b, float x, float y) {
    return (a.x - x) * (b.y - y) - (b.x - x) * (a.y - y);
  }

  explicit Course(const ScreenTriangle<float>& t)
      : a(ndc(t.x[0], t.y[0], t.d[0])), b(ndc(t.x[1], t.y[1], t.d[1])), c(ndc(t.x[2], t.y[2], t.d[2])) {}

  void at(int column, int row) {
    const float x = 2.0f * (static_cast<float>(column) + 0.5f) / kWidth - 1.0f;
    const float y = 1.0f - 2.0f * (static_cast<float>(row) + 0.5f) / kHeight;
    const float ab = edge(a, b, x, y), bc = edge(b, c, x, y), ca = edge(c, a, x, y);
    inside = ab * bc >= 0 && ab * ca >= 0;
    depth = (bc * a.d + ca * b.d + ab * c.d) / (ab + bc + ca);
  }

  Vertex a, b, c;
  bool inside = false;
  float depth = 0;
};

TwoProductMode::Prepared prepare_for_image(const ScreenTriangle<float>& t) {
  return TwoProductMode::prepare(t, SampleGrid{FillRule::kClosed, kWidth, kHeight}, 0);
}

TEST(TwoProduct, EqualsTheLiteralProgramWithinTheBox) {
  Random random(97);
  int inside = 0;
  for (int i = 0; i < 400; ++i) {
    std::array<Point, 3> p;
    for (Point& corner : p)
      corner = {random.uniform(-20, 100), random.uniform(-20, 70), random.uniform(-1, 1)};
    if (i % 4 == 0) p = random_sliver(random, 48);
    const auto t = screen_triangle<float>(p[0], p[1], p[2]);
    const auto prepared = prepare_for_image(t);
    Course course(t);
    const PixelBox box = intersect(prepared.box, {0, 0, kWidth, kHeight});
    for (int y = box.y0; y < box.y1; ++y)
      for (int x = box.x0; x < box.x1; ++x) {
        course.at(x, y);
        ASSERT_EQ(covers<TwoProductMode>(prepared, x, y), course.inside) << i;
        if (!course.inside) continue;
        ++inside;
        const float depth = TwoProductMode::depth(prepared, x, y);
        const auto [low, high] = std::minmax({t.d[0], t.d[1], t.d[2]});
        ASSERT_EQ(depth, std::clamp(course.depth, low, high));
      }
  }
  EXPECT_GT(inside, 50000);
}

TEST(TwoProduct, TheFillRuleIsClosedAndTheOrderOfTheCornersMatters) {
  const Point a{1.1, 2.3}, b{30.7, 5.9}, c{12.2, 40.4};
  const auto t = screen_triangle<float>(a, b, c);
  const auto closed = prepare_for_image(t);
  const auto top_left = TwoProductMode::prepare(t, SampleGrid{FillRule::kTopLeft, kWidth, kHeight}, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      ASSERT_EQ(covers<TwoProductMode>(closed, x, y), covers<TwoProductMode>(top_left, x, y));
  // Edge AB is in both products; which side that is follows the order of the corners.
  const auto turned = prepare_for_image(screen_triangle<float>(b, c, a));
  EXPECT_EQ(TwoProductMode::edge_value(closed, 1, 8, 9), TwoProductMode::edge_value(turned, 0, 8, 9));
}

TEST(TwoProduct, AcceptsTheExtensionOfAB) {
  // The defect that makes it unbounded (accuracy.md, section 1): on the whole line AB both products are zero.
  // Here the line is the row of centres y = 3.5 of an image in which coordinates are short fractions.
  const auto covered = [](const Point& a, const Point& b, const Point& c) {
    const auto prepared =
        TwoProductMode::prepare(screen_triangle<float>(a, b, c), SampleGrid{FillRule::kClosed, 16, 16}, 0);
    std::vector<int> columns;
    for (int x = 0; x < 16; ++x)
      if (covers<TwoProductMode>(prepared, x, 3)) columns.push_back(x);
    return columns;
  };
  const Point a{3.5, 3.5}, b{6.5, 3.5}, c{12, 7};
  EXPECT_EQ(covered(a, b, c), (std::vector<int>{3, 4, 5, 6, 7, 8, 9, 10, 11}));  // to the end of the box
  EXPECT_EQ(covered(b, c, a), (std::vector<int>{3, 4, 5, 6}));  // right, were AB another side
}

TEST(TwoProduct, ATriangleWithoutAreaCoversItsBoxAtTheNearestDepth) {
  // A = B: every product is zero. On the line to C depth is 0 / 0, beside it a number divided by zero.
  const auto t = screen_triangle<float>({2, 2, 0.5}, {2, 2, 0.25}, {9, 9, 0.75});
  const auto prepared = TwoProductMode::prepare(t, SampleGrid{FillRule::kClosed, 16, 16}, 0);
  for (int y = 2; y < 9; ++y)
    for (int x = 2; x < 9; ++x) {
      EXPECT_TRUE(covers<TwoProductMode>(prepared, x, y));
      const float depth = TwoProductMode::depth(prepared, x, y);
      EXPECT_TRUE(depth == 0.25f || (x != y && depth == 0.75f)) << x << "," << y << ": " << depth;
    }
}

}  // namespace
}  // namespace rasterbench
