// tile_simd: tile_parallel with its loops in vectors.
//
// The same way through the frame as tile_parallel (binned, then one thread a tile), so that what differs is
// the inner loops (fixed_lanes.h): boxes for binning are found a vector of triangles at a time without
// setting them up; in a tile, triangles of a few pixels lie in the lanes of vectors and are set up and
// sampled together, a sample position at a time (as in Abrash, Rasterization on Larrabee, 2009, turned by 90
// degrees); larger ones have their spans found by exact division and drawn a vector of pixels at a time.
#include "kernels/bins.h"
#include "kernels/fixed_lanes.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

struct TileSimd {
  static constexpr KernelInfo kInfo{.name = "tile_simd",
                                    .parallel_unit = "a square tile (--tile, 64 pixels)",
                                    .synchronisation = "none: an iteration owns its tile",
                                    .work = "T + tiles of all boxes + B, in vectors",
                                    .has_tiles = true,
                                    .unit = LoopUnit::kTile,
                                    .needs = "has its loops in the integers of fixed_8"};

  template <std::same_as<Fixed8> Mode>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) {
      const FixedLanes& lanes = fixed_lanes(in.settings.geometry.isa);
      const int side = in.settings.tile;
      boxes_.require(static_cast<std::size_t>(in.size()), "the boxes of the triangles");
      lists_.build(
          in.size(), side, side, in.settings.width, in.settings.height, execution,
          [&](std::int64_t begin, std::int64_t end) {
            lanes.boxes(in.triangles.data() + begin, end - begin, boxes_.data() + begin);
          },
          [&](std::int64_t i) { return boxes_[static_cast<std::size_t>(i)]; });
      small_.resize(static_cast<std::size_t>(execution.threads()));
      const BoxedTriangles triangles{in.triangles.data(), boxes_.data(), in.settings.fill, in.settings.tie,
                                     in.triangle_count};
      execution.loop(lists_.cells(), [&](std::int64_t tile, int worker) {
        const PixelBox bounds = lists_.box(tile);
        const LaneTarget target{out.keys.data(), out.width};
        Batches& batches = small_[static_cast<std::size_t>(worker)];
        const auto entries = lists_.entries(tile);
        for (std::size_t entry = 0; entry < entries.size(); ++entry) {
          if (entry + kAhead < entries.size()) {  // a tile's triangles may lie anywhere in memory
            __builtin_prefetch(&boxes_[entries[entry + kAhead]]);
            __builtin_prefetch(&in.triangles[entries[entry + kAhead]]);
          }
          const std::uint32_t index = entries[entry];
          const PixelBox& box = boxes_[index];
          if (!FixedLanes::is_small(box)) {
            const auto prepared = in.prepare(index);
            if (!prepared.box.empty()) lanes.large(prepared, intersect(prepared.box, bounds), target);
            continue;
          }
          Batch& batch = batches.of(box);
          batch.indices[batch.size++] = index;
          if (batch.size == kBatch) batch.draw(lanes, triangles, bounds, target);
        }
        for (Batch& batch : batches.by_size) batch.draw(lanes, triangles, bounds, target);
      });
    }

    void count(WorkCounters& counters) const {
      lists_.count(counters);
      counters.raster_bytes->read += static_cast<std::int64_t>(boxes_.bytes());
      counters.raster_bytes->written += static_cast<std::int64_t>(boxes_.bytes());
    }

    std::size_t bytes() const { return boxes_.bytes() + lists_.bytes() + small_.size() * sizeof(small_[0]); }

   private:
    static constexpr std::size_t kBatch = 64;  // triangles: a few vectors of any width
    static constexpr std::size_t kAhead = 32;  // entries: how far triangles are fetched ahead

    struct Batch {
      std::uint32_t indices[kBatch];
      std::size_t size = 0;

      void draw(const FixedLanes& lanes, const BoxedTriangles& in, const PixelBox& bounds,
                const LaneTarget& out) {
        if (size > 0) lanes.small(in, indices, static_cast<std::int64_t>(size), bounds, out);
        size = 0;
      }
    };
    /// Lanes wait for the largest box among them: boxes of a kind go together, by their longer side in
    /// pixels.
    struct alignas(64) Batches {
      static constexpr std::int32_t kLongestSide[] = {2, 4, 8, FixedLanes::kMaxSmallSide};
      Batch by_size[std::size(kLongestSide)];

      Batch& of(const PixelBox& box) {
        const std::int32_t side = std::max(box.x1 - box.x0, box.y1 - box.y0);
        std::size_t i = 0;
        while (side > kLongestSide[i]) ++i;
        return by_size[i];
      }
    };

    Buffer<PixelBox> boxes_;
    CellLists lists_;
    std::vector<Batches> small_;  // per worker
  };
};

const KernelRegistration<TileSimd> kRegistration;

}  // namespace
}  // namespace rasterbench
