// Approximate reciprocals (x86 rcpss, relative error at most 1.5 * 2^-12; Intel SDM, volume 2): what a
// division by the area can be traded for. Their bits differ between makes of CPU.
#pragma once

#include <cmath>
#include <limits>
#include <string_view>

#include "numeric/depth.h"

#if defined(__SSE__)
#include <xmmintrin.h>

namespace rasterbench {

inline constexpr std::string_view kReciprocalUnavailable = {};

/// Not for denormals, which rcpss takes for zero.
inline float approximate_reciprocal(float v) { return _mm_cvtss_f32(_mm_rcp_ss(_mm_set_ss(v))); }

inline bool has_approximate_reciprocal(float v) { return std::abs(v) >= std::numeric_limits<float>::min(); }

struct ApproximateReciprocal {
  static float quotient(float numerator, float denominator) {
    if (!has_approximate_reciprocal(denominator)) return numerator / denominator;
    return numerator * approximate_reciprocal(denominator);
  }
};

/// With one step of Newton's method, which squares the relative error.
struct NewtonReciprocal {
  static float quotient(float numerator, float denominator) {
    if (!has_approximate_reciprocal(denominator)) return numerator / denominator;
    const float guess = approximate_reciprocal(denominator);
    return numerator * (guess * (2 - denominator * guess));
  }
};

}  // namespace rasterbench
#else

namespace rasterbench {

inline constexpr std::string_view kReciprocalUnavailable = "needs the x86 instruction rcpss";
using ApproximateReciprocal = Division;
using NewtonReciprocal = Division;

}  // namespace rasterbench
#endif
