// An independent renderer: serial, double precision, by ray-plane intersection in homogeneous coordinates. Deliberately
// simple; shares nothing with the kernels beyond the input types.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pipeline/screen.h"
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

/// Draws `triangles` (id = index, smallest id wins a tie).
IdImage render_in_double(std::span<const Triangle> triangles, const Camera& camera, FillRule fill, NearRule near_rule);

/// How far a numeric mode may stray from exact arithmetic, before any input is known.
struct ModeBound {
  double vertex_unit;    ///< unit roundoff of the stored screen coordinates: 2^-24 or 2^-53
  double snap;           ///< largest snap of a coordinate in pixels: 2^-9 for fixed_8, else 0
  double edge_unit;      ///< unit roundoff of the edge functions: 2^-24, 2^-53, or 0 where they are exact integers
  double depth_unit;     ///< unit roundoff of the depth interpolation
};

/// How a picture differs from the double renderer's.
struct Comparison {
  std::int64_t pixels = 0;
  std::int64_t identical = 0;    ///< same id
  std::int64_t edge_ties = 0;    ///< ids differ; a centre within the mode's bound of an edge explains it
  std::int64_t depth_ties = 0;   ///< ids differ; a depth gap within the mode's bound explains it
  std::int64_t errors = 0;       ///< ids differ and nothing explains it, or the depth of an equal id is out of bound
  double max_depth_error_steps = 0;  ///< over pixels of equal id, in steps of 2^-24
  std::int64_t worst_pixel = -1;     ///< index of the first error, or -1
  bool within_bound() const { return errors == 0; }
};

/// Compares ids and depths that a kernel drew against `truth`, and classifies every difference by the bound of its mode.
Comparison compare_with_double(const IdImage& truth, std::span<const std::int32_t> ids, std::span<const float> depths,
                               std::span<const Triangle> triangles, const Camera& camera, FillRule fill,
                               NearRule near_rule, const ModeBound& bound);

}  // namespace rasterbench
