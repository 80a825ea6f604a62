// For tests: the specified pipeline (accuracy.md, section 1) in 1024-bit floats, written down as the text has
// it: view coordinates, then all triangles at all samples. What is nearer to zero than 2^-800 of its terms is
// zero.
#pragma once

#include <array>
#include <boost/multiprecision/mpfr.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "numeric/screen.h"
#include "reference/double_renderer.h"
#include "scene/scene.h"

namespace rasterbench::end_to_end {

class BruteForce {
 public:
  BruteForce(const Scene& scene, int width, int height, FillRule fill, NearRule near_rule)
      : scene_(scene), width_(width), height_(height), fill_(fill), near_rule_(near_rule) {
    const SceneParameters& p = scene.parameters;
    const Real x = p.camera.x, y = p.camera.y, z = p.camera.z;
    camera_ = {x, y, z};
    const Real ground = sqrt(x * x + z * z), distance = sqrt(x * x + y * y + z * z);
    e_w_ = {x / distance, y / distance, z / distance};
    if (ground == 0) {
      e_u_ = {1, 0, 0};
      e_v_ = {0, 0, y > 0 ? -1 : 1};
    } else {
      e_u_ = {z / ground, 0, -x / ground};
      e_v_ = {-x * y / (ground * distance), ground / distance, -y * z / (ground * distance)};
    }
    scale_y_ = 1 / tan(Real(p.theta) / 2);
    scale_x_ = scale_y_ * height / width;
  }

  IdImage draw() const {
    const std::size_t pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
    IdImage image{.width = width_,
                  .height = height_,
                  .ids = std::vector<std::int32_t>(pixels, -1),
                  .depths = std::vector<double>(pixels, 1)};
    std::vector<Real> depths(pixels, 1);
    for (std::size_t id = 0; id < scene_.model.triangles.size(); ++id) {
      const std::optional<Seen> seen = view(scene_.model.triangles[id]);
      if (!seen) continue;
      for (std::size_t p = 0; p < pixels; ++p) {
        const std::optional<Real> d =
            depth(*seen, static_cast<int>(p) % width_, static_cast<int>(p) / width_);
        if (!d || *d > depths[p] - kZero) continue;
        depths[p] = *d;
        image.depths[p] = static_cast<double>(*d);
        image.ids[p] = static_cast<std::int32_t>(id);
      }
    }
    return image;
  }

 private:
  using Real = boost::multiprecision::number<boost::multiprecision::mpfr_float_backend<308>,
                                             boost::multiprecision::et_off>;
  struct Vector {
    Real x, y, z;
  };
  struct Seen {
    std::array<Vector, 3> corners;  // (u, v, w)
    std::array<Vector, 3> edges;    // cross products of the other two corners
    std::array<Real, 3> sizes;      // of their terms
    Real determinant;
  };

  static Real dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
  static Vector cross(const Vector& a, const Vector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  }
  static Real size(const Vector& a) { return abs(a.x) + abs(a.y) + abs(a.z); }

  std::optional<Seen> view(const Triangle& t) const {
    Seen seen;
    const std::array<Vec3, 3> points = {t.a, t.b, t.c};
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3& p = points[i];
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return std::nullopt;
      const Vector relative = {p.x - camera_.x, p.y - camera_.y, p.z - camera_.z};
      seen.corners[i] = {dot(relative, e_u_), dot(relative, e_v_), dot(relative, e_w_)};
      if (near_rule_ == NearRule::kOff && seen.corners[i].z >= -kZero * size(relative)) return std::nullopt;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector &a = seen.corners[(i + 1) % 3], &b = seen.corners[(i + 2) % 3];
      seen.edges[i] = cross(a, b);
      seen.sizes[i] = size(a) * size(b);
    }
    seen.determinant = dot(seen.corners[0], seen.edges[0]);
    if (abs(seen.determinant) <= kZero * size(seen.corners[0]) * seen.sizes[0]) return std::nullopt;
    return seen;
  }

  // The shares of the corners in the point seen at (x_S, y_S), positive inside.
  std::array<Real, 3> shares(const Seen& seen, const Real& x, const Real& y) const {
    const Vector ray = {x / scale_x_, y / scale_y_, -1};
    std::array<Real, 3> e;
    for (std::size_t i = 0; i < 3; ++i) {
      e[i] = dot(ray, seen.edges[i]);
      if (abs(e[i]) <= kZero * size(ray) * seen.sizes[i]) e[i] = 0;
      if (seen.determinant < 0) e[i] = -e[i];
    }
    return e;
  }

  std::optional<Real> depth(const Seen& seen, int j, int i) const {
    const Real x = 2 * (Real(j) + 0.5) / width_ - 1, y = 1 - 2 * (Real(i) + 0.5) / height_;
    const std::array<Real, 3> e = shares(seen, x, y);
    if (e[0] < 0 || e[1] < 0 || e[2] < 0) return std::nullopt;
    if (fill_ == FillRule::kTopLeft) {
      // A sample on an edge is inside if moving it to the right by much less than a pixel, and down by much
      // less than that, brings it inside: it does across a left edge and a top edge.
      const std::array<Real, 3> moved = shares(seen, x + ldexp(Real(1), -200), y - ldexp(Real(1), -400));
      if (moved[0] <= 0 || moved[1] <= 0 || moved[2] <= 0) return std::nullopt;
    }
    const Real w = (e[0] * seen.corners[0].z + e[1] * seen.corners[1].z + e[2] * seen.corners[2].z) /
                   (e[0] + e[1] + e[2]);
    const Real n = scene_.parameters.near_plane, f = scene_.parameters.far_plane;
    const Real d = ((n + f) / (n - f) * w + 2 * n * f / (n - f)) / -w;
    if (near_rule_ == NearRule::kClip && d < -1 - kZero) return std::nullopt;
    if (d >= 1 - kZero) return std::nullopt;
    return d;
  }

  inline static const Real kZero = ldexp(Real(1), -800);
  const Scene& scene_;
  int width_, height_;
  FillRule fill_;
  NearRule near_rule_;
  Vector camera_, e_u_, e_v_, e_w_;
  Real scale_x_, scale_y_;
};

}  // namespace rasterbench::end_to_end
