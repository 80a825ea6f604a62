// What the geometry stage hands to a kernel, and a numeric mode is defined on: triangles on the screen.
#pragma once

#include <cstdint>

namespace rasterbench {

/// Who owns a pixel centre that lies exactly on an edge.
enum class FillRule {
  kClosed,   ///< both sides do; the smallest (depth, rank) wins (the course contract)
  kTopLeft,  ///< exactly one: the triangle whose top or left edge it is (Direct3D 11.3, 3.4.1)
};

/// Which triangle wins an exact tie in depth: rank is a bijection of the id, the smallest rank wins.
enum class TieRule {
  kFirst,  ///< rank = id
  kLast,   ///< rank = T - 1 - id
};

/// What geometry does to points in front of the near plane.
enum class NearRule {
  kClip,  ///< triangles are cut at the near plane
  kOff,   ///< the literal step list of the course text: no cut; a triangle with a corner at w <= 0 draws
          ///< nothing
};

/// What the depth of a corner is. A smaller value is always nearer, so that every mode orders alike.
enum class DepthFunction {
  kNdc,       ///< d of the course contract: -1 on the near plane, +1 on the far plane
  kReversed,  ///< minus reversed z: -1 on the near plane, 0 on the far plane, where floats are dense
  kInverseW,  ///< -far / w: -far/near on the near plane, -1 on the far plane (perspective cameras only)
};

/// The value of a depth function on the far plane: what lies there or beyond is not drawn.
constexpr double far_value(DepthFunction function) {
  return function == DepthFunction::kNdc ? 1 : function == DepthFunction::kReversed ? 0 : -1;
}

/// A depth function's values as d: d = offset + scale * value.
struct DepthMap {
  double offset = 0, scale = 1;
};

/// What a triangle is drawn into: the fill rule and, for modes that work in normalised device coordinates,
/// the image's size in pixels.
struct SampleGrid {
  FillRule fill;
  int width, height;
  SampleGrid(FillRule rule, int image_width = 1, int image_height = 1)  // NOLINT: a rule alone is a grid
      : fill(rule), width(image_width), height(image_height) {}
};

/// All guard-banded screen coordinates are within +-kGuardBand pixels.
inline constexpr double kGuardBand = 131072.0;  // 2^17

/// A triangle after view, clipping and projection: x to the right and y down, in pixels, sample (j, i) at
/// (j+.5, i+.5); d the value of a depth function (-1 on the near and +1 on the far plane, unless a mode asks
/// for another). id is the world triangle's, shared by
/// all pieces of a clipped one; id < 0 marks a slot of a triangle that draws nothing.
template <class Real>
struct ScreenTriangle {
  Real x[3], y[3], d[3];
  std::int32_t id;
};

}  // namespace rasterbench
