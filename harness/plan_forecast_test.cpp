#include "harness/plan_forecast.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "base/error.h"

namespace rasterbench {
namespace {

TEST(PlanForecast, NoiseOfAPairIsPartedIntoLaunchesAndBlocks) {
  // Log ratios 0.1, 0.3 in launch 0 and 0.5, 0.7 in launch 1: within 0.02, of means 0.08, between 0.08 - 0.02
  // / 2.
  EarlierPoint faster{{1, 1, 1, 1}, {0, 0, 1, 1}, {0, 1, 2, 3}, 1};
  EarlierPoint slower{
      {std::exp(0.1), std::exp(0.3), std::exp(0.5), std::exp(0.7), 9}, {0, 0, 1, 1, 2}, {0, 1, 2, 3, 4}, 1};
  const auto noise = measured_noise(slower, faster);
  ASSERT_TRUE(noise);
  EXPECT_TRUE(noise->measured);
  EXPECT_NEAR(noise->within, std::sqrt(0.02), 1e-12);
  EXPECT_NEAR(noise->between, std::sqrt(0.07), 1e-12);
  faster.blocks = {10, 11, 12, 13};
  EXPECT_FALSE(measured_noise(slower, faster)) << "no pairs";
}

TEST(PlanForecast, TheDetectableEffectFollowsFromNoiseSamplesAndLaunches) {
  // t(0.975, 4) + t(0.8, 4) = 2.776 + 0.941; SE = sqrt(pi / 2 / 50) 0.1.
  const double error = 0.1 * std::sqrt(std::numbers::pi / 2 / 50);
  EXPECT_NEAR(std::log(detectable_factor({.within = 0.1}, 50, 5, 0.05)), (2.776 + 0.941) * error, 1e-4);
  EXPECT_NEAR(std::log(detectable_factor({.within = 0.1}, 50, 1, 0.05)), (2.010 + 0.849) * error, 1e-4);
  EXPECT_NEAR(std::log(detectable_factor({.between = 0.1}, 50, 5, 0.05)),
              (2.776 + 0.941) * 0.1 / std::sqrt(5), 1e-4);
  EXPECT_GT(detectable_factor({.within = 0.1}, 50, 5, 0.01), detectable_factor({.within = 0.1}, 50, 5, 0.05));
}

TEST(PlanForecast, AQuieterPointStopsEarlier) {
  const SamplingPlan plan{.target = 0.02, .min_samples = 10, .max_samples = 40};
  EXPECT_EQ(expected_samples(plan, 0.001), 10);
  EXPECT_EQ(expected_samples(plan, 0.04), 25);  // (1.96 x 1.2533 x 0.04 / 0.02)^2 = 24.1
  EXPECT_EQ(expected_samples(plan, 0.5), 40);
}

class EarlierRunTest : public testing::Test {
 protected:
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("plan_forecast_test." + std::to_string(getpid()));
  EarlierRunTest() { std::filesystem::create_directories(folder_); }
  ~EarlierRunTest() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& file, const std::string& text) { std::ofstream(folder_ / file) << text; }
  void write_run(const std::string& journal) {
    write(
        "records.jsonl",
        R"({"name": "a", "status": "ok", "samples_ms": [1000, 2000], "launches": [0, 1], "blocks": [0, 1], "frames_per_sample": 2})"
        "\n"
        R"({"name": "b", "status": "skipped", "samples_ms": []})"
        "\n");
    write("context.json", R"({"started": "2024-02-28T23:59:00Z", "finished": "2024-02-29T00:00:09Z"})");
    write("journal.jsonl", journal);
  }
};

TEST_F(EarlierRunTest, HoldsTimesAndWhatElseTookTime) {
  EXPECT_FALSE(read_earlier_run(folder_));
  write_run("{\"event\": \"start\"}\n");
  const auto run = read_earlier_run(folder_);
  ASSERT_TRUE(run);
  ASSERT_EQ(run->points.size(), 1u);
  EXPECT_EQ(run->points.at("a").ms, (std::vector<double>{1000, 2000}));
  EXPECT_NEAR(run->other_seconds.value(), 69 - 9,
              1e-9);  // 3 s of samples, each of 2 frames after an untimed one
}

TEST_F(EarlierRunTest, AResumedRunDoesNotTellWhatElseTookTime) {
  write_run("{\"event\": \"start\"}\n{\"event\": \"resume\"}\n");
  EXPECT_FALSE(read_earlier_run(folder_)->other_seconds);
}

TEST_F(EarlierRunTest, RefusesWhatNoStudyWrote) {
  write("records.jsonl", "{}\n");
  EXPECT_THROW(read_earlier_run(folder_), InputError);
  write(
      "records.jsonl",
      R"({"name": "a", "status": "ok", "samples_ms": [1], "launches": [], "blocks": [0], "frames_per_sample": 1})");
  EXPECT_THROW(read_earlier_run(folder_), InputError);
}

}  // namespace
}  // namespace rasterbench
