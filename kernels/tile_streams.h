// What a front end hands to the tiles: per tile a stream of entries of some 32-bit fields, in blocks that a
// vector can be stored into. Each worker fills streams of its own; whoever draws a tile reads those of all
// workers. No atomics, and since the smallest key wins, the order does not matter.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "base/buffer.h"

namespace rasterbench {

/// The streams of one worker, one for each tile. Blocks come from an arena that is kept between frames, so
/// that a frame allocates nothing; a caller makes sure of the room beforehand (spare_blocks, grow).
template <int kFields>
class TileStreams {
 public:
  static constexpr int kCapacity = 48;  ///< entries a block
  static constexpr int kOverhang = 16;  ///< entries of the widest vector: what a store may write at once

  struct Block {
    alignas(64) std::uint32_t fields[kFields][kCapacity];
    std::int64_t size;
    const Block* next;  ///< an older block of the same tile, or null
  };

  /// Empties the streams of `tiles` tiles.
  void reset(std::int64_t tiles) {
    last_.assign(static_cast<std::size_t>(tiles), nullptr);
    used_ = 0;
  }

  /// The newest block of a tile's stream, null where it is empty.
  const Block* blocks(std::int64_t tile) const { return last_[static_cast<std::size_t>(tile)]; }

  /// The block of `tile` that has room for `entries` more, kOverhang at most. Needs a spare block.
  Block& room(std::int64_t tile, int entries = kOverhang) {
    Block*& last = last_[static_cast<std::size_t>(tile)];
    if (last == nullptr || last->size > kCapacity - entries) {
      Block& block = take();
      block.size = 0;
      block.next = last;
      last = &block;
    }
    return *last;
  }

  /// Entries of a tile's stream.
  std::int64_t entries(std::int64_t tile) const {
    std::int64_t sum = 0;
    for (const Block* block = blocks(tile); block != nullptr; block = block->next) sum += block->size;
    return sum;
  }

  std::int64_t used_blocks() const { return used_; }
  /// Blocks that room() can still take.
  std::int64_t spare_blocks() const { return capacity_ - used_; }

  /// Blocks that `entries` more, appended up to kOverhang at once, can take at most: a tile's first one, and
  /// another one where that is left with fewer than kOverhang free.
  std::int64_t most_blocks(std::int64_t entries) const {
    return std::min(entries, static_cast<std::int64_t>(last_.size()) + entries / (kCapacity - kOverhang + 1));
  }
  /// Bytes that grow(blocks) would add.
  std::size_t bytes_to_grow(std::int64_t blocks) const {
    return spare_blocks() >= blocks
               ? 0
               : static_cast<std::size_t>(std::max(blocks - spare_blocks(), kChunk)) * sizeof(Block);
  }

  /// Makes at least `blocks` spare. Throws InputError where the memory is not there.
  void grow(std::int64_t blocks) {
    while (spare_blocks() < blocks) {
      const std::int64_t more = std::max(blocks - spare_blocks(), kChunk);
      chunks_.push_back(
          {Buffer<Block>(static_cast<std::size_t>(more), "the entries of the tiles"), capacity_});
      capacity_ += more;
    }
  }

  std::size_t bytes() const {
    return static_cast<std::size_t>(capacity_) * sizeof(Block) + last_.size() * sizeof(last_[0]);
  }
  static constexpr std::size_t kBlockBytes = sizeof(Block);

 private:
  static constexpr std::int64_t kChunk = 512;  // blocks allocated at once

  struct Chunk {
    Buffer<Block> blocks;
    std::int64_t first;  // number of its first block
  };

  Block& take() {
    while (chunk_ > 0 && used_ < chunks_[chunk_].first) --chunk_;  // after a reset
    while (used_ >= chunks_[chunk_].first + static_cast<std::int64_t>(chunks_[chunk_].blocks.size()))
      ++chunk_;
    Chunk& chunk = chunks_[chunk_];
    const auto number = static_cast<std::size_t>(used_++ - chunk.first);
    // The next block will be written soon: what a store waits for is that its line arrives.
    if (number + 1 < chunk.blocks.size()) {
      auto* const next = reinterpret_cast<const char*>(&chunk.blocks[number + 1]);
      for (std::size_t line = 0; line < sizeof(Block); line += 64) __builtin_prefetch(next + line, 1);
    }
    return chunk.blocks[number];
  }

  std::vector<Block*> last_;   // per tile
  std::vector<Chunk> chunks_;  // blocks never move: streams point at them
  std::size_t chunk_ = 0;      // the chunk of block `used_`
  std::int64_t used_ = 0, capacity_ = 0;
};

}  // namespace rasterbench
