// The rays through the samples of a picture and where they meet triangles, in double precision. Knows nothing
// of Embree: ray_scene.h rounds these rays for it, ray_comparison.cpp judges by them.
#pragma once

#include <cmath>

#include "scene/camera.h"
#include "scene/model.h"

namespace rasterbench {

inline Vec3d operator+(const Vec3d& a, const Vec3d& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3d operator-(const Vec3d& a, const Vec3d& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3d operator*(double k, const Vec3d& a) { return {k * a.x, k * a.y, k * a.z}; }
inline double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vec3d& a) { return std::hypot(a.x, a.y, a.z); }
inline Vec3d to_double(const Vec3& p) { return {p.x, p.y, p.z}; }

/// The ray through one sample, in world space. Points on it are told by their position: the share of the way
/// from the near plane (0) to the far plane (1).
struct SampleRay {
  Vec3d origin;     ///< on the near plane
  Vec3d direction;  ///< of length 1, away from the camera
  double length;    ///< from the near to the far plane, world units
};

/// The rays of a camera, one through each sample of its viewport.
class SampleRays {
 public:
  /// Throws InputError where a camera samples at corners and has a single row or column, which says nothing
  /// of the view's extent, and Error for a camera whose matrix is singular.
  explicit SampleRays(const Camera& camera);

  /// The rays of one row of samples: what does not depend on the column.
  class Row {
   public:
    SampleRay at(int column) const;

   private:
    friend class SampleRays;
    const SampleRays* rays_;
    Vec3d origin_constant_, origin_slope_, direction_constant_, direction_slope_;
    double determinant_constant_, determinant_slope_;
  };
  Row row(int y) const;

  /// How far along its ray a triangle's plane is, clamped to the corners' own distances from the near plane,
  /// which rounding would leave where the plane is seen edge-on. NaN for a plane that contains the ray's
  /// direction. The same bits for any order of the corners.
  double position(const Triangle& triangle, const SampleRay& ray) const;

  /// Depth d at a position: -1 at 0, and below 1 up to 1.
  double depth(const SampleRay& ray, double position) const;

  /// Whether the side from which a, b, c run counter-clockwise looks away from the ray's origin.
  static bool is_back_face(const Triangle& triangle, const SampleRay& ray);

  /// The largest coordinate of any sample on the near plane, world units.
  double near_extent() const { return near_extent_; }

 private:
  /// A sample's place in the view, -1 .. 1, is offset + step * index.
  struct Axis {
    double offset, step;
    double at(double index) const { return offset + step * index; }
  };

  Camera camera_;
  AffineRow far_;  // zero on the far plane, positive in front of it
  Axis across_, down_;
  double near_extent_ = 0;
};

}  // namespace rasterbench
