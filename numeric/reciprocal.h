// Approximate reciprocals (x86 rcpss, relative error at most 1.5 * 2^-12; Intel SDM, volume 2): what a
// division by the area can be traded for. Their bits differ between makes of CPU.
#pragma once

#if defined(__SSE__)
#include <xmmintrin.h>

namespace rasterbench {

inline constexpr std::string_view kReciprocalUnavailable = {};

struct ApproximateReciprocal {
  static float quotient(float numerator, float denominator) {
    return numerator * _mm_cvtss_f32(_mm_rcp_ss(_mm_set_ss(denominator)));
  }
};

/// With one step of Newton's method, which squares the relative error.
struct NewtonReciprocal {
  static float quotient(float numerator, float denominator) {
    const float guess = _mm_cvtss_f32(_mm_rcp_ss(_mm_set_ss(denominator)));
    return numerator * (guess * (2 - denominator * guess));
  }
};

}  // namespace rasterbench
#else
#include "numeric/depth.h"

namespace rasterbench {

inline constexpr std::string_view kReciprocalUnavailable = "needs the x86 instruction rcpss";
using ApproximateReciprocal = Division;
using NewtonReciprocal = Division;

}  // namespace rasterbench
#endif
