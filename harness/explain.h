// The story of one pixel: which triangles claim it, and what each arithmetic makes of them.
#pragma once

#include <string>
#include <vector>

#include "reference/judge.h"

namespace rasterbench {

/// A text of several lines: the owner by the oracle, the end-to-end truth, Embree and each mode of `modes`;
/// then, for every triangle that one of them lets claim the pixel, its three edge values and its depth in
/// exact arithmetic and in each mode. (x, y) lies within the image.
std::string explain_pixel(Judge& judge, const std::vector<std::string>& modes, int x, int y);

}  // namespace rasterbench
