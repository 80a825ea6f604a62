// Scenes whose corners land where one says on the screen, through the pipeline that every scene goes through.
#pragma once

#include <array>
#include <span>

#include "scene/scene.h"

namespace rasterbench::extremes {

/// A corner at (x, y) px (sample (j, i) at (j+.5, i+.5), y down) and `w` world units in front of the camera.
struct ScreenCorner {
  double x, y, w;
};
using ScreenCorners = std::array<ScreenCorner, 3>;

/// Distances of the planes of a screen scene: d = 1.25 - 2.25 / w is exact wherever 1 / w is.
inline constexpr double kScreenNear = 1, kScreenFar = 9;

/// The scene whose triangle i has its corners at corners[i]; width and height in pixels. Where both are
/// powers of two and x, y, w have few enough bits (24 together with the division by `height`), all of it is
/// exact: the pipeline's double coordinates are the given ones, to the bit. Elsewhere world coordinates are
/// rounded to float32. Throws InputError if width or height is not a power of two.
Scene screen_scene(std::span<const ScreenCorners> corners, int width, int height);

}  // namespace rasterbench::extremes
