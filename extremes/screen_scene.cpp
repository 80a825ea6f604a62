#include "extremes/screen_scene.h"

#include <fmt/format.h>

#include <bit>

#include "base/error.h"
#include "scene/generator.h"

namespace rasterbench::extremes {
namespace {

/// 1 / tan(kTheta / 2) is 2 to the last bit, so that a unit at depth w measures height / w pixels.
constexpr double kTheta = 0x1.dac670561bb50p-1;
/// The camera's height above the origin on the z axis: a power of two above kScreenFar, so that z = kDistance
/// - w has no more bits than w.
constexpr double kDistance = 16;

bool is_power_of_two(int side) { return side > 0 && std::has_single_bit(static_cast<unsigned>(side)); }

}  // namespace

Scene screen_scene(std::span<const ScreenCorners> corners, int width, int height) {
  if (!is_power_of_two(width) || !is_power_of_two(height))
    throw InputError({.field = "size"},
                     fmt::format("{}x{}: places on the screen are exact only where both sides are powers of "
                                 "two",
                                 width, height));
  Scene scene;
  scene.parameters.camera = {0, 0, kDistance};
  scene.parameters.width = width;
  scene.parameters.height = height;
  scene.parameters.theta = kTheta;
  scene.parameters.near_plane = kScreenNear;
  scene.parameters.far_plane = kScreenFar;
  scene.model.triangles = room_for_triangles(static_cast<std::int64_t>(corners.size()));
  const auto place = [&](const ScreenCorner& c) {
    return Vec3{static_cast<float>((c.x - width / 2.0) * c.w / height),
                static_cast<float>((height / 2.0 - c.y) * c.w / height), static_cast<float>(kDistance - c.w)};
  };
  for (const ScreenCorners& t : corners)
    scene.model.triangles.push_back({place(t[0]), place(t[1]), place(t[2])});
  return scene;
}

}  // namespace rasterbench::extremes
