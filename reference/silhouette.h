// The border of what is drawn, and how far two of them are apart.
#pragma once

#include <cstdint>
#include <span>

namespace rasterbench {

/// Hausdorff distance in pixels between the borders of the drawn regions (ids >= 0) of two pictures, row 0 on
/// top: the largest distance from a pixel of one border to the nearest pixel of the other. A drawn pixel is
/// on the border if one of its four neighbours in the image is not drawn; the rim of the image is no border.
/// 0 where neither picture has a border, infinite where one has. Exact and linear in the number of pixels:
/// Felzenszwalb & Huttenlocher, Distance transforms of sampled functions, Theory of Computing 8, 2012.
double silhouette_distance(std::span<const std::int32_t> ids_a, std::span<const std::int32_t> ids_b,
                           int width, int height);

}  // namespace rasterbench
