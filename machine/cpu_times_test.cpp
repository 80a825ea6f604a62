#include "machine/cpu_times.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

namespace rasterbench {
namespace {

TEST(CpuTimes, AreTheSumsOfTheFirstLine) {
  std::istringstream stat("cpu  100 20 30 4000 50 6 4 25 70 80\ncpu0 1 1 1 1 1 1 1 1 1 1\n");
  const auto times = parse_cpu_times(stat);
  const double ticks = static_cast<double>(sysconf(_SC_CLK_TCK));
  ASSERT_TRUE(times);
  // Guests (70, 80) are in user and nice already; waiting for a disk (50) is idle.
  EXPECT_DOUBLE_EQ(times->busy, (100 + 20 + 30 + 6 + 4) / ticks);
  EXPECT_DOUBLE_EQ(times->stolen, 25 / ticks);
}

TEST(CpuTimes, OfAnotherFileAreNone) {
  for (const char* text : {"", "cpu 1 2 3", "intr 1 2 3 4 5 6 7 8 9"}) {
    std::istringstream stat(text);
    EXPECT_FALSE(parse_cpu_times(stat)) << text;
  }
}

TEST(CpuTimes, OfThisMachineHoldThoseOfThisProcess) {
  const auto before = read_cpu_times();
  if (!before) GTEST_SKIP() << "no /proc/stat";
  const double own = own_cpu_seconds();
  volatile double sink = 0;
  while (own_cpu_seconds() < own + 0.1) sink = sink + 1;
  const auto after = read_cpu_times();
  EXPECT_GT(after->busy + after->stolen, before->busy + before->stolen);
}

class CpuFolder : public testing::Test {
 protected:
  CpuFolder()
      : root_(std::filesystem::temp_directory_path() / ("cpu_times_test." + std::to_string(getpid()))) {}
  ~CpuFolder() override { std::filesystem::remove_all(root_); }

  void write(const std::string& file, const std::string& text) {
    std::filesystem::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }

  std::filesystem::path root_;
};

TEST_F(CpuFolder, FrequencyIsThatOfTheFastestCpu) {
  write("cpu0/cpufreq/scaling_cur_freq", "1200000\n");
  write("cpu11/cpufreq/scaling_cur_freq", "3400000\n");
  write("cpufreq/scaling_cur_freq", "9900000\n");  // no CPU
  EXPECT_EQ(read_frequency_mhz(root_), Reading(3400.0));
}

TEST_F(CpuFolder, ThrottlingIsSummed) {
  write("cpu0/thermal_throttle/core_throttle_count", "2\n");
  write("cpu0/thermal_throttle/package_throttle_count", "3\n");
  write("cpu1/thermal_throttle/core_throttle_count", "4\n");
  EXPECT_EQ(read_throttle_count(root_), Reading(9.0));
}

TEST_F(CpuFolder, WhatIsNotThereSaysSo) {
  write("cpu0/online", "1\n");
  for (const Reading& reading :
       {read_frequency_mhz(root_), read_throttle_count(root_), read_frequency_mhz(root_ / "none")}) {
    ASSERT_TRUE(std::holds_alternative<std::string>(reading));
    EXPECT_TRUE(std::get<std::string>(reading).starts_with("unavailable: no "));
  }
}

}  // namespace
}  // namespace rasterbench
