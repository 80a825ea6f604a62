// The exact sign of an orientation of float32 points.
//
// This work is based on: Jonathan Richard Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast
// Robust Geometric Predicates, Discrete & Computational Geometry 18, 1997. Float32 input makes it short: a
// product of two float32 numbers is exact in double.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace rasterbench {

/// Sign (-1, 0, 1) of the exact sum of six finite doubles.
inline int exact_sign_of_sum(const std::array<double, 6>& terms) {
  double sum = 0, size = 0;
  for (const double term : terms) {
    sum += term;
    size += std::abs(term);
  }
  // Five additions, each within 2^-53 of a partial sum that is at most `size`; one more for `size` itself.
  if (std::abs(sum) > 6 * 0x1p-53 * size) return sum > 0 ? 1 : -1;

  // Grow-expansion (Shewchuk, section 2.4): nonoverlapping components whose sum is exact, the last of which
  // that is not zero has the sign of all.
  std::array<double, 6> expansion{};
  for (std::size_t count = 0; count < terms.size(); ++count) {
    double carry = terms[count];
    for (std::size_t i = 0; i < count; ++i) {
      const double rounded = carry + expansion[i];  // Two-Sum (Knuth)
      const double part = rounded - carry;
      expansion[i] = (carry - (rounded - part)) + (expansion[i] - part);
      carry = rounded;
    }
    expansion[count] = carry;
  }
  for (std::size_t i = expansion.size(); i-- > 0;)
    if (expansion[i] != 0) return expansion[i] > 0 ? 1 : -1;
  return 0;
}

/// Sign of (b-a) x (p-a), exact for finite float32 numbers.
inline int exact_orientation(float ax, float ay, float bx, float by, float px, float py) {
  const auto product = [](float u, float v) { return double{u} * double{v}; };
  return exact_sign_of_sum({product(bx, py), -product(bx, ay), -product(ax, py), -product(by, px),
                            product(by, ax), product(ay, px)});
}

}  // namespace rasterbench
