// Helpers of the tests that set modes beside the oracle: scenes that are hard in different ways, and what a
// mode is given of them.
#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "numeric/modes.h"
#include "pipeline/frame.h"
#include "reference/oracle.h"
#include "scene/generator.h"

namespace rasterbench {

struct HardScene {
  std::string name;
  Scene scene;
};

/// Triangles of sizes from 1e-4 to 3 world units around the origin, some of them slivers, some crossing the
/// near plane of a camera in their midst.
inline Scene random_scene(int count, double slivers, std::uint64_t seed) {
  Random random(seed);
  Scene scene;
  const auto around = [&](const Vec3& p, double radius) {
    const auto moved = [&](float v) { return static_cast<float>(v + radius * random.uniform(-1, 1)); };
    const float x = moved(p.x), y = moved(p.y);
    return Vec3{x, y, moved(p.z)};
  };
  for (int i = 0; i < count; ++i) {
    const double size = std::pow(10, random.uniform(-4, 0.5));
    const Vec3 a = around({0, 0, 0}, 1), b = around(a, size);
    const auto t = static_cast<float>(random.uniform());
    const Vec3 between{a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
    const bool is_sliver = random.uniform() < slivers;
    scene.model.triangles.push_back({a, b, is_sliver ? around(between, 1e-5 * size) : around(a, size)});
  }
  scene.parameters.camera = {0.4, 0.5, 1.1};
  scene.parameters.near_plane = 0.05;
  scene.parameters.far_plane = 2.5;
  return scene;
}

/// Small scenes; the names of generators say what they stress.
inline std::vector<HardScene> hard_scenes() {
  std::vector<HardScene> scenes;
  for (const char* name : {"teapot:triangles=3000", "confetti:triangles=1500,distribution=heavy,size=30",
                           "layers:depth=3,triangles=600", "terrain:triangles=2000"})
    scenes.push_back({name, generate(name)});
  scenes.push_back({"random", random_scene(600, 0, 1)});
  scenes.push_back({"slivers", random_scene(1200, 1, 2)});
  Scene close = random_scene(600, 0.2, 3);
  close.parameters.camera = {0.01, 0.02, 0.1};
  close.parameters.near_plane = 0.001;
  scenes.push_back({"crossing the near plane", close});
  Scene twice = generate("teapot:triangles=1000");
  const std::vector<Triangle> once = twice.model.triangles;
  for (const Triangle& t : once) twice.model.triangles.push_back({t.b, t.a, t.c});
  scenes.push_back({"every triangle twice", twice});
  return scenes;
}

/// Random triangles of many hard kinds, the same for every fill rule.
template <class Real>
class HardTriangles {
 public:
  static constexpr int kSlivers = 3, kPlane = 5, kRelated = 7, kKinds = 13;

  /// Of all kinds, or of one.
  HardTriangles(std::uint64_t seed, const Viewport& size, DepthFunction function, int only = kKinds)
      : random_(seed), width_(size.width), height_(size.height), far_(far_value(function)), only_(only) {}

  std::vector<ScreenTriangle<Real>> some(int count) {
    std::vector<ScreenTriangle<Real>> triangles;
    for (int i = 0; i < count; ++i) {
      ScreenTriangle<Real> t = next(triangles);
      t.id = static_cast<std::int32_t>(i * 7 % count);  // ids are not in the order of the triangles
      if (random_.bits() % 20 == 0) t.id = -1;
      triangles.push_back(t);
    }
    return triangles;
  }

 private:
  bool one_in(unsigned n) { return random_.bits() % n == 0; }
  int below(int n) { return static_cast<int>(random_.bits() % static_cast<unsigned>(n)); }
  Real real(double v) { return static_cast<Real>(v); }

  Real anywhere(int size) { return real(random_.uniform(-4, size + 4)); }
  Real on_lattice(int size) { return real((below(2 * size + 8) - 4) * 0.5); }
  Real extreme(int size) {
    const Real values[] = {real(1e-38),
                           real(-1e-38),
                           real(-0.0),
                           real(0),
                           std::numeric_limits<Real>::denorm_min(),
                           -std::numeric_limits<Real>::min() / 3,
                           real(1e5),
                           real(-131072),
                           real(131072),
                           real(0.5),
                           std::nextafter(real(3.5), real(0)),
                           real(size - 0.5)};
    return values[below(12)];
  }
  Real depth() {
    switch (below(8)) {
      case 0:
        return real(far_);
      case 1:
        return std::nextafter(real(far_), real(-2));
      case 2:
        return real(far_ + random_.uniform(0, 0.5));
      case 3:
        return real(far_ - 1e-3 * below(3));
      case 4:
        return one_in(2) ? real(far_ - 0.25 * below(5)) : std::numeric_limits<Real>::denorm_min();
      case 5:
        return real(far_ - std::pow(10, random_.uniform(-6, 6)));
      default:
        return real(far_ - random_.uniform(0, 2));
    }
  }

  ScreenTriangle<Real> next(const std::vector<ScreenTriangle<Real>>& earlier) {
    ScreenTriangle<Real> t{};
    const int kind = only_ < kKinds ? only_ : below(earlier.empty() ? kRelated : kKinds);
    for (int i = 0; i < 3; ++i) {
      t.x[i] = kind == 1 ? on_lattice(width_) : kind == 2 ? extreme(width_) : anywhere(width_);
      t.y[i] = kind == 1 ? on_lattice(height_) : kind == 2 ? extreme(height_) : anywhere(height_);
      t.d[i] = depth();
    }
    if (kind == 2 && one_in(2)) t.x[below(3)] = anywhere(width_), t.y[below(3)] = anywhere(height_);
    if (kind == kSlivers && one_in(2)) {  // on a line through samples, or of no area
      for (int i = 0; i < 2; ++i) t.x[i] = on_lattice(width_), t.y[i] = on_lattice(height_);
      t.x[2] = (t.x[0] + t.x[1]) / 2;
      t.y[2] = (t.y[0] + t.y[1]) / 2;
      if (one_in(2)) t.y[2] = std::nextafter(t.y[2], anywhere(height_));
    } else if (kind == kSlivers) {  // with a sample in the middle
      const double run = random_.uniform(-4, 4), rise = random_.uniform(-4, 4);
      const double x = below(width_) + 0.5, y = below(height_) + 0.5;
      const double along[] = {1, -random_.uniform(), 0.1}, across[] = {1, random_.uniform(), -1};
      const double width = std::pow(10, random_.uniform(-16, -1));
      for (int i = 0; i < 3; ++i) {
        t.x[i] = real(x + along[i] * run + across[i] * width * rise);
        t.y[i] = real(y + along[i] * rise - across[i] * width * run);
      }
    }
    if (kind == 4) t.x[1] = t.x[0], t.y[1] = one_in(2) ? t.y[0] : t.y[1];
    if (kind == kPlane) {  // one of several triangles of the same plane, or nearly
      const bool on_samples = one_in(2);
      for (int i = 0; i < 3; ++i) {
        if (on_samples) t.x[i] = on_lattice(width_), t.y[i] = on_lattice(height_);
        t.d[i] = real(far_ - 1 + (t.x[i] + 2 * t.y[i] - 20) / 16);
      }
      if (one_in(2)) t.d[0] = std::nextafter(t.d[0], depth());
    }
    if (kind == 6) {  // an edge through a sample, or past it by less than a product's last bit
      const double x = 8.5 + below(4), y = 8.5 + below(3), run = random_.uniform(-1, 1),
                   rise = random_.uniform(-1, 1);
      for (int i = 0; i < 2; ++i) {
        const double along = i == 0 ? 0.5 : -0.25 * (1 + below(8));
        t.x[i] = real(x + along * std::round(run * 0x1p12) * 0x1p-12);
        t.y[i] = real(y + along * std::round(rise * 0x1p12) * 0x1p-12);
        if (one_in(2)) t.x[i] = std::nextafter(t.x[i], anywhere(width_));
      }
    }
    if (kind < kRelated) return t;

    const auto& before = earlier[static_cast<std::size_t>(below(static_cast<int>(earlier.size())))];
    const int turn = below(3);
    for (int i = 0; i < 3; ++i) {
      const int k = kind == kRelated ? (turn + 3 - i) % 3 : (turn + i) % 3;  // flipped, or turned
      if (kind >= 9 && i == 2) break;                                        // shares an edge only
      if (kind == 12 && i == 1) break;                                       // or a corner
      t.x[i] = before.x[k], t.y[i] = before.y[k], t.d[i] = before.d[k];
    }
    if (kind == 8 && one_in(2)) t.d[0] = std::nextafter(t.d[0], depth());  // all but the same
    return t;
  }

  Random random_;
  int width_, height_;
  double far_;
  int only_;
};

/// What a mode is given of a scene.
template <NumericMode Mode>
std::vector<ScreenTriangle<typename Mode::Real>> screen_triangles(const Scene& scene,
                                                                  const FrameSettings& settings) {
  std::vector<ScreenTriangle<typename Mode::Real>> screen(scene.model.triangles.size()), extra;
  GeometryCounts counts;
  transform_triangles<typename Mode::Real>(
      scene.model.triangles, 0, make_screen_transform(sized_camera(scene, settings), Mode::kDepthFunction),
      settings.geometry, screen.data(), extra, counts);
  screen.insert(screen.end(), extra.begin(), extra.end());
  return screen;
}

template <NumericMode Mode>
OracleInput<typename Mode::Real> oracle_input(
    const std::vector<ScreenTriangle<typename Mode::Real>>& triangles, const FrameSettings& settings) {
  return {triangles, settings.width, settings.height, settings.fill, settings.tie, Mode::kDepthFunction};
}

/// Ids and stored depth values of a mode by its scalar specification.
struct ModePicture {
  std::vector<std::int32_t> ids;
  std::vector<double> values;
};

template <NumericMode Mode>
ModePicture draw_screen_triangles(const std::vector<ScreenTriangle<typename Mode::Real>>& triangles,
                                  const FrameSettings& settings) {
  const auto count = static_cast<std::int64_t>(triangles.size());
  std::vector<typename Mode::Key> keys(settings.pixels(), Mode::kClear);
  for (const auto& triangle : triangles) {
    if (triangle.id < 0) continue;
    const auto rank = swap_rank(settings.tie, count, static_cast<std::uint32_t>(triangle.id));
    const auto prepared = Mode::prepare(triangle, settings.grid(), rank);
    const PixelBox box = intersect(prepared.box, settings.bounds());
    for (int y = box.y0; y < box.y1; ++y)
      for (int x = box.x0; x < box.x1; ++x) {
        if (!Mode::inside(prepared, x, y)) continue;
        const auto key = Mode::key(Mode::depth(prepared, x, y), rank);
        auto& pixel = keys[static_cast<std::size_t>(y * settings.width + x)];
        if (key < pixel) pixel = key;
      }
  }
  ModePicture picture;
  for (const auto& key : keys) {
    const bool drawn = key < Mode::kClear;
    picture.ids.push_back(drawn ? static_cast<std::int32_t>(swap_rank(settings.tie, count, Mode::rank(key)))
                                : -1);
    picture.values.push_back(Mode::value(key));
  }
  return picture;
}

/// Calls visit.template operator()<Mode>() for the modes that promise something and run here.
template <class Visit>
void for_each_bounded_mode(Visit visit) {
  for_each_mode([&]<NumericMode Mode>() {
    if constexpr (requires { Mode::unavailable(); }) {
      if (!Mode::unavailable().empty()) return;
    }
    if (Mode::kInfo.numbers.bounded && Mode::kInfo.unavailable.empty()) visit.template operator()<Mode>();
  });
}

}  // namespace rasterbench
