// How alike two pictures look: a side note to the exact counts, because a picture with visible gaps still
// scores well.
#pragma once

#include <cstdint>
#include <span>

namespace rasterbench {

/// Mean structural similarity of the luma (ITU-R BT.601) of two RGBA8 pictures of width * height, red in the
/// lowest byte; 1 where they are equal. Wang, Bovik, Sheikh & Simoncelli 2004: Gaussian window of 11 x 11
/// pixels, sigma 1.5, K1 = 0.01, K2 = 0.03, one window centred on each pixel, cut at the border.
double structural_similarity(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b, int width,
                             int height);

}  // namespace rasterbench
