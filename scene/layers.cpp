// layers: walls behind one another, each a grid of triangles that fills the picture: depth complexity is
// exactly `depth`, and the order of the ids decides whether each layer is drawn over the last
// (back-to-front), or hidden by the first one (front-to-back), which is what early depth tests and tile
// rejection live on.
//
// Only + - * / and sqrt are used, so that the bytes are the same everywhere.

#include <algorithm>
#include <cmath>

#include "scene/generator.h"

namespace rasterbench {
namespace {

constexpr double kTanHalf = 0.41421356237309503;  // of half the default field of view, pi/4: sqrt(2) - 1
constexpr double kAspect = 16.0 / 9.0;
constexpr double kOverhang = 1.02;             // a wall is this much larger than the picture
constexpr double kDistance = 4;                // the camera's, from the origin, on the z axis
constexpr double kNearest = 2, kFarthest = 6;  // distances of the first and the last wall from the camera
constexpr double kRelief = 0.05;               // deepest dent of a lone wall

enum Order { kFrontToBack, kBackToFront, kRandom };

struct Grid {
  std::int64_t columns, rows;
};

/// Nearly square quads in 16:9, and as near to `quads` as that allows.
Grid grid_for(double quads) {
  const double rows = std::max(1.0, std::floor(std::sqrt(quads / kAspect) + 0.5));
  const double columns = std::max(1.0, std::floor(quads / rows + 0.5));
  return {static_cast<std::int64_t>(columns), static_cast<std::int64_t>(rows)};
}

void add_wall(std::vector<Triangle>& triangles, double distance, double relief, const Grid& grid,
              Random random) {
  std::vector<double> dents(static_cast<std::size_t>((grid.columns + 1) * (grid.rows + 1)));
  for (double& dent : dents) dent = random.uniform(-relief, relief);
  const auto corner = [&](std::int64_t column, std::int64_t row) {
    const double d = distance + dents[static_cast<std::size_t>(row * (grid.columns + 1) + column)];
    const double half_height =
        kOverhang * kTanHalf * d;  // along the line of sight: the grid on the screen stays even
    const double x = 2 * static_cast<double>(column) / static_cast<double>(grid.columns) - 1;
    const double y = 2 * static_cast<double>(row) / static_cast<double>(grid.rows) - 1;
    return Vec3{static_cast<float>(kAspect * half_height * x), static_cast<float>(half_height * y),
                static_cast<float>(kDistance - d)};
  };
  for (std::int64_t row = 0; row < grid.rows; ++row) {
    for (std::int64_t column = 0; column < grid.columns; ++column) {
      const Vec3 a = corner(column, row), b = corner(column + 1, row);
      const Vec3 c = corner(column + 1, row + 1), d = corner(column, row + 1);
      triangles.push_back({a, b, c});
      triangles.push_back({a, c, d});
    }
  }
}

/// Fisher and Yates; std::shuffle differs between standard libraries.
void shuffle(std::vector<Triangle>& triangles, Random random) {
  for (std::size_t i = triangles.size(); i > 1; --i) {
    const std::size_t other = static_cast<std::size_t>(random.uniform() * static_cast<double>(i));
    std::swap(triangles[i - 1], triangles[other]);
  }
}

Scene make_layers(const GeneratorValues& values) {
  const std::int64_t depth = values.integer("depth");
  const auto order = static_cast<Order>(values.integer("order"));
  const Grid grid = grid_for(values.number("triangles") / (2 * static_cast<double>(depth)));

  Scene scene;
  const auto seed = static_cast<std::uint64_t>(values.integer("seed"));
  const double step = (kFarthest - kNearest) / static_cast<double>(std::max<std::int64_t>(1, depth - 1));
  const double relief = std::min(kRelief, 0.3 * step);
  scene.model.triangles = room_for_triangles(2 * depth * grid.columns * grid.rows);
  for (std::int64_t i = 0; i < depth; ++i) {
    const std::int64_t layer = order == kBackToFront ? depth - 1 - i : i;  // 0 is the nearest
    add_wall(scene.model.triangles, kNearest + step * static_cast<double>(layer), relief, grid,
             Random(seed * 1000003 + static_cast<std::uint64_t>(layer)));
  }
  if (order == kRandom) shuffle(scene.model.triangles, Random(seed));

  scene.parameters.camera = {0, 0, kDistance};
  scene.parameters.near_plane = 1;
  scene.parameters.far_plane = 9;
  return scene;
}

const GeneratorRegistration kLayers({
    .name = "layers",
    .meaning = "full-screen walls behind one another: depth complexity and the order of drawing",
    .keys = {{.name = "triangles",
              .meaning = "wanted number; the nearest that a grid in each wall allows is made",
              .default_value = 8000,
              .minimum = 2,
              .maximum = 2e8,
              .integer = true},
             {.name = "depth",
              .meaning = "number of walls",
              .default_value = 4,
              .minimum = 1,
              .maximum = 1000,
              .integer = true},
             {.name = "order",
              .meaning = "of the ids: the nearest wall first, the farthest first, or all triangles shuffled",
              .words = {"front-to-back", "back-to-front", "random"}},
             {.name = "seed",
              .meaning = "of the relief, and of order=random",
              .default_value = 1,
              .maximum = kMaxSeed,
              .integer = true}},
    .make = make_layers,
});

}  // namespace
}  // namespace rasterbench
