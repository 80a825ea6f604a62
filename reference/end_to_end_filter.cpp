// Homogeneous rasterization (Olano, Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates,
// Graphics Hardware 1997) with forward error bounds (Higham, Accuracy and Stability of Numerical Algorithms,
// SIAM 2002, chapter 3). u = 2^-53; a hat marks what is computed; "magnitude" of a sum is the sum of its
// terms' magnitudes. Corners are taken relative to the sample before they are multiplied, which keeps the
// bound of an edge at the rounding of the corners however small the triangle is.
//
// Corner. U^ = ((a Px + b Py) + c Pz) + d has coefficients rounded once (u), products (u) and three sums (3
// u): |U^ - U| <= 5.01 u magnitude(U), likewise V and z.
//
// Corner relative to the sample. x^ = U^ - X z^ adds two roundings to the errors of U and z: with |X| < W,
//   |x^ - x| <= 7.1 u (magnitude(U) + W magnitude(z)) < x_error = 10 u (...), and |x^| <= u_reach = (...).
//
// Share. e = x1 y2 - x2 y1. |x^ y^ - x y| <= x_error (|y^| + y_error) + y_error (|x^| + x_error) for each of
// the products; the three roundings are at most 2.01 u (|x1^ y2^| + |x2^ y1^|), which is below 0.21 of the
// same terms because 10 u |x^| <= x_error. kShareError = 1.5 covers 1.21 and the rounding of the bound
// itself.
//
// Distance. t = sum e z / sum e, the weights being all of one sign. With error(e) = b and S^ > 2 sum b,
//   (t - t^) sum e = sum e^ (z^ - t^) + sum (e - e^)(z^ - t^) + sum e (z - z^)
// The first sum is 0 but for the rounding of t^, at most 8.1 u sum |e^ z^|; the second is at most
// sum b |z^ - t^|; the third at most sum (|e^| + b) 5.01 u magnitude(z). z_error = 20 u magnitude(z) covers
// the first and the third together. |S^ - S| <= 1.15 sum b.
//
// kTiny in each bound covers underflow: an underflowing product is off by 2^-1075, and nothing that it is
// multiplied with or divided by later exceeds 2^500. Overflow is impossible: coordinates are floats and the
// transform is at most 2^40, hence |x^| < 2^190, |e^| < 2^385, |e^ z^| < 2^560.
#include "reference/end_to_end_filter.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace rasterbench::end_to_end {
namespace {

constexpr double kU = 0x1p-53;
constexpr double kCornerError = 10 * kU;
constexpr double kShareError = 1.5;
constexpr double kDistanceError = 20 * kU;
constexpr double kTiny = 0x1p-500;

// Of an index of a row or column that was found by a division: far above the rounding of a quotient below
// 2^18, and what is farther away is outside the picture whatever its rounding.
constexpr double kIndexError = 0x1p-20;

// The indices of 0 .. count - 1 in [low, high].
IndexRange indices_between(double low, double high, IndexRange range) {
  low = std::ceil(low - kIndexError);
  high = std::floor(high + kIndexError);
  if (low > range.last || high < range.first) return {};
  return {low > range.first ? static_cast<int>(low) : range.first,
          high < range.last ? static_cast<int>(high) : range.last};
}

struct Sum {
  double value, magnitude;
};

Sum affine(const Vec3d& row, const Vec3& p, double constant) {
  const double x = row.x * double{p.x}, y = row.y * double{p.y}, z = row.z * double{p.z};
  return {x + y + z + constant, std::abs(x) + std::abs(y) + std::abs(z) + std::abs(constant)};
}

}  // namespace

FilteredTriangle::FilteredTriangle(const Triangle& triangle, const SampleTransform& transform)
    : z_low_(INFINITY),
      z_high_(-INFINITY),
      unit_(transform.unit),
      width_(transform.width),
      height_(transform.height) {
  const std::array<const Vec3*, 3> points = {&triangle.a, &triangle.b, &triangle.c};
  for (std::size_t i = 0; i < 3; ++i) {
    const Sum u = affine(transform.u, *points[i], 0), v = affine(transform.v, *points[i], 0);
    const Sum z = affine(transform.z, *points[i], transform.distance);
    const double u_reach = u.magnitude + width_ * z.magnitude, v_reach = v.magnitude + height_ * z.magnitude;
    const double z_error = kDistanceError * z.magnitude + kTiny;
    corners_[i] = {.u = u.value,
                   .v = v.value,
                   .z = z.value,
                   .u_reach = u_reach,
                   .x_error = kCornerError * u_reach + kTiny,
                   .y_error = kCornerError * v_reach + kTiny,
                   .z_error = z_error};
    z_low_ = std::min(z_low_, z.value - z_error);
    z_high_ = std::max(z_high_, z.value + z_error);
  }
}

