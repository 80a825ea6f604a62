#include "machine/hardware_counters.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

namespace rasterbench {
namespace {

void spin(double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
  }
}

TEST(HardwareCounters, EveryEventIsCountedOrSaysWhyNot) {
  const HardwareReport report = count_hardware([] { spin(0.02); });
  ASSERT_EQ(report.events.size(), 10u);
  for (const char* name :
       {"cycles", "instructions", "branches", "branch_misses", "l1d_read_misses", "llc_misses",
        "dtlb_read_misses", "task_clock", "context_switches", "page_faults"}) {
    const std::size_t event = report.index_of(name);
    ASSERT_LT(event, report.events.size()) << name;
    for (const auto& thread : report.threads)
      EXPECT_EQ(thread.counts[event].has_value(), report.events[event].unavailable.empty()) << name;
    if (report.threads.empty()) continue;  // nothing is counted here
    EXPECT_EQ(report.total(name).has_value(), report.events[event].unavailable.empty()) << name;
  }
}

TEST(HardwareCounters, EventsThatTakeTurnsAreScaledToTheWholeTime) {
  EXPECT_EQ(scaled_count(300, 1000, 250)->value, 1200);
  EXPECT_EQ(scaled_count(300, 1000, 250)->share, 0.25);
  EXPECT_EQ(scaled_count(300, 1000, 1000)->value, 300);
  EXPECT_FALSE(scaled_count(0, 1000, 0));
  EXPECT_EQ(scaled_count(0, 0, 0)->value, 0);
}

TEST(HardwareCounters, CountTheCyclesAndInstructionsOfWork) {
  const HardwareReport report = count_hardware([] { spin(0.02); });
  if (!report.total("instructions"))
    GTEST_SKIP() << report.events[report.index_of("instructions")].unavailable;
  EXPECT_GT(*report.total("instructions"), 1e5);
  EXPECT_GT(*report.total("cycles"), 1e5);
}

TEST(HardwareCounters, TaskClockIsTheTimeOfTheThreadsThatRan) {
  const HardwareReport report = count_hardware([] { spin(0.05); });
  if (!report.total("task_clock")) GTEST_SKIP() << report.events[report.index_of("task_clock")].unavailable;
  EXPECT_EQ(report.threads.size(), 1u);
  EXPECT_EQ(report.threads[0].id, static_cast<int>(gettid()));
  EXPECT_GT(*report.total("task_clock"), 1e6);  // of 50 ms, whatever else the machine does
  EXPECT_LT(*report.total("task_clock"), 1e10);
}

TEST(HardwareCounters, CountOtherThreads) {
  std::atomic<int> phase{0};
  std::atomic<int> id{0};
  std::thread other([&] {
    id = static_cast<int>(gettid());
    while (phase == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    spin(0.02);
    phase = 2;
    while (phase == 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  while (id == 0) std::this_thread::yield();
  const HardwareReport report = count_hardware([&] {
    phase = 1;
    while (phase != 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  phase = 3;
  other.join();
  if (!report.events[report.index_of("task_clock")].unavailable.empty())
    GTEST_SKIP() << report.events[report.index_of("task_clock")].unavailable;
  const bool counted = std::any_of(report.threads.begin(), report.threads.end(),
                                   [&](const auto& thread) { return thread.id == id; });
  EXPECT_TRUE(counted);
}

TEST(HardwareCounters, PageFaultsAreThoseOfTouchedPages) {
  constexpr std::size_t kPages = 64;
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  void* memory = mmap(nullptr, kPages * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  madvise(memory, kPages * page, MADV_NOHUGEPAGE);
  const HardwareReport report = count_hardware([&] {
    for (std::size_t i = 0; i < kPages; ++i) static_cast<volatile char*>(memory)[i * page] = 1;
  });
  munmap(memory, kPages * page);
  if (!report.total("page_faults")) GTEST_SKIP() << report.events[report.index_of("page_faults")].unavailable;
  EXPECT_GE(*report.total("page_faults"), static_cast<double>(kPages));
  EXPECT_LT(*report.total("page_faults"), 4.0 * kPages);
}

}  // namespace
}  // namespace rasterbench
