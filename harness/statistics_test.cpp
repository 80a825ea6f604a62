#include "harness/statistics.h"

#include <gtest/gtest.h>

#include <numeric>

#include "scene/generator.h"

namespace rasterbench {
namespace {

std::vector<double> one_to(int n) {
  std::vector<double> values(static_cast<std::size_t>(n));
  std::iota(values.rbegin(), values.rend(), 1.0);  // descending: order must not matter
  return values;
}

TEST(Statistics, Median) {
  EXPECT_EQ(median(std::vector{3.0}), 3);
  EXPECT_EQ(median(std::vector{5.0, 1.0, 3.0}), 3);
  EXPECT_EQ(median(std::vector{4.0, 1.0, 3.0, 2.0}), 2.5);
}

// Ranks from tables of the sign test: n = 6 gives [1, 6] (96.9 %), 10 gives [2, 9] (97.9 %), 20 gives [6, 15]
// (95.9 %), 100 gives [40, 61] (96.5 %).
TEST(Statistics, IntervalRanks) {
  EXPECT_FALSE(median_interval(one_to(5)));
  EXPECT_EQ(median_interval(one_to(6)), (std::pair{1.0, 6.0}));
  EXPECT_EQ(median_interval(one_to(10)), (std::pair{2.0, 9.0}));
  EXPECT_EQ(median_interval(one_to(20)), (std::pair{6.0, 15.0}));
  EXPECT_EQ(median_interval(one_to(100)), (std::pair{40.0, 61.0}));
  EXPECT_TRUE(median_interval(one_to(5000)));
}

TEST(Statistics, IntervalCoversTheMedianAsOftenAsItSays) {
  Random random(11);
  int covered = 0;
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<double> values(15);
    for (double& v : values) v = random.uniform() * random.uniform();  // skewed; its median is about 0.1867
    const auto interval = median_interval(values);
    covered += interval->first <= 0.18668 && 0.18668 <= interval->second;
  }
  EXPECT_GT(covered, kTrials * 95 / 100);
  EXPECT_LT(covered, kTrials * 98 / 100);
}

TEST(Statistics, StudentQuantilesAreThoseOfTheTables) {
  EXPECT_NEAR(student_t_quantile(0.975, 1), 12.706, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.975, 2), 4.303, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.975, 4), 2.776, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.995, 9), 3.250, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.8, 4), 0.941, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.975, 100), 1.984, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.975, 10001), 1.960, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.5, 3), 0, 1e-9);
}

TEST(Statistics, Percentile) {
  EXPECT_FALSE(percentile_95(one_to(58)));
  EXPECT_EQ(percentile_95(one_to(100)), 95);
}

}  // namespace
}  // namespace rasterbench
