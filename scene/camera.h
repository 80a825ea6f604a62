// Cameras: any world-to-clip matrix plus a viewport.
#pragma once

#include <array>
#include <cstdint>

namespace rasterbench {

/// A point in double precision, world frame.
struct Vec3d {
  double x, y, z;
};

/// Four coefficients of an affine function of a world point: f(P) = x*P.x + y*P.y + z*P.z + w.
struct AffineRow {
  double x, y, z, w;
};

/// Where in a pixel its sample lies, relative to the image plane.
enum class Sampling {
  kCentre,  ///< sample (j+.5, i+.5); the viewport spans W x H pixels (the course contract)
  kCorner,  ///< the outermost samples lie on the image corners: the viewport spans (W-1) x (H-1) pixels (the
            ///< PLY contract)
};

/// Image size in pixels; 1 <= width, height <= kMaxImageSide.
struct Viewport {
  int width = 0;
  int height = 0;
  Sampling sampling = Sampling::kCentre;
};

inline constexpr int kMaxImageSide = 65536;

/// World to clip space in homogeneous coordinates: (x, y, z, w)(P), each an affine function of the world
/// point, so that x/w and y/w are in [-1, 1] inside the view (y up), z/w = -1 on the near and +1 on the far
/// plane, w > 0 in front. `near_distance` is the signed distance in front of the near plane, kept apart
/// because z + w loses it to rounding.
struct Camera {
  AffineRow x, y, z, w;
  AffineRow near_distance;
  Viewport viewport;
  double near_w = 0;  ///< w of every point on the near plane, where it is the same for all; 0 where it is not
  AffineRow reversed_z = {};  ///< over w: minus reversed z, -1 on the near and 0 on the far plane, kept apart
                              ///< because z - w loses it to rounding
  double near_plane = 0, far_plane = 0;  ///< distances from the camera along the view axis, world units
  bool perspective = true;               ///< false: orthographic, w is 1 everywhere
};

/// The camera of the course contract (INFO0939): at `position`, looking at the origin, y up, perspective.
/// D = |M| and D_g = sqrt(Mx^2 + Mz^2) by hypot; on the Y axis e_U = e_X and e_V = -sgn(My) e_Z.
/// `theta` is the vertical field of view in radians; 0 < near_plane < far_plane.
/// Preconditions (checked by the reader of scene parameters, which can name the field): position != 0, 0 <
/// theta < pi.
Camera look_at_origin(const Vec3d& position, double theta, double near_plane, double far_plane,
                      const Viewport& viewport);

/// An orthographic camera with the same view frame: `half_height` world units are visible above and below the
/// centre.
Camera orthographic_at_origin(const Vec3d& position, double half_height, double near_plane, double far_plane,
                              const Viewport& viewport);

}  // namespace rasterbench
