// Compares a kernel's picture with the double renderer's, pixel by pixel; footprint.h says what a kernel may
// do.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/error.h"
#include "reference/footprint.h"

namespace rasterbench {
namespace {

using reference::DepthRange;
using reference::Footprint;

constexpr double kStep =
    0x1p-24;  // depths are judged in this unit: pictures hold them as floats, most of them near 1

class PixelComparer {
 public:
  PixelComparer(std::span<const Triangle> triangles, const Camera& camera, NearRule near_rule,
                const PictureBound& bound)
      : triangles_(triangles), camera_(camera), near_rule_(near_rule), bound_(bound), cache_(1 << 12) {}

  // Of equal ids. The truth is asked too, so that an error of either computation shows.
  bool may_both_be_depths(std::int32_t id, double x, double y, double depth, double truth) {
    const DepthRange range = footprint(id).depths(x, y);
    return range.contains(depth) && range.contains(truth);
  }

  // Of different ids: `drawn` must be allowed to cover the point with that depth, and `truth` must be allowed
  // to lose the point, by not covering it or by its depth. -1 is the background, at depth 1.
  PixelVerdict of_different(std::int32_t drawn, double depth, std::int32_t truth, double x, double y) {
    bool is_certain = true;  // as far as edges go
    if (drawn >= 0) {
      const Footprint& footprint_drawn = footprint(drawn);
      if (!(depth <= 1) || !footprint_drawn.may_cover(x, y) || !footprint_drawn.depths(x, y).contains(depth))
        return PixelVerdict::kError;
      is_certain = footprint_drawn.must_cover(x, y);
    } else if (depth != 1) {
      return PixelVerdict::kError;
    }
    if (truth >= 0) {
      const Footprint& footprint_truth = footprint(truth);
      if (!footprint_truth.must_cover(x, y)) return PixelVerdict::kEdgeTie;
      if (!(depth <= footprint_truth.depths(x, y).high)) return PixelVerdict::kError;
    }
    return is_certain ? PixelVerdict::kDepthTie : PixelVerdict::kEdgeTie;
  }

 private:
  // Neighbouring pixels ask for the same triangles.
  const Footprint& footprint(std::int32_t id) {
    Footprint& slot = cache_[static_cast<std::size_t>(id) % cache_.size()];
    if (slot.id() != id)
      slot = Footprint(triangles_[static_cast<std::size_t>(id)], id, camera_, near_rule_, bound_);
    return slot;
  }

  std::span<const Triangle> triangles_;
  const Camera& camera_;
  NearRule near_rule_;
  PictureBound bound_;
  std::vector<Footprint> cache_;
};

}  // namespace

Comparison compare_with_double(const IdImage& truth, std::span<const std::int32_t> ids,
                               std::span<const float> depths, std::span<const Triangle> triangles,
                               const Camera& camera, NearRule near_rule, const PictureBound& bound) {
  const std::size_t width = static_cast<std::size_t>(truth.width);
  const std::size_t pixels = width * static_cast<std::size_t>(truth.height);
  if (ids.size() != pixels || depths.size() != pixels || truth.ids.size() != pixels ||
      truth.depths.size() != pixels)
    throw Error("pictures of different sizes are compared");
  Comparison result;
  result.pixels = static_cast<std::int64_t>(pixels);
  result.verdicts.assign(pixels, PixelVerdict::kIdentical);
  PixelComparer judge(triangles, camera, near_rule, bound);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const double x = static_cast<double>(pixel % width) + 0.5, y = static_cast<double>(pixel / width) + 0.5;
    const std::int32_t drawn = ids[pixel], expected = truth.ids[pixel];
    const double depth = double{depths[pixel]}, exact = truth.depths[pixel];
    PixelVerdict verdict = PixelVerdict::kError;
    if (drawn == expected) {
      const double error = std::abs(depth - exact);
      // NaN keeps the old maximum; it is an error anyway.
      result.max_depth_error_steps = std::max(result.max_depth_error_steps, error / kStep);
      const bool within_output = error <= kStep * std::max(1.0, std::abs(exact));
      if (drawn < 0 ? depth == 1 : within_output || judge.may_both_be_depths(drawn, x, y, depth, exact)) {
        ++result.identical;
        continue;
      }
    } else if (drawn >= -1 && drawn < static_cast<std::int64_t>(triangles.size())) {
      verdict = judge.of_different(drawn, depth, expected, x, y);
    }
    result.verdicts[pixel] = verdict;
    if (verdict == PixelVerdict::kEdgeTie) ++result.edge_ties;
    if (verdict == PixelVerdict::kDepthTie) ++result.depth_ties;
    if (verdict == PixelVerdict::kError && result.errors++ == 0)
      result.worst_pixel = static_cast<std::int64_t>(pixel);
  }
  return result;
}

}  // namespace rasterbench
