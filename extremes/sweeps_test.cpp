// The sweeps: their values, their scenes, and that extremes break what they must break.
#include "extremes/sweeps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "numeric/modes.h"

namespace rasterbench::extremes {
namespace {

const Sweep& sweep_named(const std::string& name) {
  const auto all = sweeps();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Sweep& s) { return s.name == name; });
  EXPECT_NE(found, all.end()) << name;
  return *found;
}

SweepPoint point(const std::string& sweep, double value, std::string_view mode) {
  const std::vector<std::string_view> modes{mode};
  return measure(sweep_named(sweep), value, modes, 2).at(0);
}

TEST(Sweeps, ValuesGoFromEndToEnd) {
  EXPECT_EQ(parameter_values(sweep_named("near_far"), 18),
            (std::vector<double>{1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14,
                                 1e15, 1e16, 1e17, 1e18}));
  for (const Sweep& sweep : sweeps()) {
    const auto values = parameter_values(sweep, 5);
    ASSERT_EQ(values.size(), 5u);
    EXPECT_EQ(values.front(), sweep.first);
    EXPECT_EQ(values.back(), sweep.last);
    EXPECT_TRUE(std::is_sorted(values.begin(), values.end()) ||
                std::is_sorted(values.rbegin(), values.rend()));
  }
}

TEST(Sweeps, ImagesHaveWidthsThatAreThemselves) {
  const Sweep& sweep = sweep_named("image_size");
  for (const int steps : {2, 4, 9, 30}) {
    const auto values = parameter_values(sweep, steps);
    EXPECT_EQ(values.size(), static_cast<std::size_t>(std::min(steps, 9)));
    for (const double value : values) EXPECT_EQ(sweep.make(value).parameters.width, value);
  }
}

TEST(Sweeps, ScenesDrawSomethingAtBothEnds) {
  for (const Sweep& sweep : sweeps())
    for (const double value : {sweep.first, sweep.last}) {
      const SweepPoint at = point(sweep.name, value, "f64");
      EXPECT_GT(at.pixels, 1000) << sweep.name;
      // The narrowest triangles hit few samples, and all others fill a good part of the picture.
      const auto least = sweep.name == "triangle_size" ? 100 : at.pixels / 20;
      EXPECT_GT(at.drawn, least) << sweep.name << " " << value;
      EXPECT_EQ(at.unexplained, 0) << sweep.name << " " << value;
      EXPECT_EQ(at.worst_distance.has_value(), !sweep.by_truth);
    }
}

TEST(Sweeps, FloatDepthBreaksWhereTheFarPlaneIsFar) {
  EXPECT_FALSE(point("near_far", 1e2, "f32").is_broken());
  EXPECT_TRUE(point("near_far", 1e18, "f32").is_broken());
  EXPECT_TRUE(point("near_far", 1e12, "filtered-unorm24").is_broken());
  for (const char* mode : {"f64", "filtered-reversed_f32", "filtered-inverse_w"})
    EXPECT_FALSE(point("near_far", 1e18, mode).is_broken()) << mode;
}

TEST(Sweeps, InverseWBreaksWithinItsBoundWhereThePlanesAreClose) {
  // A narrow view from far away: 1/w hardly changes between the planes, and its rounding is large in d.
  const SweepPoint at = point("field_of_view", 1e-3, "filtered-inverse_w");
  EXPECT_TRUE(at.is_broken());
  EXPECT_EQ(at.unexplained, 0);
}

TEST(Sweeps, FixedPointBreaksWhereTrianglesAreSmall) {
  EXPECT_FALSE(point("triangle_size", 100, "fixed_12").is_broken());
  EXPECT_TRUE(point("triangle_size", 1e-2, "fixed_4").is_broken());
  const SweepPoint exact = point("triangle_size", 1e-3, "exact");
  EXPECT_EQ(exact.wrong, 0);
  EXPECT_EQ(exact.worst_distance, 0);
}

TEST(Sweeps, BrokenIsMoreThanOneInAThousand) {
  SweepPoint at;
  at.drawn = 1000;
  at.wrong = 1;
  EXPECT_FALSE(at.is_broken());
  at.wrong = 2;
  EXPECT_TRUE(at.is_broken());
  at.drawn = 0;
  EXPECT_TRUE(at.is_broken());
  at.wrong = 0;
  EXPECT_FALSE(at.is_broken());
}

}  // namespace
}  // namespace rasterbench::extremes
