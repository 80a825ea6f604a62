// The resolve stage: visibility buffer -> colours and depths. Shades visible triangles only.
#pragma once

#include <algorithm>
#include <cstdint>

#include "numeric/mode.h"
#include "pipeline/frame.h"
#include "pipeline/shade_lanes.h"
#include "pipeline/stream_lanes.h"
#include "scene/model.h"
#include "scene/parameters.h"

namespace rasterbench {

/// RGBA8 with red in the lowest byte and alpha 255.
inline std::uint32_t pack_rgba(const Rgb& colour) {
  return std::uint32_t{colour.r} | std::uint32_t{colour.g} << 8 | std::uint32_t{colour.b} << 16 | 0xff000000u;
}

/// Flat shading of the course contract: n = (AB x AC)/|AB x AC|, L = (-1,-1,-1)/sqrt(3), s = max(0, -n.L),
/// each channel trunc(s C). In double, so that no float32 triangle overflows or loses its normal.
std::uint32_t shade_flat(const Triangle& triangle, const Rgb& colour);

/// Runs of pixels of a row that show one triangle, or the background. As many as a block of pixels can have.
struct PixelRuns {
  static constexpr int kBlock = 256;  // pixels: what a block needs stays in L1

  int count = 0;
  int begin[kBlock + 1];          ///< of each run, and where the last one ends
  std::uint32_t colours[kBlock];  ///< of each run
  std::uint32_t ids[kBlock];      ///< of the runs that show a triangle
  int run_of[kBlock];             ///< the run of each of these ids
  std::uint32_t shaded[kBlock];
};

/// Resolves row y: reads keys, writes colours and depths, `width` of each. A triangle is shaded once per run
/// of its pixels. `map` takes the mode's depth values to d. `streaming`: past the caches, a block at a time.
template <NumericMode Mode>
void resolve_row(const typename Mode::Key* keys, int width, const Scene& scene, TieRule tie,
                 const DepthMap& map, Isa isa, std::uint32_t* colours, float* depths,
                 bool streaming = false) {
  const auto& triangles = scene.model.triangles;
  const auto count = static_cast<std::int64_t>(triangles.size());
  const std::uint32_t background = pack_rgba(scene.parameters.background);
  const std::uint32_t empty = Mode::rank(Mode::kClear);  // no triangle's
  PixelRuns runs;
  alignas(64) std::uint32_t block_colours[PixelRuns::kBlock];
  alignas(64) float block_depths[PixelRuns::kBlock];
  for (int first = 0; first < width; first += PixelRuns::kBlock) {
    const int end = std::min(width, first + PixelRuns::kBlock);
    runs.count = 0;
    std::size_t shaded = 0;
    for (int x = first; x < end; ++x) {
      const std::uint32_t rank = Mode::rank(keys[x]);
      if (x > first && rank == Mode::rank(keys[x - 1])) continue;
      if (rank == empty) {
        runs.colours[runs.count] = background;
      } else {
        runs.ids[shaded] = swap_rank(tie, count, rank);
        // Neighbours on the screen may lie far apart in memory.
        __builtin_prefetch(&triangles[runs.ids[shaded]]);
        runs.run_of[shaded++] = runs.count;
      }
      runs.begin[runs.count++] = x;
    }
    runs.begin[runs.count] = end;
    shade_in_lanes(triangles, {runs.ids, shaded}, scene.parameters.object, runs.shaded, isa);
    for (std::size_t i = 0; i < shaded; ++i) runs.colours[runs.run_of[i]] = runs.shaded[i];
    std::uint32_t* const to_colours = streaming ? block_colours : colours + first;
    float* const to_depths = streaming ? block_depths : depths + first;
    for (int run = 0; run < runs.count; ++run)
      std::fill(to_colours + (runs.begin[run] - first), to_colours + (runs.begin[run + 1] - first),
                runs.colours[run]);
    for (int x = first; x < end; ++x) to_depths[x - first] = Mode::output_depth(keys[x], map);
    if (streaming)
      stream_pixels(to_colours, to_depths, static_cast<std::size_t>(end - first), colours + first,
                    depths + first, isa);
  }
  if (streaming) flush_streams();
}

}  // namespace rasterbench
