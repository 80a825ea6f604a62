// Where on the screen a loop spends its time: the cost of its iterations as a heat map over the picture.
#pragma once

#include "harness/loop_costs.h"

namespace rasterbench {

/// RGBA8 pixels, row 0 on top, and what their colours say: a linear scale from 0 to `high` in `unit`, drawn
/// in matplotlib's viridis (van der Walt & Smith, 2015: even steps of lightness, so that it can be read in
/// grey) with `opacity`, over the picture in grey. Costs above `high`, the 99.9th percentile of the pixels
/// that have any, look like it.
struct CostImage {
  std::vector<std::uint32_t> colours;
  std::string unit;  ///< "us a tile", or "ns a pixel" for triangles
  double high = 0;
  double shown = 1;  ///< share of the loop's cost that lies on the picture: what draws nothing has no place
};
inline constexpr double kCostOpacity = 0.7;

/// The image of `costs`, those of the loop of `point`. Rows, tiles and pixels have the cost of their
/// iteration; a triangle's cost is spread evenly over the pixels of its box, and those of overlapping boxes
/// add up. Throws Error where the costs are not those of the point.
CostImage cost_image(const Point& point, const Scene& scene, const LoopShape& shape, const LoopCosts& costs);

}  // namespace rasterbench
