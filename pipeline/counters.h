// What a frame did, counted: taken in a frame that is drawn for it and never timed, so that the timed code is
// free of counters.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace rasterbench {

/// How many of the drawn screen triangles are how large, by the longer side of their pixel box within the
/// image.
struct SizeClasses {
  /// Largest side of a class in pixels; what is larger falls into the last class.
  static constexpr std::array<std::int32_t, 6> kLargestSide{2, 4, 8, 16, 32, 64};

  std::int64_t without_sample = 0;  ///< the box is empty, or the set-up found that nothing is drawn
  std::array<std::int64_t, kLargestSide.size() + 1> by_side{};

  /// Counts a box of width x height samples.
  void add(std::int32_t width, std::int32_t height) {
    if (width <= 0 || height <= 0) {
      ++without_sample;
      return;
    }
    const auto found = std::lower_bound(kLargestSide.begin(), kLargestSide.end(), std::max(width, height));
    ++by_side[static_cast<std::size_t>(found - kLargestSide.begin())];
  }

  bool operator==(const SizeClasses&) const = default;
};

/// Bytes of the arrays that a stage goes through: each element that it reads and each that it writes counts
/// once, however often a loop comes back to it. So the least that can pass between the caches and the cores,
/// or memory where the array does not stay in a cache.
struct StageBytes {
  std::int64_t read = 0, written = 0;
  bool operator==(const StageBytes&) const = default;
};

/// What one worker did in the raster stage.
struct WorkerWork {
  std::int64_t triangles = 0;         ///< that it set up
  std::int64_t bin_entries = 0;       ///< that it went through, of kernels that bin
  std::int64_t fragments_tested = 0;  ///< as WorkCounters::fragments_tested
  std::int64_t fragments_passed = 0;
  /// That it read: screen triangles to set up, set-up triangles of bin entries, and a key for each fragment
  /// that passed.
  std::int64_t bytes = 0;
};

/// What a frame did; a field is empty where the kernel has no such thing or does not count it.
struct WorkCounters {
  std::optional<SizeClasses> sizes;
  std::optional<std::int64_t> samples_in_boxes;  ///< of all screen triangles, within the image
  /// Samples of which a kernel asked whether a triangle covers them; of all_pixels by the box alone, too.
  std::optional<std::int64_t> fragments_tested;
  std::optional<std::int64_t> edge_tests;         ///< of a single edge, by kernels that search spans
  std::optional<std::int64_t> fragments_passed;   ///< depths and keys that were made: covered samples
  std::optional<std::int64_t> covered_pixels;     ///< that show a triangle in the end
  std::optional<std::int64_t> visible_triangles;  ///< that some pixel shows
  std::optional<std::int64_t> tiles;              ///< cells of the bins: tiles, rows or bands
  std::optional<std::int64_t> tiles_touched;      ///< that some triangle's box touches
  /// Fragments that were binned in place of their triangles.
  std::optional<std::int64_t> binned_fragments;
  std::optional<std::int64_t> bin_entries;  ///< pairs of a triangle and a cell that its box touches
  /// Of these, entries left out because what the tile shows is nearer wherever their triangles reach.
  std::optional<std::int64_t> hidden_entries;
  std::optional<std::int64_t> merges;  ///< keys of private buffers that were compared with the frame's
  std::vector<WorkerWork> per_worker;  ///< empty where the calls of the mode are not counted
  std::optional<StageBytes> clear_bytes, geometry_bytes, raster_bytes, resolve_bytes;
};

}  // namespace rasterbench
