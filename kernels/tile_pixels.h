// A tile of fused_tiles while it is drawn, and what is done to it without vectors.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "kernels/fragments.h"
#include "kernels/tile_lanes.h"

namespace rasterbench {

/// The depth of an empty pixel: with kNoRank it is the mode's kClear, so that d = 1 is not drawn.
inline constexpr float kClearDepth = 0x1.fffffep-1f;

/// A tile's pixels while it is drawn.
struct TilePixels {
  float* depths;
  std::int32_t* ranks;
  std::int64_t pitch;
  PixelBox box;             ///< of the image
  int side;                 ///< of a tile that the image does not cut
  float* farthest;          ///< TileScratch::farthest
  std::uint64_t untouched;  ///< bit b: block b still has to be cleared
  std::int64_t drawn = 0;   ///< samples, some more than once
  std::int64_t next_look;   ///< at `farthest`, when so many are drawn

  std::int32_t width() const { return box.x1 - box.x0; }
  std::int32_t height() const { return box.y1 - box.y0; }

  /// log2 of the blocks in a row or column.
  int block_shift() const {
    return std::countr_zero(static_cast<unsigned>(std::max(side, kBlockSide))) - kBlockShift;
  }
  std::int32_t blocks() const { return 1 << 2 * block_shift(); }
  /// The pixels of a block, beyond the image too.
  PixelBox block(std::int32_t number) const {
    const std::int32_t x = (number & ((1 << block_shift()) - 1)) << kBlockShift;
    const std::int32_t y = number >> block_shift() << kBlockShift;
    return intersect({x, y, x + kBlockSide, y + kBlockSide}, {0, 0, side, side});
  }
  /// Those of the image.
  PixelBox block_in_image(std::int32_t number) const {
    return intersect(block(number), {0, 0, width(), height()});
  }

  /// What of a box of the image lies in the tile, counted from its first pixel.
  PixelBox of_image(const PixelBox& pixels) const {
    const PixelBox here = intersect(pixels, box);
    return {here.x0 - box.x0, here.y0 - box.y0, here.x1 - box.x0, here.y1 - box.y0};
  }

  /// Whether what is shown in every block that touches `pixels`, a box that is not empty, is nearer.
  bool hides(const PixelBox& pixels, float nearest) const {
    const std::int32_t x1 = (pixels.x1 - 1) >> kBlockShift, y1 = (pixels.y1 - 1) >> kBlockShift;
    for (std::int32_t y = pixels.y0 >> kBlockShift; y <= y1; ++y)
      for (std::int32_t x = pixels.x0 >> kBlockShift; x <= x1; ++x)
        if (!(nearest > farthest[(y << block_shift()) + x])) return false;
    return true;
  }

  /// Keeps a fragment if its key is smaller.
  void keep(std::int64_t place, float depth, std::int32_t rank) const {
    const float old_depth = depths[place];
    const std::int32_t old_rank = ranks[place];
    const bool kept = (depth < old_depth) | ((depth == old_depth) & (rank < old_rank));
    depths[place] = kept ? depth : old_depth;
    ranks[place] = kept ? rank : old_rank;
  }
};

/// Keeps a tile until the next round, and brings it back.
inline void save(const TilePixels& tile, int image_width, float* depths, std::int32_t* ranks) {
  for (std::int32_t y = 0; y < tile.height(); ++y) {
    const std::int64_t at = std::int64_t{tile.box.y0 + y} * image_width + tile.box.x0;
    std::copy_n(tile.depths + y * tile.pitch, tile.width(), depths + at);
    std::copy_n(tile.ranks + y * tile.pitch, tile.width(), ranks + at);
  }
}
inline void load(const TilePixels& tile, int image_width, const float* depths, const std::int32_t* ranks) {
  for (std::int32_t y = 0; y < tile.height(); ++y) {
    const std::int64_t at = std::int64_t{tile.box.y0 + y} * image_width + tile.box.x0;
    std::copy_n(depths + at, tile.width(), tile.depths + y * tile.pitch);
    std::copy_n(ranks + at, tile.width(), tile.ranks + y * tile.pitch);
  }
}

inline float as_float(std::uint32_t bits) { return std::bit_cast<float>(bits); }

/// Entry i of a block, as a screen triangle without its id.
inline ScreenTriangle<float> triangle_of(const TriangleStreams::Block& block, std::size_t i) {
  ScreenTriangle<float> t{};
  for (int corner = 0; corner < 3; ++corner) {
    t.x[corner] = as_float(block.fields[corner][i]);
    t.y[corner] = as_float(block.fields[3 + corner][i]);
    t.d[corner] = as_float(block.fields[6 + corner][i]);
  }
  return t;
}

/// One triangle of any size, pixel by pixel.
template <NumericMode Mode>
void draw_one_by_one(const TriangleStreams::Block& block, std::size_t i, const SampleGrid& grid,
                     const TilePixels& tile) {
  const std::uint32_t rank = block.fields[9][i];
  const auto prepared = Mode::prepare(triangle_of(block, i), grid, rank);
  const PixelBox box = intersect(prepared.box, tile.box);
  for_each_fragment<Mode>(prepared, box, [&](std::int32_t x, std::int32_t y, typename Mode::Key key) {
    tile.keep((y - tile.box.y0) * tile.pitch + (x - tile.box.x0),
              decode(static_cast<std::uint32_t>(key >> 32)), static_cast<std::int32_t>(rank));
  });
}

/// Whether entry i of a block covers a sample that its lane was not certain of. Out of line: it is rare.
template <NumericMode Mode>
[[gnu::noinline]] bool covers_exactly(const TriangleStreams::Block& block, std::size_t i,
                                      const SampleGrid& grid, std::int32_t x, std::int32_t y) {
  return covers<Mode>(Mode::prepare(triangle_of(block, i), grid, block.fields[9][i]), x, y);
}

}  // namespace rasterbench
