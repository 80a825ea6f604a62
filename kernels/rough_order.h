// A rough order by value, faster than sorting.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace rasterbench {

/// Sorts `indices` by their values, but for those that differ by little. Finite values; `room` is for its
/// use.
inline void sort_roughly(const float* values, std::vector<std::uint32_t>& indices,
                         std::vector<std::uint32_t>& room) {
  if (indices.size() < 2) return;
  float low = values[indices[0]], high = low;
  for (const std::uint32_t i : indices) {
    low = std::min(low, values[i]);
    high = std::max(high, values[i]);
  }
  constexpr std::size_t kClasses = 64;
  const float range = high - low;
  const float scale = range > 0x1p-100f ? (kClasses - 1) / range : 0.0f;
  const auto class_of = [&](std::uint32_t i) { return static_cast<std::size_t>((values[i] - low) * scale); };
  std::uint32_t ends[kClasses + 1] = {};
  for (const std::uint32_t i : indices) ++ends[class_of(i) + 1];
  for (std::size_t c = 1; c <= kClasses; ++c) ends[c] += ends[c - 1];
  room.swap(indices);
  indices.resize(room.size());
  for (const std::uint32_t i : room) indices[ends[class_of(i)]++] = i;
}

}  // namespace rasterbench
