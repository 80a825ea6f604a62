#include "reference/end_to_end_exact.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

namespace rasterbench::end_to_end {
namespace {

constexpr mpfr_prec_t kFirstPrecision = 256;
constexpr int kMantissaBits = 53;

// The exponent of the lowest bit of a finite number other than 0.
int lowest_bit(double value) {
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);
  const auto integer = static_cast<std::uint64_t>(std::ldexp(std::abs(mantissa), kMantissaBits));
  return exponent - kMantissaBits + std::countr_zero(integer);
}

bool is_finite(const Vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

// The smallest power of two that makes all finite coordinates of the scene integers.
int integer_scale(const Scene& scene) {
  int lowest = 0;
  const auto consider = [&](double value) {
    if (value != 0) lowest = std::min(lowest, lowest_bit(value));
  };
  const SceneParameters& p = scene.parameters;
  for (const double value : {p.camera.x, p.camera.y, p.camera.z, p.near_plane, p.far_plane}) consider(value);
  for (const Triangle& t : scene.model.triangles)
    for (const Vec3* corner : {&t.a, &t.b, &t.c})
      if (is_finite(*corner))
        for (const float value : {corner->x, corner->y, corner->z}) consider(value);
  return -lowest;
}

template <class Point>
Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class Point>
Integer dot(const Point& a, const Point& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// factor * a + c.
RayForm scaled_form(const Integer& factor, const RayForm& a, const Integer& c) {
  return {factor * a.u, factor * a.v, factor * a.w, c};
}

// Whether a sample on the edge belongs to the triangle: the edge's value, with the sign of the volume, grows
// to the right across a left edge, and downwards (against Y) across a top edge.
bool is_top_left(const RayForm& edge, Sign facing) {
  const Sign right = sign_of(edge.u) * facing, down = sign_of(edge.v) * facing * Sign::kNegative;
  return right == Sign::kPositive || (right == Sign::kZero && down == Sign::kPositive);
}

}  // namespace

ExactScene::ExactScene(const Scene& scene, int width, int height, int max_bits)
    : triangles_(scene.model.triangles),
      theta_(scene.parameters.theta),
      width_(width),
      height_(height),
      shift_(integer_scale(scene)) {
  const SceneParameters& p = scene.parameters;
  camera_ = {scaled(p.camera.x), scaled(p.camera.y), scaled(p.camera.z)};
  near_ = scaled(p.near_plane);
  far_ = scaled(p.far_plane);
  const Integer &x = camera_.x, &y = camera_.y, &z = camera_.z;
  camera_distance_squared_ = dot(camera_, camera_);
  ground_squared_ = x * x + z * z;
  if (ground_squared_ == 0) {  // on the Y axis the axes are the world's, and no lengths are left to divide by
    const int up = y.sign();
    u_axis_ = {1, 0, 0};
    v_axis_ = {0, 0, -up};
    w_axis_ = {0, up, 0};
    ground_squared_ = distance_squared_ = 1;
  } else {
    u_axis_ = {z, 0, -x};
    v_axis_ = {-x * y, ground_squared_, -y * z};
    w_axis_ = camera_;
    distance_squared_ = camera_distance_squared_;
  }
  if (const Integer root = sqrt(distance_squared_); root * root == distance_squared_)
    rational_distance_ = root;
  for (mpfr_prec_t bits = std::min<mpfr_prec_t>(kFirstPrecision, max_bits); bits <= max_bits; bits *= 4)
    constants_.push_back(constants(bits));
}

Integer ExactScene::scaled(double coordinate) const {
  int exponent = 0;
  const double mantissa = std::frexp(coordinate, &exponent);
  const Integer integer = static_cast<std::int64_t>(std::ldexp(mantissa, kMantissaBits));
  const int shift = exponent - kMantissaBits + shift_;
  // What is divided away are zero bits: no bit of a coordinate is below the scale.
  return shift >= 0 ? Integer(integer << shift) : Integer(integer / (Integer(1) << -shift));
}

ExactScene::Constants ExactScene::constants(mpfr_prec_t bits) const {
  return {.tangent = tangent_of_half(theta_, bits),
          .distance = square_root(distance_squared_, bits),
          .ground = square_root(ground_squared_, bits)};
}

SampleTransform ExactScene::transform() const {
  // One end of an interval of this width rounds to a neighbour of the true number, within 1.001 u of it.
  const Constants c = constants(kFirstPrecision);
  const Interval u_scale = Interval(height_, kFirstPrecision) / c.tangent / c.ground;
  const Interval v_scale = u_scale / c.distance;
  const Interval w_scale = Interval(-1, kFirstPrecision) / c.distance;
  Interval distance = square_root(camera_distance_squared_, kFirstPrecision);
  mpfr_div_2si(distance.low.get(), distance.low.get(), shift_, MPFR_RNDD);

  // The largest of H/k and the distance is made 1, as far as the unit stays a double.
  const Interval zoom = Interval(height_, kFirstPrecision) / c.tangent;
  constexpr mpfr_exp_t kLargestUnit = 1000;
  const mpfr_exp_t exponent = std::clamp<mpfr_exp_t>(
      std::max(mpfr_get_exp(zoom.high.get()), mpfr_get_exp(distance.low.get())), 0, kLargestUnit);
  const auto rounded = [&](Interval value) {
    mpfr_div_2si(value.low.get(), value.low.get(), exponent, MPFR_RNDD);
    return mpfr_get_d(value.low.get(), MPFR_RNDN);
  };
  const auto row = [&](const Point& axis, const Interval& scale) {
    return Vec3d{rounded(scale * Interval(axis.x, kFirstPrecision)),
                 rounded(scale * Interval(axis.y, kFirstPrecision)),
                 rounded(scale * Interval(axis.z, kFirstPrecision))};
  };
  return {.u = row(u_axis_, u_scale),
          .v = row(v_axis_, v_scale),
          .z = row(w_axis_, w_scale),
          .distance = rounded(distance),
          .unit = std::ldexp(1.0, static_cast<int>(exponent)),
          .width = width_,
          .height = height_};
}

ExactScene::Point ExactScene::relative_to_camera(const Vec3& p) const {
  return {scaled(p.x) - camera_.x, scaled(p.y) - camera_.y, scaled(p.z) - camera_.z};
}

bool ExactScene::is_in_front(const Triangle& triangle) const {
  const auto in_front = [this](const Vec3& p) { return dot(relative_to_camera(p), w_axis_) < 0; };
  return in_front(triangle.a) && in_front(triangle.b) && in_front(triangle.c);
}

RayForm ExactScene::form(const Point& l) const {
  return {dot(l, u_axis_), dot(l, v_axis_), dot(l, w_axis_), 0};
}

ExactTriangle ExactScene::triangle(std::int32_t id) const {
  const Triangle& t = triangles_[static_cast<std::size_t>(id)];
  const Point a = relative_to_camera(t.a), b = relative_to_camera(t.b), c = relative_to_camera(t.c);
  const Point bc = cross(b, c);
  ExactTriangle exact{
      .volume = dot(a, bc), .edges = {form(bc), form(cross(c, a)), form(cross(a, b))}, .plane = {}};
  for (const RayForm& edge : exact.edges) {  // the normal is the sum of the edges' vectors
    exact.plane.u += edge.u;
    exact.plane.v += edge.v;
    exact.plane.w += edge.w;
  }
  return exact;
}

Interval ExactScene::value(const RayForm& form, Sample sample, const Constants& constants) const {
  const mpfr_prec_t bits = constants.tangent.bits();
  const Interval view = constants.tangent * (constants.distance * Interval(sample.x * form.u, bits) +
                                             Interval(sample.y * form.v, bits));
  const Interval axis = constants.distance * Interval(form.c, bits) - Interval(form.w, bits);
  return view + constants.ground * (Interval(height_, bits) * axis);
}

Sign ExactScene::sign(const RayForm& form, Sample sample) const {
  const Integer u = sample.x * form.u, v = sample.y * form.v;
  const bool is_zero = rational_distance_
                           ? *rational_distance_ * u + v == 0 && *rational_distance_ * form.c == form.w
                           : u == 0 && v == 0 && form.c == 0 && form.w == 0;
  if (is_zero) return Sign::kZero;
  for (const Constants& c : constants_)
    if (const Sign sign = value(form, sample, c).sign(); sign != Sign::kUnknown) return sign;
  return Sign::kUnknown;
}

// Near: distance >= n, that is volume / plane >= n, where both have the same sign. Far: distance < f.
Sign ExactScene::visible(const ExactTriangle& triangle, Sample sample, FillRule fill,
                         NearRule near_rule) const {
  const Sign facing = sign_of(triangle.volume);
  bool known = true;
  for (const RayForm& edge : triangle.edges) {
    const Sign inside = sign(edge, sample) * facing;
    if (inside == Sign::kNegative) return Sign::kNegative;
    if (inside == Sign::kZero && fill == FillRule::kTopLeft && !is_top_left(edge, facing))
      return Sign::kNegative;
    known = known && inside != Sign::kUnknown;
  }
  if (near_rule == NearRule::kClip) {
    const Sign behind_near = sign(scaled_form(-near_, triangle.plane, triangle.volume), sample) * facing;
    if (behind_near == Sign::kNegative) return Sign::kNegative;
    known = known && behind_near != Sign::kUnknown;
  }
  const Sign beyond_far = sign(scaled_form(-far_, triangle.plane, triangle.volume), sample) * facing;
  if (beyond_far == Sign::kPositive || beyond_far == Sign::kZero) return Sign::kNegative;
  return known && beyond_far != Sign::kUnknown ? Sign::kPositive : Sign::kUnknown;
}

// Nearer: plane_a / volume_a > plane_b / volume_b.
RayForm ExactScene::nearer(const ExactTriangle& a, const ExactTriangle& b) const {
  const bool same_side = a.volume.sign() == b.volume.sign();
  const Integer at_a = same_side ? b.volume : -b.volume, at_b = same_side ? a.volume : -a.volume;
  return {at_a * a.plane.u - at_b * b.plane.u, at_a * a.plane.v - at_b * b.plane.v,
          at_a * a.plane.w - at_b * b.plane.w, 0};
}

// distance = volume / (plane.ray), of which value() is H D D_g times the denominator.
std::optional<double> ExactScene::distance(const ExactTriangle& triangle, Sample sample) const {
  for (const Constants& c : constants_) {
    const Interval denominator = value(triangle.plane, sample, c);
    if (denominator.sign() == Sign::kUnknown) continue;
    const mpfr_prec_t bits = c.tangent.bits();
    Interval t = Interval(height_ * triangle.volume, bits) * c.distance * c.ground / denominator;
    for (Float* end : {&t.low, &t.high}) mpfr_div_2si(end->get(), end->get(), shift_, MPFR_RNDN);
    const double low = mpfr_get_d(t.low.get(), MPFR_RNDN), high = mpfr_get_d(t.high.get(), MPFR_RNDN);
    // Correctly rounded, or the neighbour of that.
    if (std::nextafter(low, INFINITY) >= high) return low;
  }
  return std::nullopt;
}

const ExactTriangle& PixelResolver::triangle(std::int32_t id) {
  const auto found = triangles_.find(id);
  return found != triangles_.end() ? found->second
                                   : triangles_.emplace(id, scene_.triangle(id)).first->second;
}

const RayForm& PixelResolver::nearer(std::int32_t a, std::int32_t b) {
  const std::uint64_t pair = static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint64_t>(b);
  const auto found = pairs_.find(pair);
  if (found != pairs_.end()) return found->second;
  return pairs_.emplace(pair, scene_.nearer(triangle(a), triangle(b))).first->second;
}

PixelResolver::Owner PixelResolver::resolve(Sample sample, std::span<const Candidate> candidates) {
  bool known = true;
  remaining_.clear();
  for (const Candidate& c : candidates) {
    const Sign visible =
        c.visible ? Sign::kPositive : scene_.visible(triangle(c.id), sample, fill_, near_rule_);
    if (visible != Sign::kNegative) remaining_.push_back(c);
    known = known && visible != Sign::kUnknown;
  }
  if (remaining_.empty()) return {};

  Candidate nearest = remaining_.front();
  for (const Candidate& c : std::span(remaining_).subspan(1)) {
    const Sign sign = scene_.sign(nearer(c.id, nearest.id), sample);
    known = known && sign != Sign::kUnknown;
    if (sign == Sign::kPositive) nearest = c;
  }
  if (known && !nearest.visible) {
    // The first stage's estimate has no bound where it could not tell that the triangle covers the sample.
    const std::optional<double> distance = scene_.distance(triangle(nearest.id), sample);
    if (distance) nearest.distance = *distance;
    known = distance.has_value();
  }
  if (known) return {.id = nearest.id, .distance = nearest.distance, .ambiguous = false};
  return {.id = remaining_.front().id, .distance = remaining_.front().distance, .ambiguous = true};
}

}  // namespace rasterbench::end_to_end
