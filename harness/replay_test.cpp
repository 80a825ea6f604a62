// What contradicts the rule of a schedule, on runs that are made by hand.
#include "harness/replay.h"

#include <gtest/gtest.h>

namespace rasterbench {
namespace {

const ExecutionConfig kDynamic{"openmp", "dynamic", 1, 2, nullptr};

/// Four iterations in chunks of one: worker 0 runs 0 and 2, worker 1 runs 1 and 3.
Replay fair_run() {
  Replay run;
  run.started = {0.0, 0.1, 1.0, 1.1};
  run.slept = {1.0, 1.0, 1.0, 1.0};
  run.workers = {0, 1, 0, 1};
  return run;
}

TEST(Contradictions, AreImpossibleByWorkerWhereChunksAreSingleIterations) {
  const auto ones = chunk_borders(kDynamic, "libgomp", 4);
  EXPECT_FALSE(can_be_contradicted(kDynamic, ones));
  EXPECT_EQ(contradiction(kDynamic, ones, std::vector<int>{1, 1, 0, 1}), std::nullopt);
  const ExecutionConfig pairs{"openmp", "dynamic", 2, 2, nullptr};
  const auto borders = chunk_borders(pairs, "libgomp", 4);
  EXPECT_TRUE(can_be_contradicted(pairs, borders));
  EXPECT_EQ(contradiction(pairs, borders, std::vector<int>{0, 0, 0, 1}), 3);
  EXPECT_TRUE(can_be_contradicted({"openmp", "static", 1, 2, nullptr}, ones));
}

TEST(Contradictions, OfTheOrderAreThoseThatNoDelayExplains) {
  const auto ones = chunk_borders(kDynamic, "libgomp", 4);
  EXPECT_EQ(order_contradiction(kDynamic, ones, fair_run()), std::nullopt);
  Replay late = fair_run();  // worker 0 took 0 first and was stopped before its stamp
  late.started[0] = 0.5;
  late.slept[0] = 0.5;
  EXPECT_EQ(order_contradiction(kDynamic, ones, late), std::nullopt);
  Replay swapped = fair_run();  // 3 starts at 1.0, and worker 1 is given 2 only at its end of 1, at 1.1
  swapped.workers = {0, 1, 1, 0};
  swapped.started = {0.0, 0.1, 1.1, 1.0};
  EXPECT_EQ(order_contradiction(kDynamic, ones, swapped), 2);
  Replay backwards = fair_run();
  backwards.workers = {0, 0, 0, 0};
  backwards.started = {3.0, 2.0, 1.0, 0.0};
  EXPECT_EQ(order_contradiction(kDynamic, ones, backwards), 0);
  EXPECT_EQ(order_contradiction({"openmp", "static", 1, 2, nullptr}, ones, backwards), std::nullopt);
}

}  // namespace
}  // namespace rasterbench
