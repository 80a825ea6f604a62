#include "harness/schedule_costs.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace rasterbench {
namespace {

TEST(ScheduleCosts, AreOfEveryScheduleWithThreads) {
  const ScheduleCosts costs = measure_schedules(2);
  for (const char* schedule :
       {"openmp:static", "openmp:static,1", "openmp:dynamic,1", "openmp:guided,16", "openmp:auto"})
    ASSERT_TRUE(costs.of.contains(schedule)) << schedule;
  EXPECT_GT(costs.of.at("openmp:dynamic,1").chunk_seconds.value_or(1), 0);  // empty on a noisy machine
  if (costs.of.contains("tbb:simple,1")) {
    EXPECT_GT(costs.of.at("tbb:simple,1").chunk_seconds.value_or(1), 0);
    EXPECT_EQ(costs.of.at("tbb:static").chunk_seconds, 0);           // one a thread, however many iterations
    EXPECT_EQ(costs.of.at("tbb:auto").chunk_seconds, std::nullopt);  // on one thread a few ranges
    EXPECT_LT(costs.steal_seconds.value_or(0), 1e-2);
  } else {
    EXPECT_EQ(costs.steal_seconds, std::nullopt);
  }
  EXPECT_EQ(costs.of.at("openmp:static").chunk_seconds, 0);  // one a thread, however many iterations
  for (const auto& [schedule, cost] : costs.of) {
    if (schedule.starts_with("openmp")) {
      EXPECT_GT(cost.start_seconds.value_or(0), 0) << schedule;
    }
    EXPECT_LT(cost.start_seconds.value_or(0), 1) << schedule;
    EXPECT_LT(cost.chunk_seconds.value_or(0), 1e-3) << schedule;
  }
}

TEST(ScheduleCosts, AreUnknownWhereNobodyCountsChunks) {
  setenv("RASTERBENCH_NO_STAMPS", "1", 1);
  const ScheduleCosts costs = measure_schedules(1);
  unsetenv("RASTERBENCH_NO_STAMPS");
  for (const auto& [schedule, cost] : costs.of)
    if (schedule.starts_with("tbb")) {
      EXPECT_EQ(cost.chunk_seconds, std::nullopt) << schedule;
    }
  EXPECT_EQ(costs.steal_seconds, std::nullopt);  // nobody to steal from
}

TEST(ScheduleCosts, AreUnknownWithinTheNoise) {
  EXPECT_EQ(beyond_noise({5, 5, 5, 5, 5, 5, 5}), 5);
  EXPECT_EQ(beyond_noise({5, 5, 5, 5, 5, 5}), std::nullopt);  // too few
  EXPECT_EQ(beyond_noise({4, 6, 5, 4.5, 5.5, 4, 6}), 5);
  EXPECT_EQ(beyond_noise({-9, 6, 1, -5, 3, -4, 8}), std::nullopt);
  EXPECT_EQ(beyond_noise({-5, -5, -5, -5, -5, -5, -5}), std::nullopt);
}

}  // namespace
}  // namespace rasterbench
