// What a front end hands to the tiles: per tile a stream of entries of some 32-bit fields, in blocks that a
// vector can be stored into. Each worker fills streams of its own; whoever draws a tile reads those of all
// workers. No atomics, and since the smallest key wins, the order does not matter.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/buffer.h"
#include "numeric/mode.h"

namespace rasterbench {

/// Where entries lie: a tile leaves them out where it shows something nearer. Anywhere, unless said.
class StreamBounds {
 public:
  StreamBounds() = default;
  /// nearest: at most the depths of the entries. pixels: of the image, not empty.
  StreamBounds(float nearest, const PixelBox& pixels)
      : least_{pixels.x0, pixels.y0, -pixels.x1, -pixels.y1}, nearest_(nearest) {}

  /// Of nothing yet.
  static StreamBounds none() {
    return {std::numeric_limits<float>::infinity(), {kMost, kMost, -kMost, -kMost}};
  }

  bool are_known() const { return nearest_ != kAnywhere; }
  void add(const StreamBounds& other) {
    if (other.are_known()) {
      for (std::size_t i = 0; i < least_.size(); ++i) least_[i] = std::min(least_[i], other.least_[i]);
      nearest_ = std::min(nearest_, other.nearest_);
    } else {
      nearest_ = kAnywhere;
    }
  }
  float nearest() const { return nearest_; }
  PixelBox pixels() const { return {least_[0], least_[1], -least_[2], -least_[3]}; }

 private:
  static constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
  static constexpr float kAnywhere = -std::numeric_limits<float>::infinity();
  // Of the ends their negatives, so that one minimum of a vector does for all four.
  alignas(16) std::array<std::int32_t, 4> least_ = {0, 0, 0, 0};
  float nearest_ = kAnywhere;
};

/// The streams of one worker, one for each tile. Entries come from an arena that is kept between frames, so
/// that a frame allocates nothing; a caller makes sure of the room beforehand (spare_blocks, grow).
template <int kFields>
class TileStreams {
 public:
  static constexpr int kCapacity = 48;  ///< entries a block
  static constexpr int kOverhang = 16;  ///< entries of the widest vector: what a store may write at once
  static constexpr std::size_t kEntryBytes = kFields * kCapacity * sizeof(std::uint32_t);  ///< of a block

  /// Apart from its entries, so that a tile may look at all its blocks before it takes one.
  struct alignas(64) Block {
    std::uint32_t (*fields)[kCapacity];
    std::int64_t size;
    StreamBounds bounds;

    /// Fetches the entries ahead of their use: they lie anywhere in memory.
    void fetch() const {
      const auto* bytes = reinterpret_cast<const char*>(fields);
      for (std::size_t line = 0; line < kEntryBytes; line += 64) __builtin_prefetch(bytes + line);
    }
  };

  /// Empties the streams of `tiles` tiles.
  void reset(std::int64_t tiles) {
    streams_.resize(static_cast<std::size_t>(tiles));
    for (auto& stream : streams_) stream.clear();
    used_ = 0;
  }

  /// The stream of a tile.
  std::span<const Block> blocks(std::int64_t tile) const { return streams_[static_cast<std::size_t>(tile)]; }

  /// The block of `tile` that has room for `entries` more, kOverhang at most. Needs a spare block. Valid
  /// until the next call for the tile.
  Block& room(std::int64_t tile, int entries = kOverhang) {
    std::vector<Block>& stream = streams_[static_cast<std::size_t>(tile)];
    if (stream.empty() || stream.back().size > kCapacity - entries)
      stream.push_back({take(), 0, StreamBounds::none()});
    return stream.back();
  }

  /// Entries of a tile's stream.
  std::int64_t entries(std::int64_t tile) const {
    std::int64_t sum = 0;
    for (const Block& block : blocks(tile)) sum += block.size;
    return sum;
  }

  std::int64_t used_blocks() const { return used_; }
  /// Blocks that room() can still take.
  std::int64_t spare_blocks() const { return capacity_ - used_; }

  /// Blocks that `entries` more, appended up to kOverhang at once, can take at most: a tile's first one, and
  /// another one where that is left with fewer than kOverhang free.
  std::int64_t most_blocks(std::int64_t entries) const {
    return std::min(entries,
                    static_cast<std::int64_t>(streams_.size()) + entries / (kCapacity - kOverhang + 1));
  }
  /// Bytes that grow(blocks) would add.
  std::size_t bytes_to_grow(std::int64_t blocks) const {
    return spare_blocks() >= blocks ? 0
                                    : static_cast<std::size_t>(std::max(blocks - spare_blocks(), kChunk)) *
                                          (sizeof(Entries) + sizeof(Block));
  }

  /// Makes at least `blocks` spare. Throws InputError where the memory is not there.
  void grow(std::int64_t blocks) {
    while (spare_blocks() < blocks) {
      const std::int64_t more = std::max(blocks - spare_blocks(), kChunk);
      chunks_.push_back(
          {Buffer<Entries>(static_cast<std::size_t>(more), "the entries of the tiles"), capacity_});
      capacity_ += more;
    }
  }

  std::size_t bytes() const {
    std::size_t blocks = 0;
    for (const auto& stream : streams_) blocks += stream.capacity();
    return static_cast<std::size_t>(capacity_) * sizeof(Entries) + blocks * sizeof(Block) +
           streams_.capacity() * sizeof(streams_[0]);
  }

 private:
  static constexpr std::int64_t kChunk = 512;  // blocks allocated at once

  struct alignas(64) Entries {
    std::uint32_t fields[kFields][kCapacity];
  };
  static_assert(sizeof(Entries) == kEntryBytes);

  struct Chunk {
    Buffer<Entries> entries;  // of each block
    std::int64_t first;       // number of its first block
  };

  std::uint32_t (*take())[kCapacity] {
    while (chunk_ > 0 && used_ < chunks_[chunk_].first) --chunk_;  // after a reset
    while (used_ >= chunks_[chunk_].first + static_cast<std::int64_t>(chunks_[chunk_].entries.size()))
      ++chunk_;
    Chunk& chunk = chunks_[chunk_];
    const auto number = static_cast<std::size_t>(used_++ - chunk.first);
    // The next block will be written soon: what a store waits for is that its line arrives.
    if (number + 1 < chunk.entries.size()) {
      auto* const next = reinterpret_cast<const char*>(&chunk.entries[number + 1]);
      for (std::size_t line = 0; line < sizeof(Entries); line += 64) __builtin_prefetch(next + line, 1);
    }
    return chunk.entries[number].fields;
  }

  std::vector<std::vector<Block>> streams_;  // per tile
  std::vector<Chunk> chunks_;                // entries never move: blocks point at them
  std::size_t chunk_ = 0;                    // the chunk of block `used_`
  std::int64_t used_ = 0, capacity_ = 0;
};

}  // namespace rasterbench
