// A rough order by depth, by counting: a sort within a class only where many fall into it.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "numeric/mode.h"

namespace rasterbench {

/// Sorts `indices` by their values, which may be infinite but no NaN: by 64 classes of equal size in the
/// codes of the values, and within a class where many are in it, as where one value lies far from all others.
/// `room` is for its use.
inline void sort_roughly(const float* values, std::vector<std::uint32_t>& indices,
                         std::vector<std::uint32_t>& room) {
  if (indices.size() < 2) return;
  std::uint32_t low = ~0u, high = 0;
  for (const std::uint32_t i : indices) {
    const std::uint32_t code = encode(values[i]);
    low = std::min(low, code);
    high = std::max(high, code);
  }
  constexpr int kBits = 6;
  constexpr std::size_t kClasses = std::size_t{1} << kBits;
  const int shift = std::max(static_cast<int>(std::bit_width(high - low)) - kBits, 0);
  const auto class_of = [&](std::uint32_t i) { return (encode(values[i]) - low) >> shift; };
  std::uint32_t ends[kClasses + 1] = {};
  for (const std::uint32_t i : indices) ++ends[class_of(i) + 1];
  for (std::size_t c = 1; c <= kClasses; ++c) ends[c] += ends[c - 1];
  room.swap(indices);
  indices.resize(room.size());
  for (const std::uint32_t i : room) indices[ends[class_of(i)]++] = i;  // then each is the end of its class
  constexpr std::uint32_t kMany = 8;
  for (std::uint32_t c = 0, begin = 0; c < kClasses; begin = ends[c++])
    if (ends[c] - begin > kMany)
      std::sort(indices.begin() + begin, indices.begin() + ends[c],
                [&](std::uint32_t a, std::uint32_t b) { return values[a] < values[b]; });
}

}  // namespace rasterbench
