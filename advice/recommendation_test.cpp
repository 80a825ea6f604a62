// Which of some measured configurations is recommended, and the command that draws with it.
#include "advice/recommendation.h"

#include <gtest/gtest.h>

#include "numeric/modes.h"

namespace rasterbench {
namespace {

ModeVerdict verdict(const ModeInfo& mode, std::int64_t predicted, std::int64_t found = 0) {
  ModeVerdict v;
  v.mode = &mode;
  v.standing = Standing::kSuffices;
  v.predicted = predicted;
  v.found = found;
  return v;
}

const ModeVerdict kFew = verdict(ExactMode::kInfo, 0), kMany = verdict(F32::kInfo, 7, 1),
                  kManyNoneFound = verdict(F32Fma::kInfo, 7, 0);

/// `rounds` frame times about `ms`, in turn above and below it.
Measurement measured(const ModeVerdict& v, double ms, double scatter, std::size_t rounds = 20) {
  Measurement m;
  m.candidate = {"tile_parallel", &v, {"openmp", "dynamic", {}, 2}};
  m.conforms = true;
  for (std::size_t i = 0; i < rounds; ++i) m.rounds_ms.push_back(ms + (i % 2 == 0 ? scatter : -scatter));
  return m;
}

const ModeVerdict* recommended(const std::vector<Measurement>& measurements) {
  const auto recommendation = recommend(measurements);
  return recommendation ? recommendation->finalists[recommendation->chosen].measurement->candidate.verdict
                        : nullptr;
}

TEST(Recommend, TheFastestThatCanBeToldApart) {
  // Both keep the tolerance, so that fewer wrong pixels are no reason to be slower.
  const std::vector measurements{measured(kFew, 10, 0.1), measured(kMany, 9, 0.1)};
  const auto recommendation = recommend(measurements);
  ASSERT_TRUE(recommendation);
  EXPECT_EQ(recommended(measurements), &kMany);
  EXPECT_EQ(recommendation->finalists[0].measurement, &measurements[1]);
  EXPECT_DOUBLE_EQ(recommendation->finalists[1].median_ms, 10);
  EXPECT_TRUE(recommendation->finalists[1].is_distinguishable);
  ASSERT_TRUE(recommendation->finalists[1].slower_by);
  EXPECT_NEAR(recommendation->finalists[1].slower_by->first, 10.0 / 9, 0.05);
  EXPECT_FALSE(recommendation->finalists[0].slower_by);
}

TEST(Recommend, TheFewestWrongPixelsWhereNothingTellsThemApart) {
  Measurement slower = measured(kFew, 9.01, 0.1), faster = measured(kMany, 9, 0.1);
  std::swap(slower.rounds_ms[0], slower.rounds_ms[1]);  // so that each is faster in some round
  for (std::size_t i = 0; i < slower.rounds_ms.size(); i += 3) slower.rounds_ms[i] = 8.5;
  const std::vector measurements{faster, slower};
  const auto recommendation = recommend(measurements);
  ASSERT_TRUE(recommendation);
  EXPECT_FALSE(recommendation->finalists[1].is_distinguishable);
  EXPECT_EQ(recommended(measurements), &kFew);
}

TEST(Recommend, FoundPixelsDecideBetweenEqualBounds) {
  const std::vector measurements{measured(kMany, 9, 0.1, 3), measured(kManyNoneFound, 9.5, 0.1, 3)};
  EXPECT_EQ(recommended(measurements), &kManyNoneFound);
}

TEST(Recommend, NothingIsToldApartByFewRounds) {
  const std::vector measurements{measured(kFew, 20, 0.1, 5), measured(kMany, 9, 0.1, 5)};
  EXPECT_EQ(recommended(measurements), &kFew);
  EXPECT_FALSE(recommend(measurements)->finalists[0].interval_ms);
  EXPECT_EQ(recommended({measured(kFew, 20, 0.1, 6), measured(kMany, 9, 0.1, 6)}), &kMany);
}

TEST(Recommend, OnlyWhatConformsAndReachedTheFinal) {
  Measurement wrong = measured(kFew, 1, 0.1), early = measured(kFew, 1, 0.1);
  wrong.conforms = false;
  early.rounds_ms.clear();
  EXPECT_EQ(recommended({wrong, early, measured(kMany, 9, 0.1)}), &kMany);
  EXPECT_EQ(recommended({wrong, early}), nullptr);
  EXPECT_EQ(recommended({}), nullptr);
}

TEST(CommandLine, IsCompleteAndQuoted) {
  FrameSettings settings{.width = 640, .height = 360, .fill = FillRule::kTopLeft};
  settings.geometry.near_rule = NearRule::kOff;
  Candidate candidate{"scanline", &kMany, {"openmp", "static", {}, 2}};
  EXPECT_EQ(
      command_line(candidate, "teapot:triangles=300", "", settings),
      "rasterbench render teapot:triangles=300 --size 640x360 --kernel scanline --numeric f32 --backend "
      "openmp --schedule static --threads 2 --fill top-left --near off");
  candidate.execution = {};
  EXPECT_EQ(command_line(candidate, "my model.dat", "it's.txt", settings),
            "rasterbench render 'my model.dat' 'it'\\''s.txt' --size 640x360 --kernel scanline --numeric f32 "
            "--backend serial --threads 1 --fill top-left --near off");
}

}  // namespace
}  // namespace rasterbench
