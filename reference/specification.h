// The scalar specification of a numeric mode, executed: for every triangle, every pixel near it, serially.
// What a kernel must equal bit for bit (design, Invariant 0).
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "pipeline/frame.h"

namespace rasterbench {

/// A finished picture, row 0 on top.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::int32_t> ids = {};       ///< -1 = background
  std::vector<float> depths = {};           ///< 1 = background
  std::vector<std::uint32_t> colours = {};  ///< RGBA8
  std::vector<double> values = {};          ///< depth values as stored, Renderer::values()
  GeometryCounts counts = {};
  std::int64_t samples_tested = 0;   ///< in the boxes of all screen triangles, cut to the image
  std::int64_t samples_covered = 0;  ///< of those, inside: pixels times depth complexity
};

/// Draws `scene` by the specification of `mode`. Throws InputError for a mode that does not exist or that
/// this CPU cannot run, and for settings that the mode does not know.
Picture render_specification(const Scene& scene, std::string_view mode, const FrameSettings& settings);

/// Pixels whose id, depth bits or colour differ.
std::int64_t differing_pixels(const Picture& a, const Picture& b);

/// What `renderer` drew last.
Picture picture_of(const Renderer& renderer, const FrameSettings& settings);

}  // namespace rasterbench
