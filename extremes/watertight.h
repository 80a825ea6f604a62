// Gaps and overlaps: on a mesh that covers the whole image, each sample belongs to exactly one triangle in
// the top-left fill rule.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "numeric/modes.h"
#include "scene/scene.h"

namespace rasterbench::extremes {

/// What one mode makes of one mesh.
struct WatertightCount {
  std::string_view mode;
  std::int64_t gaps = 0;      ///< pixels covered by no triangle
  std::int64_t overlaps = 0;  ///< pixels covered by more than one
};

/// Whether a mode cannot leave out or share a sample: its edge functions are exact, if only on snapped
/// corners. Of all others nothing is promised: neighbours at an edge agree where it is written the same way
/// for both, but rounding can make the signs of several edges about one corner contradict each other.
bool is_watertight_by_construction(const ModeInfo& mode);

/// Counts directly by the modes' specifications, no kernel in between, each mode on one of `threads` threads.
/// The mesh must cover the whole image, of the size in the scene's parameters. Throws InputError where memory
/// does not suffice. Precondition: each mode has screen triangles and this CPU can run it.
std::vector<WatertightCount> count_gaps_and_overlaps(const Scene& scene,
                                                     std::span<const std::string_view> modes, int threads);

}  // namespace rasterbench::extremes
