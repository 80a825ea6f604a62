// The first half of fused_tiles in vectors: from screen triangles to the streams of the tiles. Modes fixed_8
// and filtered, with the bits of their scalar specifications.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "base/isa.h"
#include "kernels/tile_streams.h"
#include "pipeline/frame.h"
#include "pipeline/screen_batch.h"

namespace rasterbench {

/// The square tiles of an image; their side is a power of two, so that shifts find the tile of a pixel.
struct TileGrid {
  int width = 0, height = 0;  ///< of the image, in pixels
  int shift = 6;              ///< log2 of the side
  std::int64_t columns = 0, rows = 0;

  TileGrid() = default;
  TileGrid(int image_width, int image_height, int side_log2)
      : width(image_width),
        height(image_height),
        shift(side_log2),
        columns((image_width + side() - 1) >> side_log2),
        rows((image_height + side() - 1) >> side_log2) {}

  int side() const { return 1 << shift; }
  /// Of a row of a tile in memory: vectors may read and write beyond its end, and small triangles may be
  /// sampled beyond the last row and column, where nothing is kept.
  int pitch() const { return side() + 16; }
  int rows_in_memory() const { return side() + 4; }
  std::int64_t tiles() const { return columns * rows; }
  PixelBox box(std::int64_t tile) const {
    const auto x = static_cast<std::int32_t>(tile % columns) << shift;
    const auto y = static_cast<std::int32_t>(tile / columns) << shift;
    return intersect({0, 0, width, height}, {x, y, x + side(), y + side()});
  }
};

/// Fields of a fragment: depth, rank, and its place in the tile, row * pitch + column.
using FragmentStreams = TileStreams<3>;
/// Fields of a triangle: x, y and d of three corners as ScreenTriangle has them, rank.
using TriangleStreams = TileStreams<10>;

/// How one frame is drawn.
struct TileSettings {
  TileGrid grid;
  FillRule fill = FillRule::kClosed;
  TieRule tie = TieRule::kFirst;
  std::int64_t triangle_count = 0;  ///< of the scene: for swap_rank()
  Techniques techniques;
};

/// What the front end of one worker fills, and what it uses meanwhile.
struct FrontEnd {
  FragmentStreams fragments;
  TriangleStreams small_triangles;  ///< of boxes of at most 4 x 4 pixels
  TriangleStreams triangles;        ///< all others

  /// Triangles of a batch whose boxes hold a sample of the image.
  struct Survivors {
    static constexpr std::size_t kSize = ScreenBatch<float>::kSize + TriangleStreams::kOverhang;
    alignas(64) float x[3][kSize], y[3][kSize], d[3][kSize];
    alignas(64) std::int32_t ranks[kSize];
    std::int64_t size;
    std::int64_t tiles;   ///< that their boxes touch, summed
    StreamBounds bounds;  ///< of all: what follows one another in the scene are neighbours in most
  } survivors;

  void reset(std::int64_t tiles) {
    fragments.reset(tiles);
    small_triangles.reset(tiles);
    triangles.reset(tiles);
  }
  /// Whether the survivors fit for certain.
  bool has_room() const {
    return fragments.spare_blocks() >= fragments.most_blocks(most_fragments()) &&
           small_triangles.spare_blocks() >= small_triangles.most_blocks(most_small()) &&
           triangles.spare_blocks() >= triangles.most_blocks(survivors.tiles);
  }
  /// Makes room for the survivors; if `generous`, for as much again as was used, so that a first frame grows
  /// few times. Throws InputError where the memory is not there.
  void grow(bool generous) {
    fragments.grow(wanted(fragments, most_fragments(), generous));
    small_triangles.grow(wanted(small_triangles, most_small(), generous));
    triangles.grow(wanted(triangles, survivors.tiles, generous));
  }
  /// Bytes that grow() would add.
  std::size_t bytes_to_grow(bool generous) const {
    return fragments.bytes_to_grow(wanted(fragments, most_fragments(), generous)) +
           small_triangles.bytes_to_grow(wanted(small_triangles, most_small(), generous)) +
           triangles.bytes_to_grow(wanted(triangles, survivors.tiles, generous));
  }
  bool empty() const {
    return fragments.used_blocks() + small_triangles.used_blocks() + triangles.used_blocks() == 0;
  }
  std::size_t bytes() const { return fragments.bytes() + small_triangles.bytes() + triangles.bytes(); }

 private:
  /// Entries that the survivors may become: boxes of 2 x 2 samples, and of 4 x 4, which touch four tiles.
  std::int64_t most_fragments() const { return 4 * survivors.size; }
  std::int64_t most_small() const { return std::min(4 * survivors.size, survivors.tiles); }

  template <class Streams>
  static std::int64_t wanted(const Streams& streams, std::int64_t entries, bool generous) {
    return streams.most_blocks(entries) + (generous ? streams.used_blocks() : 0);
  }
};

/// The loops of one instruction set and mode.
struct FrontEndLanes {
  /// Fills front_end.survivors.
  void (*select)(const ScreenBatch<float>& batch, const TileSettings& settings, FrontEnd& front_end);
  /// Appends the survivors to the streams, which have room for them.
  void (*distribute)(const TileSettings& settings, FrontEnd& front_end);
};

/// For an instruction set that this CPU has, in mode fixed_8 or filtered; throws std::logic_error for others.
FrontEndLanes front_end_lanes(Isa isa, std::string_view mode);

/// Whether `mode` is fixed_8; throws std::logic_error where it is not filtered either.
bool is_fixed_8(std::string_view mode);

}  // namespace rasterbench
