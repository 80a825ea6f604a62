// Depth of which the order is exact: intervals in double, rationals where they overlap.
#pragma once

#include <compare>
#include <cstdint>

#include "numeric/depth.h"

namespace rasterbench {

/// The depth of a triangle's plane at the sample of pixel (x, y): its value to rounding, and what decides
/// where that does not. The triangle must outlive it.
struct ExactDepth {
  double value;
  float error;  ///< |value - exact depth| is at most this; infinite: unknown
  std::int32_t x, y;
  const ScreenTriangle<float>* triangle;  ///< nullptr: the far plane
  operator double() const { return value; }
};

/// Sign of (exact depth of a - exact depth of b) by rational arithmetic. Both at the same sample.
int compare_exactly(const ExactDepth& a, const ExactDepth& b);

struct ExactKey {
  ExactDepth depth;
  std::uint32_t rank;

  friend bool operator<(const ExactKey& a, const ExactKey& b) {
    const double gap = a.depth.value - b.depth.value;
    const double uncertain = double{a.depth.error} + double{b.depth.error};
    if (gap < -uncertain) return true;
    if (gap > uncertain) return false;
    const int order = compare_exactly(a.depth, b.depth);
    // A depth equal to the far plane's is not drawn, whatever its rank.
    if (order == 0 && (a.depth.triangle == nullptr || b.depth.triangle == nullptr)) return false;
    return order != 0 ? order < 0 : a.rank < b.rank;
  }
  friend bool operator==(const ExactKey& a, const ExactKey& b) {
    return a.rank == b.rank && a.depth.triangle == b.depth.triangle;
  }
};

/// Keys in 40 bytes: for kernels that own a pixel or lock it.
struct ExactKeys {
  using Key = ExactKey;
  static constexpr DepthFunction kDepthFunction = DepthFunction::kNdc;
  static constexpr Key kClear{{1, 0, 0, 0, nullptr}, 0xffffffffu};
  static Key key(const ExactDepth& depth, std::uint32_t rank) { return {depth, rank}; }
  static double value(const Key& key) { return key.depth.value; }
  static float output_depth(const Key& key, const DepthMap& = {}) {
    return static_cast<float>(key.depth.value);
  }
  static std::uint32_t rank(const Key& key) { return key.rank; }
};

}  // namespace rasterbench
