// Screen triangles in whole numbers of any size: what the exact modes and the error bounds are tested
// against. GMP, where numeric/exact.cpp has Boost's own integers: they share nothing.
#pragma once

#include <array>
#include <boost/multiprecision/gmp.hpp>
#include <cmath>
#include <cstdint>

#include "numeric/coverage_testing.h"

namespace rasterbench {

using Big = boost::multiprecision::mpz_int;

/// Everything is in units of 2^-kBigBits px (or of depth): the last bit of the smallest float32 numbers, and
/// 24 more, so that a mantissa of 24 bits is never shifted down.
inline constexpr int kBigBits = 149 + 24;

inline Big big(float value) {
  int exponent = 0;
  const float fraction = std::frexp(value, &exponent);
  const Big mantissa = static_cast<std::int64_t>(std::ldexp(fraction, 24));
  return mantissa << (exponent - 24 + kBigBits);
}

inline Big big_sample(std::int32_t pixel) { return Big(2 * pixel + 1) << (kBigBits - 1); }

inline IntegerTriangle<Big> big_triangle(const ScreenTriangle<float>& t) {
  return {{{big(t.x[0]), big(t.y[0])}, {big(t.x[1]), big(t.y[1])}, {big(t.x[2]), big(t.y[2])}}};
}

/// A quotient with a positive denominator.
struct BigQuotient {
  Big numerator, denominator;

  /// Sign of (this - other).
  int compare(const BigQuotient& other) const {
    return Big(numerator * other.denominator).compare(other.numerator * denominator);
  }

  /// |this - value|, to the precision of a double.
  double distance(double value) const {
    // The value in units of 2^-1126: the last bit of the smallest double, and 52 more.
    constexpr int kBits = 1074 + 52;
    int exponent = 0;
    const double fraction = std::frexp(value, &exponent);
    const Big wide = Big(static_cast<std::int64_t>(std::ldexp(fraction, 53))) << (exponent - 53 + kBits);
    const Big gap = abs((numerator << kBits) - wide * denominator);
    if (gap == 0) return 0;
    // Both brought to 64 bits before they become floating-point numbers: they may be far beyond their range.
    const auto top = [](const Big& v, int& shift) {
      shift = static_cast<int>(msb(v)) - 63;
      const Big leading = shift >= 0 ? Big(v >> shift) : Big(v << -shift);
      return static_cast<double>(static_cast<std::uint64_t>(leading));
    };
    int of_gap = 0, of_denominator = 0;
    const double high = top(gap, of_gap), low = top(denominator, of_denominator);
    return std::ldexp(high / low, of_gap - of_denominator - kBits);
  }
};

/// The exact depth of the plane through the corners at the sample of pixel (x, y). The area is not zero.
inline BigQuotient exact_plane_depth(const ScreenTriangle<float>& t, std::int32_t x, std::int32_t y) {
  const auto p = big_triangle(t);
  const Big d0 = big(t.d[0]), d1 = big(t.d[1]) - d0, d2 = big(t.d[2]) - d0;
  const Big x1 = p[1].x - p[0].x, y1 = p[1].y - p[0].y, x2 = p[2].x - p[0].x, y2 = p[2].y - p[0].y;
  const Big dx = big_sample(x) - p[0].x, dy = big_sample(y) - p[0].y;
  Big area = x1 * y2 - y1 * x2;
  Big numerator = d0 * area + (d1 * y2 - d2 * y1) * dx + (d2 * x1 - d1 * x2) * dy;
  if (area < 0) {
    area = -area;
    numerator = -numerator;
  }
  return {numerator, area << kBigBits};
}

inline bool exactly_covers(const ScreenTriangle<float>& t, std::int32_t x, std::int32_t y, FillRule fill) {
  return exactly_covers<Big>(big_triangle(t), {big_sample(x), big_sample(y)}, fill);
}

}  // namespace rasterbench
