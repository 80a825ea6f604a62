#include "extremes/meshes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/generator.h"

namespace rasterbench::extremes {
namespace {

/// A grid of points, (columns + 1) x (rows + 1) of them, cut into two triangles a cell. point(i, j) gives the
/// corner in column i and row j; falls(i, j) says which diagonal.
template <class Triangle, class PointAt, class Falls>
std::vector<Triangle> cut_grid(std::int64_t columns, std::int64_t rows, PointAt point, Falls falls) {
  std::vector<Triangle> triangles;
  triangles.reserve(static_cast<std::size_t>(2 * columns * rows));
  for (std::int64_t j = 0; j < rows; ++j)
    for (std::int64_t i = 0; i < columns; ++i) {
      const auto a = point(i, j), b = point(i + 1, j), c = point(i + 1, j + 1), d = point(i, j + 1);
      if (falls(i, j)) {
        triangles.push_back({a, b, c});
        triangles.push_back({a, c, d});
      } else {
        triangles.push_back({a, b, d});
        triangles.push_back({b, c, d});
      }
    }
  return triangles;
}

/// A random number of a cell, the same whenever it is asked for, so that neighbours need no table.
class CellRandom {
 public:
  explicit CellRandom(std::uint64_t seed) : seed_(seed) {}
  double uniform(std::int64_t i, std::int64_t j, std::uint64_t which, double low, double high) const {
    const std::uint64_t row = Random(seed_ + 4 * static_cast<std::uint64_t>(j) + which).bits();
    return Random(row + static_cast<std::uint64_t>(i)).uniform(low, high);
  }

 private:
  std::uint64_t seed_;
};

double on_grid(double v, int grid) { return grid > 0 ? std::nearbyint(v * grid) / grid : v; }

/// A view depth with three fraction bits, well between the planes of a screen scene.
double random_w(Random& random) { return std::floor(random.uniform(1.25, 8.5) * 8) / 8; }

}  // namespace

std::vector<ScreenCorners> fan(std::int64_t triangles, double radius, double rim_w, double turn, int width,
                               int height) {
  const ScreenCorner hub{width / 2 + 0.5, height / 2 + 0.5, kFlatW};
  const double pixels = radius * std::hypot(width, height);
  const auto rim = [&](std::int64_t i) {
    const double angle =
        turn + 2 * std::numbers::pi * static_cast<double>(i % triangles) / static_cast<double>(triangles);
    return ScreenCorner{hub.x + pixels * std::cos(angle), hub.y + pixels * std::sin(angle), rim_w};
  };
  std::vector<ScreenCorners> all;
  for (std::int64_t i = 0; i < triangles; ++i) all.push_back({hub, rim(i), rim(i + 1)});
  return all;
}

std::vector<ScreenCorners> lattice(int cell, int width, int height) {
  const auto point = [&](std::int64_t i, std::int64_t j) {
    return ScreenCorner{static_cast<double>((i - 1) * cell) + 0.5, static_cast<double>((j - 1) * cell) + 0.5,
                        kFlatW};
  };
  return cut_grid<ScreenCorners>(width / cell + 3, height / cell + 3, point,
                                 [](std::int64_t i, std::int64_t j) { return (i + j) % 2 == 0; });
}

std::vector<ScreenCorners> jittered_plane(std::int64_t triangles, double jitter, int grid, std::uint64_t seed,
                                          int width, int height) {
  const double cell =
      std::max(std::sqrt(2.0 * width * height / static_cast<double>(triangles)), grid > 0 ? 1.0 / grid : 0);
  const auto columns = static_cast<std::int64_t>(width / cell) + 4;
  const auto rows = static_cast<std::int64_t>(height / cell) + 4;
  const CellRandom random(seed);
  const auto point = [&](std::int64_t i, std::int64_t j) {
    const double x = static_cast<double>(i - 1) + random.uniform(i, j, 0, -jitter, jitter);
    const double y = static_cast<double>(j - 1) + random.uniform(i, j, 1, -jitter, jitter);
    return ScreenCorner{on_grid(x * cell, grid), on_grid(y * cell, grid), kFlatW};
  };
  return cut_grid<ScreenCorners>(columns, rows, point, [&](std::int64_t i, std::int64_t j) {
    return random.uniform(i, j, 2, 0, 1) < 0.5;
  });
}

namespace {

/// The edge's middle if it is to be halved. The same for both directions of the edge, to the bit.
struct Refinement {
  double finest, growth, focus_x, focus_y;