int FilteredTriangle::orientation() const {
  // At a sample near the triangle, where the determinant of a small triangle is not all rounding.
  double x = 0, y = 0;
  if (const Corner& a = corners_[0]; a.z > a.z_error) {
    x = std::clamp(a.u / a.z, -double(width_), double(width_));
    y = std::clamp(a.v / a.z, -double(height_), double(height_));
  }
  const Shares e = shares(row_at(y), x);
  double determinant = 0, error = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Corner& c = corners_[i];
    determinant += e.value[i] * c.z;
    error += e.error[i] * std::abs(c.z) + (std::abs(e.value[i]) + e.error[i]) * c.z_error;
  }
  return determinant > error ? 1 : determinant < -error ? -1 : 0;
}

bool FilteredTriangle::is_in_front() const { return z_low_ > 0; }

bool FilteredTriangle::is_behind() const { return z_high_ < 0; }

// A row in which all corners are certainly above, or all below, the sample is not covered. Where z > 0, the
// corners' V - Y z > y_error is Y < (V - y_error) / z.
IndexRange FilteredTriangle::rows() const {
  const IndexRange all{0, height_ - 1};
  if (!is_in_front()) return all;
  double low = INFINITY, high = -INFINITY;
  for (const Corner& c : corners_) {
    low = std::min(low, (c.v - c.y_error) / c.z);
    high = std::max(high, (c.v + c.y_error) / c.z);
  }
  return indices_between((height_ - 1 - high) / 2, (height_ - 1 - low) / 2, all);
}

IndexRange FilteredTriangle::columns() const {
  const IndexRange all{0, width_ - 1};
  if (!is_in_front()) return all;
  double low = INFINITY, high = -INFINITY;
  for (const Corner& c : corners_) {
    low = std::min(low, (c.u - c.x_error) / c.z);
    high = std::max(high, (c.u + c.x_error) / c.z);
  }
  return indices_between((low + width_ - 1) / 2, (high + width_ - 1) / 2, all);
}

FilteredTriangle::Row FilteredTriangle::row_at(double y) const {
  Row row;
  bool all_above = true, all_below = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const Corner& c = corners_[i];
    row.y[i] = c.v - y * c.z;
    row.reach[i] = std::abs(row.y[i]) + c.y_error;
    all_above = all_above && row.y[i] > c.y_error;
    all_below = all_below && row.y[i] < -c.y_error;
  }
  row.misses = all_above || all_below;
  return row;
}

// On a row, orientation * e_i = c - X m. The slack is the bound of a share with the largest |x| of the
// picture.
IndexRange FilteredTriangle::columns(const Row& row, int orientation, IndexRange columns) const {
  constexpr int kWorthNarrowing = 8;  // solving for the ends of a row costs as much as some samples
  if (columns.last - columns.first < kWorthNarrowing) return columns;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const Corner &a = corners_[j], &b = corners_[k];
    const double slack = kShareError * (a.x_error * row.reach[k] + b.y_error * a.u_reach +
                                        b.x_error * row.reach[j] + a.y_error * b.u_reach) +
                         kTiny;
    const double c = orientation * (a.u * row.y[k] - b.u * row.y[j]) + slack;
    const double m = orientation * (a.z * row.y[k] - b.z * row.y[j]);
    if (m > 0) columns = indices_between(-INFINITY, (c / m + width_ - 1) / 2, columns);
    if (m < 0) columns = indices_between((c / m + width_ - 1) / 2, INFINITY, columns);
    if (columns.empty() || (m == 0 && c < 0)) return {};
  }
  return columns;
}

FilteredTriangle::Shares FilteredTriangle::shares(const Row& row, double x) const {
  std::array<double, 3> xs, reach;
  for (std::size_t i = 0; i < 3; ++i) {
    xs[i] = corners_[i].u - x * corners_[i].z;
    reach[i] = std::abs(xs[i]) + corners_[i].x_error;
  }
  Shares shares;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    shares.value[i] = xs[j] * row.y[k] - xs[k] * row.y[j];
    shares.error[i] = kShareError * (corners_[j].x_error * row.reach[k] + corners_[k].y_error * reach[j] +
                                     corners_[k].x_error * row.reach[j] + corners_[j].y_error * reach[k]) +
                      kTiny;
  }
  return shares;
}

std::optional<Fragment> FilteredTriangle::fragment(const Row& row, int j, int orientation) const {
  const Shares e = shares(row, 2.0 * j + 1 - width_);
  double sum = 0, sum_error = 0, moment = 0;
  bool covers = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const double share = orientation * e.value[i];
    if (share < -e.error[i]) return std::nullopt;
    covers = covers && share > e.error[i];
    sum += share;
    sum_error += 2 * e.error[i];
    moment += share * corners_[i].z;
  }
  // A covered point lies between its triangle's corners.
  double low = z_low_, high = z_high_, distance = 0.5 * (z_low_ + z_high_);
  if (sum > sum_error) {
    distance = moment / sum;
    double error = 0;
    for (std::size_t i = 0; i < 3; ++i)
      error += e.error[i] * std::abs(corners_[i].z - distance) +
               (std::abs(e.value[i]) + e.error[i]) * corners_[i].z_error;
    error /= sum - sum_error;
    low = std::max(low, distance - error);
    high = std::min(high, distance + error);
  } else {
    covers = false;
  }
  if (high <= 0) return std::nullopt;
  return Fragment{unit_ * low, unit_ * high, unit_ * distance, covers};
}

}  // namespace rasterbench::end_to_end
