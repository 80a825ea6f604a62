// teapot: Newell's 32 bicubic Bezier patches, each cut into n x n quads of two triangles: a closed-looking
// object of medium size in the middle of the picture, its triangles small where patches are (spout, knob) and
// large on the body.
//
// This work is based on: Martin Newell, "The Utilization of Procedure Models in Digital Image Synthesis",
// 1975; the numbers and their licence are in teapot_patches.h.
//
// Scale: these are the numbers in general use, rim at z = 2.4 and top at 3.15, which Jim Blinn had squashed:
// Newell's pot is 1.3 times as tall. Kept squashed, because that is the picture everybody knows.
//
// Holes, all kept, so that this is not a closed mesh: the lid (radius 1.3) is smaller than the rim it should
// lie on (radius 1.4), and through the gap one sees the inside; spout and handle run into the body untrimmed,
// and the wall has no hole behind them; the spout is open at its tip; there is one wall, without an inner
// side. The 1975 data had no bottom: the four patches that close it are later.
//
// Only + - * / are used, so that the bytes are the same everywhere. Neighbouring patches have the same bits
// on their common edge (see evaluate), so there are no cracks beyond these holes.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "scene/generator.h"
#include "scene/teapot_patches.h"

namespace rasterbench {
namespace {

using Weights = std::array<double, 4>;

/// Bernstein weights of k/n. Those of (n-k)/n are the same bits in reverse.
Weights bernstein(std::int64_t k, std::int64_t n) {
  const double t = static_cast<double>(k) / static_cast<double>(n);
  const double s = static_cast<double>(n - k) / static_cast<double>(n);
  return {s * s * s, 3 * (s * s) * t, 3 * (t * t) * s, t * t * t};
}

/// The outer pair and the inner pair apart: reversing weights and values together does not change a bit,
/// which is what makes patches meet that walk along a common edge in opposite directions.
double blend(const Weights& w, double a, double b, double c, double d) {
  return (w[0] * a + w[3] * d) + (w[1] * b + w[2] * c);
}

/// The point of a patch at weights (u, v), y up: (x, y, z) of the data is (x, z, -y) here.
Vec3d evaluate(const std::uint16_t (&patch)[16], const Weights& u, const Weights& v) {
  std::array<double, 3> p;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<double, 4> row;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto value = [&](std::size_t j) { return kTeapotPoints[patch[4 * i + j]][axis]; };
      row[i] = blend(v, value(0), value(1), value(2), value(3));
    }
    p[axis] = blend(u, row[0], row[1], row[2], row[3]);
  }
  return {p[0], p[2], -p[1]};
}

/// Triangles of 32 patches of n x n quads: two each, but one in the row at the pole of the 4 lid and 4 bottom
/// patches.
std::int64_t triangle_count(std::int64_t n) { return 32 * 2 * n * n - 8 * n; }

std::int64_t segments_for(std::int64_t wish) {
  std::int64_t n = 1;
  while (triangle_count(n + 1) <= wish) ++n;
  return triangle_count(n + 1) - wish < wish - triangle_count(n) ? n + 1 : n;
}

struct Bounds {
  Vec3d low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
            std::numeric_limits<double>::infinity()};
  Vec3d high{-low.x, -low.y, -low.z};

  void add(const Vec3d& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
};

/// Leaves out what has no area: at a pole a whole row of the grid is one point, and with n = 1 the tip of the
/// spout is a line.
void add_triangle(std::vector<Triangle>& triangles, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3d u{double{b.x} - a.x, double{b.y} - a.y, double{b.z} - a.z};
  const Vec3d v{double{c.x} - a.x, double{c.y} - a.y, double{c.z} - a.z};
  if (u.y * v.z != u.z * v.y || u.z * v.x != u.x * v.z || u.x * v.y != u.y * v.x)
    triangles.push_back({a, b, c});
}

Scene make_teapot(const GeneratorValues& values) {
  const std::int64_t n = segments_for(values.integer("triangles"));
  std::vector<Weights> weights;
  for (std::int64_t k = 0; k <= n; ++k) weights.push_back(bernstein(k, n));

  Bounds bounds;
  for (const auto& patch : kTeapotPatches)
    for (const Weights& u : weights)
      for (const Weights& v : weights) bounds.add(evaluate(patch, u, v));
  const Vec3d& low = bounds.low;
  const Vec3d& high = bounds.high;
  const Vec3d centre{(low.x + high.x) / 2, (low.y + high.y) / 2, (low.z + high.z) / 2};
  const double scale = 2 / std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  const auto place = [&](const Vec3d& p) {
    return Vec3{static_cast<float>((p.x - centre.x) * scale), static_cast<float>((p.y - centre.y) * scale),
                static_cast<float>((p.z - centre.z) * scale)};
  };

  Scene scene;
  scene.model.triangles = room_for_triangles(triangle_count(n));
  std::vector<Vec3> row(weights.size()), next(weights.size());
  for (const auto& patch : kTeapotPatches) {
    for (std::size_t i = 0; i < weights.size(); ++i) {
      for (std::size_t j = 0; j < weights.size(); ++j)
        next[j] = place(evaluate(patch, weights[i], weights[j]));
      for (std::size_t j = 1; i > 0 && j < weights.size(); ++j) {
        add_triangle(scene.model.triangles, row[j - 1], row[j], next[j]);
        add_triangle(scene.model.triangles, row[j - 1], next[j], next[j - 1]);
      }
      std::swap(row, next);
    }
  }
  scene.parameters.near_plane = 1;
  scene.parameters.far_plane = 3.1;
  return scene;
}

const GeneratorRegistration kTeapot({
    .name = "teapot",
    .meaning = "Newell's teapot: one object in the middle, triangles of uneven size",
    .keys = {{.name = "triangles",
              .meaning = "wanted number; the nearest that the patches' grid allows is made",
              .default_value = 43000,
              .minimum = 64,
              .maximum = 2e8,
              .integer = true}},
    .make = make_teapot,
});

}  // namespace
}  // namespace rasterbench