  ScreenCorner middle(const ScreenCorner& a, const ScreenCorner& b) const {
    return {(a.x + b.x) / 2, (a.y + b.y) / 2, kFlatW};
  }
  bool halves(const ScreenCorner& a, const ScreenCorner& b) const {
    const ScreenCorner m = middle(a, b);
    return std::hypot(a.x - b.x, a.y - b.y) > finest + growth * std::hypot(m.x - focus_x, m.y - focus_y);
  }

  void refine(const ScreenCorners& t, std::vector<ScreenCorners>& out) const {
    std::array<bool, 3> halved{};
    int count = 0;
    for (std::size_t e = 0; e < 3; ++e) count += halved[e] = halves(t[e], t[(e + 1) % 3]);
    if (count == 0) return out.push_back(t);
    // Turned so that the halved edges come first, or the whole one last.
    std::size_t first = 0;
    if (count == 1) first = halved[0] ? 0 : halved[1] ? 1 : 2;
    if (count == 2) first = !halved[2] ? 0 : !halved[0] ? 1 : 2;
    const ScreenCorner &a = t[first], &b = t[(first + 1) % 3], &c = t[(first + 2) % 3];
    const ScreenCorner ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    if (count == 1) {
      refine({a, ab, c}, out);
      refine({ab, b, c}, out);
      return;
    }
    refine({ab, b, bc}, out);
    if (count == 2) {
      refine({a, ab, bc}, out);
      refine({a, bc, c}, out);
      return;
    }
    refine({a, ab, ca}, out);
    refine({ca, bc, c}, out);
    refine({ab, bc, ca}, out);
  }
};

}  // namespace

std::vector<ScreenCorners> refined_plane(double finest, double growth, int width, int height) {
  // The focus has no round coordinates; the square's corners have, and lie outside of the image.
  const Refinement refinement{finest, growth, width * 0.379, height * 0.617};
  const double left = -8, right = width + 8.0, top = -8, bottom = height + 8.0;
  std::vector<ScreenCorners> triangles;
  refinement.refine({{{left, top, kFlatW}, {right, top, kFlatW}, {right, bottom, kFlatW}}}, triangles);
  refinement.refine({{{left, top, kFlatW}, {right, bottom, kFlatW}, {left, bottom, kFlatW}}}, triangles);
  return triangles;
}

std::vector<ScreenCorners> scattered(std::int64_t count, int grid, std::uint64_t seed, int width,
                                     int height) {
  Random random(seed);
  std::vector<ScreenCorners> triangles;
  for (std::int64_t i = 0; i < count; ++i) {
    const auto corner = [&] {
      const double x = on_grid(random.uniform(0, width), grid), y = on_grid(random.uniform(0, height), grid);
      return ScreenCorner{x, y, random_w(random)};
    };
    const ScreenCorner a = corner(), b = corner(), c = corner();
    triangles.push_back({a, b, c});
  }
  return triangles;
}

std::vector<ScreenCorners> slivers(std::int64_t count, double breadth, std::uint64_t seed, int width,
                                   int height) {
  Random random(seed);
  std::vector<ScreenCorners> triangles;
  for (std::int64_t i = 0; i < count; ++i) {
    const auto corner = [&] {
      const double x = random.uniform(0, width), y = random.uniform(0, height);
      return ScreenCorner{x, y, random_w(random)};
    };
    const ScreenCorner a = corner(), b = corner();
    const double t = random.uniform(), off = random.uniform(-breadth, breadth);
    const double dx = b.x - a.x, dy = b.y - a.y, length = std::hypot(dx, dy);
    const ScreenCorner c{a.x + t * dx - off * dy / length, a.y + t * dy + off * dx / length,
                         random_w(random)};
    triangles.push_back({a, b, c});
  }
  return triangles;
}

std::vector<ScreenCorners> around_samples(std::int64_t count, double edge, std::uint64_t seed, int width,
                                          int height) {
  Random random(seed);
  std::vector<ScreenCorners> triangles;
  const double radius = edge / std::numbers::sqrt3;  // of the circle through the corners
  for (std::int64_t i = 0; i < count; ++i) {
    // An equilateral triangle covers 0.41 of the circle through its corners: its centre within 0.9 radii.
    const double off = 0.9 * radius * std::sqrt(random.uniform()),
                 at = random.uniform(0, 2 * std::numbers::pi);
    const double x = std::floor(random.uniform(0, width)) + 0.5 + off * std::cos(at);
    const double y = std::floor(random.uniform(0, height)) + 0.5 + off * std::sin(at);
    const double turn = random.uniform(0, 2 * std::numbers::pi);
    const auto corner = [&](int k) {
      const double angle = turn + 2 * std::numbers::pi * k / 3;
      return ScreenCorner{x + radius * std::cos(angle), y + radius * std::sin(angle), random_w(random)};
    };
    const ScreenCorner a = corner(0), b = corner(1), c = corner(2);
    triangles.push_back({a, b, c});
  }
  return triangles;
}

std::vector<Triangle> sphere(int rings, double radius) {
  const auto point = [&](std::int64_t segment, std::int64_t ring) {
    // The poles and the seam exactly, so that the mesh is closed to the bit.
    if (ring == 0 || ring == rings) return Vec3{0, static_cast<float>(ring == 0 ? radius : -radius), 0};
    const double down = std::numbers::pi * static_cast<double>(ring) / rings;
    const double round = std::numbers::pi * static_cast<double>(segment % (2 * rings)) / rings;
    return Vec3{static_cast<float>(radius * std::sin(down) * std::cos(round)),
                static_cast<float>(radius * std::cos(down)),
                static_cast<float>(radius * std::sin(down) * std::sin(round))};
  };
  auto triangles =
      cut_grid<Triangle>(2 * rings, rings, point, [](std::int64_t, std::int64_t) { return true; });
  std::erase_if(triangles, [](const Triangle& t) {  // those whose corners coincide at a pole
    const auto same = [](const Vec3& p, const Vec3& q) { return p.x == q.x && p.y == q.y && p.z == q.z; };
    return same(t.a, t.b) || same(t.b, t.c) || same(t.c, t.a);
  });
  return triangles;
}

std::vector<Triangle> ground_plane(std::int64_t triangles, double extent, double jitter, std::uint64_t seed) {
  const auto side = std::max<std::int64_t>(1, std::llround(std::sqrt(static_cast<double>(triangles) / 2)));
  const double cell = 2 * extent / static_cast<double>(side);
  const CellRandom random(seed);
  const auto point = [&](std::int64_t i, std::int64_t j) {
    const double x = static_cast<double>(i) + random.uniform(i, j, 0, -jitter, jitter);
    const double z = static_cast<double>(j) + random.uniform(i, j, 1, -jitter, jitter);
    return Vec3{static_cast<float>(x * cell - extent), 0, static_cast<float>(z * cell - extent)};
  };
  return cut_grid<Triangle>(
      side, side, point, [&](std::int64_t i, std::int64_t j) { return random.uniform(i, j, 2, 0, 1) < 0.5; });
}

Scene translated(Scene scene, double distance) {
  Vec3d& m = scene.parameters.camera;
  const double length = std::hypot(m.x, m.y, m.z);
  const Vec3d by{distance * m.x / length, distance * m.y / length, distance * m.z / length};
  const auto move = [&](Vec3& p) {
    p = {static_cast<float>(p.x + by.x), static_cast<float>(p.y + by.y), static_cast<float>(p.z + by.z)};
  };
  for (Triangle& t : scene.model.triangles)
    for (Vec3* corner : {&t.a, &t.b, &t.c}) move(*corner);
  m = {m.x + by.x, m.y + by.y, m.z + by.z};
  return scene;
}

}  // namespace rasterbench::extremes
