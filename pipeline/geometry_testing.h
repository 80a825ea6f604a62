// Helpers of the tests of the geometry stage: a camera whose arithmetic is exact, and the stage's output as
// one list.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include "pipeline/geometry.h"
#include "scene/generator.h"

namespace rasterbench {

/// At the origin, looking along -z, field of view 90 degrees, near 1, far 9: with z = -P.z in front of the
/// camera, x_px = W/2 (1 + P.x/z), y_px = H/2 (1 - P.y/z), d = 1.25 - 2.25/z; minus reversed z is
/// 0.125 - 1.125/z. All coefficients are short binary fractions.
inline Camera plain_camera(int width, int height, Sampling sampling = Sampling::kCentre) {
  return {.x = {1, 0, 0, 0},
          .y = {0, 1, 0, 0},
          .z = {0, 0, -1.25, -2.25},
          .w = {0, 0, -1, 0},
          .near_distance = {0, 0, -1, -1},
          .viewport = {width, height, sampling},
          .near_w = 1,
          .reversed_z = {0, 0, -0.125, -1.125},
          .near_plane = 1,
          .far_plane = 9};
}

inline constexpr int kSide = 8;  ///< of the image of the tests, in pixels

/// The world point that plain_camera(kSide, kSide) sees at (x, y) px, `z` in front of the camera.
inline Vec3 at_pixel(double x, double y, double z) {
  return {static_cast<float>((x - 4) / 4 * z), static_cast<float>((4 - y) / 4 * z), static_cast<float>(-z)};
}

template <class Real>
struct GeometryResult {
  std::vector<ScreenTriangle<Real>> slots, extra;
  GeometryCounts counts;

  /// Everything that is drawn.
  std::vector<ScreenTriangle<Real>> pieces() const {
    std::vector<ScreenTriangle<Real>> all;
    for (const auto& t : slots)
      if (t.id >= 0) all.push_back(t);
    all.insert(all.end(), extra.begin(), extra.end());
    return all;
  }
};

template <class Real = float>
GeometryResult<Real> run_geometry(const std::vector<Triangle>& triangles, const GeometryOptions& options = {},
                                  const Camera& camera = plain_camera(kSide, kSide),
                                  std::int32_t first_id = 0) {
  GeometryResult<Real> result;
  // An id that is neither "draws nothing" nor a triangle's: every slot has to be written.
  result.slots.assign(triangles.size(), {{}, {}, {}, -77});
  transform_triangles<Real>(triangles, first_id, make_screen_transform(camera), options, result.slots.data(),
                            result.extra, result.counts);
  return result;
}

/// A corner of a piece: x, y, d.
template <class Real>
using CornerOf = std::tuple<Real, Real, Real>;

template <class Real>
std::array<CornerOf<Real>, 3> corners_of(const ScreenTriangle<Real>& t) {
  std::array<CornerOf<Real>, 3> corners;
  for (std::size_t i = 0; i < 3; ++i) corners[i] = {t.x[i], t.y[i], t.d[i]};
  return corners;
}

/// A random triangle about the camera: some of its corners before the near plane, behind the camera, beyond
/// the far plane or far off the screen. With `wild`, one corner in four is up to 1e7 away.
inline Triangle random_triangle(Random& random, bool wild = false) {
  const auto point = [&] {
    const double scale = wild && random.uniform() < 0.25 ? std::pow(10.0, random.uniform(1, 7)) : 1;
    return Vec3{static_cast<float>(scale * random.uniform(-4, 4)),
                static_cast<float>(scale * random.uniform(-4, 4)),
                static_cast<float>(random.uniform(-11, 3))};
  };
  const Vec3 a = point(), b = point(), c = point();
  return {a, b, c};
}

}  // namespace rasterbench
