// Second stage of the end-to-end truth: coverage and depth order at a sample, decided exactly.
//
// The world is scaled by a power of two that makes every coordinate an integer. With M the camera's position,
// the sample (X, Y) of end_to_end_filter.h looks along
//   ray = k (X/H e_U + Y/H e_V) - e_W,   k = tan(theta/2)
// and all that is asked for is the sign of L.ray + c for a vector L and a number c of integers: an edge's
// with L = (A - M) x (B - M), a plane's with L = its normal. D and D_g are square roots of integers and scale
// the axes to integers (on the Y axis these are integers already, and 1 stands for both), so that with exact
// u, v, w, c
//   H D D_g (L.ray + c) = k (X D u + Y v) + H D_g (D c - w).
// theta is a non-zero double, hence algebraic, hence k is transcendental (Lindemann 1882): the sum is zero
// only if both brackets are, and these are zero only if integers are (if D is irrational, the coefficients of
// 1 and D). Exact ties are therefore recognised as such, and any other sign shows at some precision.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "numeric/screen.h"
#include "reference/end_to_end_filter.h"
#include "reference/end_to_end_interval.h"
#include "scene/scene.h"

namespace rasterbench::end_to_end {

/// X = 2 j + 1 - W, Y = H - 1 - 2 i.
struct Sample {
  int x, y;
};

/// u, v, w, c of the head comment.
struct RayForm {
  Integer u, v, w, c;
};

/// A triangle as seen by the camera.
struct ExactTriangle {
  Integer volume;                ///< det(A - M, B - M, C - M); 0: no area, or seen edge-on
  std::array<RayForm, 3> edges;  ///< opposite corner i; the inside has the sign of `volume`
  RayForm plane;                 ///< normal.ray = volume / distance along the view axis
};

/// The scene in integers, with the camera's irrational constants as intervals. Its functions may be called
/// from several threads.
class ExactScene {
 public:
  /// Signs are evaluated at 256, 1024, 4096, ... bits and given up above `max_bits`. `scene` must outlive
  /// this.
  ExactScene(const Scene& scene, int width, int height, int max_bits);

  SampleTransform transform() const;

  /// Whether all corners have w > 0. The triangle's corners must be finite, here and below.
  bool is_in_front(const Triangle& triangle) const;
  ExactTriangle triangle(std::int32_t id) const;

  /// kPositive: covered and, as the rule says, between near and far plane. kNegative: not. Precondition: the
  /// volume is not 0.
  Sign visible(const ExactTriangle& triangle, Sample sample, FillRule fill, NearRule near_rule) const;
  /// Positive at the samples where `a` is nearer than `b`, of those that both cover; all zero for triangles
  /// of one plane.
  RayForm nearer(const ExactTriangle& a, const ExactTriangle& b) const;
  Sign sign(const RayForm& form, Sample sample) const;
  /// Distance along the view axis in world units where the sample sees the triangle's plane, rounded; nothing
  /// if the highest precision does not tell.
  std::optional<double> distance(const ExactTriangle& triangle, Sample sample) const;

 private:
  struct Point {
    Integer x, y, z;
  };
  // k, D and D_g at one precision.
  struct Constants {
    Interval tangent, distance, ground;
  };

  Integer scaled(double coordinate) const;
  Point relative_to_camera(const Vec3& p) const;
  RayForm form(const Point& l) const;
  Constants constants(mpfr_prec_t bits) const;
  Interval value(const RayForm& form, Sample sample, const Constants& constants) const;

  std::span<const Triangle> triangles_;
  double theta_;
  int width_, height_;
  int shift_;  // the world is scaled by 2^shift_
  Point camera_;
  Integer near_, far_;
  Point u_axis_, v_axis_, w_axis_;  // D_g e_U, D D_g e_V, D e_W
  Integer distance_squared_, ground_squared_;
  std::optional<Integer> rational_distance_;  // D, if it is an integer
  Integer camera_distance_squared_;
  std::vector<Constants> constants_;
};

/// Decides the pixels of one part of a picture; remembers triangles and pairs of them.
class PixelResolver {
 public:
  struct Candidate {
    std::int32_t id;
    bool visible;     ///< certainly; otherwise possibly
    double distance;  ///< estimate
  };
  struct Owner {
    std::int32_t id = -1;
    double distance = 0;  ///< along the view axis, world units
    bool ambiguous = false;
  };

  PixelResolver(const ExactScene& scene, FillRule fill, NearRule near_rule)
      : scene_(scene), fill_(fill), near_rule_(near_rule) {}

  /// The nearest of the visible candidates, the smallest id on an exact tie. Candidates come with ids
  /// increasing.
  Owner resolve(Sample sample, std::span<const Candidate> candidates);

 private:
  const ExactTriangle& triangle(std::int32_t id);
  const RayForm& nearer(std::int32_t a, std::int32_t b);

  const ExactScene& scene_;
  FillRule fill_;
  NearRule near_rule_;
  std::unordered_map<std::int32_t, ExactTriangle> triangles_;
  std::unordered_map<std::uint64_t, RayForm> pairs_;
  std::vector<Candidate> remaining_;
};

}  // namespace rasterbench::end_to_end
