#include "harness/placement.h"

#include <gtest/gtest.h>

namespace rasterbench {
namespace {

Json thread(std::vector<int> cpus, int moves) {
  return {{"first_cpu", cpus.empty() ? -1 : cpus.front()},
          {"last_cpu", cpus.empty() ? -1 : cpus.back()},
          {"cpus", cpus},
          {"moves", moves}};
}

Sample sample(int launch, Json threads) {
  return {.block = 0, .launch = launch, .ms = 1, .answer = {{"per_thread", std::move(threads)}}};
}

PointState state_of(std::vector<Sample> samples) {
  PointState state;
  state.samples = std::move(samples);
  return state;
}

/// Two packages and NUMA nodes of one core, each of two CPUs: 0 and 2, 1 and 3.
Topology two_cores() { return Topology({{0, 0, 0, 0}, {1, 1, 1, 1}, {2, 0, 0, 0}, {3, 1, 1, 1}}); }

TEST(Placement, CountsSamplesByCpuAndMigrations) {
  const PointState state = state_of({sample(0, {thread({0}, 0)}), sample(0, {thread({0, 3}, 1)}),
                                     sample(0, {thread({0}, 0)}), sample(1, {thread({1}, 0)})});
  EXPECT_EQ(samples_by_cpu(state, 0), (Json{{"0", 3}, {"1", 1}, {"3", 1}}));
  // One within the second sample and one after it; launch 1 is another process.
  EXPECT_EQ(migrations_of(state, 0), 2);
}

TEST(Placement, SaysWhereTheThreadsWere) {
  const Json placement = placement_of(
      state_of({sample(0, {thread({0}, 0), thread({1}, 0)}), sample(0, {thread({0}, 0), thread({2}, 0)}),
                sample(0, {thread({3}, 0), thread({3}, 0)})}),
      two_cores());
  EXPECT_EQ(placement.at("cpus"), 4);
  EXPECT_EQ(placement.at("cores"), 2);
  EXPECT_EQ(placement.at("packages"), 2);
  EXPECT_EQ(placement.at("numa_nodes"), 2);
  EXPECT_EQ(placement.at("samples_sharing_cpu"), 1);
  EXPECT_EQ(placement.at("samples_sharing_core"), 2);
  EXPECT_EQ(placement.at("migrations"), 3);  // once the first thread, twice the second
  EXPECT_TRUE(placement.at("binding").is_null());
}

TEST(Placement, ThreadsThatSwapCpusShareNone) {
  const Json placement =
      placement_of(state_of({sample(0, {thread({0, 1}, 1), thread({1, 0}, 1)})}), two_cores());
  EXPECT_EQ(placement.at("samples_sharing_cpu"), 0);
  EXPECT_EQ(placement.at("samples_sharing_core"), 0);
}

TEST(Placement, WithoutTopologyCpusAreKnownAndCoresAreNot) {
  const Json placement = placement_of(state_of({sample(0, {thread({5}, 0)})}), Topology({}));
  EXPECT_EQ(placement.at("cpus"), 1);
  EXPECT_TRUE(placement.at("cores").is_string());
}

TEST(Placement, IsNullWhereNobodyLooked) {
  EXPECT_TRUE(placement_of(state_of({sample(0, Json::array())}), two_cores()).is_null());
  EXPECT_TRUE(placement_of(state_of({sample(0, {thread({}, 0)})}), two_cores()).is_null());
}

}  // namespace
}  // namespace rasterbench
