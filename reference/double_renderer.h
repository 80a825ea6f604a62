// The independent answer that every benchmark point is judged by: a serial renderer in double precision that
// shares nothing with the kernels beyond the input types, and a comparison that knows how far a numeric mode
// may stray from it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "numeric/bound.h"
#include "numeric/screen.h"
#include "scene/camera.h"
#include "scene/model.h"

namespace rasterbench {

/// A picture as ids and depths, row 0 on top: id -1 and depth 1 where nothing is drawn.
struct IdImage {
  int width = 0;
  int height = 0;
  std::vector<std::int32_t> ids;  ///< width * height
  std::vector<double> depths;     ///< width * height
};

/// Draws `triangles` (id = index, smallest id wins a tie in depth) by homogeneous rasterization: nothing is
/// clipped, and coverage and depth come straight from the clip-space corners. A triangle with a non-finite
/// corner or without area in the world draws nothing; back faces are drawn. Throws InputError if the picture
/// does not fit into memory. Preconditions: triangles.size() <= kMaxTriangles, 1 <= camera.viewport.width,
/// height <= kMaxImageSide.
IdImage render_in_double(std::span<const Triangle> triangles, const Camera& camera, FillRule fill,
                         NearRule near_rule);

/// How far a picture may stray: by the bound of its mode and, where another program has drawn it, by that
/// program's own geometry.
struct PictureBound : ModeBound {
  PictureBound(const ModeBound& mode = {}) : ModeBound(mode) {}  // NOLINT: a mode's bound is a picture's
  double geometry_unit = 0x1p-53;  ///< unit roundoff of view, clipping and projection
  /// The depth at a sample is d0 + gx x + gy y from the image's origin, unclamped, in [-1, 1]; not from a
  /// corner, clamped to the corners' depths.
  bool depth_from_origin = false;
  /// Rounding of a corner's depth in units of d beyond vertex_unit, where another function of it is stored.
  double corner_depth_error = 0;
};

/// What explains a pixel of a comparison.
enum class PixelVerdict : std::uint8_t { kIdentical, kEdgeTie, kDepthTie, kError };

/// How a picture differs from the double renderer's. Every pixel is in exactly one of the classes identical
/// (unless its depth is out of bound), edge_ties, depth_ties and errors.
struct Comparison {
  std::int64_t pixels = 0;
  std::int64_t identical = 0;   ///< same id, and depth within the mode's bound
  std::int64_t edge_ties = 0;   ///< ids differ; a centre within the mode's bound of an edge explains it
  std::int64_t depth_ties = 0;  ///< ids differ; a depth gap within the mode's bound explains it
  std::int64_t errors = 0;      ///< ids differ and nothing explains it, or the depth of an equal id is wrong
  double max_depth_error_steps = 0;    ///< over pixels of equal id, in steps of 2^-24
  std::int64_t worst_pixel = -1;       ///< index of the first error, or -1
  std::vector<PixelVerdict> verdicts;  ///< per pixel
  bool within_bound() const { return errors == 0; }
};

/// Compares ids and depths that a kernel or another program drew against `truth`, and classifies every
/// difference by `bound`. The fill rule is not asked for: a centre on an edge is within every mode's bound of
/// it. A pixel without a triangle must have depth 1. Throws Error if the sizes do not match.
Comparison compare_with_double(const IdImage& truth, std::span<const std::int32_t> ids,
                               std::span<const float> depths, std::span<const Triangle> triangles,
                               const Camera& camera, NearRule near_rule, const PictureBound& bound);

}  // namespace rasterbench
