#include "scene/camera.h"

#include <cmath>

namespace rasterbench {
namespace {

/// The view frame of the course contract (accuracy.md, section 1) and the camera's distance from the origin.
struct ViewFrame {
  Vec3d u, v, w;
  double distance;
};

ViewFrame view_frame(const Vec3d& m) {
  const double distance = std::hypot(m.x, m.y, m.z);
  const double ground = std::hypot(m.x, m.z);
  const Vec3d w{m.x / distance, m.y / distance, m.z / distance};
  if (ground == 0) return {{1, 0, 0}, {0, 0, m.y > 0 ? -1.0 : 1.0}, w, distance};
  // e_V as products of quotients: the numerators of the formula, Mx My and so on, would overflow for a far
  // camera.
  const double gx = m.x / ground, gz = m.z / ground;
  return {{gz, 0, -gx}, {-gx * w.y, ground / distance, -gz * w.y}, w, distance};
}

AffineRow scaled(const Vec3d& axis, double factor, double constant) {
  return {factor * axis.x, factor * axis.y, factor * axis.z, constant};
}

}  // namespace

// The camera looks at the origin along e_W, so that M.e_U = M.e_V = 0 and M.e_W = D hold exactly: the
// constants of the rows are written as these values and not as rounded dot products. View coordinates: u =
// P.e_U, v = P.e_V, w = P.e_W - D.

Camera look_at_origin(const Vec3d& position, double theta, double near_plane, double far_plane,
                      const Viewport& viewport) {
  const ViewFrame view = view_frame(position);
  const double ratio = static_cast<double>(viewport.width) / static_cast<double>(viewport.height);
  const double scale_y = 1.0 / std::tan(theta / 2);
  const double scale_x = scale_y / ratio;
  const double slope = (near_plane + far_plane) / (near_plane - far_plane);
  const double offset = 2 * near_plane * far_plane / (near_plane - far_plane);

  Camera camera;
  camera.x = scaled(view.u, scale_x, 0);
  camera.y = scaled(view.v, scale_y, 0);
  camera.z = scaled(view.w, slope, offset - slope * view.distance);
  camera.w = scaled(view.w, -1, view.distance);
  camera.near_distance = scaled(view.w, -1, view.distance - near_plane);
  camera.viewport = viewport;
  camera.near_w = near_plane;
  // r = n (f - distance) / ((f - n) distance), and the row is -r w.
  const double reversed_scale = near_plane / (far_plane - near_plane);
  camera.reversed_z = scaled(view.w, -reversed_scale, -reversed_scale * (far_plane - view.distance));
  camera.near_plane = near_plane;
  camera.far_plane = far_plane;
  return camera;
}

Camera orthographic_at_origin(const Vec3d& position, double half_height, double near_plane, double far_plane,
                              const Viewport& viewport) {
  const ViewFrame view = view_frame(position);
  const double ratio = static_cast<double>(viewport.width) / static_cast<double>(viewport.height);
  const double slope = -2 / (far_plane - near_plane);

  Camera camera;
  camera.x = scaled(view.u, 1 / (half_height * ratio), 0);
  camera.y = scaled(view.v, 1 / half_height, 0);
  camera.z =
      scaled(view.w, slope, -slope * view.distance - (far_plane + near_plane) / (far_plane - near_plane));
  camera.w = {0, 0, 0, 1};
  camera.near_distance = scaled(view.w, -1, view.distance - near_plane);
  camera.viewport = viewport;
  camera.near_w = 1;
  const double reversed_scale = 1 / (far_plane - near_plane);
  camera.reversed_z = scaled(view.w, -reversed_scale, -reversed_scale * (far_plane - view.distance));
  camera.near_plane = near_plane;
  camera.far_plane = far_plane;
  camera.perspective = false;
  return camera;
}

}  // namespace rasterbench
