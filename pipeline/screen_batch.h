// Screen triangles a vector can load: each coordinate in an array of its own.
#pragma once

#include <cstddef>
#include <cstdint>

#include "numeric/screen.h"

namespace rasterbench {

/// Up to kSize screen triangles as ScreenTriangle has them, ids below 0 for those that draw nothing. Small
/// enough for L1.
template <class Real>
struct ScreenBatch {
  static constexpr std::size_t kSize = 256;  // a multiple of every vector's lanes

  alignas(64) Real x[3][kSize];
  alignas(64) Real y[3][kSize];
  alignas(64) Real d[3][kSize];
  alignas(64) std::int32_t ids[kSize];

  void set(std::size_t i, const ScreenTriangle<Real>& triangle) {
    for (int corner = 0; corner < 3; ++corner) {
      x[corner][i] = triangle.x[corner];
      y[corner][i] = triangle.y[corner];
      d[corner][i] = triangle.d[corner];
    }
    ids[i] = triangle.id;
  }
};

}  // namespace rasterbench
