// tile_parallel: square tiles of the image in parallel; a tile draws the triangles whose boxes touch it.
//
// Sort-middle (Molnar et al. 1994), the way of every tiling GPU and of Mesa's llvmpipe: triangles are binned,
// then each tile is drawn by one thread while its keys stay in the cache. No synchronisation on pixels; large
// triangles are set up once and visited by each of their tiles.
#include "kernels/bins.h"
#include "kernels/fragments.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

struct TileParallel {
  static constexpr KernelInfo kInfo{.name = "tile_parallel",
                                    .parallel_unit = "a square tile (--tile, 64 pixels)",
                                    .synchronisation = "none: an iteration owns its tile",
                                    .work = "T + tiles of all boxes + B",
                                    .has_tiles = true,
                                    .unit = LoopUnit::kTile};

  template <NumericMode Mode>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) {
      bins_.build(in, in.settings.tile, in.settings.tile, execution);
      execution.loop(bins_.cells(), [&](std::int64_t tile, int) {
        const PixelBox bounds = bins_.box(tile);
        bins_.for_each_triangle(tile, [&](const auto& triangle) {
          for_each_fragment<Mode>(triangle, intersect(triangle.box, bounds),
                                  [&](auto x, auto y, const auto& key) { keep_nearest(out.at(x, y), key); });
        });
      });
    }

    std::size_t bytes() const { return bins_.bytes(); }
    void count(WorkCounters& counters) const { bins_.count(counters); }

   private:
    Bins<Mode> bins_;
  };
};

const KernelRegistration<TileParallel> kRegistration;

}  // namespace
}  // namespace rasterbench
