// The geometry stage for the triangles that no plane cuts, one in each lane of a vector.
#pragma once

#include <cstdint>

#include "base/isa.h"
#include "pipeline/geometry.h"
#include "pipeline/screen_batch.h"

namespace rasterbench {

/// Triangles that one call takes at most: a bit of the answer for each.
inline constexpr std::int64_t kMaxLaneTriangles = 64;

/// transform_triangles() for triangles[0 .. n), 0 < n <= kMaxLaneTriangles, that are rejected or drawn as
/// they are: their slots are written and they are counted. Bit i of the answer says that triangle i was left
/// untouched, because a plane cuts it or it has no lane. The arithmetic is that of corner.h, operation by
/// operation, so that the result is the same to the bit. With Isa::kBaseline nothing is done.
/// `Slots` is ScreenTriangle<Real>, an array of them, or one ScreenBatch<float>; triangle 0 goes to
/// first_slot.
template <class Slots>
std::uint64_t transform_in_lanes(const Triangle* triangles, std::int64_t n, std::int32_t first_id,
                                 const ScreenTransform& transform, const GeometryOptions& options,
                                 Slots* slots, std::int64_t first_slot, GeometryCounts& counts);

}  // namespace rasterbench
