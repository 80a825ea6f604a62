// A sample at (X, Y) of the view shows the points P with x(P) = X w(P) and y(P) = Y w(P), the rows of the
// camera's matrix: two planes with normals a and b. They meet in a line of direction a x b, and with the near
// plane n in its origin, by Cramer's rule
//   origin = -(a0 (b x n) + b0 (n x a) + n0 (a x b)) / (n . (a x b)).
// Along a row of samples b is constant and a affine in X, hence so are all three terms.
//
// The near plane is taken from Camera::near_distance and the far one from Camera::reversed_z, which are kept
// for this purpose: z + w and z - w lose them to rounding.
#include "reference/rays.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

#include "base/error.h"

namespace rasterbench {
namespace {

Vec3d normal(const AffineRow& row) { return {row.x, row.y, row.z}; }

AffineRow combine(const AffineRow& p, double k, const AffineRow& q) {
  return {p.x + k * q.x, p.y + k * q.y, p.z + k * q.z, p.w + k * q.w};
}

double at(const AffineRow& row, const Vec3d& p) { return dot(normal(row), p) + row.w; }

// The corners as they are used for the plane: in an order that does not depend on the triangle's.
struct Corners {
  Vec3d a, b, c;
};
Corners ordered_corners(const Triangle& t) {
  const auto is_before = [](const Vec3& p, const Vec3& q) {
    return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z);
  };
  const Vec3 *a = &t.a, *b = &t.b, *c = &t.c;
  if (is_before(*b, *a)) std::swap(a, b);
  if (is_before(*c, *b)) std::swap(b, c);
  if (is_before(*b, *a)) std::swap(a, b);
  return {to_double(*a), to_double(*b), to_double(*c)};
}

}  // namespace

SampleRays::SampleRays(const Camera& camera) : camera_(camera) {
  const Viewport& viewport = camera.viewport;
  const bool centre = viewport.sampling == Sampling::kCentre;
  if (!centre && (viewport.width < 2 || viewport.height < 2))
    throw InputError({.field = "size"}, "sampling at the image's corners needs two rows and columns");
  const auto axis = [&](int samples) {
    return centre ? Axis{1.0 / samples - 1, 2.0 / samples} : Axis{-1, 2.0 / (samples - 1)};
  };
  across_ = axis(viewport.width);
  const Axis up = axis(viewport.height);
  down_ = {-up.offset, -up.step};

  const AffineRow& r = camera.reversed_z;
  const bool has_reversed_z = r.x != 0 || r.y != 0 || r.z != 0;
  far_ = has_reversed_z ? AffineRow{-r.x, -r.y, -r.z, -r.w} : combine(camera.w, -1, camera.z);

  for (const int y : {0, viewport.height - 1})
    for (const int x : {0, viewport.width - 1}) {
      const SampleRay ray = row(y).at(x);
      // Infinite coordinates are left to those who cannot hold them.
      if (std::isnan(ray.origin.x + ray.origin.y + ray.origin.z) || std::isnan(length(ray.direction)) ||
          !(ray.length > 0))
        throw Error("the camera's matrix is singular");
      for (const double c : {ray.origin.x, ray.origin.y, ray.origin.z})
        near_extent_ = std::max(near_extent_, std::abs(c));
    }
}

SampleRays::Row SampleRays::row(int y) const {
  const AffineRow b_row = combine(camera_.y, -down_.at(y), camera_.w);
  const Vec3d b = normal(b_row), n = normal(camera_.near_distance);
  const Vec3d b_n = cross(b, n);
  const auto terms = [&](const AffineRow& a_row) {
    const Vec3d a = normal(a_row), a_b = cross(a, b);
    const Vec3d origin = a_row.w * b_n + b_row.w * cross(n, a) + camera_.near_distance.w * a_b;
    return std::tuple{-1.0 * origin, a_b, dot(n, a_b)};
  };
  Row row;
  row.rays_ = this;
  std::tie(row.origin_constant_, row.direction_constant_, row.determinant_constant_) = terms(camera_.x);
  std::tie(row.origin_slope_, row.direction_slope_, row.determinant_slope_) = terms(camera_.w);
  return row;
}

SampleRay SampleRays::Row::at(int column) const {
  const double x = rays_->across_.at(column);
  const double determinant = determinant_constant_ - x * determinant_slope_;
  const Vec3d along = direction_constant_ - x * direction_slope_;
  const double size = std::sqrt(dot(along, along));
  SampleRay ray;
  ray.origin = 1 / determinant * (origin_constant_ - x * origin_slope_);
  ray.direction = (determinant < 0 ? -1 : 1) / size * along;
  ray.length = -rasterbench::at(rays_->far_, ray.origin) / dot(normal(rays_->far_), ray.direction);
  return ray;
}

double SampleRays::position(const Triangle& triangle, const SampleRay& ray) const {
  const auto [a, b, c] = ordered_corners(triangle);
  const Vec3d plane = cross(b - a, c - a);
  const double slope = dot(plane, ray.direction);
  if (slope == 0) return std::numeric_limits<double>::quiet_NaN();
  const double position = dot(plane, a - ray.origin) / (slope * ray.length);
  // Straight from the corners, so that a triangle on one of the two planes is at 0 or 1 exactly.
  const double whole_way = dot(normal(camera_.near_distance), ray.direction) * ray.length;
  const auto corner = [&](const Vec3d& p) {
    const double share = at(camera_.near_distance, p) / whole_way;
    return at(far_, p) <= 0 ? std::max(share, 1.0) : share;
  };
  const auto [low, high] = std::minmax({corner(a), corner(b), corner(c)});
  return std::clamp(position, low, high);
}

double SampleRays::depth(const SampleRay& ray, double position) const {
  const double near_w = camera_.near_w > 0 ? camera_.near_w : at(camera_.w, ray.origin);
  const double far_w = at(camera_.w, ray.origin + ray.length * ray.direction);
  const double from_near = position * far_w, from_far = (1 - position) * near_w;
  constexpr double kBelowFar = 1 - 0x1p-53;
  const double depth = (from_near - from_far) / (from_near + from_far);
  return position < 1 ? std::min(depth, kBelowFar) : depth;
}

bool SampleRays::is_back_face(const Triangle& t, const SampleRay& ray) {
  const Vec3d a = to_double(t.a);
  return dot(cross(to_double(t.b) - a, to_double(t.c) - a), ray.direction) > 0;
}

}  // namespace rasterbench
