// Mode f64: vertices, coverage and depth in double precision; its depth has no 32-bit key.
#pragma once

#include "numeric/float_edges.h"

namespace rasterbench {

struct F64 : FloatEdges<double>, WideKeys {
  static constexpr ModeInfo kInfo{
      .name = "f64",
      .vertices = "float64",
      .edges = "float64, (b-a)x(p-a) with ordered end points",
      .depth = "float64, plane through the first corner, clamped; rounded to float32 on output",
      .bound =
          "a centre is misclassified only within about 4u X px of an edge (u = 2^-53, X = largest coordinate "
          "in px)",
      .numbers = {.vertex_unit = 0x1p-53, .snap = 0, .edge_unit = 0x1p-53, .depth_unit = 0x1p-53}};
};

}  // namespace rasterbench
