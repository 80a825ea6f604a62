// triangle_atomics: triangles in parallel; a pixel keeps its smallest key by an atomic minimum.
//
// Depth and id in one 64-bit word make "nearest triangle" a minimum, which commutes: no lock, and the same
// bits in any order. The technique of Nanite's software rasterizer for small triangles (Karis et al.,
// SIGGRAPH 2021, Advances in Real-Time Rendering) and of Laine & Karras (HPG 2011) for depth.
#include <atomic>

#include "kernels/fragments.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

/// Lowers `pixel` to `key`. Relaxed: the loop's end orders all of it before resolve reads.
void atomic_minimum(std::uint64_t& pixel, std::uint64_t key, Contention& contention) {
  std::atomic_ref<std::uint64_t> shared(pixel);
  std::uint64_t seen = shared.load(std::memory_order_relaxed);
  while (key < seen && !shared.compare_exchange_weak(seen, key, std::memory_order_relaxed))
    ++contention.failed_exchanges;
}

struct TriangleAtomics {
  static constexpr KernelInfo kInfo{.name = "triangle_atomics",
                                    .parallel_unit = "a triangle",
                                    .synchronisation = "64-bit atomic minimum of a pixel's key",
                                    .work = "T + B"};

  template <PackedKeyMode Mode>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) {
      execution.loop(in.size(), [&](std::int64_t i, int worker) {
        const auto triangle = in.prepare(i);
        Contention& contention = execution.contention_of(worker);
        for_each_fragment<Mode>(triangle, triangle.box, [&](auto x, auto y, auto key) {
          atomic_minimum(out.at(x, y), key, contention);
        });
      });
    }
  };
};

const KernelRegistration<TriangleAtomics> kRegistration;

}  // namespace
}  // namespace rasterbench
