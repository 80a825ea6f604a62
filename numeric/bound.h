// The a-priori error bound of a numeric mode.
#pragma once

namespace rasterbench {

/// How far a numeric mode may stray from exact arithmetic, before any input is known.
struct ModeBound {
  double vertex_unit;  ///< unit roundoff of the stored screen coordinates: 2^-24 or 2^-53
  double snap;         ///< largest snap of a coordinate in pixels: 2^-9 for fixed_8, else 0
  double
      edge_unit;  ///< unit roundoff of the edge functions: 2^-24, 2^-53, or 0 where they are exact integers
  double depth_unit;  ///< unit roundoff of the depth interpolation
};

}  // namespace rasterbench
