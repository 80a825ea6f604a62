// Mode f32: everything in single precision; the format that most programs use.
#pragma once

#include "numeric/float_edges.h"

namespace rasterbench {

struct F32 : FloatEdges<float>, PackedKeys {
  static constexpr ModeInfo kInfo{
      .name = "f32",
      .vertices = "float32",
      .edges = "float32, (b-a)x(p-a) with ordered end points",
      .depth = "float32, plane through the first corner, clamped",
      .bound =
          "a centre is misclassified only within about 4u X px of an edge (u = 2^-24, X = largest coordinate "
          "in px)",
      .numbers = {.vertex_unit = 0x1p-24, .snap = 0, .edge_unit = 0x1p-24, .depth_unit = 0x1p-24}};
};

}  // namespace rasterbench
