// Predicted against found: what a mode gets wrong must have been predicted from its bound.
#include <gtest/gtest.h>

#include "reference/oracle_testing.h"

namespace rasterbench {
namespace {

/// What became of one mode in one scene.
struct Outcome {
  std::int64_t pixels = 0, wrong = 0, predicted = 0, surprises = 0;
  double max_depth_error = 0, bound_of_depth = 0;
};

template <NumericMode Mode>
Outcome predict_and_draw(const std::vector<ScreenTriangle<typename Mode::Real>>& triangles,
                         const FrameSettings& settings) {
  const auto input = oracle_input<Mode>(triangles, settings);
  const OracleImage oracle = exact_owners(input, 2);
  const Prediction prediction = predict_wrong(input, oracle, Mode::kInfo.numbers, 2);
  const ModePicture picture = draw_screen_triangles<Mode>(triangles, settings);
  Outcome outcome{.pixels = static_cast<std::int64_t>(oracle.ids.size()),
                  .predicted = prediction.pixels,
                  .bound_of_depth = prediction.max_depth_error};
  for (std::size_t i = 0; i < oracle.ids.size(); ++i) {
    const bool wrong = picture.ids[i] != oracle.ids[i];
    outcome.wrong += wrong;
    outcome.surprises += wrong && prediction.reasons[i] == 0;
    if (prediction.reasons[i] == 0 && oracle.ids[i] >= 0)
      outcome.max_depth_error =
          std::max(outcome.max_depth_error, std::abs(picture.values[i] - oracle.values[i]));
  }
  return outcome;
}

/// Another fill rule and another rule for ties at every call.
FrameSettings changing_settings(int width, int height) {
  static int calls = 0;
  ++calls;
  return {.width = width,
          .height = height,
          .fill = calls % 2 == 0 ? FillRule::kClosed : FillRule::kTopLeft,
          .tie = calls % 3 == 0 ? TieRule::kLast : TieRule::kFirst};
}

template <NumericMode Mode>
void expect_no_surprise(const Outcome& outcome) {
  EXPECT_EQ(outcome.surprises, 0) << "of " << outcome.wrong << " wrong pixels";
  EXPECT_LE(outcome.max_depth_error, outcome.bound_of_depth);
  if (Mode::kInfo.numbers.exact_winner) {
    EXPECT_EQ(outcome.predicted, 0);
  }
}

TEST(Prediction, NoModeIsWrongWhereItWasNotPredicted) {
  std::int64_t wrong = 0;
  for (const HardScene& hard : hard_scenes())
    for_each_bounded_mode([&]<NumericMode Mode>() {
      const FrameSettings settings = changing_settings(200, 150);
      SCOPED_TRACE(hard.name + " in " + std::string(Mode::kInfo.name));
      const Outcome outcome = predict_and_draw<Mode>(screen_triangles<Mode>(hard.scene, settings), settings);
      expect_no_surprise<Mode>(outcome);
      wrong += outcome.wrong;
    });
  EXPECT_GT(wrong, 500);  // else there was nothing to predict
}

TEST(Prediction, NorOnHardScreenTriangles) {
  std::int64_t wrong = 0, pixels = 0;
  for_each_bounded_mode([&]<NumericMode Mode>() {
    SCOPED_TRACE(std::string(Mode::kInfo.name));
    using Triangles = HardTriangles<typename Mode::Real>;
    for (std::uint64_t seed = 0; seed < 120; ++seed) {
      const FrameSettings settings = changing_settings(18, 12);
      const int only = seed % 3 == 0   ? Triangles::kSlivers
                       : seed % 3 == 1 ? Triangles::kPlane
                                       : Triangles::kKinds;
      const auto triangles = Triangles(seed, {18, 12}, Mode::kDepthFunction, only).some(12);
      const Outcome outcome = predict_and_draw<Mode>(triangles, settings);
      expect_no_surprise<Mode>(outcome);
      wrong += outcome.wrong;
      pixels += outcome.pixels;
    }
  });
  EXPECT_GT(wrong, pixels / 200);
}

TEST(Prediction, NorFarFromTheOrigin) {
  std::int64_t wrong = 0;
  for_each_bounded_mode([&]<NumericMode Mode>() {
    SCOPED_TRACE(std::string(Mode::kInfo.name));
    using Real = typename Mode::Real;
    constexpr int kWidth = 1500, kHeight = 40;
    Random random(4);
    std::vector<ScreenTriangle<Real>> triangles;
    const auto real = [&](double low, double high) { return static_cast<Real>(random.uniform(low, high)); };
    for (std::int32_t id = 0; id < 240; ++id) {
      ScreenTriangle<Real> t{{}, {}, {}, id};
      const double x = random.uniform(0, kWidth), y = random.uniform(0, kHeight),
                   slope = random.uniform(-1, 1);
      for (int k = 0; k < 3; ++k) {
        t.d[k] = static_cast<Real>(far_value(Mode::kDepthFunction) - random.uniform(0, 1));
        if (id % 3 == 0) {  // hardly rises
          t.x[k] = real(-131072, 131072), t.y[k] = static_cast<Real>(y + random.uniform(-1, 1));
        } else if (id % 3 == 1) {  // steep
          t.x[k] = static_cast<Real>(x + random.uniform(-5, 5)), t.y[k] = real(-131072, 131072);
        } else {  // along a line across the guard band and the image
          const double along = (k == 0 ? 1 : -1) * random.uniform(60000, 120000);
          t.x[k] = static_cast<Real>(x + along), t.y[k] = static_cast<Real>(y + slope * along + k);
        }
      }
      triangles.push_back(t);
    }
    const Outcome outcome = predict_and_draw<Mode>(triangles, changing_settings(kWidth, kHeight));
    if (Mode::kInfo.name == F32::kInfo.name) {
      EXPECT_GT(outcome.wrong, 10);
    }
    expect_no_surprise<Mode>(outcome);
    wrong += outcome.wrong;
  });
  EXPECT_GT(wrong, 1000);
}

TEST(Prediction, IsNotTrivial) {
  const Scene scene = generate("teapot:triangles=5000");
  const FrameSettings settings{.width = 480, .height = 270};
  const auto share = [&]<NumericMode Mode>() {
    const Outcome outcome = predict_and_draw<Mode>(screen_triangles<Mode>(scene, settings), settings);
    return static_cast<double>(outcome.predicted) / static_cast<double>(outcome.pixels);
  };
  EXPECT_LT(share.operator()<F64>(), 1e-4);
  EXPECT_LT(share.operator()<Filtered>(), 1e-3);
  EXPECT_LT(share.operator()<F32>(), 1e-3);
  EXPECT_LT(share.operator()<Fixed8>(), 0.01);
  EXPECT_GT(share.operator()<Fixed4>(), 0.001);  // but it does predict what happens
}

/// The reasons for one pixel of a hand-made picture.
template <NumericMode Mode>
int reasons_at(const std::vector<ScreenTriangle<typename Mode::Real>>& triangles, int x, int y) {
  const auto input = oracle_input<Mode>(triangles, {.width = 8, .height = 8});
  const auto prediction = predict_wrong(input, exact_owners(input, 1), Mode::kInfo.numbers, 1);
  return prediction.reasons[static_cast<std::size_t>(y * 8 + x)];
}

TEST(Prediction, NamesTheReason) {
  using Triangles = std::vector<ScreenTriangle<float>>;
  const ScreenTriangle<float> wall{{-90, 290, -90}, {-90, -90, 290}, {0.25f, 0.25f, 0.25f}, 0};
  ScreenTriangle<float> close = wall, beyond = wall;
  for (float& d : close.d) d = 0.25f + 0x1p-20f;
  for (float& d : beyond.d) d = 1 - 0x1p-18f;
  close.x[0] = -91;  // another plane's corners, or they would be known to be alike
  close.id = 1;
  const ScreenTriangle<float> edge{{4.49f, 90, 4.49f}, {-90, -90, 90}, {0, 0, 0}, 2};
  EXPECT_EQ(reasons_at<Fixed4>(Triangles{wall}, 4, 4), 0);
  EXPECT_EQ(reasons_at<FilteredUnorm<16>>(Triangles{wall, close}, 4, 4), kDepthCanFlip);
  EXPECT_EQ(reasons_at<FilteredUnorm<24>>(Triangles{wall, close}, 4, 4), 0);
  EXPECT_EQ(reasons_at<FilteredUnorm<16>>(Triangles{beyond}, 4, 4), kDepthCanFlip);
  EXPECT_EQ(reasons_at<FilteredUnorm<24>>(Triangles{beyond}, 4, 4), 0);
  EXPECT_EQ(reasons_at<Fixed4>(Triangles{wall, edge}, 4, 4), kEdgeCanFlip);
  EXPECT_EQ(reasons_at<Fixed4>(Triangles{wall, edge}, 3, 4), 0);
  EXPECT_EQ(reasons_at<Fixed8>(Triangles{wall, edge}, 4, 4), 0);
  EXPECT_EQ(reasons_at<Fixed4>(Triangles{edge}, 4, 4), kEdgeCanFlip);
  EXPECT_EQ(reasons_at<ExactMode>(Triangles{wall, edge, close}, 4, 4), 0);
}

}  // namespace
}  // namespace rasterbench
