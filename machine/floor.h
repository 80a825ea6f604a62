// The floor of a point: the time in which its data could pass between memory and the CPU, whatever draws it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace rasterbench {

/// What a frame cannot do without: each triangle is read once (nine float32) and each pixel is written once
/// (RGBA8 and a float32 depth).
inline constexpr std::size_t kTriangleBytes = 36, kPixelBytes = 8;

/// Bytes that are read and bytes that are written.
struct WorkingSet {
  std::size_t read_bytes = 0, write_bytes = 0;
  auto operator<=>(const WorkingSet&) const = default;
};

/// The working set of a frame of `triangles` triangles and width x height pixels.
constexpr WorkingSet working_set_of(std::int64_t triangles, int width, int height) {
  return {static_cast<std::size_t>(triangles) * kTriangleBytes,
          static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * kPixelBytes};
}

/// Milliseconds in which `set` is read and then written, at rates in bytes per second above 0.
constexpr double floor_ms(const WorkingSet& set, double read_rate, double write_rate) {
  return 1e3 * (static_cast<double>(set.read_bytes) / read_rate +
                static_cast<double>(set.write_bytes) / write_rate);
}

}  // namespace rasterbench
