#include "harness/bound.h"

#include <gtest/gtest.h>

namespace rasterbench {
namespace {

/// A frame of 10 ms of which 6 are the raster stage.
PointCosts costs() {
  return {.frame = 10,
          .clear = 1,
          .geometry = 2,
          .raster = 6,
          .resolve = 1,
          .floor = {},
          .own_bytes = {},
          .ipc = {}};
}

TEST(Bound, IsBandwidthUpToOneAndAHalfFloors) {
  PointCosts c = costs();
  c.floor = 10 / 1.5;
  c.raster_imbalance = 5;  // memory comes first
  EXPECT_EQ(find_bound(c).name, "memory bandwidth");
  c.floor = 6.6;
  EXPECT_NE(find_bound(c).name, "memory bandwidth");
  c.own_bytes = 9;
  EXPECT_EQ(find_bound(c).name, "memory bandwidth");
  EXPECT_NE(find_bound(c).text.find("move less"), std::string::npos);
}

TEST(Bound, IsWaitingFromAFifthOfTheFrameOn) {
  PointCosts c = costs();
  c.raster_imbalance = 1.2;
  c.raster_serial = 0.9;
  EXPECT_EQ(find_bound(c).name, "imbalance");
  std::swap(c.raster_imbalance, c.raster_serial);
  EXPECT_EQ(find_bound(c).name, "serial part");
  c.raster_serial = 0.7;
  EXPECT_EQ(find_bound(c).name, "instructions");
}

TEST(Bound, IsGeometryFromHalfOfTheFrameOn) {
  PointCosts c = costs();
  c.geometry = 5;
  c.raster = 3;
  EXPECT_EQ(find_bound(c).name, "geometry");
  c.geometry = 4.9;
  EXPECT_EQ(find_bound(c).name, "instructions");
  EXPECT_NE(find_bound(c).text.find("longest stage is geometry, 49.0 %"), std::string::npos);
}

TEST(Bound, NamesTheLongestStageAndItsInstructionsPerCycle) {
  PointCosts c = costs();
  EXPECT_NE(find_bound(c).text.find("longest stage is raster, 60.0 %"), std::string::npos);
  c.ipc = 2.5;
  EXPECT_NE(find_bound(c).text.find("2.50 instructions per cycle"), std::string::npos);
}

}  // namespace
}  // namespace rasterbench
