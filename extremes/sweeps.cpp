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

/// A teapot of curved surfaces in layers, small enough for the end-to-end truth of many scenes.
Scene teapot() {
  Scene scene = generate("teapot:triangles=2000");
  scene.parameters.width = 160;
  scene.parameters.height = 90;
  return scene;
}

/// The radius about the origin that the generator's camera shows, and its distance.
struct Framing {
  double distance, radius;
};
Framing framing(const Scene& scene) {
  const SceneParameters p = framing_parameters(scene.model);
  const double distance = std::hypot(p.camera.x, p.camera.y, p.camera.z);
  return {distance, distance - p.near_plane};
}

/// The planes about the object, geometrically: near = distance / sqrt(ratio).
Scene with_near_far_ratio(double ratio) {
  Scene scene = teapot();
  const SceneParameters framed = framing_parameters(scene.model);
  scene.parameters.camera = framed.camera;
  const double distance = framing(scene).distance;
  scene.parameters.near_plane = distance / std::sqrt(ratio);
  scene.parameters.far_plane = distance * std::sqrt(ratio);
  return scene;
}

Scene moved_away(double distance) {
  Scene scene = teapot();
  const SceneParameters framed = framing_parameters(scene.model);
  scene.parameters.camera = framed.camera;
  scene.parameters.near_plane = framed.near_plane;
  scene.parameters.far_plane = framed.far_plane;
  return translated(std::move(scene), distance);
}

/// The camera moves back as the field of view narrows, so that the object keeps its size in the picture.
Scene with_field_of_view(double theta) {
  Scene scene = teapot();
  SceneParameters& p = scene.parameters;
  const SceneParameters framed = framing_parameters(scene.model);
  const Framing frame = framing(scene);
  const double distance = frame.radius * (1 + 1 / std::tan(theta / 2));
  const double scale = distance / frame.distance;
  p.camera = {framed.camera.x * scale, framed.camera.y * scale, framed.camera.z * scale};
  p.theta = theta;
  // Half-way from the camera to the sphere about the object.
  p.near_plane = (distance - frame.radius) / 2;
  p.far_plane = distance + frame.radius;
  return scene;
}

/// Compact triangles with edges of that size, and slivers of that breadth across the image.
Scene with_triangle_size(double edge) {
  constexpr int kWidth = 512, kHeight = 256;
  // Fewer where they are large, so that a pixel is not covered by more than some tens of them.
  const double most = 20.0 * kWidth * kHeight / (0.43 * edge * edge);
  const auto count = static_cast<std::int64_t>(std::clamp(most, 100.0, 4000.0));
  auto triangles = around_samples(count, edge, kSeed, kWidth, kHeight);
  const auto thin = slivers(count / 10, edge, kSeed, kWidth, kHeight);
  triangles.insert(triangles.end(), thin.begin(), thin.end());
  return screen_scene(triangles, kWidth, kHeight);
}

Scene with_image_width(double width) {
  constexpr int kHeight = 32;
  const int w =
      static_cast<int>(std::exp2(std::round(std::log2(width))));  // screen scenes want a power of two
  return screen_scene(slivers(200, 4, kSeed, w, kHeight), w, kHeight);
}

std::vector<Sweep> all_sweeps() {
  return {
      {"near_far", "far / near", true, 1e1, 1e18, 18, with_near_far_ratio},
      {"translation", "distance that object and camera are moved by, world units", true, 1, 1e7, 8,
       moved_away},
      {"field_of_view", "theta, radians", true, 3.1, 1e-5, 12, with_field_of_view},
      {"triangle_size", "edge of triangles and breadth of slivers, pixels", false, 1e3, 1e-3, 13,
       with_triangle_size},
      {"image_size", "width, pixels", false, 64, 16384, 9, with_image_width},
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
          .unexplained = verdict.errors,
          .worst_distance = {},
          .max_depth_error_steps = verdict.max_depth_error_steps};
}

SweepPoint by_oracle(Judge& judge, const Picture& picture, const ModeInfo& mode) {
  const Accuracy accuracy = judge.against_oracle(picture, mode);
  return {.numeric = mode.name,
          .pixels = accuracy.pixels,
          .drawn = drawn_pixels(judge.oracle(mode).ids),
          .wrong = accuracy.wrong,
          .unexplained = accuracy.unexplained,
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
                     : std::abs(value / decade - 1) < 1e-12 ? decade
                                                            : value);
  }
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
