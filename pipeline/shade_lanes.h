// Flat shading of many triangles, one in each lane of a vector.
#pragma once

#include <cstdint>
#include <span>

#include "base/isa.h"
#include "scene/model.h"
#include "scene/parameters.h"

namespace rasterbench {

/// colours[i] = shade_flat(triangles[ids[i]], colour) for every i, to the bit: the arithmetic is that of
/// shade_flat(), operation by operation.
void shade_in_lanes(std::span<const Triangle> triangles, std::span<const std::uint32_t> ids,
                    const Rgb& colour, std::uint32_t* colours, Isa isa);

}  // namespace rasterbench
