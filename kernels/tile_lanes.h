// The second half of fused_tiles in vectors: from the streams of a tile to its pixels. Modes fixed_8 and
// filtered, with the bits of their scalar specifications.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/isa.h"
#include "kernels/front_end_lanes.h"
#include "kernels/rough_order.h"
#include "pipeline/frame.h"

namespace rasterbench {

/// Triangles of a tile, set up: x and y count from the tile's first pixel. Each row is one quantity.
struct TileTriangles {
  static constexpr std::size_t kSize = 256;
  static constexpr std::size_t kRoom = kSize + TriangleStreams::kCapacity + TriangleStreams::kOverhang;

  /// In mode fixed_8: edge e at pixel (x, y): value + per_column x + per_row y >= 0 inside.
  alignas(64) std::int32_t value[3][kRoom], per_column[3][kRoom], per_row[3][kRoom];
  /// In mode filtered instead: sorted corners in pixels, the bound of its edges' errors, 1 where the
  /// orientation is negative.
  alignas(64) float x[3][kRoom], y[3][kRoom], error[kRoom];
  alignas(64) std::int32_t is_negative[kRoom];
  alignas(64) std::int32_t partial[kRoom];  ///< bit e: edge e may leave samples of the box outside
  alignas(64) std::int32_t x0[kRoom], y0[kRoom], x1[kRoom], y1[kRoom];  ///< the box within the tile
  alignas(64) float d0[kRoom], gx[kRoom], gy[kRoom], low[kRoom], high[kRoom], px[kRoom], py[kRoom];
  alignas(64) float nearest[kRoom];  ///< smallest depth of a sample of the box
  alignas(64) std::int32_t ranks[kRoom];
  std::size_t size = 0;
};

/// Large triangles are drawn by blocks of a tile, squares of this many pixels: of the largest tile, 8 x 8.
inline constexpr int kBlockShift = 4, kBlockSide = 1 << kBlockShift, kMostBlocks = 64;

/// Blocks of streams in order of depth.
class StreamOrder {
 public:
  void clear() {
    blocks_.clear();
    nearest_.clear();
    order_.clear();
  }
  void add(const TriangleStreams::Block& block) {
    order_.push_back(static_cast<std::uint32_t>(blocks_.size()));
    blocks_.push_back(&block);
    nearest_.push_back(block.bounds.nearest());
  }
  /// The nearest first, roughly.
  void sort() { sort_roughly(nearest_.data(), order_, unsorted_); }

  std::size_t size() const { return order_.size(); }
  const TriangleStreams::Block& operator[](std::size_t i) const { return *blocks_[order_[i]]; }
  std::size_t bytes() const {
    return blocks_.capacity() * sizeof(blocks_[0]) + nearest_.capacity() * sizeof(nearest_[0]) +
           (order_.capacity() + unsorted_.capacity()) * sizeof(order_[0]);
  }

 private:
  std::vector<const TriangleStreams::Block*> blocks_;
  std::vector<float> nearest_;  // of each block
  std::vector<std::uint32_t> order_, unsorted_;
};

/// What the drawing of a tile needs; one for each worker.
struct TileScratch {
  explicit TileScratch(const TileGrid& grid)
      : depths(static_cast<std::size_t>(grid.rows_in_memory() + 1) * static_cast<std::size_t>(grid.pitch()),
               "a tile"),
        ranks(depths.size(), "a tile"),
        heads(depths.size(), "a tile"),
        ids(depths.size(), "a tile"),
        colours(depths.size(), "a tile") {
    order.reserve(TileTriangles::kRoom);
    unsorted.reserve(TileTriangles::kRoom);
  }

  std::size_t bytes() const {
    return depths.bytes() + ranks.bytes() + heads.bytes() + ids.bytes() + colours.bytes() +
           (order.capacity() + unsorted.capacity()) * sizeof(order[0]) + stream_order.bytes();
  }

  Buffer<float>
      depths;  ///< a row that is never drawn, then rows_in_memory; -inf where no pixel of the image is
  Buffer<std::int32_t> ranks;  ///< kNoRank: nothing there yet
  TileTriangles triangles;
  Isa isa = Isa::kBaseline;
  /// Of each block: at least the depths of its pixels. Room for a vector behind.
  alignas(64) float farthest[kMostBlocks + TriangleStreams::kOverhang];
  std::int64_t hidden_entries = 0;             ///< as in WorkCounters
  std::vector<std::uint32_t> order, unsorted;  ///< of the large triangles: their indices
  StreamOrder stream_order;
  Buffer<std::uint32_t> heads, ids, colours;  ///< of the runs of pixels that show one triangle
};

inline constexpr std::int32_t kNoRank = 0x7fffffff;  ///< above every rank: T <= 2^31 - 1

/// One tile, from streams to the picture.
struct TileTask {
  std::int64_t tile;
  std::span<const FrontEnd* const> front_ends;  ///< one for each worker
  /// Depths and ranks of the whole image between the rounds of a frame, or null: see fused_tiles.cpp.
  float* kept_depths;
  std::int32_t* kept_ranks;
  bool first_round, last_round;
};

/// Where the picture goes.
struct TileOutput {
  const Scene& scene;
  std::uint32_t* colours;
  float* depths;
  std::int32_t* ids;  ///< null: nobody asks for them
};

/// Draws a tile.
using DrawTile = void (*)(const TileTask& task, const TileSettings& settings, TileScratch& scratch,
                          const TileOutput& output);

/// For an instruction set that this CPU has, in mode fixed_8 or filtered; throws std::logic_error for others.
DrawTile tile_lanes(Isa isa, std::string_view mode);

}  // namespace rasterbench
