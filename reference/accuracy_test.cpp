// The metrics on pictures made by hand, whose answers are known, and on those of every mode.
#include "reference/accuracy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "reference/oracle_testing.h"
#include "reference/silhouette.h"

namespace rasterbench {
namespace {

constexpr int kSide = 8;
constexpr double kNear = 1, kFar = 9;

Camera test_camera(bool perspective = true) {
  const Viewport viewport{kSide, kSide};
  return perspective ? look_at_origin({0, 0, 4}, 1, kNear, kFar, viewport)
                     : orthographic_at_origin({0, 0, 4}, 1, kNear, kFar, viewport);
}

using Triangles = std::vector<ScreenTriangle<float>>;

/// Covers the whole image. `corner` tells apart walls that are not known to be alike by their corners.
ScreenTriangle<float> wall(std::int32_t id, float d, float corner = -90) {
  return {{corner, 290, corner}, {-90, -90, 290}, {d, d, d}, id};
}

/// Covers columns 0 to 4: a level depth and an edge at x = 4.75.
ScreenTriangle<float> half(std::int32_t id, float d) {
  return {{-300, 4.75f, 4.75f}, {4, -300, 300}, {d, d, d}, id};
}

/// The oracle's own picture, to be spoilt.
struct Case {
  Triangles triangles;
  OracleInput<float> input;
  OracleImage oracle;
  std::vector<std::int32_t> ids;
  std::vector<double> values;
  std::vector<std::uint32_t> colours, oracle_colours;

  explicit Case(Triangles list, DepthFunction function = DepthFunction::kNdc)
      : triangles(std::move(list)),
        input{triangles, kSide, kSide, FillRule::kClosed, TieRule::kFirst, function},
        oracle(exact_owners(input, 1)),
        ids(oracle.ids),
        values(oracle.values),
        colours(ids.size(), 0xff204060u),
        oracle_colours(colours) {}
  Case(const Case&) = delete;

  static std::size_t at(int x, int y) { return static_cast<std::size_t>(y * kSide + x); }

