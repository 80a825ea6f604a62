#include "harness/run.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "harness/google_benchmark.h"

namespace rasterbench {
namespace {

class RunTest : public testing::Test {
 protected:
  RunTest() {
    Point point;
    point.scene = {"teapot", "teapot", ""};
    point.width = point.height = 8;
    point.kernel = "scanline";
    study_.points = {{point, point_name(point), {}}};
    point.kernel = "tile_parallel";
    study_.points.push_back({point, point_name(point), "no reason"});
    study_.hashes["teapot"] = "00";
    states_ = initial_states(study_, "build");
  }

  Json verify() {
    return {{"event", "verify"},
            {"id", states_[0].id},
            {"frames", 2},
            {"judgement",
             {{"failure", nullptr},
              {"verify", {{"conforms", true}}},
              {"work", {{"triangles", 3}}},
              {"threads_observed", 1}}}};
  }
  Json sample(int block, double ms) {
    const Json thread{
        {"busy_ms", ms / 2}, {"idle_ms", ms / 4},     {"iterations", 4},      {"chunks", 2},
        {"cpu", 0},          {"first_cpu", 0},        {"last_cpu", 0},        {"cpus", Json::array({0})},
        {"moves", 0},        {"failed_exchanges", 3}, {"contended_locks", 2}, {"lock_wait_ms", ms / 8}};
    return {{"event", "sample"},
            {"id", states_[0].id},
            {"block", block},
            {"launch", 0},
            {"answer",
             {{"ms", ms},
              {"loop_ms", ms - 0.5},
              {"stages", {{"clear", 0.1}, {"geometry", 0.2}, {"raster", ms - 0.4}, {"resolve", 0.1}}},
              {"per_thread", Json::array({thread})},
              {"threads_observed", 1}}}};
  }

