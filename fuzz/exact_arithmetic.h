// Float32 operations that say whether they were exact: a changed case must be the one that was meant.
#pragma once

#include <optional>

namespace rasterbench::fuzz {

/// a + b where it is a float32 number; by Two-Sum (Knuth, The Art of Computer Programming 2, 4.2.2), whose
/// second part is the rounding error.
inline std::optional<float> exact_sum(float a, float b) {
  const float sum = a + b;
  const float part = sum - a;
  const float error = (a - (sum - part)) + (b - part);
  if (error != 0) return std::nullopt;
  return sum;
}

/// The middle of a and b where it is a float32 number.
inline std::optional<float> exact_midpoint(float a, float b) {
  const auto sum = exact_sum(a, b);
  if (!sum || *sum * 0.5f * 2 != *sum) return std::nullopt;
  return *sum * 0.5f;
}

}  // namespace rasterbench::fuzz
