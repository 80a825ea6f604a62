// A model: triangles in world space, from a file or a generator.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace rasterbench {

/// A point or direction in the world frame (y up), as the files store it.
struct Vec3 {
  float x, y, z;
};

/// One triangle of a .dat file: corners A, B, C, 36 bytes.
struct Triangle {
  Vec3 a, b, c;
};
static_assert(sizeof(Triangle) == 36, "Triangle is read straight from .dat files");

/// At most this many triangles (design: limits): an id is a non-negative int32.
inline constexpr std::int64_t kMaxTriangles = 2147483647;

/// World triangles and where they came from. The id of a triangle is its index.
struct Model {
  std::string name;                 ///< as the user wrote it: a path or "terrain:triangles=1000"
  std::vector<Triangle> triangles;  ///< size <= kMaxTriangles
};

}  // namespace rasterbench
