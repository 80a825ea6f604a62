// The steps of the geometry stage on the corners of one triangle. Shared with the analysis of what a scene
// needs (needs.h), whose answers hold because it evaluates the very same expressions.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "pipeline/geometry.h"

namespace rasterbench {

/// A corner in homogeneous pixel coordinates.
struct Corner {
  double x, y, z, w;     // x / w and y / w in pixels, z / w the depth
  double near_distance;  // >= 0 behind the near plane, where things are visible
};

struct ScreenPoint {
  double x, y, d;
};

inline double apply(const AffineRow& row, const Vec3& p) {
  return row.x * double{p.x} + row.y * double{p.y} + row.z * double{p.z} + row.w;
}

inline Corner transform_corner(const ScreenTransform& t, const Vec3& p) {
  return {apply(t.x, p), apply(t.y, p), apply(t.z, p), apply(t.w, p), apply(t.near_distance, p)};
}

inline ScreenPoint project(const Corner& c) { return {c.x / c.w, c.y / c.w, c.z / c.w}; }

/// By the bits, so that it also holds where a compiler was told that there are no NaNs.
inline bool is_finite(const Triangle& t) {
  const auto finite = [](float f) { return (std::bit_cast<std::uint32_t>(f) & 0x7f800000u) != 0x7f800000u; };
  const auto all_finite = [&](const Vec3& p) { return finite(p.x) && finite(p.y) && finite(p.z); };
  return all_finite(t.a) && all_finite(t.b) && all_finite(t.c);
}

inline bool has_zero_area(const Triangle& t) {
  const double ux = double{t.b.x} - t.a.x, uy = double{t.b.y} - t.a.y, uz = double{t.b.z} - t.a.z;
  const double vx = double{t.c.x} - t.a.x, vy = double{t.c.y} - t.a.y, vz = double{t.c.z} - t.a.z;
  return uy * vz == uz * vy && uz * vx == ux * vz && ux * vy == uy * vx;
}

inline bool is_before_near(const Corner& c) { return c.near_distance < 0; }
inline bool has_no_place(const Corner& c) { return !(c.w > 0); }
inline bool is_before_far(const Corner& c, const ScreenTransform& t) { return c.z < t.far_depth * c.w; }
inline bool is_beyond_guard_band(const Corner& c) {
  return std::abs(c.x) > kGuardBand * c.w || std::abs(c.y) > kGuardBand * c.w;
}

/// Whether a test holds for any of some corners: std::any_of is unrolled for long ranges, and these have
/// three.
template <class Corners, class Test>
bool any(const Corners& corners, Test test) {
  for (const auto& corner : corners)
    if (test(corner)) return true;
  return false;
}

template <class Corners, class Test>
bool all(const Corners& corners, Test test) {
  return !any(corners, [&](const auto& corner) { return !test(corner); });
}

/// Whether the box of the points misses the image.
template <class Points>
bool misses_image(const Points& points, const ScreenTransform& t) {
  double low_x = points.begin()->x, high_x = low_x, low_y = points.begin()->y, high_y = low_y;
  for (const ScreenPoint& p : points) {
    low_x = std::min(low_x, p.x);
    high_x = std::max(high_x, p.x);
    low_y = std::min(low_y, p.y);
    high_y = std::max(high_y, p.y);
  }
  return high_x < 0 || low_x > t.width || high_y < 0 || low_y > t.height;
}

}  // namespace rasterbench
