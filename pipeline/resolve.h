// The resolve stage: visibility buffer -> colours and depths. Shades visible triangles only.
#pragma once

#include <cstdint>

#include "numeric/mode.h"
#include "pipeline/frame.h"
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

/// Resolves row y: reads keys, writes colours and depths, `width` of each. A triangle is shaded once per run
/// of its pixels. `map` takes the mode's depth values to d.
template <NumericMode Mode>
void resolve_row(const typename Mode::Key* keys, int width, const Scene& scene, TieRule tie,
                 const DepthMap& map, std::uint32_t* colours, float* depths) {
  const auto& triangles = scene.model.triangles;
  const auto count = static_cast<std::int64_t>(triangles.size());
  const std::uint32_t background = pack_rgba(scene.parameters.background);
  typename Mode::Key clear = Mode::kClear;
  std::uint32_t shaded_rank = Mode::rank(clear);
  std::uint32_t colour = background;
  for (int x = 0; x < width; ++x) {
    const auto& key = keys[x];
    const std::uint32_t rank = Mode::rank(key);  // that of an empty pixel is no triangle's
    if (rank != shaded_rank) {
      shaded_rank = rank;
      colour = rank == Mode::rank(clear)
                   ? background
                   : shade_flat(triangles[swap_rank(tie, count, rank)], scene.parameters.object);
    }
    colours[x] = colour;
    depths[x] = Mode::output_depth(key, map);
  }
}

}  // namespace rasterbench
