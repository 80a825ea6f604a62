// The inner loops of mode fixed_8 in vectors: triangles in lanes where they are small, pixels in lanes where
// they are large. Integers decide coverage and the depth has the operations of numeric/depth.h one by one, so
// that every instruction set gives the bits of the scalar specification.
#pragma once

#include <cstdint>

#include "base/isa.h"
#include "numeric/modes.h"
#include "pipeline/frame.h"

namespace rasterbench {

/// Where fragments go: the smaller key stays. Row 0 on top, `width` keys a row.
struct LaneTarget {
  std::uint64_t* keys;
  std::int64_t width;
};

/// Triangles of a frame, and the boxes of pixels in which they are drawn.
struct BoxedTriangles {
  const ScreenTriangle<float>* triangles;
  const PixelBox* boxes;
  FillRule fill;
  TieRule tie;
  std::int64_t triangle_count;  ///< of the scene: for swap_rank()
};

/// One compilation of the loops.
struct FixedLanes {
  /// Side in pixels of the largest box that `small` takes: edge values stay far within 32 bits.
  static constexpr std::int32_t kMaxSmallSide = 16;

  static bool is_small(const PixelBox& box) {
    return box.x1 - box.x0 <= kMaxSmallSide && box.y1 - box.y0 <= kMaxSmallSide;
  }

  /// boxes[i]: the pixels that triangles[i] can cover, of the plane and not of the image; empty where its id
  /// is below 0. For i < n.
  void (*boxes)(const ScreenTriangle<float>* triangles, std::int64_t n, PixelBox* boxes);
  /// Draws the triangles in.triangles[indices[i]], i < n, whose boxes are small, within `bounds`.
  void (*small)(const BoxedTriangles& in, const std::uint32_t* indices, std::int64_t n,
                const PixelBox& bounds, const LaneTarget& out);
  /// Draws one triangle of any size in `box`, which lies within its own.
  void (*large)(const Fixed8::Prepared& triangle, const PixelBox& box, const LaneTarget& out);
};

/// The loops for an instruction set that this CPU has; for kBaseline scalar ones.
const FixedLanes& fixed_lanes(Isa isa);

}  // namespace rasterbench
