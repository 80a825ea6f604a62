// The oracle against rationals everywhere: every triangle, every pixel, no filter, and other formulas.
#include "reference/oracle.h"

#include <gtest/gtest.h>

#include <boost/multiprecision/gmp.hpp>
#include <cmath>
#include <optional>
#include <tuple>

#include "base/error.h"
#include "reference/oracle_testing.h"

namespace rasterbench {
namespace {

using Rational = boost::multiprecision::mpq_rational;

constexpr int kWidth = 18, kHeight = 12;  // small: rationals are slow

/// An affine function on the screen.
struct Affine {
  Rational constant, x, y;
  Rational at(const Rational& px, const Rational& py) const { return constant + x * px + y * py; }
};

/// The function that is 1 at corner i and 0 at the others; nothing where the corners are collinear.
template <class Real>
std::optional<Affine> barycentric(const ScreenTriangle<Real>& t, int i) {
  const auto corner = [&](int k) {
    return std::pair<Rational, Rational>(double{t.x[k % 3]}, double{t.y[k % 3]});
  };
  const auto [px, py] = corner(i);
  const auto [ax, ay] = corner(i + 1);
  const auto [bx, by] = corner(i + 2);
  const Rational x = ay - by, y = bx - ax, constant = ax * by - bx * ay;
  const Rational at_corner = constant + x * px + y * py;
  if (at_corner == 0) return {};
  return Affine{constant / at_corner, x / at_corner, y / at_corner};
}

/// One triangle in rationals. Top-left is the closed rule for a sample moved to the right by an
/// infinitesimal, and down by a still smaller one.
template <class Real>
struct Brute {
  std::vector<Affine> weights;
  Affine depth{};

  explicit Brute(const ScreenTriangle<Real>& t) {
    for (int i = 0; i < 3; ++i) {
      const auto weight = barycentric(t, i);
      if (!weight) return;
      weights.push_back(*weight);
      const Rational d(double{t.d[i]});
      depth.constant += weight->constant * d;
      depth.x += weight->x * d;
      depth.y += weight->y * d;
    }
  }

