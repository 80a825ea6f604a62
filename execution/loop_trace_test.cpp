// A trace holds every iteration of the loop under study once, in chunks as the schedule deals them.
#include "execution/loop_trace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

namespace rasterbench {
namespace {

constexpr std::int64_t kIterations = 100;

void spin(double seconds) {
  const double end = LoopTrace::now() + seconds;
  while (LoopTrace::now() < end) {
  }
}

/// Every schedule of the build on 1 to 3 threads, by itself and with a chunk of 7.
std::vector<ExecutionConfig> all_configs() {
  std::vector<ExecutionConfig> all;
  for (const Schedule& schedule : schedules())
    for (int threads = 1; threads <= (schedule.backend == "serial" ? 1 : 3); ++threads) {
      all.push_back({schedule.backend, schedule.name, {}, threads});
      if (!schedule.chunk.empty()) all.push_back({schedule.backend, schedule.name, 7, threads});
    }
  return all;
}

/// Checks that the chunks of `trace` hold iterations 0 .. n-1 of each loop once, and that their times follow
/// each other on every thread.
void expect_whole(const LoopTrace& trace) {
  std::vector<std::vector<int>> seen;
  for (const TracedLoop& loop : trace.loops()) {
    EXPECT_LE(loop.begin, loop.end);
    seen.emplace_back(static_cast<std::size_t>(loop.iterations), 0);
  }
  for (const auto& chunks : trace.chunks()) {
    double before = 0;
    for (const TracedChunk& chunk : chunks) {
      ASSERT_LT(static_cast<std::size_t>(chunk.loop), seen.size());
      const TracedLoop& loop = trace.loops()[static_cast<std::size_t>(chunk.loop)];
      EXPECT_LE(std::max(before, loop.begin), chunk.begin);
      EXPECT_LE(chunk.begin, chunk.end);
      EXPECT_LE(chunk.end, loop.end);
      before = chunk.end;
      for (std::int64_t i = chunk.first; i <= chunk.last; ++i)
        ++seen[static_cast<std::size_t>(chunk.loop)].at(static_cast<std::size_t>(i));
    }
  }
  for (const auto& of_loop : seen)
    for (const int times : of_loop) ASSERT_EQ(times, 1);
}

TEST(LoopTraces, HoldEveryIterationOnceUnderEverySchedule) {
  for (ExecutionConfig config : all_configs()) {
    SCOPED_TRACE(to_string(config) + " on " + std::to_string(config.threads));
    LoopTrace trace(LoopTrace::Detail::kChunks);
    config.trace = &trace;
    const auto execution = make_execution(config);
    const auto nothing = [](std::int64_t, int) {};
    execution->uniform_loop(1000, nothing);
    EXPECT_TRUE(trace.loops().empty());
    execution->loop(kIterations, nothing);
    execution->loop(13, nothing);
    ASSERT_EQ(trace.loops().size(), 2u);
    EXPECT_FALSE(trace.loops_alike());
    expect_whole(trace);
    std::int64_t iterations = 0;
    for (const WorkerTally& tally : execution->tally()) iterations += tally.iterations;
    EXPECT_EQ(iterations, 1000 + kIterations + 13);
    trace.clear();
    execution->loop(kIterations, nothing);
    ASSERT_EQ(trace.loops().size(), 1u);
    expect_whole(trace);
  }
}

TEST(LoopTraces, CutChunksAsTheScheduleDoes) {
  for (const auto& [schedule, threads] :
       {std::pair{"dynamic", 1}, {"dynamic", 3}, {"static", 1}, {"static", 2}}) {
    SCOPED_TRACE(schedule);
    LoopTrace trace(LoopTrace::Detail::kChunks);
    const auto execution = make_execution({"openmp", schedule, 7, threads, &trace});
    execution->loop(kIterations, [](std::int64_t, int) {});
    std::size_t chunks = 0;
    std::int64_t tallied = 0;
    for (const WorkerTally& tally : execution->tally()) tallied += tally.chunks;
    for (const auto& of_worker : trace.chunks())
      for (const TracedChunk& chunk : of_worker) {
        ++chunks;
        EXPECT_EQ(chunk.first % 7, 0);
        EXPECT_EQ(chunk.last, std::min(chunk.first + 6, kIterations - 1));
      }
    EXPECT_EQ(chunks, 15u);
    EXPECT_EQ(tallied, 15);
  }
}

TEST(LoopTraces, OfStaticWithoutAChunkHaveOneAThread) {
  LoopTrace trace(LoopTrace::Detail::kChunks);
  const auto execution = make_execution({"openmp", "static", {}, 2, &trace});
  execution->loop(kIterations, [](std::int64_t, int) {});
  ASSERT_EQ(trace.chunks().size(), 2u);
  for (const auto& of_worker : trace.chunks()) EXPECT_EQ(of_worker.size(), 1u);
  for (const WorkerTally& tally : execution->tally()) EXPECT_EQ(tally.chunks, 1);
}

/// Threads take turns as they come, so that a rule that is not the runtime's would be seen: a thread's run
/// would end within one of its chunks, which makes one more.
TEST(LoopTraces, CutChunksOfGuidedAsLibgompDoes) {
  if (openmp_runtime() != "libgomp") GTEST_SKIP() << "the rule is libgomp's, loaded is " << openmp_runtime();
  EXPECT_EQ(libgomp_guided_begins(100, 2, 1), (std::vector<std::int64_t>{0, 50, 75, 88, 94, 97, 99}));
  EXPECT_EQ(libgomp_guided_begins(100, 2, 20), (std::vector<std::int64_t>{0, 50, 75, 95}));
  EXPECT_TRUE(libgomp_guided_begins(0, 2, 1).empty());
  for (const std::optional<int> chunk : {std::optional<int>(), std::optional<int>(5)})
    for (int threads = 1; threads <= 4; ++threads) {
      LoopTrace trace(LoopTrace::Detail::kChunks);
      const auto execution = make_execution({"openmp", "guided", chunk, threads, &trace});
      execution->loop(1000, [](std::int64_t i, int) { spin(i % 7 == 0 ? 2e-5 : 2e-6); });
      std::vector<std::int64_t> begins;
      for (const auto& of_worker : trace.chunks())
        for (const TracedChunk& traced : of_worker) begins.push_back(traced.first);
      std::sort(begins.begin(), begins.end());
      EXPECT_EQ(begins, libgomp_guided_begins(1000, threads, chunk.value_or(1))) << threads;
      expect_whole(trace);
    }
}

TEST(LoopTraces, HaveTheRangesOfOneTbb) {
  const auto names = backends();
  if (std::count(names.begin(), names.end(), "tbb") == 0) GTEST_SKIP() << "this build has no tbb";
  LoopTrace trace(LoopTrace::Detail::kChunks);
  // The simple partitioner halves ranges down to the grain, so 64 iterations at grain 8 are 8 ranges, which
  // on one thread follow each other: only what the body was handed tells them apart.
  const auto execution = make_execution({"tbb", "simple", 8, 1, &trace});
  execution->loop(64, [](std::int64_t, int) {});
  const auto chunks = trace.chunks();
  ASSERT_EQ(chunks.size(), 1u);
  EXPECT_EQ(chunks[0].size(), 8u);
  for (const TracedChunk& chunk : chunks[0]) EXPECT_EQ(chunk.last - chunk.first, 7);
  EXPECT_EQ(execution->tally()[0].chunks, 8);
}

TEST(LoopTraces, TimeEachIteration) {
  LoopTrace trace(LoopTrace::Detail::kIterations);
  const auto execution = make_execution({"serial", "", {}, 1, &trace});
  const auto body = [](std::int64_t i, int) { spin(i == 3 ? 2e-3 : 1e-4); };
  execution->loop(8, body);
  ASSERT_EQ(trace.iteration_seconds().size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_GE(trace.iteration_seconds()[i], i == 3 ? 2e-3 : 1e-4);
  const TracedLoop& loop = trace.loops().front();
  double sum = 0;
  for (const double seconds : trace.iteration_seconds()) sum += seconds;
  EXPECT_LE(sum, loop.end - loop.begin);
  EXPECT_GE(sum, 0.5 * (loop.end - loop.begin));
  trace.clear();
  EXPECT_EQ(trace.iteration_seconds()[3], 0);
}

TEST(LoopTraces, OfLoopsAloneHaveNoChunks) {
  LoopTrace trace(LoopTrace::Detail::kLoops);
  const auto execution = make_execution({"openmp", "dynamic", {}, 2, &trace});
  execution->loop(kIterations, [](std::int64_t, int) { spin(1e-5); });
  ASSERT_EQ(trace.loops().size(), 1u);
  EXPECT_TRUE(trace.loops_alike());
  EXPECT_GE(trace.loops()[0].end - trace.loops()[0].begin, 1e-5 * kIterations / 2);
  for (const auto& of_worker : trace.chunks()) EXPECT_TRUE(of_worker.empty());
}

TEST(LoopTraces, KnowWhatAStampCosts) {
  const double seconds = LoopTrace::stamp_seconds();
  EXPECT_GT(seconds, 0);
  EXPECT_LT(seconds, 1e-4);
}

}  // namespace
}  // namespace rasterbench
