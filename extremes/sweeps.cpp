#include "extremes/sweeps.h"

#include <algorithm>
#include <cmath>

#include "extremes/judge_case.h"
#include "extremes/meshes.h"
#include "kernels/kernel.h"
#include "scene/generator.h"

namespace rasterbench::extremes {
namespace {

constexpr std::uint64_t kSeed = 1;

/// The size of the pictures that the end-to-end truth judges, in pixels: small enough for many of them.
constexpr int kWidth = 160, kHeight = 90;

/// A teapot of curved surfaces in layers, as large as fits.
Scene framed_teapot() {
  Scene scene = generate("teapot:triangles=2000");
  scene.parameters = framing_parameters(scene.model);
  scene.parameters.width = kWidth;
  scene.parameters.height = kHeight;
  return scene;
}

double length(const Vec3d& v) { return std::hypot(v.x, v.y, v.z); }

/// The planes about the object, geometrically: near = distance / sqrt(ratio).
Scene with_near_far_ratio(double ratio) {
  Scene scene = framed_teapot();
  const double distance = length(scene.parameters.camera);
  scene.parameters.near_plane = distance / std::sqrt(ratio);
  scene.parameters.far_plane = distance * std::sqrt(ratio);
  return scene;
}

Scene moved_away(double distance) { return translated(framed_teapot(), distance); }

/// Two walls with relief through each other, across the view axis: the camera moves back as the field of view
/// narrows, so that a part of the same size fills the picture.
Scene with_field_of_view(double theta) {
  constexpr double kReach = 2;       // of the walls to each side; 1 is visible above and below
  constexpr double kRelief = 0.004;  // below the distance at the widest angle, 1 / tan(3.1 / 2) = 0.02
  const double distance = 1 / std::tan(theta / 2);
  // The view frame of the course contract (accuracy.md, section 1) for the default direction.
  const SceneParameters defaults;
  const double from_origin = length(defaults.camera);
  const Vec3d w{defaults.camera.x / from_origin, defaults.camera.y / from_origin,
                defaults.camera.z / from_origin};
  const double ground = std::hypot(w.x, w.z);
  const Vec3d u{w.z / ground, 0, -w.x / ground}, v{-w.x * w.y / ground, ground, -w.z * w.y / ground};

  Scene scene;
  SceneParameters& p = scene.parameters;
  p.camera = {w.x * distance, w.y * distance, w.z * distance};
  p.width = kWidth;
  p.height = kHeight;
  p.theta = theta;
  p.near_plane = distance - 2 * kRelief;
  p.far_plane = distance + 2 * kRelief;
  for (const double waves : {9.0, 13.0})
    for (Triangle t : ground_plane(1000, kReach, 0.25, kSeed)) {
      for (Vec3* corner : {&t.a, &t.b, &t.c}) {
        const double x = corner->x, y = corner->z;
        const double z = kRelief * std::sin(waves * x + 1) * std::cos(waves * y + 2);
        *corner = {static_cast<float>(x * u.x + y * v.x + z * w.x), static_cast<float>(y * v.y + z * w.y),
                   static_cast<float>(x * u.z + y * v.z + z * w.z)};
      }
      scene.model.triangles.push_back(t);
    }
  return scene;
}

/// Compact triangles with edges of that size, and slivers of that breadth across the image.
Scene with_triangle_size(double edge) {
  constexpr int kScreenWidth = 512, kScreenHeight = 256;
  // Fewer where they are large, so that a pixel is not covered by more than some tens of them.
  const double most = 20.0 * kScreenWidth * kScreenHeight / (0.43 * edge * edge);
  const auto count = static_cast<std::int64_t>(std::clamp(most, 100.0, 4000.0));
  auto triangles = around_samples(count, edge, kSeed, kScreenWidth, kScreenHeight);
  const auto thin = slivers(count / 10, edge, kSeed, kScreenWidth, kScreenHeight);
  triangles.insert(triangles.end(), thin.begin(), thin.end());
  return screen_scene(triangles, kScreenWidth, kScreenHeight);
}

/// Slivers of a few pixels' breadth across a low and wide image.
Scene with_image_width(double width) {
  constexpr int kScreenHeight = 32;
  const int pixels = static_cast<int>(width);
  return screen_scene(slivers(200, 4, kSeed, pixels, kScreenHeight), pixels, kScreenHeight);
}

std::vector<Sweep> all_sweeps() {
  return {
      {"near_far", "far / near", true, 1e1, 1e18, 18, false, with_near_far_ratio},
      {"translation", "distance that object and camera are moved by, world units", true, 1, 1e7, 8, false,
       moved_away},
      {"field_of_view", "theta, radians", true, 3.1, 1e-5, 12, false, with_field_of_view},
      {"triangle_size", "edge of triangles and breadth of slivers, pixels", false, 1e3, 1e-3, 13, false,
       with_triangle_size},
      {"image_size", "width, pixels", false, 64, 16384, 9, true, with_image_width},
  };
}

template <class Ids>
std::int64_t drawn_pixels(const Ids& ids) {
  return std::count_if(ids.begin(), ids.end(), [](std::int32_t id) { return id >= 0; });
}

SweepPoint by_truth(Judge& judge, const Picture& picture, const ModeInfo& mode) {
  const Accuracy accuracy = judge.against_oracle(picture, mode);
  const EndToEndVerdict verdict = judge.against_truth(picture, mode, &accuracy);
  return {.numeric = mode.name,
          .pixels = verdict.pixels,
          .drawn = drawn_pixels(judge.truth().truth.ids),
          .wrong = verdict.wrong(),
          .unexplained = verdict.errors + accuracy.depth_out_of_bound,
          .worst_distance = {},
          .max_depth_error_steps = verdict.max_depth_error_steps};
}

SweepPoint by_oracle(Judge& judge, const Picture& picture, const ModeInfo& mode) {
  const Accuracy accuracy = judge.against_oracle(picture, mode);
  return {.numeric = mode.name,
          .pixels = accuracy.pixels,
          .drawn = drawn_pixels(judge.oracle(mode).ids),
          .wrong = accuracy.wrong,
          .unexplained = accuracy.unexplained + accuracy.depth_out_of_bound,
          .worst_distance = accuracy.worst_distance,
          .max_depth_error_steps = accuracy.max_depth_error_steps};
}

}  // namespace

bool SweepPoint::is_broken() const {
  return static_cast<double>(wrong) > kBrokenShare * static_cast<double>(drawn);
}

std::span<const Sweep> sweeps() {
  static const std::vector<Sweep> all = all_sweeps();
  return all;
}

std::vector<double> parameter_values(const Sweep& sweep, int steps) {
  std::vector<double> values;
  for (int i = 0; i < steps; ++i) {
    // The ends exactly; and powers of ten where the steps are decades, not their neighbours by rounding.
    const double exponent =
        std::log10(sweep.first) + (std::log10(sweep.last) - std::log10(sweep.first)) * i / (steps - 1);
    const double value = std::pow(10, exponent);
    const double decade = std::pow(10, std::round(exponent));
    values.push_back(i == 0                                 ? sweep.first
                     : i == steps - 1                       ? sweep.last
                     : sweep.powers_of_two                  ? std::exp2(std::round(std::log2(value)))
                     : std::abs(value / decade - 1) < 1e-12 ? decade
                                                            : value);
  }
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

std::vector<SweepPoint> measure(const Sweep& sweep, double value, std::span<const std::string_view> modes,
                                int threads) {
  const Scene scene = sweep.make(value);
  check_scene_parameters(scene.parameters, "sweep " + sweep.name);
  const FrameSettings settings{.width = scene.parameters.width, .height = scene.parameters.height};
  Judge judge(scene, settings, threads);
  std::vector<SweepPoint> points;
  for (const std::string_view name : modes) {
    const ModeInfo& mode = *find_mode(name);
    const auto renderer = make_renderer("tile_parallel", name, {&scene, settings, {}});
    renderer->draw();
    const Picture picture = picture_of(*renderer, settings);
    points.push_back(sweep.by_truth ? by_truth(judge, picture, mode) : by_oracle(judge, picture, mode));
  }
  return points;
}

}  // namespace rasterbench::extremes
