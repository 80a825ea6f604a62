// The a-priori error bound of a numeric mode.
#pragma once

#include "numeric/screen.h"

namespace rasterbench {

/// How an edge function is written, which decides how its rounding errors grow.
enum class EdgeForm {
  kCross,        ///< (b-a) x (p-a): errors grow with the distance from the edge's first corner
  kPlane,        ///< A x + B y + C: errors grow with the distance from the image's origin
  kIncremental,  ///< kCross at an absolute column of 64, then one addition a pixel
  kExact,        ///< the sign is that of exact arithmetic on the (snapped) corners
};

/// How far a numeric mode may stray from exact arithmetic on the screen triangles that it is given, before
/// any input is known. Unit roundoffs are those of Higham, Accuracy and Stability of Numerical Algorithms,
/// section 2.1: 2^-24 for float32, 2^-53 for float64, 0 for exact arithmetic.
struct ModeBound {
  double vertex_unit = 0x1p-24;  ///< unit roundoff of the screen coordinates that geometry hands over
  double snap = 0;               ///< largest snap of a coordinate in pixels: 2^-9 for fixed_8, else 0
  EdgeForm edge_form = EdgeForm::kCross;
  double edge_unit = 0x1p-24;      ///< unit roundoff of the edge functions
  double gradient_unit = 0x1p-24;  ///< unit roundoff of the depth's gradients
  double reciprocal_error = 0;     ///< relative error of 1 / area where it is approximated, else 0
  double depth_unit = 0x1p-24;     ///< unit roundoff of the depth at a sample, and of its format
  double depth_step = 0;           ///< distance of neighbouring depths of a fixed-point format, else 0
  bool exact_winner = false;       ///< the nearest triangle is that of exact arithmetic
  bool bounded = true;             ///< false: nothing is promised ("unbounded")
};

}  // namespace rasterbench
