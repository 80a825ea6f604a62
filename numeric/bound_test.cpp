// Every bounded mode within its bound (numeric/bound.h): edge functions and depths against whole numbers,
// with the tolerances that the bound's numbers give. gamma_n = n u / (1 - n u): Higham, Accuracy and
// Stability of Numerical Algorithms, lemma 3.1.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>

#include "numeric/exact_testing.h"

namespace rasterbench {
namespace {

constexpr double gamma(int n, double unit) { return n * unit / (1 - n * unit); }

template <class Mode>
class Bound : public BoundedMode<Mode> {};
TYPED_TEST_SUITE(Bound, ModeTypes, ModeNames);

constexpr double kUnit = 0x1p23;  // float32 numbers >= 1 are whole in this unit

IntPoint whole(double x, double y) {
  return {static_cast<std::int64_t>(x * kUnit), static_cast<std::int64_t>(y * kUnit)};
}

/// Corners in the canonical order, whole in 1 / kUnit.
IntTriangle sorted_whole(const std::array<Point, 3>& corners) {
  IntTriangle t;
  for (std::size_t i = 0; i < 3; ++i) t[i] = whole(corners[i].x, corners[i].y);
  std::sort(t.begin(), t.end(),
            [](const IntPoint& a, const IntPoint& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  return t;
}

double pixels(Int128 v) { return static_cast<double>(v) / kUnit; }

/// By how much edge function `e` of a mode may be wrong at a sample, in px^2.
double edge_tolerance(const ModeBound& bound, const IntTriangle& t, int e, const IntPoint& sample) {
  constexpr int kRoundings = 8;  // what the oracle allows as well; a cross product has 4
  const IntPoint &a = t[static_cast<std::size_t>(kEdgeFrom[e])], &b = t[static_cast<std::size_t>(kEdgeTo[e])];
  const double dx = std::abs(pixels(b.x - a.x)), dy = std::abs(pixels(b.y - a.y));
  const double to_x = std::abs(pixels(sample.x - a.x)), to_y = std::abs(pixels(sample.y - a.y));
  switch (bound.edge_form) {
    case EdgeForm::kCross:
      return gamma(kRoundings, bound.edge_unit) * (dx * to_y + dy * to_x);
    case EdgeForm::kPlane:
      return gamma(kRoundings, bound.edge_unit) * (dx * (std::abs(pixels(sample.y)) + std::abs(pixels(a.y))) +
                                                   dy * (std::abs(pixels(sample.x)) + std::abs(pixels(a.x))));
    case EdgeForm::kIncremental:  // from at most 63 px to the left, by one addition a pixel
      return gamma(kRoundings + 64, bound.edge_unit) * (dx * to_y + dy * (to_x + 64));
    case EdgeForm::kExact:
      break;
  }
  return 0;
}

/// Whether the bound explains a misclassified sample: an edge function, or the area that says which side of
/// the edges is inside, may have the wrong sign; or a snap moved an edge over the sample.
bool is_explained(const ModeBound& bound, const IntTriangle& t, const IntPoint& sample) {
  for (int e = 0; e < 3; ++e) {
    const IntPoint &a = t[static_cast<std::size_t>(kEdgeFrom[e])],
                   &b = t[static_cast<std::size_t>(kEdgeTo[e])];
    const double tolerance = edge_tolerance(bound, t, e, sample);
    if (tolerance > 0 && std::abs(static_cast<double>(cross(a, b, sample))) <= tolerance * kUnit * kUnit)
      return true;
    if (bound.snap > 0 &&
        distance_to_line(a, b, sample) <= std::numbers::sqrt2 * bound.snap * (1 + 1e-9) * kUnit)
      return true;
  }
  const double x1 = pixels(t[1].x - t[0].x), y1 = pixels(t[1].y - t[0].y);
  const double x2 = pixels(t[2].x - t[0].x), y2 = pixels(t[2].y - t[0].y);
  return std::abs(static_cast<double>(cross(t[0], t[1], t[2]))) <
         gamma(4, bound.edge_unit) * (std::abs(x1 * y2) + std::abs(y1 * x2)) * kUnit * kUnit;
}

TYPED_TEST(Bound, ExplainsEveryMisclassifiedSample) {
  const ModeBound& bound = TypeParam::kInfo.numbers;
  Random random(12);
  std::int64_t tested = 0, wrong = 0, covered = 0;
  for (const double extent : {64.0, 4096.0, 65536.0, 131072.0})
    for (int i = 0; i < 250; ++i) {
      const auto corners = random_sliver(random, extent);
      const IntTriangle t = sorted_whole(corners);
      for (const FillRule fill : kFillRules) {
        const auto prepared = prepare<TypeParam>(corners[0], corners[1], corners[2], fill);
        for (int k = 0; k < 50; ++k) {
          // Pixels along an edge, where the sign is uncertain.
          const auto e = static_cast<std::size_t>(k % 3);
          const Point &a = corners[e], &b = corners[(e + 1) % 3];
          const double s = random.uniform();
          const int x = static_cast<int>(a.x + s * (b.x - a.x)), y = static_cast<int>(a.y + s * (b.y - a.y));
          const IntPoint sample = whole(x + 0.5, y + 0.5);
          ++tested;
          const bool truth = exactly_covers(t, sample, fill);
          covered += truth;
          if (covers<TypeParam>(prepared, x, y) == truth) continue;
          ++wrong;
          ASSERT_TRUE(is_explained(bound, t, sample))
              << "extent " << extent << ", triangle " << i << " at " << x << "," << y;
        }
      }
    }
  EXPECT_GT(covered, tested / 12);
  // The bound is needed, and a mode without edge errors needs none: double has none of these wrong.
  if (bound.edge_form == EdgeForm::kExact ? bound.snap == 0 : bound.edge_unit == 0x1p-53) {
    EXPECT_EQ(wrong, 0);
  } else {
    EXPECT_GT(wrong, 0);
  }
}

/// The triangle whose plane a mode interpolates: its corners snapped, in canonical order.
ScreenTriangle<float> plane_of(const ModeBound& bound, const std::array<Point, 3>& corners) {
  ScreenTriangle<float> t = screen_triangle<float>(corners[0], corners[1], corners[2]);
  if (bound.snap > 0)
    for (int i = 0; i < 3; ++i) {
      t.x[i] = static_cast<float>(std::nearbyint(t.x[i] / (2 * bound.snap)) * 2 * bound.snap);
      t.y[i] = static_cast<float>(std::nearbyint(t.y[i] / (2 * bound.snap)) * 2 * bound.snap);
    }
  return canonical(t);
}

/// By how much the stored depth at a sample may be wrong where the triangle covers it exactly; infinite where
/// the area may be zero but for rounding, so that only the corners' range is left.
double depth_tolerance(const ModeBound& bound, const ScreenTriangle<float>& t, int x, int y) {
  const double x1 = double{t.x[1]} - t.x[0], y1 = double{t.y[1]} - t.y[0], d1 = double{t.d[1]} - t.d[0];
  const double x2 = double{t.x[2]} - t.x[0], y2 = double{t.y[2]} - t.y[0], d2 = double{t.d[2]} - t.d[0];
  const double dx = std::abs(x + 0.5 - t.x[0]), dy = std::abs(y + 0.5 - t.y[0]);
  const double area = std::abs(x1 * y2 - y1 * x2);
  // Two differences and a product in each term, and their difference.
  const double of_products = gamma(4, bound.gradient_unit);
  const double area_error = of_products * (std::abs(x1 * y2) + std::abs(y1 * x2));
  if (!(area > 2 * area_error)) return std::numeric_limits<double>::infinity();
  double error = 0, size = std::abs(t.d[0]);
  const auto add_term = [&](double numerator, double products, double distance) {
    const double gradient = std::abs(numerator) / area;
    const double largest = (std::abs(numerator) + of_products * products) / (area - area_error);
    // The numerator, the area, and the quotient: a division or an approximate reciprocal and a product, then
    // the narrowing to the plane's format.
    error +=
        distance * ((of_products * products + gradient * area_error) / (area - area_error) +
                    largest * (gamma(2, bound.gradient_unit) + bound.reciprocal_error + bound.depth_unit));
    size += distance * largest;
  };
  add_term(d1 * y2 - d2 * y1, std::abs(d1 * y2) + std::abs(d2 * y1), dx);
  add_term(d2 * x1 - d1 * x2, std::abs(d2 * x1) + std::abs(d1 * x2), dy);
  // The plane at the sample: a difference, a product and two sums. Then the format.
  return error + gamma(4, bound.depth_unit) * size + bound.depth_unit + 0.5 * bound.depth_step * (1 + 1e-6);
}

TYPED_TEST(Bound, HoldsForStoredDepths) {
  const ModeBound& bound = TypeParam::kInfo.numbers;
  Random random(15);
  int asked = 0, unknown = 0, tight = 0;
  double worst = 0;  // error / tolerance
  for (int i = 0; i < 2500; ++i) {
    const double extent = std::array{8.0, 200.0, 4096.0, 131072.0}[static_cast<std::size_t>(i % 4)];
    auto corners = random_sliver(random, extent);
    if (i % 3 == 0)
      for (Point& p : corners)
        p = {random.uniform(-0.2, 1.2) * extent, random.uniform(-0.2, 1.2) * extent, p.d};
    const ScreenTriangle<float> t = plane_of(bound, corners);
    const auto prepared = prepare<TypeParam>(Point{t.x[0], t.y[0], t.d[0]}, Point{t.x[1], t.y[1], t.d[1]},
                                             Point{t.x[2], t.y[2], t.d[2]}, FillRule::kClosed);
    for (int k = 0; k < 8; ++k) {
      const double a = random.uniform(), b = random.uniform(0, 1 - a);
      const int x = static_cast<int>(std::floor(t.x[0] + a * (t.x[1] - t.x[0]) + b * (t.x[2] - t.x[0])));
      const int y = static_cast<int>(std::floor(t.y[0] + a * (t.y[1] - t.y[0]) + b * (t.y[2] - t.y[0])));
      if (!covers<TypeParam>(prepared, x, y) || !exactly_covers(t, x, y, FillRule::kClosed)) continue;
      ++asked;
      const double tolerance = depth_tolerance(bound, t, x, y);
      if (std::isinf(tolerance)) {
        ++unknown;
        continue;
      }
      tight += tolerance < 1e-3;
      const double value = TypeParam::value(TypeParam::key(TypeParam::depth(prepared, x, y), 0));
      const double error = exact_plane_depth(t, x, y).distance(value);
      ASSERT_LE(error, tolerance) << i << " at " << x << "," << y;
      worst = std::max(worst, error / tolerance);
    }
  }
  EXPECT_GT(asked, 4000);
  EXPECT_LT(unknown, asked / 2);
  EXPECT_GT(tight, asked / 4);
  EXPECT_GT(worst, 0.04);  // the bound is of the size of the errors
}

/// rcpss takes a denormal for zero: an area that small must not make an infinite quotient of every gradient.
template <class Mode>
class Reciprocal : public testing::Test {};
using ReciprocalModes = testing::Types<F32, F32Rcp, F32RcpNewton>;
TYPED_TEST_SUITE(Reciprocal, ReciprocalModes, ModeNames);

TYPED_TEST(Reciprocal, OfADenormalArea) {
  // The edge from (0, 0) to (1, 1) passes through the first sample; d = y.
  for (const float width : {0x1p-100f, 0x1p-126f, 0x1p-130f, 0x1p-149f}) {
    const ScreenTriangle<float> t{{0, width, 1}, {0, 0, 1}, {0, 0, 1}, 0};
    const auto prepared = TypeParam::prepare(t, FillRule::kClosed, 0);
    ASSERT_TRUE(covers<TypeParam>(prepared, 0, 0));
    EXPECT_NEAR(depth_at<TypeParam>(prepared, 0, 0), 0.5, TypeParam::kInfo.numbers.reciprocal_error) << width;
  }
}

TYPED_TEST(Reciprocal, IsAsGoodAsItSays) {
  // A right-angled triangle of any area, with a gradient of one over its width: the plane adds no error that
  // counts beside the reciprocal's.
  Random random(16);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const float width = static_cast<float>(std::exp2(random.uniform(1, 16)));
    const ScreenTriangle<float> t{{0, width, 0}, {0, 0, width}, {0, 1, 0}, 0};
    const int x = static_cast<int>(width / 3);
    const double exact = (x + 0.5) / double{width};
    const double relative =
        depth_at<TypeParam>(TypeParam::prepare(t, FillRule::kClosed, 0), x, 0) / exact - 1;
    worst = std::max(worst, std::abs(relative));
  }
  const double promised = TypeParam::kInfo.numbers.reciprocal_error;
  EXPECT_LE(worst, promised + gamma(8, 0x1p-24));
  EXPECT_GE(worst, promised / 8);  // else it is not what it says it is
}

}  // namespace
}  // namespace rasterbench
