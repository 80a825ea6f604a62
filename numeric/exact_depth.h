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
    if (const int order = compare_exactly(a.depth, b.depth); order != 0) return order < 0;
    // A depth equal to the far plane's is not drawn, whatever its rank.
    const bool a_is_clear = a.depth.triangle == nullptr, b_is_clear = b.depth.triangle == nullptr;
    if (a_is_clear || b_is_clear) return a_is_clear && !b_is_clear;
    if (a.rank != b.rank) return a.rank < b.rank;
    // Two pieces of one clipped triangle: their values are stored, and may differ in the last bit.
    return a.depth.value < b.depth.value;
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
