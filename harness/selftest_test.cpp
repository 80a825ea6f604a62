#include "harness/selftest.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "harness/statistics.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

SamplingPlan small_plan() {
  SamplingPlan plan;
  plan.min_samples = 10;
  plan.max_samples = 40;
  plan.launches = 5;
  return plan;
}

/// Comparisons of 400 that come out different, where label 1 takes `factor` times as long as label 0 and
/// `drift` more per block.
int differences(double factor, double drift) {
  int found = 0;
  Random random(3);
  for (std::uint64_t trial = 0; trial < 400; ++trial)
    found += compare_with_itself(small_plan(), trial, 1, [&](int label, int block) {
               return (label == 1 ? factor : 1) * (10 + drift * block + random.uniform());
             }).differs();
  return found;
}

// 5 % of 400 is 20; the order statistics of 10 to 40 pairs promise 2.1 to 5 %. More than 31 has a chance of
// 0.6 %.
TEST(Selftest, EqualLabelsDifferAsSeldomAsPromised) {
  EXPECT_LE(differences(1, 0), 31);
  EXPECT_LE(differences(1, 0.2), 31);  // drift meets both labels
}

TEST(Selftest, ADifferenceIsFound) { EXPECT_GE(differences(1.2, 0), 399); }

TEST(Selftest, BlocksAreShuffledAndLabelsStopOnTheirOwn) {
  SamplingPlan plan = small_plan();
  plan.target = 1e-9;
  std::set<int> first_of_a_block;
  int last_block = -1;
  Random random(4);
  const SelfComparison comparison = compare_with_itself(plan, 1, 1, [&](int label, int block) {
    if (block != last_block) first_of_a_block.insert(label);
    last_block = block;
    return label == 0 ? 1.0 : 1 + random.uniform();  // label 0 does not vary: it stops at once
  });
  EXPECT_EQ(first_of_a_block, (std::set{0, 1}));
  EXPECT_EQ(comparison.labels[0].stop, "target");
  EXPECT_EQ(comparison.labels[0].times_ms.size(), 10u);
  EXPECT_EQ(comparison.labels[1].stop, "max_samples");
  EXPECT_EQ(comparison.labels[1].times_ms.size(), 40u);
  EXPECT_TRUE(comparison.differs());
  // The interval is that of the 10 blocks that both have.
  EXPECT_GT(comparison.interval->first, 0.5);
  EXPECT_LT(comparison.interval->second, 1.0);
}

// Clopper and Pearson (1934): 0 of 100 is [0, 3.62 %], 5 of 100 is [1.64, 11.28 %], 100 of 100 is [96.38 %,
// 1].
TEST(Selftest, ProportionInterval) {
  const auto near = [](std::pair<double, double> interval, double low, double high) {
    return std::abs(interval.first - low) < 1e-4 && std::abs(interval.second - high) < 1e-4;
  };
  EXPECT_TRUE(near(proportion_interval(0, 100), 0, 0.0362));
  EXPECT_TRUE(near(proportion_interval(5, 100), 0.0164, 0.1128));
  EXPECT_TRUE(near(proportion_interval(100, 100), 0.9638, 1));
}

// Of 40, 6 have the interval [5.71, 29.84] %, and 5 have [4.19, 26.80] %; one of one has [2.5, 100] %.
TEST(Selftest, TheLeastRateThatCanBeFound) {
  EXPECT_EQ(least_found(40, 0.05), 6);
  EXPECT_EQ(least_found(2, 0.05), 2);
  EXPECT_EQ(least_found(1, 0.05), std::nullopt);
  EXPECT_EQ(least_found(100, 0), 1);
}

}  // namespace
}  // namespace rasterbench