  Accuracy judge(const ModeBound& bound, const Camera& camera = test_camera()) const {
    return measure_accuracy({ids, values, colours}, input, oracle, oracle_colours, camera, bound, 2);
  }
};

constexpr ModeBound kUnboundedMode{.bounded = false};

TEST(Accuracy, TheOraclesOwnPictureIsPerfect) {
  const Case same({wall(0, 0.5f), half(1, 0.25f)});
  const Accuracy a = same.judge(Fixed4::kInfo.numbers);
  EXPECT_EQ(a.pixels, 64);
  EXPECT_EQ(a.wrong + a.false_positives + a.false_negatives + a.exact_ties + a.edge + a.depth, 0);
  EXPECT_EQ(a.unexplained + a.unbounded + a.colours_changed + a.depth_out_of_bound, 0);
  EXPECT_EQ(a.max_depth_error_steps, 0);
  EXPECT_EQ(a.max_depth_error_world, 0);
  EXPECT_EQ(a.silhouette_hausdorff, 0);
  EXPECT_EQ(a.worst_distance, 0);
  EXPECT_EQ(a.worst_pixel, -1);
  EXPECT_EQ(a.psnr, INFINITY);
  EXPECT_EQ(a.predicted, 0);
  EXPECT_TRUE(a.within_bound());
  EXPECT_EQ(a.classes, std::vector<PixelClass>(64, PixelClass::kSame));
}

/// The class of one pixel in which `drawn` was drawn, and that nothing else is said to be wrong.
Accuracy spoilt(const Triangles& triangles, int x, int y, std::int32_t drawn, const ModeBound& bound,
                PixelClass expected) {
  Case spoil(triangles);
  spoil.ids[Case::at(x, y)] = drawn;
  const Accuracy a = spoil.judge(bound);
  EXPECT_EQ(a.wrong, 1);
  EXPECT_EQ(a.worst_pixel, static_cast<std::int64_t>(Case::at(x, y)));
  EXPECT_EQ(a.classes[Case::at(x, y)], expected);
  EXPECT_EQ(std::count(a.classes.begin(), a.classes.end(), PixelClass::kSame), 63);
  EXPECT_EQ(a.exact_ties, expected == PixelClass::kExactTie);
  EXPECT_EQ(a.edge, expected == PixelClass::kEdge);
  EXPECT_EQ(a.depth, expected == PixelClass::kDepth);
  EXPECT_EQ(a.unexplained, expected == PixelClass::kUnexplained);
  EXPECT_EQ(a.unbounded, expected == PixelClass::kUnbounded);
  EXPECT_EQ(a.within_bound(), expected != PixelClass::kUnexplained);
  EXPECT_EQ(a.predicted < 0, !bound.bounded);
  return a;
}

TEST(Accuracy, ATriangleDrawnOutsideOfItsEdge) {
  const Triangles scene = {wall(0, 0.5f), half(1, 0.25f)};
  const ModeBound coarse{.snap = 1, .edge_form = EdgeForm::kExact, .edge_unit = 0};
  EXPECT_EQ(spoilt(scene, 5, 3, 1, coarse, PixelClass::kEdge).worst_distance, 0.75);
  EXPECT_EQ(spoilt(scene, 5, 3, 1, Fixed4::kInfo.numbers, PixelClass::kUnexplained).worst_distance, 0.75);
  EXPECT_EQ(spoilt(scene, 5, 3, 1, kUnboundedMode, PixelClass::kUnbounded).worst_distance, 0.75);
  // Where the half is behind the wall, no error of an edge brings it to the front.
  const Triangles behind = {wall(0, 0.25f), half(1, 0.5f)};
  spoilt(behind, 5, 3, 1, coarse, PixelClass::kUnexplained);
}

TEST(Accuracy, ATriangleLeftOut) {
  const Triangles scene = {wall(0, 0.5f), half(1, 0.25f)};
  const ModeBound coarse{.snap = 1, .edge_form = EdgeForm::kExact, .edge_unit = 0};
  EXPECT_EQ(spoilt(scene, 4, 3, 0, coarse, PixelClass::kEdge).worst_distance, 0.25);
  EXPECT_EQ(spoilt(scene, 3, 3, 0, Fixed4::kInfo.numbers, PixelClass::kUnexplained).worst_distance, 1.25);
}

TEST(Accuracy, BackgroundInsteadOfATriangleAndBack) {
  const Triangles scene = {half(1, 0.25f)};
  const ModeBound coarse{.snap = 1, .edge_form = EdgeForm::kExact, .edge_unit = 0};
  const Accuracy missing = spoilt(scene, 4, 3, -1, coarse, PixelClass::kEdge);
  EXPECT_EQ(missing.false_negatives, 1);
  EXPECT_EQ(missing.false_positives, 0);
  EXPECT_EQ(missing.worst_distance, 0.25);
  EXPECT_EQ(missing.silhouette_hausdorff, 1);
  const Accuracy extra = spoilt(scene, 7, 3, 1, coarse, PixelClass::kUnexplained);
  EXPECT_EQ(extra.false_positives, 1);
  EXPECT_EQ(extra.false_negatives, 0);
  EXPECT_EQ(extra.worst_distance, 2.75);
  EXPECT_EQ(extra.silhouette_hausdorff, 3);
  spoilt({wall(0, 0.5f)}, 4, 3, -1, Fixed4::kInfo.numbers, PixelClass::kUnexplained);
  // One that a coarse format of depth takes for the far plane.
  const Triangles far = {wall(0, 1 - 0x1p-18f)};
  EXPECT_EQ(spoilt(far, 4, 3, -1, FilteredUnorm<16>::kInfo.numbers, PixelClass::kDepth).worst_distance, 0);
  spoilt(far, 4, 3, -1, FilteredUnorm<24>::kInfo.numbers, PixelClass::kUnexplained);
}

TEST(Accuracy, TrianglesInTheWrongOrder) {
  const Triangles close = {wall(0, 0.25f), wall(1, 0.25f + 0x1p-20f, -91)};
  EXPECT_EQ(spoilt(close, 2, 2, 1, FilteredUnorm<16>::kInfo.numbers, PixelClass::kDepth).worst_distance, 0);
  spoilt(close, 2, 2, 1, FilteredUnorm<24>::kInfo.numbers, PixelClass::kUnexplained);
  spoilt(close, 2, 2, 1, ExactMode::kInfo.numbers, PixelClass::kUnexplained);
  const Triangles tied = {wall(0, 0.25f), wall(1, 0.25f, -91)};
  for (const ModeBound& bound : {F32::kInfo.numbers, kUnboundedMode})
    EXPECT_EQ(spoilt(tied, 2, 2, 1, bound, PixelClass::kExactTie).worst_distance, 0);
  spoilt(tied, 2, 2, 1, ExactMode::kInfo.numbers, PixelClass::kUnexplained);
}

TEST(Accuracy, ATriangleOnTheFarPlaneThatIsDrawn) {
  spoilt({wall(0, 1)}, 2, 2, 0, F32::kInfo.numbers, PixelClass::kDepth);
  spoilt({wall(0, 1.25f)}, 2, 2, 0, F32::kInfo.numbers, PixelClass::kUnexplained);
}

TEST(Accuracy, TheDepthMayBeThatOfAnotherPieceOfTheTriangle) {
  // Halves of a square, one level and one steep; the sample is in the level one, and the coarse mode may find
  // it in the other.
  const ModeBound coarse{.snap = 1, .edge_form = EdgeForm::kExact, .edge_unit = 0};
  const auto out_of_bound = [&](std::int32_t id_of_steep) {
    Case spoil({{{0, 8, 8}, {0, 0, 8}, {0.25f, 0.25f, 0.25f}, 1},
                {{0, 8, 0}, {0, 8, 8}, {0.25f, 0.25f, 0.75f}, id_of_steep}});
    spoil.values[Case::at(4, 3)] = 0.28;
    return spoil.judge(coarse).depth_out_of_bound;
  };
  EXPECT_EQ(out_of_bound(1), 0);
  EXPECT_EQ(out_of_bound(2), 1);
}

TEST(Accuracy, AnIdThatDoesNotExistIsUnexplained) {
  spoilt({wall(0, 0.5f)}, 0, 0, 77, F32::kInfo.numbers, PixelClass::kUnexplained);
}

TEST(Accuracy, TheWorstPixelIsTheFarthestFromItsEdge) {
  Case spoil({wall(0, 0.5f), half(1, 0.25f)});
  for (const int x : {4, 2, 3}) spoil.ids[Case::at(x, x)] = 0;
  spoil.ids[Case::at(5, 5)] = 1;
  const Accuracy a = spoil.judge(Fixed4::kInfo.numbers);
  EXPECT_EQ(a.wrong, 4);
  EXPECT_EQ(a.unexplained, 4);
  EXPECT_EQ(a.worst_distance, 2.25);
  EXPECT_EQ(a.worst_pixel, static_cast<std::int64_t>(Case::at(2, 2)));
}

TEST(Accuracy, DepthErrorsInStepsAndInTheWorld) {
  // Distances along the view axis by the definition of each depth.
  const auto value_of = [](DepthFunction function, bool perspective, double w) {
    const double n = kNear, f = kFar;
    if (function == DepthFunction::kInverseW) return -f / w;
    if (function == DepthFunction::kReversed)
      return -(perspective ? n * (f - w) / ((f - n) * w) : (f - w) / (f - n));
    return perspective ? ((f + n) * w - 2 * n * f) / ((f - n) * w) : (2 * w - f - n) / (f - n);
  };
  for (const bool perspective : {true, false})
    for (const DepthFunction function :
         {DepthFunction::kNdc, DepthFunction::kReversed, DepthFunction::kInverseW}) {
      if (!perspective && function == DepthFunction::kInverseW) continue;
      const double distance = 3, moved = 3 + 1e-5;
      Case spoil({wall(0, static_cast<float>(value_of(function, perspective, distance)))}, function);
      const auto pixel = Case::at(6, 1);
      // The wall's own depth is rounded to float32, and so a little off.
      const double shift = value_of(function, perspective, moved) - value_of(function, perspective, distance);
      spoil.values[pixel] += shift;
      const Accuracy a = spoil.judge(F32::kInfo.numbers, test_camera(perspective));
      EXPECT_NEAR(a.max_depth_error_world, 1e-5, 1e-11);
      const double d_shift = value_of(DepthFunction::kNdc, perspective, moved) -
                             value_of(DepthFunction::kNdc, perspective, distance);
      EXPECT_NEAR(a.max_depth_error_steps, d_shift * 0x1p24, 1e-4);
      EXPECT_EQ(a.depth_out_of_bound, 1);
      EXPECT_EQ(a.wrong, 0);
      EXPECT_FALSE(a.within_bound());
      EXPECT_EQ(spoil.judge(kUnboundedMode, test_camera(perspective)).depth_out_of_bound, 0);
    }
}

TEST(Accuracy, Colours) {
  Case spoil({wall(0, 0.5f)});
  spoil.colours[3] += 8;            // red
  spoil.colours[9] += 9u << 8;      // green
  spoil.colours[40] -= 10u << 16;   // blue
  spoil.colours[41] ^= 0xff000000;  // alpha is not a colour
  const Accuracy a = spoil.judge(F32::kInfo.numbers);
  EXPECT_EQ(a.colours_changed, 3);
  EXPECT_EQ(a.colours_changed_8, 2);
  EXPECT_NEAR(a.psnr, 10 * std::log10(255.0 * 255.0 / ((64 + 81 + 100) / (3 * 64.0))), 1e-12);
}

TEST(Accuracy, SizesMustMatch) {
  Case spoil({wall(0, 0.5f)});
  spoil.values.pop_back();
  EXPECT_THROW(spoil.judge(F32::kInfo.numbers), Error);
}

TEST(Accuracy, EveryBoundedModeIsWithinItsBound) {
  std::int64_t wrong = 0, ties = 0;
  const auto judge = [&]<NumericMode Mode>(const std::vector<ScreenTriangle<typename Mode::Real>>& triangles,
                                           const FrameSettings& settings, const Camera& camera) {
    const auto input = oracle_input<Mode>(triangles, settings);
    const OracleImage oracle = exact_owners(input, 2);
    const ModePicture picture = draw_screen_triangles<Mode>(triangles, settings);
    const std::vector<std::uint32_t> colours(picture.ids.size());
    const Accuracy a = measure_accuracy<typename Mode::Real>({picture.ids, picture.values, colours}, input,
                                                             oracle, colours, camera, Mode::kInfo.numbers, 2);
    EXPECT_EQ(a.unexplained, 0) << "first at " << a.worst_pixel;
    EXPECT_EQ(a.depth_out_of_bound, 0);
    EXPECT_EQ(a.wrong, a.exact_ties + a.edge + a.depth);
    EXPECT_LE(a.edge + a.depth, a.predicted);
    wrong += a.wrong;
    ties += a.exact_ties;
    if (Mode::kInfo.numbers.exact_winner) {
      EXPECT_EQ(a.wrong, 0);
    }
  };
  for (const HardScene& hard : hard_scenes())
    for_each_bounded_mode([&]<NumericMode Mode>() {
      SCOPED_TRACE(hard.name + " in " + std::string(Mode::kInfo.name));
      const FrameSettings settings{.width = 120, .height = 90};
      judge.template operator()<Mode>(screen_triangles<Mode>(hard.scene, settings), settings,
                                      sized_camera(hard.scene, settings));
    });
  for_each_bounded_mode([&]<NumericMode Mode>() {
    using Triangle = HardTriangles<typename Mode::Real>;
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
      SCOPED_TRACE("seed " + std::to_string(seed) + " in " + std::string(Mode::kInfo.name));
      const int only = seed % 3 == 0   ? Triangle::kSlivers
                       : seed % 3 == 1 ? Triangle::kPlane
                                       : Triangle::kKinds;
      const FrameSettings settings{.width = 18, .height = 12, .fill = FillRule::kTopLeft};
      judge.template operator()<Mode>(Triangle(seed, {18, 12}, Mode::kDepthFunction, only).some(12), settings,
                                      test_camera());
    }
  });
  EXPECT_GT(wrong, 500);
  EXPECT_GT(ties, 10);
}

TEST(Silhouette, MovedSquares) {
  constexpr int kWidth = 40, kHeight = 30;
  const auto square = [&](int x0, int y0) {
    std::vector<std::int32_t> ids(kWidth * kHeight, -1);
    for (int y = y0; y < y0 + 6; ++y)
      for (int x = x0; x < x0 + 6; ++x) ids[static_cast<std::size_t>(y * kWidth + x)] = 7;
    return ids;
  };
  const auto here = square(5, 5);
  EXPECT_EQ(silhouette_distance(here, here, kWidth, kHeight), 0);
  EXPECT_EQ(silhouette_distance(here, square(8, 5), kWidth, kHeight), 3);
  EXPECT_EQ(silhouette_distance(here, square(14, 17), kWidth, kHeight), 15);
  const std::vector<std::int32_t> empty(kWidth * kHeight, -1), full(kWidth * kHeight, 0);
  EXPECT_EQ(silhouette_distance(empty, full, kWidth, kHeight), 0);  // the rim is no border
  EXPECT_EQ(silhouette_distance(empty, here, kWidth, kHeight), INFINITY);
  EXPECT_EQ(silhouette_distance(here, empty, kWidth, kHeight), INFINITY);
}

TEST(Silhouette, AgreesWithAllPairs) {
  Random random(2);
  for (int run = 0; run < 40; ++run) {
    const int width = 1 + static_cast<int>(random.bits() % 30),
              height = 1 + static_cast<int>(random.bits() % 20);
    const auto size = static_cast<std::size_t>(width * height);
    const auto picture = [&](double share) {
      std::vector<std::int32_t> ids(size);
      for (auto& id : ids) id = random.uniform() < share ? 3 : -1;
      return ids;
    };
    const auto a = picture(run % 2 == 0 ? 0.02 : 0.6), b = picture(run % 3 == 0 ? 0.02 : 0.5);
    const auto border = [&](const std::vector<std::int32_t>& ids) {
      std::vector<std::pair<int, int>> points;
      const auto open = [&](int x, int y) {
        return x >= 0 && x < width && y >= 0 && y < height &&
               ids[static_cast<std::size_t>(y * width + x)] < 0;
      };
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          if (ids[static_cast<std::size_t>(y * width + x)] >= 0 &&
              (open(x - 1, y) || open(x + 1, y) || open(x, y - 1) || open(x, y + 1)))
            points.emplace_back(x, y);
      return points;
    };
    const auto directed = [](const auto& from, const auto& to) {
      double farthest = 0;
      for (const auto& [x, y] : from) {
        double nearest = INFINITY;
        for (const auto& [u, v] : to) nearest = std::min(nearest, std::hypot(x - u, y - v));
        farthest = std::max(farthest, nearest);
      }
      return farthest;
    };
    const auto of_a = border(a), of_b = border(b);
    const double expected = std::max(directed(of_a, of_b), directed(of_b, of_a));
    const double found = silhouette_distance(a, b, width, height);
    if (std::isinf(expected)) {
      EXPECT_EQ(found, expected);
    } else {
      EXPECT_NEAR(found, expected, 1e-9) << run;
    }
  }
}

TEST(DifferenceImage, ShowsEachClassOverGrey) {
  constexpr int kWidth = 320, kHeight = 40;
  Accuracy accuracy{.pixels = kWidth * kHeight, .wrong = 2, .edge = 1, .unexplained = 1};
  accuracy.classes.assign(kWidth * kHeight, PixelClass::kSame);
  const auto at = [](int x, int y) { return static_cast<std::size_t>(y * kWidth + x); };
  accuracy.classes[at(10, 10)] = PixelClass::kEdge;
  accuracy.classes[at(kWidth - 1, kHeight - 1)] = PixelClass::kUnexplained;  // cut at the corner
  const std::vector<std::uint32_t> colours(kWidth * kHeight, 0xff0000ffu);
  const DifferenceImage image = difference_image(accuracy, colours, kWidth, kHeight);
  ASSERT_EQ(image.width, kWidth);
  ASSERT_GT(image.height, kHeight + 10);
  ASSERT_EQ(image.pixels.size(), static_cast<std::size_t>(image.width * image.height));
  const std::uint32_t edge = image.pixels[at(10, 10)], beyond = image.pixels[at(kWidth - 1, kHeight - 1)];
  const std::uint32_t grey = image.pixels[at(100, 20)];
  EXPECT_EQ(grey & 0xff, grey >> 8 & 0xff);
  EXPECT_EQ(grey & 0xff, grey >> 16 & 0xff);
  EXPECT_NE(edge, beyond);
  EXPECT_EQ(image.pixels[at(9, 9)], edge);
  EXPECT_EQ(image.pixels[at(11, 11)], edge);
  EXPECT_EQ(image.pixels[at(12, 10)], grey);
  const auto legend = image.pixels.begin() + kWidth * kHeight;
  EXPECT_GT(std::count(legend, image.pixels.end(), edge), 20);    // its swatch
  EXPECT_GT(std::count(legend, image.pixels.end(), beyond), 20);  // and none of what did not occur
  EXPECT_GT(std::count(legend, image.pixels.end(), 0xff141414u), 200);
  EXPECT_THROW(difference_image(accuracy, colours, kWidth, kHeight - 1), Error);
}

TEST(DifferenceImage, OfATinyPictureIsStillAPicture) {
  Accuracy accuracy{.pixels = 1};
  accuracy.classes = {PixelClass::kSame};
  const std::vector<std::uint32_t> colour = {0xff808080u};
  const DifferenceImage image = difference_image(accuracy, colour, 1, 1);
  EXPECT_EQ(image.pixels.size(), static_cast<std::size_t>(image.width * image.height));
}

}  // namespace
}  // namespace rasterbench
