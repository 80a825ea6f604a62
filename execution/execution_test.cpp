// Every schedule of the build runs every iteration once, on the threads that were asked for.
#include "execution/execution.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <numeric>

#include "base/error.h"

namespace rasterbench {
namespace {

constexpr std::int64_t kLengths[] = {0, 1, 7, 1000};

/// Every schedule with each number of threads and, where it takes one, each chunk.
std::vector<ExecutionConfig> all_configs() {
  std::vector<ExecutionConfig> all;
  for (const Schedule& schedule : schedules())
    for (int threads = 1; threads <= (schedule.backend == "serial" ? 1 : 4); ++threads) {
      all.push_back({schedule.backend, schedule.name, {}, threads});
      if (schedule.chunk.empty()) continue;
      for (const int chunk : {1, 3, 1000}) all.push_back({schedule.backend, schedule.name, chunk, threads});
    }
  return all;
}

std::string describe(const ExecutionConfig& config) {
  return to_string(config) + " on " + std::to_string(config.threads);
}

std::int64_t iterations_of(const Execution& execution) {
  std::int64_t sum = 0;
  for (const WorkerTally& tally : execution.tally()) sum += tally.iterations;
  return sum;
}

TEST(Schedules, OfThisBuild) {
  const auto names = backends();
  EXPECT_EQ(std::count(names.begin(), names.end(), "serial"), 1);
  EXPECT_EQ(std::count(names.begin(), names.end(), "openmp"), 1);
  for (const char* name : {"static", "dynamic", "guided", "auto"})
    EXPECT_EQ(find_schedule({"openmp", name, {}, 1}).name, name);
  if (std::count(names.begin(), names.end(), "tbb") == 0) GTEST_SKIP() << "this build has no tbb";
  for (const char* name : {"auto", "simple", "static", "affinity"})
    EXPECT_EQ(find_schedule({"tbb", name, {}, 1}).name, name);
}

class EveryConfig : public testing::TestWithParam<ExecutionConfig> {};

TEST_P(EveryConfig, RunsEachIterationOnceAndTalliesIt) {
  const auto execution = make_execution(GetParam());
  ASSERT_EQ(execution->threads(), GetParam().threads);
  ASSERT_EQ(execution->tally().size(), static_cast<std::size_t>(GetParam().threads));
  for (const bool uniform : {false, true})
    for (const std::int64_t n : kLengths) {
      std::vector<std::atomic<int>> runs(static_cast<std::size_t>(n));
      std::vector<std::atomic<std::int64_t>> by_worker(static_cast<std::size_t>(execution->threads()));
      std::atomic<int> bad_workers{0};
      const auto body = [&](std::int64_t i, int worker) {
        ++runs[static_cast<std::size_t>(i)];
        if (worker < 0 || worker >= execution->threads())
          ++bad_workers;
        else
          ++by_worker[static_cast<std::size_t>(worker)];
      };
      execution->reset_tally();
      uniform ? execution->uniform_loop(n, body) : execution->loop(n, body);
      ASSERT_EQ(bad_workers, 0);
      for (std::size_t i = 0; i < runs.size(); ++i) ASSERT_EQ(runs[i], 1) << "iteration " << i << " of " << n;
      for (std::size_t w = 0; w < by_worker.size(); ++w) {
        const WorkerTally& tally = execution->tally()[w];
        ASSERT_EQ(tally.iterations, by_worker[w]) << "worker " << w << ", n = " << n;
        ASSERT_GE(tally.busy_seconds, 0);
        if (tally.iterations > 0) {
          ASSERT_GE(tally.cpu, 0);
        }
      }
      ASSERT_EQ(iterations_of(*execution), n);
    }
}

TEST_P(EveryConfig, TalliesLoopsOfBothKindsUntilReset) {
  const auto execution = make_execution(GetParam());
  const auto nothing = [](std::int64_t, int) {};
  execution->uniform_loop(10, nothing);
  execution->loop(7, nothing);
  execution->uniform_loop(100, nothing);
  EXPECT_EQ(iterations_of(*execution), 117);
  execution->reset_tally();
  for (const WorkerTally& tally : execution->tally()) {
    EXPECT_EQ(tally.iterations, 0);
    EXPECT_EQ(tally.busy_seconds, 0);
    EXPECT_EQ(tally.cpu, -1);
  }
  execution->loop(3, nothing);
  EXPECT_EQ(iterations_of(*execution), 3);
}

TEST_P(EveryConfig, RunsWithoutStampsWhereTheyAreLeftOut) {
  setenv("RASTERBENCH_NO_STAMPS", "1", 1);
  const auto bare = make_execution(GetParam());
  unsetenv("RASTERBENCH_NO_STAMPS");
  std::atomic<std::int64_t> runs{0};
  bare->loop(1000, [&](std::int64_t, int) { ++runs; });
  bare->uniform_loop(1000, [&](std::int64_t, int) { ++runs; });
  EXPECT_EQ(runs, 2000);
  EXPECT_FALSE(bare->loop_seconds());
  for (const WorkerTally& tally : bare->tally()) {
    EXPECT_EQ(tally.iterations, 0);
    EXPECT_EQ(tally.chunks, 0);
    EXPECT_EQ(tally.busy_seconds, 0);
  }
}

TEST_P(EveryConfig, TimesLoopsWhereTheyAreFew) {
  const auto execution = make_execution(GetParam());
  const auto nothing = [](std::int64_t, int) {};
  for (int loop = 0; loop < Execution::kTimedLoops; ++loop) execution->loop(1, nothing);
  ASSERT_TRUE(execution->loop_seconds());
  double busiest = 0;
  for (const WorkerTally& tally : execution->tally()) busiest = std::max(busiest, tally.busy_seconds);
  EXPECT_GE(*execution->loop_seconds(), busiest);
  execution->loop(1, nothing);
  EXPECT_FALSE(execution->loop_seconds());
  execution->reset_tally();
  EXPECT_EQ(execution->loop_seconds(), 0.0);
}

TEST_P(EveryConfig, TalliesChunks) {
  const auto execution = make_execution(GetParam());
  execution->loop(1000, [](std::int64_t, int) {});
  std::int64_t chunks = 0;
  for (const WorkerTally& tally : execution->tally()) {
    EXPECT_LE(tally.chunks, tally.iterations);
    EXPECT_EQ(tally.chunks > 0, tally.iterations > 0);
    chunks += tally.chunks;
  }
  EXPECT_GE(chunks, 1);
  const ExecutionConfig& config = GetParam();
  const bool has_size = config.schedule == "dynamic" || (config.schedule == "static" && config.chunk);
  if (config.backend == "openmp" && has_size) {
    const int size = config.chunk.value_or(1);
    EXPECT_EQ(chunks, (1000 + size - 1) / size);
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryConfig, testing::ValuesIn(all_configs()), [](const auto& test) {
  std::string name = describe(test.param);
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
});

TEST(Executions, ResultsOfAnIterationAreSeenAfterTheLoop) {
  for (const ExecutionConfig& config : all_configs()) {
    const auto execution = make_execution(config);
    std::vector<std::int64_t> squares(1000);  // not atomic: the end of the loop is what orders the writes
    execution->loop(1000, [&](std::int64_t i, int) { squares[static_cast<std::size_t>(i)] = i * i; });
    for (std::size_t i = 0; i < squares.size(); ++i)
      ASSERT_EQ(squares[i], static_cast<std::int64_t>(i * i)) << describe(config);
  }
}

TEST(Executions, RunOnAsManyThreadsAsAskedFor) {
  for (const Schedule& schedule : schedules())
    for (int threads = 1; threads <= (schedule.backend == "serial" ? 1 : 4); ++threads) {
      const ExecutionConfig config{schedule.backend, schedule.name, {}, threads};
      const auto execution = make_execution(config);
      const ObservedThreads observed = observe_threads(*execution);
      EXPECT_EQ(observed.count, threads) << describe(config);
      EXPECT_EQ(observed.cpus.size(), static_cast<std::size_t>(threads)) << describe(config);
      EXPECT_FALSE(observed.denormals_flushed) << describe(config);
      for (const int cpu : observed.cpus) EXPECT_GE(cpu, 0);
    }
}

TEST(Executions, BusyTimeIsThatOfTheBody) {
  const auto execution = make_execution({});
  execution->loop(4, [](std::int64_t, int) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(5);
    while (std::chrono::steady_clock::now() < end) {
    }
  });
  EXPECT_GE(execution->tally()[0].busy_seconds, 0.020);
  EXPECT_LT(execution->tally()[0].busy_seconds, 10);
}

/// Which worker ran each of n iterations.
std::vector<int> workers_of(Execution& execution, std::int64_t n) {
  std::vector<int> workers(static_cast<std::size_t>(n), -1);
  execution.loop(n, [&](std::int64_t i, int worker) { workers[static_cast<std::size_t>(i)] = worker; });
  return workers;
}

TEST(OpenMp, StaticGivesContiguousBlocksInTheOrderOfTheWorkers) {
  for (int threads = 1; threads <= 4; ++threads) {
    const auto execution = make_execution({"openmp", "static", {}, threads});
    const auto workers = workers_of(*execution, 103);
    EXPECT_TRUE(std::is_sorted(workers.begin(), workers.end()));
    for (int w = 0; w < threads; ++w) {
      const auto share = std::count(workers.begin(), workers.end(), w);
      EXPECT_GE(share, 103 / threads);
      EXPECT_LE(share, 103 / threads + 1);
    }
  }
}

TEST(OpenMp, StaticWithAChunkDealsItRoundRobin) {
  const auto execution = make_execution({"openmp", "static", 3, 2});
  EXPECT_EQ(workers_of(*execution, 11), (std::vector<int>{0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1}));
}

TEST(OpenMp, DynamicKeepsChunksTogether) {
  const auto execution = make_execution({"openmp", "dynamic", 5, 3});
  const auto workers = workers_of(*execution, 100);
  for (std::size_t i = 0; i < workers.size(); ++i) EXPECT_EQ(workers[i], workers[i / 5 * 5]);
}

// libgomp's auto is static with the chunk of whatever loop ran before where parallel and for are one
// construct, or GCC makes them one (measured).
TEST(OpenMp, AutoDoesNotInheritTheChunkOfTheLoopBefore) {
  if (openmp_runtime() != "libgomp") GTEST_SKIP() << "auto is deterministic in libgomp only";
  const auto fixed = make_execution({"openmp", "static", {}, 3});
  const auto automatic = make_execution({"openmp", "auto", {}, 3});
  workers_of(*fixed, 100);
  const auto after_static = workers_of(*automatic, 100);
  for (const ExecutionConfig& before :
       {ExecutionConfig{"openmp", "dynamic", 7, 3}, {"openmp", "static", 5, 3}, {"openmp", "guided", 9, 3}}) {
    const auto other = make_execution(before);
    workers_of(*other, 100);
    EXPECT_EQ(workers_of(*automatic, 100), after_static) << "after " << to_string(before);
  }
}

TEST(OpenMp, UniformLoopIsStaticWhateverTheSchedule) {
  const auto execution = make_execution({"openmp", "dynamic", 1, 3});
  std::vector<int> workers(90, -1);
  execution->uniform_loop(90,
                          [&](std::int64_t i, int worker) { workers[static_cast<std::size_t>(i)] = worker; });
  for (int i = 0; i < 90; ++i) EXPECT_EQ(workers[static_cast<std::size_t>(i)], i / 30);
}

TEST(OpenMp, RuntimeIsKnown) { EXPECT_NE(openmp_runtime(), "unknown"); }

TEST(Serial, RunsInOrder) {
  const auto execution = make_execution({});
  std::vector<std::int64_t> order;
  execution->loop(50, [&](std::int64_t i, int worker) {
    EXPECT_EQ(worker, 0);
    order.push_back(i);
  });
  std::vector<std::int64_t> expected(50);
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(order, expected);
}

TEST(ExecutionConfigs, AsText) {
  EXPECT_EQ(to_string(ExecutionConfig{}), "serial");
  EXPECT_EQ(to_string({"openmp", "static", {}, 8}), "openmp:static");
  EXPECT_EQ(to_string({"openmp", "dynamic", 16, 8}), "openmp:dynamic,16");
  EXPECT_EQ(to_string({"tbb", "auto", 1, 1}), "tbb:auto,1");
}

/// what() of the InputError of make_execution; "none" where it makes one.
std::string error_of(const ExecutionConfig& config) {
  try {
    make_execution(config);
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

TEST(ExecutionConfigs, ThatCannotRunAreRefused) {
  EXPECT_EQ(error_of({"openmpi", "static", {}, 1}),
            "backend: unknown backend 'openmpi'; did you mean 'openmp'?");
  EXPECT_EQ(error_of({"openmp", "dynamc", {}, 1}),
            "schedule: unknown openmp schedule 'dynamc'; did you mean 'dynamic'?");
  EXPECT_EQ(error_of({"openmp", "", {}, 1}),
            "schedule: unknown openmp schedule ''; known: static, dynamic, guided, auto");
  EXPECT_EQ(error_of({"openmp", "auto", 4, 1}), "chunk: openmp:auto takes no chunk");
  EXPECT_EQ(error_of({"openmp", "dynamic", 0, 1}), "chunk: must be at least 1");
  EXPECT_EQ(error_of({"openmp", "dynamic", -3, 1}), "chunk: must be at least 1");
  EXPECT_EQ(error_of({"openmp", "static", {}, 0}), "threads: must be at least 1");
  EXPECT_EQ(error_of({"serial", "static", {}, 1}), "schedule: serial takes no schedule");
  EXPECT_EQ(error_of({"serial", "", 4, 1}), "chunk: serial takes no chunk");
  EXPECT_EQ(error_of({"serial", "", {}, 2}), "threads: serial runs on one thread");
  EXPECT_EQ(error_of({"openmp", "dynamic", 1, 1}), "none");
}

TEST(ExecutionConfigs, SchedulesBelongToTheirBackend) {
  const auto names = backends();
  if (std::count(names.begin(), names.end(), "tbb") == 0) GTEST_SKIP() << "this build has no tbb";
  EXPECT_EQ(error_of({"tbb", "guided", {}, 1}),
            "schedule: unknown tbb schedule 'guided'; known: auto, simple, static, affinity");
  EXPECT_EQ(error_of({"openmp", "simple", {}, 1}),
            "schedule: unknown openmp schedule 'simple'; known: static, dynamic, guided, auto");
  EXPECT_EQ(error_of({"tbb", "static", 2, 1}), "none");
}

TEST(AvailableCpus, AreAtLeastOne) { EXPECT_GE(available_cpus(), 1); }

// Not promised by oneTBB: its limit is the smallest of all that are alive, so that one execution of it at a
// time is all there may be.
TEST(OpenMp, ExecutionsDoNotLimitEachOther) {
  const auto narrow = make_execution({"openmp", "static", {}, 1});
  const auto wide = make_execution({"openmp", "dynamic", {}, 4});
  EXPECT_EQ(observe_threads(*wide).count, 4);
  EXPECT_EQ(observe_threads(*narrow).count, 1);
}

}  // namespace
}  // namespace rasterbench