  Study study_;
  std::vector<PointState> states_;
};

TEST_F(RunTest, RecordHoldsTheSamples) {
  apply_event(verify(), states_[0]);
  for (int i = 0; i < 7; ++i) apply_event(sample(i, 10 - i), states_[0]);
  apply_event({{"event", "stop"}, {"reason", "target"}}, states_[0]);
  const Json record = make_record(states_[0], study_, 1.5, Topology({}), "context");
  EXPECT_EQ(record.at("status"), "ok");
  EXPECT_EQ(record.at("samples_ms").size(), 7u);
  EXPECT_EQ(record.at("median_ms"), 7.0);
  EXPECT_EQ(record.at("interval_ms"), (Json{4.0, 10.0}));
  EXPECT_EQ(record.at("floor_ms"), 1.5);
  EXPECT_EQ(record.at("stop"), "target");
  EXPECT_EQ(record.at("frames_per_sample"), 2);
  EXPECT_EQ(record.at("stages_ms").at("geometry").size(), 7u);
  EXPECT_EQ(record.at("loop_ms"), (Json{9.5, 8.5, 7.5, 6.5, 5.5, 4.5, 3.5}));
  EXPECT_EQ(record.at("per_thread").at(0).at("busy_ms"), 3.5);
  EXPECT_EQ(record.at("per_thread").at(0).at("idle_ms"), 1.75);
  EXPECT_EQ(record.at("per_thread").at(0).at("chunks"), 2);
  EXPECT_EQ(record.at("per_thread").at(0).at("lock_wait_ms"), 0.875);
  EXPECT_EQ(record.at("per_thread").at(0).at("contended_locks"), 2);
  EXPECT_EQ(record.at("per_thread").at(0).at("failed_exchanges"), 3);
  EXPECT_EQ(record.at("per_thread").at(0).at("cpus"), (Json{{"0", 7}}));
  EXPECT_EQ(record.at("per_thread").at(0).at("migrations"), 0);
  EXPECT_EQ(record.at("placement").at("cpus"), 1);
  EXPECT_EQ(record.at("id").get<std::string>().size(), 32u);
}

/// Two threads take turns at being the longest: the medians of the threads are even, no frame is.
TEST_F(RunTest, RasterLoopIsSharedWithinEachSample) {
  apply_event(verify(), states_[0]);
  for (int i = 0; i < 8; ++i) {
    Json event = sample(i, 12);
    Json thread = event.at("answer").at("per_thread").at(0);
    thread["busy_ms"] = 10;
    thread["idle_ms"] = 1;
    Json other = thread;
    other["busy_ms"] = 5;
    other["idle_ms"] = 6;
    event["answer"]["per_thread"] = i % 2 == 0 ? Json{thread, other} : Json{other, thread};
    apply_event(event, states_[0]);
  }
  const Json record = make_record(states_[0], study_, 1.5, Topology({}), "context");
  EXPECT_EQ(record.at("per_thread").at(0).at("busy_ms"), record.at("per_thread").at(1).at("busy_ms"));
  EXPECT_EQ(record.at("raster_loop"), (Json{{"busy_mean_ms", 7.5},
                                            {"busy_longest_ms", 10.0},
                                            {"imbalance_ms", 2.5},
                                            {"outside_ms", 1.0},
                                            {"lock_wait_ms", 3.0},
                                            {"contended_locks", 4.0},
                                            {"failed_exchanges", 6.0}}));
}

/// Three times 0.1 over three is more than 0.1.
TEST_F(RunTest, RasterLoopIsNeverLessThanEven) {
  apply_event(verify(), states_[0]);
  Json event = sample(0, 0.2);
  const Json thread = event.at("answer").at("per_thread").at(0);
  event["answer"]["per_thread"] = Json{thread, thread, thread};
  apply_event(event, states_[0]);
  EXPECT_EQ(make_record(states_[0], study_, 1.5, Topology({}), "c").at("raster_loop").at("imbalance_ms"),
            0.0);
}

TEST_F(RunTest, FailureHidesTheSpeed) {
  apply_event(verify(), states_[0]);
  apply_event(sample(0, 1), states_[0]);
  apply_event({{"event", "fail"}, {"reason", "died"}}, states_[0]);
  const Json record = make_record(states_[0], study_, 1.5, Topology({}), "context");
  EXPECT_EQ(record.at("status"), "failed");
  EXPECT_EQ(record.at("reason"), "died");
  EXPECT_TRUE(record.at("samples_ms").empty());
  EXPECT_TRUE(record.at("median_ms").is_null());
  EXPECT_TRUE(record.at("floor_ms").is_null());
  EXPECT_TRUE(record.at("raster_loop").is_null());
  EXPECT_EQ(summary_table(states_).find("1.000"), std::string::npos);
}

TEST_F(RunTest, SkippedPointsSayWhy) {
  const Json record = make_record(states_[1], study_, 1.5, Topology({}), "context");
  EXPECT_EQ(record.at("status"), "skipped");
  EXPECT_EQ(record.at("reason"), "no reason");
}

TEST_F(RunTest, ReplayRestoresTheState) {
  const Json start = start_event(study_, states_, "build");
  std::vector<PointState> other = initial_states(study_, "build");
  replay({start, verify(), sample(0, 3), sample(1, 4)}, start, "journal", other);
  EXPECT_EQ(other[0].samples.size(), 2u);
  EXPECT_EQ(other[0].spent_ms, 14);
  EXPECT_EQ(other[0].frames, 2);
}

TEST_F(RunTest, ReplayRefusesAnotherBuildOrPlan) {
  const Json start = start_event(study_, states_, "build");
  EXPECT_THROW(replay({start_event(study_, states_, "other build")}, start, "journal", states_), InputError);
  study_.points.pop_back();
  const auto fewer = initial_states(study_, "build");
  EXPECT_THROW(replay({start_event(study_, fewer, "build")}, start, "journal", states_), InputError);
  EXPECT_THROW(replay({}, start, "journal", states_), InputError);
}

TEST_F(RunTest, IdDependsOnSceneAndBuild) {
  const std::string id = states_[0].id;
  EXPECT_NE(initial_states(study_, "other")[0].id, id);
  study_.hashes["teapot"] = "01";
  EXPECT_NE(initial_states(study_, "build")[0].id, id);
}

TEST_F(RunTest, GoogleBenchmarkReportHasEverySample) {
  apply_event(verify(), states_[0]);
  for (int i = 0; i < 3; ++i) apply_event(sample(i, i + 1), states_[0]);
  const std::vector<Json> records{make_record(states_[0], study_, {}, Topology({}), "c"),
                                  make_record(states_[1], study_, {}, Topology({}), "c")};
  const Json report = Json::parse(google_benchmark_report(records, "json", {}));
  const Json& runs = report.at("benchmarks");
  ASSERT_EQ(runs.size(), 7u);  // three samples, mean, median, stddev, one error
  EXPECT_NEAR(runs[2].at("real_time").get<double>(), 3.0, 1e-9);
  EXPECT_EQ(runs[4].at("aggregate_name"), "median");
  EXPECT_NEAR(runs[4].at("real_time").get<double>(), 2.0, 1e-9);
  EXPECT_TRUE(runs[6].at("error_occurred").get<bool>());
}

}  // namespace
}  // namespace rasterbench
