// The sweeps go from harmless to where modes break.
#include "extremes/sweeps.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace rasterbench::extremes {
namespace {

TEST(Sweeps, ValuesAreEvenInTheirLogarithm) {
  for (const Sweep& sweep : sweeps()) {
    const auto values = parameter_values(sweep, 5);
    ASSERT_EQ(values.size(), 5u);
    EXPECT_DOUBLE_EQ(values.front(), sweep.first);
    EXPECT_DOUBLE_EQ(values.back(), sweep.last);
    for (std::size_t i = 2; i < values.size(); ++i)
      EXPECT_NEAR(values[i] / values[i - 1], values[1] / values[0], 1e-9 * values[1] / values[0])
          << sweep.name;
  }
}

TEST(Sweeps, FloatDepthBreaksWhereTheNearPlaneIsTooNear) {
  constexpr std::array<std::string_view, 2> kModes{"filtered", "filtered-reversed_f32"};
  for (const Sweep& sweep : sweeps()) {
    if (sweep.name != "near_far") continue;
    for (const SweepPoint& point : measure(sweep, sweep.first, kModes, 2)) {
      EXPECT_GT(point.drawn, 100);
      EXPECT_FALSE(point.is_broken()) << point.numeric;
    }
    const auto extreme = measure(sweep, sweep.last, kModes, 2);
    EXPECT_TRUE(extreme[0].is_broken());
    EXPECT_FALSE(extreme[1].is_broken());
    for (const SweepPoint& point : extreme) EXPECT_LE(point.unexplained, point.wrong);
    return;
  }
  FAIL() << "there is no sweep of near and far";
}

}  // namespace
}  // namespace rasterbench::extremes
