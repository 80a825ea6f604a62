#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <thread>
#include <vector>

#include "base/buffer.h"
#include "base/error.h"
#include "execution/execution.h"
#include "machine/bandwidth.h"
#include "machine/floor.h"
#include "machine/geometry_rate.h"
#include "machine/loops.h"
#include "machine/team.h"
#include "scene/scene.h"

namespace rasterbench {
namespace {

constexpr std::size_t kBlockBytes = kBlockWords * sizeof(std::uint64_t);

TEST(Team, EveryThreadRunsEveryWorkOnce) {
  Team team(std::min(3, available_cpus()));
  std::vector<int> runs(static_cast<std::size_t>(team.threads()));
  for (int round = 1; round <= 50; ++round) {
    EXPECT_GE(team.run([&](int thread) { ++runs[static_cast<std::size_t>(thread)]; }), 0);
    for (const int count : runs) ASSERT_EQ(count, round);
  }
}

TEST(Team, TimesTheSlowest) {
  Team team(1);
  EXPECT_GE(team.run([](int) { std::this_thread::sleep_for(std::chrono::milliseconds(5)); }), 0.005);
}

TEST(Team, RefusesThreadsThatCannotRunAtOnce) { EXPECT_THROW(Team(available_cpus() + 1), Error); }

// The loops do what they are timed for: a loop that leaves something out would show a rate that nobody
// reaches.

TEST(Loops, SumEveryWordOnce) {
  Buffer<std::uint64_t> words(3 * kBlockWords, "words");
  std::iota(words.data(), words.data() + words.size(), std::uint64_t{1});
  const std::uint64_t n = words.size();
  EXPECT_EQ(sum_words(words.data(), n), n * (n + 1) / 2);
  EXPECT_EQ(sum_words(words.data() + kBlockWords, kBlockWords),
            sum_words(words.data(), 2 * kBlockWords) - sum_words(words.data(), kBlockWords));
  EXPECT_EQ(sum_words(words.data(), 0), 0u);
  words[5] = ~std::uint64_t{0};  // was 6: the sum wraps around
  EXPECT_EQ(sum_words(words.data(), n), n * (n + 1) / 2 - 7);
}

TEST(Loops, WriteEveryWordAndNoOther) {
  for (const auto write : {store_words, stream_words}) {
    Buffer<std::uint64_t> words(4 * kBlockWords, "words");
    write(words.data() + kBlockWords, 2 * kBlockWords, 0xfedcba9876543210);
    for (std::size_t i = 0; i < words.size(); ++i)
      ASSERT_EQ(words[i], i / kBlockWords == 1 || i / kBlockWords == 2 ? 0xfedcba9876543210 : 0u) << i;
  }
}

TEST(Loops, Triad) {
  Buffer<double> a(2 * kBlockWords, "a"), b(kBlockWords, "b"), c(kBlockWords, "c");
  for (std::size_t i = 0; i < kBlockWords; ++i) {
    b[i] = static_cast<double>(i);
    c[i] = static_cast<double>(1000 * i);
  }
  triad(a.data(), b.data(), c.data(), 3, kBlockWords);
  for (std::size_t i = 0; i < kBlockWords; ++i) ASSERT_EQ(a[i], 3001.0 * static_cast<double>(i)) << i;
  for (std::size_t i = kBlockWords; i < a.size(); ++i) ASSERT_EQ(a[i], 0) << i;
}

TEST(Loops, HaveAName) { EXPECT_STRNE(loop_instructions(), ""); }

TEST(Floor, CountsWhatAFrameCannotDoWithout) {
  EXPECT_EQ(working_set_of(1000000, 1920, 1080), (WorkingSet{36000000, 16588800}));
  EXPECT_EQ(working_set_of(2147483647, 65536, 65536), (WorkingSet{77309411292, 34359738368}));
  EXPECT_EQ(working_set_of(0, 1, 1), (WorkingSet{0, 8}));
}

TEST(Floor, FollowsFromKnownRates) {
  // 36 MB at 18 GB/s take 2 ms, 16 MB at 32 GB/s half of one.
  EXPECT_DOUBLE_EQ(floor_ms({36000000, 16000000}, 18e9, 32e9), 2.5);
  EXPECT_DOUBLE_EQ(floor_ms({0, 8000000}, 1e9, 8e9), 1.0);
  EXPECT_DOUBLE_EQ(floor_ms({36000000, 0}, 36e9, 1e9), 1.0);
}

void expect_rates(const std::vector<double>& rates, std::size_t count) {
  EXPECT_EQ(rates.size(), count);
  for (const double rate : rates) EXPECT_GT(rate, 0);
}

TEST(MeasuredBandwidth, HasEveryRateForEachRepetition) {
  for (int threads = 1; threads <= std::min(2, available_cpus()); ++threads) {
    const Bandwidth all = measure_bandwidth({100000, 200000}, threads, {3, 0}, BandwidthLoops::kAll);
    EXPECT_EQ(all.threads, threads);
    for (const auto& rates : {all.read, all.write, all.streaming_write, all.triad}) expect_rates(rates, 3);
    const Bandwidth some = measure_bandwidth({100000, 200000}, threads, {2, 0}, BandwidthLoops::kFloor);
    for (const auto& rates : {some.read, some.streaming_write}) expect_rates(rates, 2);
    EXPECT_TRUE(some.write.empty() && some.triad.empty());
  }
}

TEST(MeasuredBandwidth, RepeatsUntilItsTimeIsOver) {
  const auto begin = std::chrono::steady_clock::now();
  const Bandwidth measured = measure_bandwidth({1000, 1000}, 1, {2, 0.02}, BandwidthLoops::kFloor);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(20));
  EXPECT_GE(measured.read.size(), 2u);
  EXPECT_EQ(measured.read.size(), measured.streaming_write.size());
}

TEST(MeasuredBandwidth, RoundsBytesUpToBlocks) {
  const auto set_of = [](WorkingSet set) {
    return measure_bandwidth(set, 1, {1, 0}, BandwidthLoops::kFloor).set;
  };
  EXPECT_EQ(set_of({10 * kBlockBytes, 20 * kBlockBytes}), (WorkingSet{10 * kBlockBytes, 20 * kBlockBytes}));
  EXPECT_EQ(set_of({10 * kBlockBytes + 1, 20 * kBlockBytes - 1}),
            (WorkingSet{11 * kBlockBytes, 20 * kBlockBytes}));
  EXPECT_EQ(set_of({1, 0}), (WorkingSet{3 * kBlockBytes, 3 * kBlockBytes}));  // three a thread
}

TEST(MeasuredBandwidth, RefusesWhatDoesNotFit) {
  EXPECT_THROW(measure_bandwidth({std::size_t{1} << 60, 8}, 1, {1, 0}, BandwidthLoops::kFloor), InputError);
}

TEST(BeyondCache, IsFourCachesOrAShareOfMemory) {
  constexpr std::size_t kMiB = 1 << 20;
  EXPECT_EQ(beyond_cache_set(32 * kMiB, 8192 * kMiB), (WorkingSet{128 * kMiB, 128 * kMiB}));
  EXPECT_EQ(beyond_cache_set(32 * kMiB, 800 * kMiB), (WorkingSet{100 * kMiB, 100 * kMiB}));
  EXPECT_GT(beyond_cache_set(0, 8192 * kMiB).read_bytes, 0u);
}

TEST(GeometryRate, TimesABatchOfTheScene) {
  const Scene scene = open_scene("terrain:triangles=1000", "");
  const GeometryRate rate = measure_geometry(scene, 1, 3);
  EXPECT_EQ(rate.threads, 1);
  EXPECT_EQ(rate.triangles, kGeometryBatch);
  expect_rates(rate.ns_per_triangle, 3);
  Scene small = scene;
  small.model.triangles.resize(5);
  EXPECT_EQ(measure_geometry(small, 1, 1).triangles, 5);
  small.model.triangles.clear();
  EXPECT_THROW(measure_geometry(small, 1, 1), InputError);
}

}  // namespace
}  // namespace rasterbench