  bool covers(const Rational& px, const Rational& py, FillRule fill) const {
    if (weights.size() < 3) return false;
    for (const Affine& w : weights) {
      const Rational value = w.at(px, py);
      const Rational zero = 0;
      const bool inside =
          fill == FillRule::kClosed ? value >= 0 : std::tie(value, w.x, w.y) > std::tie(zero, zero, zero);
      if (!inside) return false;
    }
    return true;
  }
};

/// What is wrong with `image` as the picture of `input`; empty if nothing.
template <class Real>
std::string fault(const OracleInput<Real>& input, const OracleImage& image) {
  std::vector<Brute<Real>> triangles(input.triangles.begin(), input.triangles.end());
  const Rational far = far_value(input.depth_function);
  for (int y = 0; y < input.height; ++y)
    for (int x = 0; x < input.width; ++x) {
      const auto i = static_cast<std::size_t>(y * input.width + x);
      const Rational px(x + 0.5), py(y + 0.5);
      int owner = -1;
      Rational nearest;
      std::optional<Rational> next;  // of all but the owner
      for (std::size_t k = 0; k < triangles.size(); ++k) {
        if (input.triangles[k].id < 0 || !triangles[k].covers(px, py, input.fill)) continue;
        Rational depth = triangles[k].depth.at(px, py);
        if (depth < far) {
          const std::int32_t id = input.triangles[k].id;
          const std::int32_t owner_id = owner < 0 ? 0 : input.triangles[static_cast<std::size_t>(owner)].id;
          const bool wins =
              owner < 0 || depth < nearest ||
              (depth == nearest && (input.tie == TieRule::kFirst ? id < owner_id : id > owner_id));
          if (wins) {
            if (owner < 0) {
              owner = static_cast<int>(k);
              nearest = depth;
              continue;
            }
            owner = static_cast<int>(k);
            std::swap(depth, nearest);
          }
        }
        if (!next || depth < *next) next = depth;
      }
      const std::string where = " at " + std::to_string(x) + "," + std::to_string(y);
      const std::int32_t id = owner < 0 ? -1 : input.triangles[static_cast<std::size_t>(owner)].id;
      if (image.ids[i] != id)
        return "id " + std::to_string(image.ids[i]) + " instead of " + std::to_string(id) + where;
      if (image.pieces[i] != owner) return "piece" + where;
      if (owner < 0) {
        if (image.values[i] != far_value(input.depth_function)) return "background value" + where;
        const float gap = next ? static_cast<float>(Rational(*next - far)) : INFINITY;
        if (!(std::abs(image.depth_gap[i] - gap) <= 1e-6f * gap) && image.depth_gap[i] != gap)
          return "background gap" + where;
        continue;
      }
      const auto& d = input.triangles[static_cast<std::size_t>(owner)].d;
      const double largest =
          std::max({std::abs(double{d[0]}), std::abs(double{d[1]}), std::abs(double{d[2]})});
      const Rational error = abs(Rational(image.values[i]) - nearest);
      if (error > Rational(0x1p-48 * largest) + Rational(0x1p-1074)) return "value" + where;
      const Rational gap = (next && *next < far ? *next : far) - nearest;
      if ((gap == 0) != (image.depth_gap[i] == 0)) return "exact tie" + where;
      if (abs(Rational(double{image.depth_gap[i]}) - gap) >
          gap / 1000000 + Rational(0x1p-46 * largest + 1e-30))
        return "gap" + where;
    }
  return {};
}

template <class Real>
class Oracle : public testing::Test {};
using Formats = testing::Types<float, double>;
TYPED_TEST_SUITE(Oracle, Formats);

constexpr FillRule kFills[] = {FillRule::kClosed, FillRule::kTopLeft};

TYPED_TEST(Oracle, AgreesWithRationalsOnHardTriangles) {
  OracleEffort effort;
  std::int64_t ties = 0, covered = 0;
  std::uint64_t seed = 1;
  for (const DepthFunction function :
       {DepthFunction::kNdc, DepthFunction::kReversed, DepthFunction::kInverseW})
    for (const FillRule fill : kFills)
      for (const TieRule tie : {TieRule::kFirst, TieRule::kLast})
        for (int i = 0; i < 12; ++i) {
          using Triangles = HardTriangles<TypeParam>;
          const int only = i % 4 == 0   ? Triangles::kSlivers
                           : i % 4 == 1 ? Triangles::kPlane
                                        : Triangles::kKinds;
          const auto triangles = Triangles(++seed, {kWidth, kHeight}, function, only).some(12);
          const OracleInput<TypeParam> input{triangles, kWidth, kHeight, fill, tie, function};
          const OracleImage image = exact_owners(input, 1);
          ASSERT_EQ(fault(input, image), "") << "seed " << seed;
          effort.coverage_fallbacks += image.effort.coverage_fallbacks;
          effort.depth_fallbacks += image.effort.depth_fallbacks;
          for (std::size_t k = 0; k < image.ids.size(); ++k) {
            covered += image.ids[k] >= 0;
            ties += image.depth_gap[k] == 0;
          }
        }
  // Else the triangles are not as hard as they should be.
  EXPECT_GT(covered, 1000);
  EXPECT_GT(ties, 100);
  EXPECT_GT(effort.coverage_fallbacks, 10);
  EXPECT_GT(effort.depth_fallbacks, 100);
}

TYPED_TEST(Oracle, ProductsThatUnderflowAreNoZeros) {
  // The base is as short as a number can be, and the sample (.5, .5) half a pixel from it.
  constexpr TypeParam kLeast = std::numeric_limits<TypeParam>::denorm_min();
  for (const TypeParam step : {kLeast, -kLeast}) {
    const std::vector<ScreenTriangle<TypeParam>> triangles = {{{0, step, 1}, {0, 0, 1}, {0, 0.25, 0.5}, 0},
                                                              {{0, 0, 1}, {0, step, 1}, {0.5, 0.25, 0}, 1}};
    for (const FillRule fill : kFills) {
      const OracleInput<TypeParam> input{triangles, 2, 2, fill};
      EXPECT_EQ(fault(input, exact_owners(input, 1)), "");
    }
  }
}

template <class Real>
OracleImage owners(const std::vector<ScreenTriangle<Real>>& triangles, int width, int height, FillRule fill,
                   int threads = 2, TieRule tie = TieRule::kFirst) {
  return exact_owners<Real>({triangles, width, height, fill, tie, DepthFunction::kNdc}, threads);
}

TYPED_TEST(Oracle, TopLeftTessellationsAreCoveredExactlyOnce) {
  // A level plane: two owners of a sample would be an exact tie, none would leave background.
  constexpr int kSide = 96;
  Random random(5);
  for (const bool on_samples : {true, false}) {
    constexpr int kCells = 40;
    std::vector<std::pair<TypeParam, TypeParam>> points;
    for (int j = 0; j <= kCells; ++j)
      for (int i = 0; i <= kCells; ++i) {
        const double step = double{kSide + 8} / kCells, jitter = on_samples ? 0 : 0.2 * step;
        const auto place = [&](int k) {
          const double v = k * step - 4 + random.uniform(-jitter, jitter);
          return static_cast<TypeParam>(on_samples ? std::floor(v) + 0.5 : v);
        };
        const TypeParam x = place(i);
        points.emplace_back(x, place(j));
      }
    std::vector<ScreenTriangle<TypeParam>> triangles;
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      if (random.bits() % 2 != 0) std::swap(a, b);
      triangles.push_back({{points[a].first, points[b].first, points[c].first},
                           {points[a].second, points[b].second, points[c].second},
                           {0.25, 0.25, 0.25},
                           static_cast<std::int32_t>(triangles.size())});
    };
    for (std::size_t j = 0; j < kCells; ++j)
      for (std::size_t i = 0; i < kCells; ++i) {
        const std::size_t p = j * (kCells + 1) + i, q = p + kCells + 1;
        add(p, p + 1, q);
        add(p + 1, q + 1, q);
      }
    const OracleImage top_left = owners(triangles, kSide, kSide, FillRule::kTopLeft);
    for (std::size_t i = 0; i < top_left.ids.size(); ++i) {
      ASSERT_GE(top_left.ids[i], 0) << "a gap at " << i;
      ASSERT_GT(top_left.depth_gap[i], 0) << "two owners at " << i;
      ASSERT_EQ(top_left.values[i], 0.25);
    }
    const OracleImage closed = owners(triangles, kSide, kSide, FillRule::kClosed);
    const auto ties = std::count(closed.depth_gap.begin(), closed.depth_gap.end(), 0.0f);
    EXPECT_EQ(ties > 0, on_samples);
    // The lattice is decided without rationals: its products are exact in double.
    if (on_samples) {
      EXPECT_EQ(closed.effort.coverage_fallbacks + closed.effort.depth_fallbacks, 0);
    }
  }
}

TYPED_TEST(Oracle, DoesNotDependOnTheThreads) {
  const auto triangles = HardTriangles<TypeParam>(99, {kWidth, kHeight}, DepthFunction::kNdc).some(40);
  const auto draw = [&](int threads) { return owners(triangles, 40, 400, FillRule::kClosed, threads); };
  const OracleImage one = draw(1);
  for (const int threads : {2, 5, 64}) {
    const OracleImage many = draw(threads);
    EXPECT_EQ(one.ids, many.ids);
    EXPECT_EQ(one.pieces, many.pieces);
    EXPECT_EQ(one.values, many.values);
    EXPECT_EQ(one.edge_margin, many.edge_margin);
    EXPECT_EQ(one.depth_gap, many.depth_gap);
    EXPECT_EQ(one.effort.coverage_tests, many.effort.coverage_tests);
    EXPECT_EQ(one.effort.coverage_fallbacks, many.effort.coverage_fallbacks);
    EXPECT_EQ(one.effort.depth_tests, many.effort.depth_tests);
    EXPECT_EQ(one.effort.depth_fallbacks, many.effort.depth_fallbacks);
  }
}

TYPED_TEST(Oracle, TrianglesGivenTwiceNeedNoRationals) {
  std::vector<ScreenTriangle<TypeParam>> triangles;
  Random random(8);
  for (std::int32_t id = 0; id < 200; id += 2) {
    ScreenTriangle<TypeParam> t{};
    for (int i = 0; i < 3; ++i) {
      t.x[i] = static_cast<TypeParam>(random.uniform(0, 64));
      t.y[i] = static_cast<TypeParam>(random.uniform(0, 64));
      t.d[i] = static_cast<TypeParam>(random.uniform(-1, 1));
    }
    t.id = id + 1;
    triangles.push_back(t);
    std::swap(t.x[0], t.x[2]), std::swap(t.y[0], t.y[2]), std::swap(t.d[0], t.d[2]);
    t.id = id;
    triangles.push_back(t);
  }
  for (const TieRule tie : {TieRule::kFirst, TieRule::kLast}) {
    const OracleImage image = owners(triangles, 64, 64, FillRule::kTopLeft, 2, tie);
    EXPECT_EQ(image.effort.depth_fallbacks, 0);
    for (std::size_t i = 0; i < image.ids.size(); ++i) {
      if (image.ids[i] < 0) continue;
      ASSERT_EQ(image.ids[i] % 2, tie == TieRule::kFirst ? 0 : 1);
      ASSERT_EQ(image.depth_gap[i], 0);
    }
  }
}

TYPED_TEST(Oracle, PiecesOfOneTriangleAreNoTie) {
  // Two halves of a square of id 3, whose diagonal runs through samples, before a wall.
  const std::vector<ScreenTriangle<TypeParam>> triangles = {{{-9, 99, -9}, {-9, -9, 99}, {0.5, 0.5, 0.5}, 1},
                                                            {{0, 8, 8}, {0, 0, 8}, {0.25, 0.25, 0.25}, 3},
                                                            {{0, 8, 0}, {0, 8, 8}, {0.25, 0.25, 0.25}, 3}};
  const OracleImage image = owners(triangles, 8, 8, FillRule::kClosed);
  for (std::size_t i = 0; i < image.ids.size(); ++i) {
    EXPECT_EQ(image.ids[i], 3);
    EXPECT_EQ(image.depth_gap[i], 0.25f);
    EXPECT_EQ(image.pieces[i], i % 8 >= i / 8 ? 1 : 2);
  }
}

TYPED_TEST(Oracle, MarginsByHand) {
  // A wall with one free edge at x = 4.75, and a triangle behind it, whose level edge at y = 2.25 counts only
  // where it is not hidden, and where it is by less than kDepthReach.
  const auto margin = [](double behind) {
    const auto d = static_cast<TypeParam>(0.5 + behind);
    const std::vector<ScreenTriangle<TypeParam>> triangles = {
        {{-100, TypeParam(4.75), TypeParam(4.75)}, {4, -100, 100}, {0.5, 0.5, 0.5}, 0},
        {{-100, 100, 4}, {2.25, 2.25, 100}, {d, d, d}, 1}};
    return owners(triangles, 12, 8, FillRule::kTopLeft).edge_margin;
  };
  const auto hidden = margin(0.25), close = margin(0.5 * OracleImage::kDepthReach);
  const auto at = [](const std::vector<float>& margins, int x, int y) {
    return margins[static_cast<std::size_t>(y * 12 + x)];
  };
  EXPECT_EQ(at(hidden, 4, 6), 0.25f);
  EXPECT_EQ(at(hidden, 3, 6), 1.25f);
  EXPECT_EQ(at(hidden, 2, 2), INFINITY);
  EXPECT_EQ(at(close, 2, 2), 0.25f);
  EXPECT_EQ(at(close, 2, 1), 0.75f);
  EXPECT_EQ(at(close, 2, 3), 1.25f);
  EXPECT_EQ(at(close, 2, 4), INFINITY);
  EXPECT_EQ(at(hidden, 6, 2), 0.25f);  // the wall's edge is farther away
  EXPECT_EQ(at(hidden, 5, 1), 0.75f);  // a background sample right of the wall and above the triangle
  EXPECT_EQ(at(hidden, 9, 6), INFINITY);
}

TYPED_TEST(Oracle, MarginsReachIntoTheNextBandOfRows) {
  const OracleImage image = owners<TypeParam>(
      {{{-99, 99, 0}, {TypeParam(31.25), TypeParam(31.25), -99}, {0, 0, 0}, 0}}, 1, 34, FillRule::kClosed);
  EXPECT_EQ(image.edge_margin[32], 1.25f);
  EXPECT_EQ(image.edge_margin[33], INFINITY);
}

TYPED_TEST(Oracle, MarginsOfIsolatedTriangles) {
  // Against the distance to a densely sampled outline.
  constexpr int kRows = 48;  // more than a band of the oracle's
  Random random(17);
  for (int i = 0; i < 12; ++i) {
    ScreenTriangle<TypeParam> t{{}, {}, {0, 0, 0}, 0};
    for (int k = 0; k < 3; ++k) {
      t.x[k] = static_cast<TypeParam>(random.uniform(-4, 28));
      t.y[k] = static_cast<TypeParam>(random.uniform(-4, kRows + 4));
    }
    if (i % 2 != 0) t.x[2] = t.x[0] + (t.x[1] - t.x[0]) / 3 + TypeParam(0.01);
    const OracleImage image = owners<TypeParam>({t}, 24, kRows, FillRule::kClosed);
    for (int y = 0; y < kRows; ++y)
      for (int x = 0; x < 24; ++x) {
        double nearest = INFINITY;
        for (int k = 0; k < 3; ++k)
          for (int step = 0; step <= 1000; ++step) {
            const double s = step / 1000.0, r = 1 - s;
            nearest = std::min(nearest, std::hypot(x + 0.5 - (r * t.x[k] + s * t.x[(k + 1) % 3]),
                                                   y + 0.5 - (r * t.y[k] + s * t.y[(k + 1) % 3])));
          }
        const double margin = image.edge_margin[static_cast<std::size_t>(y * 24 + x)];
        if (nearest < 1.49) {
          ASSERT_NEAR(margin, nearest, 0.03) << i << " at " << x << "," << y;
        } else if (nearest > 1.52) {
          ASSERT_EQ(margin, INFINITY) << i << " at " << x << "," << y;
        }
      }
  }
}

TYPED_TEST(Oracle, NonFiniteCornersDrawNothing) {
  constexpr TypeParam kNan = std::numeric_limits<TypeParam>::quiet_NaN();
  constexpr TypeParam kInfinity = std::numeric_limits<TypeParam>::infinity();
  const OracleImage image = owners<TypeParam>({{{0, 9, kNan}, {0, 0, 9}, {0, 0, 0}, 0},
                                               {{0, 9, 0}, {0, 0, kInfinity}, {0, 0, 0}, 1},
                                               {{0, 9, 0}, {0, 0, 9}, {0, -kInfinity, 0}, 2}},
                                              8, 8, FillRule::kClosed);
  EXPECT_EQ(std::count(image.ids.begin(), image.ids.end(), -1), 64);
}

TYPED_TEST(Oracle, AnEmptySceneIsBackground) {
  const OracleImage image = owners<TypeParam>({}, 3, 2, FillRule::kClosed);
  EXPECT_EQ(image.ids, std::vector<std::int32_t>(6, -1));
  EXPECT_EQ(image.depth_gap, std::vector<float>(6, INFINITY));
  EXPECT_EQ(image.edge_margin, std::vector<float>(6, INFINITY));
}

TEST(OracleSize, AnImageThatDoesNotFitIsRefused) {
  EXPECT_THROW(exact_owners<float>({{}, 65536, 65536}, 1), InputError);
}

TEST(OracleSize, AModelAtFullHighDefinitionTakesFewTests) {
  const Scene scene = generate("teapot:triangles=5000");
  const FrameSettings settings{.width = 960, .height = 540};
  std::vector<ScreenTriangle<float>> screen(scene.model.triangles.size()), extra;
  GeometryCounts counts;
  transform_triangles<float>(scene.model.triangles, 0, make_screen_transform(sized_camera(scene, settings)),
                             settings.geometry, screen.data(), extra, counts);
  const OracleImage image = owners(screen, settings.width, settings.height, FillRule::kClosed);
  const auto drawn =
      std::count_if(image.ids.begin(), image.ids.end(), [](std::int32_t id) { return id >= 0; });
  EXPECT_GT(drawn, 50000);
  // Two or three layers, three edges, and rows of samples that are cut to the triangles.
  EXPECT_LT(image.effort.coverage_tests, 20 * drawn);
  EXPECT_EQ(image.effort.coverage_fallbacks, 0);
}

}  // namespace
}  // namespace rasterbench
