#include "harness/limits.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace rasterbench {
namespace {

Json rates(int threads, double read, double write) {
  return {{"threads", threads},
          {"read_bytes", 36000},
          {"write_bytes", 8000},
          {"read", {{"gb_per_s", 1}, {"interval", {1, 2}}, {"best", read}}},
          {"streaming_write", {{"gb_per_s", 1}, {"interval", {1, 2}}, {"best", write}}}};
}

TEST(Limits, FloorFollowsFromTheRatesOfItsKey) {
  Limits limits;
  limits.add(rates(1, 3.6, 8));
  limits.add(rates(2, 7.2, 8));
  ASSERT_TRUE(limits.floor_of({1, {36000, 8000}}));
  EXPECT_DOUBLE_EQ(*limits.floor_of({1, {36000, 8000}}), 0.011);  // 10 us + 1 us
  EXPECT_DOUBLE_EQ(*limits.floor_of({2, {36000, 8000}}), 0.006);
  EXPECT_FALSE(limits.floor_of({3, {36000, 8000}}));
  EXPECT_FALSE(limits.floor_of({1, {36000, 8008}}));
  EXPECT_EQ(limits.to_json().at("rates").size(), 2u);
}

TEST(Limits, WhatCouldNotBeMeasuredGivesNoFloor) {
  Json entry = rates(1, 1, 1);
  entry["read"] = entry["streaming_write"] = "unavailable: 1 of 2 threads ran";
  Limits limits;
  limits.add(entry);
  EXPECT_TRUE(limits.has({1, {36000, 8000}}));
  EXPECT_FALSE(limits.floor_of({1, {36000, 8000}}));
}

TEST(Limits, MediansHaveIntervals) {
  const std::vector<double> seven{7e9, 1e9, 5e9, 4e9, 3e9, 6e9, 2e9};
  EXPECT_EQ(rate_json(seven).at("gb_per_s"), 4);
  EXPECT_EQ(rate_json(seven).at("interval"), (Json{1, 7}));
  EXPECT_EQ(rate_json(seven).at("best"), 7);
  EXPECT_EQ(time_json("ns", seven), (Json{{"ns", 4e9}, {"interval", {1e9, 7e9}}, {"best", 1e9}}));
  EXPECT_TRUE(rate_json(std::span(seven).first(5)).at("interval").is_null());
}

TEST(Limits, MeasuredEntryIsOneThatIsTaken) {
  const LimitKey key{1, {36000, 8000}};
  const Json entry = measure_limit(key, 0);
  Limits limits;
  limits.add(entry);
  ASSERT_TRUE(limits.floor_of(key)) << entry;
  EXPECT_GT(*limits.floor_of(key), 0);
}

TEST(Limits, ReplayTakesEveryLimitOfTheJournal) {
  const Json one{{"event", "limit"}, {"rates", rates(1, 3.6, 8)}};
  const Limits limits =
      replay_limits({{{"event", "start"}}, one, {{"event", "verify"}, {"id", "a"}}}, "journal");
  EXPECT_TRUE(limits.has({1, {36000, 8000}}));
  EXPECT_FALSE(limits.has({2, {36000, 8000}}));
  EXPECT_THROW(replay_limits({{{"event", "limit"}, {"rates", {{"threads", 1}}}}}, "journal"), InputError);
  EXPECT_THROW(replay_limits({{{"event", "limit"}}}, "journal"), InputError);
}

}  // namespace
}  // namespace rasterbench
