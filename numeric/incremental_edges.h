// Edge functions in float32 by repeated addition along a row, as hardware and old software did it.
//
// The value starts afresh at every column that is a multiple of 64, so that it does not depend on where a
// kernel starts; its errors still add up over up to 63 additions.
#pragma once

#include "numeric/cross_edges.h"

namespace rasterbench {

struct IncrementalEdges : CrossEdges<float> {
  static constexpr bool kMonotone = false;  // a restart can undo what additions have lost
  static constexpr std::int32_t kRestart = 64;

  /// Calls visit(x, value) at pixels first .. last of a row, which lie between two restarts.
  template <class Visit>
  static void walk(const Setup& s, int e, std::int32_t first, std::int32_t last, std::int32_t y,
                   Visit visit) {
    const std::int32_t start = first & ~(kRestart - 1);
    float sum = CrossEdges<float>::value(s, e, start, y);
    for (std::int32_t x = start; x < first; ++x) sum -= s.dy[e];
    for (std::int32_t x = first; x <= last; ++x, sum -= s.dy[e]) visit(x, sum);
  }

  static float value(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    float value = 0;
    walk(s, e, x, x, y, [&](std::int32_t, float sum) { value = sum; });
    return value;
  }

  static bool inside_edge(const Setup& s, int e, std::int32_t x, std::int32_t y) {
    return value(s, e, x, y) >= s.least[e];
  }

  static std::uint64_t inside_run(const Setup& s, std::int32_t x, std::int32_t y, std::int32_t n) {
    std::uint64_t inside = n < 64 ? (std::uint64_t{1} << n) - 1 : ~std::uint64_t{0};
    for (int e = 0; e < 3 && inside != 0; ++e)
      walk(s, e, x, x + n - 1, y,
           [&](std::int32_t at, float sum) { inside &= ~(std::uint64_t{sum < s.least[e]} << (at - x)); });
    return inside;
  }
};

}  // namespace rasterbench
