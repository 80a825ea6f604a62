// What a scene asks of a rasterizer: how large its triangles are on the screen, how deep its layers lie, how
// near its edges and depths come to the samples. Facts of one camera and one image size.
#pragma once

#include <cstdint>

#include "pipeline/needs.h"
#include "reference/judge.h"

namespace rasterbench {

/// Order statistics of some numbers; all NaN where there are none.
struct Spread {
  double least, first_percent, median, largest;
};
/// Reorders `values`. The first percent is the nearest-rank 1st percentile.
Spread spread_of(std::vector<double>& values);

/// Distance from the camera in world units along the view axis at which the depth is d; infinite where no
/// point before infinity has that depth. `d` in [-1, 1]: d = -1 on the near plane, 1 on the far plane.
double view_distance(const Camera& camera, double d);

struct SceneFacts {
  std::int64_t triangles = 0;
  NeedsAnalysis needs;
  GeometryCounts counts;  ///< of the general geometry stage
  double low_x = 0,
         high_x = 0;  ///< extents in pixels of the screen triangles, which may reach out of the image
  double low_y = 0, high_y = 0;
  Spread edge_length;                ///< pixels, of all edges of all screen triangles
  std::int64_t subpixel = 0;         ///< screen triangles whose box is less than a pixel wide and high
  std::int64_t covered_pixels = 0;   ///< that show a triangle
  double nearest = 0, farthest = 0;  ///< of what is seen: view_distance()
  double mean_layers = 0;            ///< triangles that cover a sample, averaged over the covered pixels
  std::int64_t most_layers = 0;
  std::int64_t depth_ties = 0;  ///< pixels where two triangles have exactly the nearest depth
  Spread depth_gap;             ///< of d to the next triangle, over the covered pixels where it is not 0
  std::int64_t on_edge = 0;     ///< pixels whose sample lies exactly on an edge that matters
  Spread edge_margin;           ///< pixels, over the samples that lie beside an edge, not on it
};

/// Of the float32 screen triangles of judge.scene() with depth d, on `threads` threads.
SceneFacts scene_facts(Judge& judge, int threads);

}  // namespace rasterbench
