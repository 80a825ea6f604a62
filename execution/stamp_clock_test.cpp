#include "execution/stamp_clock.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace rasterbench {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_of_wall(Clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

TEST(StampClock, RunsAsFastAsTheWallClock) {
  StampClock::calibrate();
  const Clock::time_point outer_begin = Clock::now();
  const double begin = StampClock::now();
  const Clock::time_point inner_begin = Clock::now();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const Clock::time_point inner_end = Clock::now();
  const double end = StampClock::now();
  const Clock::time_point outer_end = Clock::now();
  // Whatever happens between the readings, the stamps lie between those of the wall clock.
  EXPECT_GE(end - begin, seconds_of_wall(inner_end - inner_begin) * (1 - 1e-4));
  EXPECT_LE(end - begin, seconds_of_wall(outer_end - outer_begin) * (1 + 1e-4));
}

TEST(StampClock, NeverGoesBackOnAThread) {
  StampClock::calibrate();
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([] {
      double last = StampClock::now();
      for (int i = 0; i < 100000; ++i) {
        const double now = StampClock::now();
        ASSERT_GE(now, last);
        last = now;
      }
    });
  for (std::thread& thread : threads) thread.join();
}

TEST(StampClock, IsTheSameOnAllThreads) {
  StampClock::calibrate();
  for (int i = 0; i < 100; ++i) {
    const double before = StampClock::now();
    double between = 0;
    std::thread([&] { between = StampClock::now(); }).join();
    const double after = StampClock::now();
    // A thread starts and ends within microseconds; the counters of two CPUs differ by less, or time is not
    // kept by them.
    ASSERT_GE(between, before - 1e-6);
    ASSERT_LE(between, after + 1e-6);
  }
}

}  // namespace
}  // namespace rasterbench
