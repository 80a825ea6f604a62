// terrain: a fractal height field seen from a low flight over it: triangles large in front and smaller than a
// pixel at the horizon, parts of the near field outside of the picture, several hills behind one another.
//
// The heights are value noise summed over octaves (fractional Brownian motion), its lattice values from a
// hash of their position: a vertex needs no neighbour, so the memory is the triangles' alone. This work is
// based on: Ken Perlin, "An Image Synthesizer", SIGGRAPH 1985; "Improving Noise", SIGGRAPH 2002 (the quintic
// fade).
//
// Only + - * / and floor are used, so that the bytes are the same everywhere.

#include <algorithm>
#include <cmath>
#include <vector>

#include "scene/generator.h"

namespace rasterbench {
namespace {

constexpr double kLeft = -2,
                 kBack =
                     -3;  // the field is [-2, 2] x [-3, 1] in x and z: its front edge is below the picture
constexpr double kSide = 4;
constexpr double kHeight = 0.35;  // heights are in +-kHeight
constexpr std::int64_t kFirstCells = 4;
constexpr int kMostOctaves = 16;

/// A value in [-1, 1) of a lattice point; the three numbers are packed, not added, so that no two points
/// share a hash.
double lattice_value(std::uint64_t seed, std::int64_t i, std::int64_t j, int octave) {
  const std::uint64_t place = static_cast<std::uint64_t>(octave) << 56 | static_cast<std::uint64_t>(i) << 28 |
                              static_cast<std::uint64_t>(j);
  return 2 * Random(Random(place).bits() ^ seed).uniform() - 1;
}

double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }

double mix(double a, double b, double t) { return a + (b - a) * t; }

/// Value noise with `cells` x `cells` lattice cells over the field, at x, z in [0, 1].
double noise(std::uint64_t seed, double x, double z, std::int64_t cells, int octave) {
  const double u = x * static_cast<double>(cells), v = z * static_cast<double>(cells);
  const double i = std::floor(u), j = std::floor(v);
  const std::int64_t ii = static_cast<std::int64_t>(i), jj = static_cast<std::int64_t>(j);
  const double s = fade(u - i), t = fade(v - j);
  return mix(mix(lattice_value(seed, ii, jj, octave), lattice_value(seed, ii + 1, jj, octave), s),
             mix(lattice_value(seed, ii, jj + 1, octave), lattice_value(seed, ii + 1, jj + 1, octave), s), t);
}

/// Octaves whose cells are at least two quads of a grid of `side` quads wide: finer ones would be aliased.
int octaves_for(std::int64_t side) {
  int octaves = 1;
  while (octaves < kMostOctaves && (kFirstCells << octaves) * 2 <= side) ++octaves;
  return octaves;
}

/// The side of the square grid whose 2 side^2 triangles are nearest to the wish.
std::int64_t side_for(std::int64_t wish) {
  std::int64_t side = 1;
  while (2 * (side + 1) * (side + 1) <= wish) ++side;
  return 2 * (side + 1) * (side + 1) - wish < wish - 2 * side * side ? side + 1 : side;
}

Scene make_terrain(const GeneratorValues& values) {
  const std::int64_t side = side_for(values.integer("triangles"));
  const std::uint64_t seed = Random(static_cast<std::uint64_t>(values.integer("seed"))).bits();
  const double roughness = values.number("roughness");
  const int octaves = octaves_for(side);

  const auto vertex = [&](std::int64_t i, std::int64_t j) {
    const double x = static_cast<double>(i) / static_cast<double>(side);
    const double z = static_cast<double>(j) / static_cast<double>(side);
    double height = 0, weight = 1, weights = 0;
    for (int octave = 0; octave < octaves; ++octave) {
      height += weight * noise(seed, x, z, kFirstCells << octave, octave);
      weights += weight;
      weight *= roughness;
    }
    return Vec3{static_cast<float>(kLeft + kSide * x), static_cast<float>(kHeight * height / weights),
                static_cast<float>(kBack + kSide * z)};
  };

  Scene scene;
  std::vector<Triangle>& triangles = scene.model.triangles;
  triangles = room_for_triangles(2 * side * side);
  std::vector<Vec3> row(static_cast<std::size_t>(side) + 1), next(row.size());
  for (std::int64_t j = 0; j <= side; ++j) {
    for (std::size_t i = 0; i < next.size(); ++i) next[i] = vertex(static_cast<std::int64_t>(i), j);
    for (std::size_t i = 1; j > 0 && i < next.size(); ++i) {
      triangles.push_back({row[i - 1], next[i - 1], next[i]});
      triangles.push_back({row[i - 1], next[i], row[i]});
    }
    std::swap(row, next);
  }

  SceneParameters& p = scene.parameters;
  p.object = {150, 175, 110};
  p.background = {140, 175, 210};
  p.camera = {0, 0.7,
              1.2};  // even the highest front edge is below the picture, and 0.34 in front of the camera
  p.near_plane = 0.2;
  p.far_plane = 5;
  return scene;
}

const GeneratorRegistration kTerrain({
    .name = "terrain",
    .meaning = "fractal height field, from a low flight: triangles of all sizes, many below a pixel, some "
               "off screen",
    .keys =
        {{.name = "triangles",
          .meaning = "wanted number; the nearest of a square grid is made",
          .default_value = 500000,
          .minimum = 2,
          .maximum = 2e8,
          .integer = true},
         {.name = "seed", .meaning = "which field", .default_value = 1, .maximum = kMaxSeed, .integer = true},
         {.name = "roughness",
          .meaning = "weight of each octave of noise over that of the one before: 0 smooth hills, 1 spikes",
          .default_value = 0.5,
          .maximum = 1}},
    .make = make_terrain,
});

}  // namespace
}  // namespace rasterbench
