#include "harness/noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

namespace rasterbench {
namespace {

Json window(int first, int last, double other, double steal) {
  return {{"event", "noise"},
          {"blocks", {first, last}},
          {"seconds", 1.0},
          {"other_load_cpus", other},
          {"steal_share", steal},
          {"load_average", 1.0},
          {"frequency_mhz", "unavailable: no cpufreq"},
          {"throttled", 0.0}};
}

std::string warning_of(const std::vector<Json>& events) {
  return noise_warning(summarise_noise(events, false));
}

TEST(Noise, AQuietMachineHasNoWarning) {
  EXPECT_EQ(warning_of({window(0, 3, 0.1, 0), window(4, 7, 0.9, 0.05), window(8, 9, 0.2, 0)}), "");
}

TEST(Noise, SummaryHasMediansAndTheWorstBlocks) {
  const Json summary = summarise_noise(
      {window(0, 3, 0.1, 0), {{"event", "sample"}}, window(4, 7, 0.9, 0.05), window(8, 9, 0.2, 0)}, false);
  EXPECT_EQ(summary.at("windows"), 3);
  EXPECT_EQ(summary.at("seconds"), 3.0);
  EXPECT_EQ(summary.at("other_load_cpus"), (Json{{"median", 0.2}, {"worst", 0.9}, {"worst_blocks", {4, 7}}}));
  EXPECT_EQ(summary.at("frequency_mhz"), "unavailable: no cpufreq");
  EXPECT_EQ(summary.at("throttled"), 0.0);
}

TEST(Noise, OtherLoadIsNamedWithItsWorstBlock) {
  const std::string usual = warning_of({window(0, 3, 0.5, 0), window(4, 4, 0.6, 0), window(5, 9, 0.4, 0)});
  EXPECT_NE(usual.find("0.50 CPUs busy in the median and 0.60 in block 4"), std::string::npos) << usual;
  const std::string once = warning_of({window(0, 3, 0, 0), window(4, 8, 1.5, 0), window(9, 9, 0, 0)});
  EXPECT_NE(once.find("1.50 in blocks 4 to 8"), std::string::npos) << once;
}

TEST(Noise, StealFrequencyAndThrottlingAreNamed) {
  std::vector<Json> events{window(0, 0, 0, 0.03), window(1, 1, 0, 0.04)};
  events[0]["frequency_mhz"] = 3000.0;
  events[1]["frequency_mhz"] = 2500.0;
  events[1]["throttled"] = 2.0;
  const std::string warning = warning_of(events);
  for (const char* words : {"hypervisor kept 3.5 %", "2500 to 3000 MHz", "throttled 2 times"})
    EXPECT_NE(warning.find(words), std::string::npos) << words << " is not in: " << warning;
  EXPECT_EQ(warning.find('\n'), std::string::npos);
}

TEST(Noise, MissingBindingIsARemarkAndNoWarning) {
  const Json quiet = summarise_noise({window(0, 3, 0, 0)}, true);
  EXPECT_EQ(quiet.at("remarks").size(), 1u);
  EXPECT_EQ(noise_warning(quiet), "");
  EXPECT_NE(noise_warning(summarise_noise({window(0, 3, 1, 0)}, true)).find("not bound"), std::string::npos);
}

TEST(Noise, WithoutWindowsSaysWhy) {
  const Json summary = summarise_noise({}, false);
  EXPECT_EQ(summary.at("windows"), 0);
  EXPECT_EQ(summary.at("other_load_cpus"), "unavailable: no sample was taken");
  EXPECT_EQ(noise_warning(summary), "");
}

TEST(Noise, ShortBlocksAreJoinedAndTheLastWindowMayBeShorter) {
  NoiseWatch watch;
  watch.begin(3, 0);
  EXPECT_FALSE(watch.end_of_block(3, 0, false));
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  EXPECT_FALSE(watch.end_of_block(4, 0, false));
  const auto event = watch.end_of_block(4, 0, true);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->at("blocks"), (Json{3, 4}));
  EXPECT_GE(event->at("seconds").get<double>(), 0.15);
}

TEST(Noise, WhatTheStudyItselfUsedIsNoOtherLoad) {
  if (!read_cpu_times()) GTEST_SKIP() << "no /proc/stat";
  NoiseWatch watch;
  const double own_before = own_cpu_seconds();
  watch.begin(0, own_before);
  volatile double sink = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(600);
  while (std::chrono::steady_clock::now() < end) sink = sink + 1;
  const double own = own_cpu_seconds() - own_before;
  // The same window, once as if the study had used nothing.
  const auto counted = NoiseWatch(watch).end_of_block(0, own_before, false);
  const auto taken_off = watch.end_of_block(0, own_before + own, false);
  ASSERT_TRUE(counted && taken_off);
  const double all = counted->at("other_load_cpus"), others = taken_off->at("other_load_cpus");
  const double mine = own / taken_off->at("seconds").get<double>();
  EXPECT_GE(all, mine - 0.1);  // /proc/stat counts in hundredths of a second
  EXPECT_NEAR(others, std::max(0.0, all - mine), 0.1);
}

}  // namespace
}  // namespace rasterbench
