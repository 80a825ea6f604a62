// triangle_locks: triangles in parallel; a lock guards each segment of 64 pixels of a row.
//
// The straightforward answer to the race of two triangles on one pixel. A lock per fragment would cost more
// than the fragment, a lock per image would serialise: a thread computes the keys of a row segment on its
// own, then takes the segment's lock once to merge them. Segments share kLocks locks (striping: Herlihy &
// Shavit, The Art of Multiprocessor Programming, 13.2).
#include <array>
#include <mutex>

#include "kernels/kernel.h"

namespace rasterbench {
namespace {

struct TriangleLocks {
  static constexpr KernelInfo kInfo{.name = "triangle_locks",
                                    .parallel_unit = "a triangle",
                                    .synchronisation = "4096 striped locks on 64-pixel row segments",
                                    .work = "T + B"};

  template <NumericMode Mode>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) {
      execution.loop(in.size(), [&](std::int64_t i, int worker) {
        const auto triangle = in.prepare(i);
        for (std::int32_t y = triangle.box.y0; y < triangle.box.y1; ++y)
          for (std::int32_t x = triangle.box.x0; x < triangle.box.x1;) {
            const std::int32_t end = std::min(triangle.box.x1, (x / kSegment + 1) * kSegment);
            draw_segment(triangle, x, end, y, out, execution.contention_of(worker));
            x = end;
          }
      });
    }

    std::size_t bytes() const { return sizeof(locks_); }

   private:
    using Key = typename Mode::Key;
    static constexpr std::int32_t kSegment = 64;  // pixels: one cache line of merging per eight of them
    static constexpr std::size_t kLocks = 4096;

    struct alignas(64) Lock {
      std::mutex mutex;
    };

    void draw_segment(const typename Mode::Prepared& triangle, std::int32_t x0, std::int32_t x1,
                      std::int32_t y, Visibility<Mode>& out, Contention& contention) {
      std::array<Key, kSegment> found;
      std::int32_t first = x1, last = x0 - 1;
      for (std::int32_t x = x0; x < x1; ++x) {
        Key& key = found[static_cast<std::size_t>(x - x0)];
        key = Mode::kClear;
        if (!Mode::inside(triangle, x, y)) continue;
        key = Mode::key(Mode::depth(triangle, x, y), triangle.rank);
        first = std::min(first, x);
        last = x;
      }
      if (last < first) return;
      const std::size_t segment =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width / kSegment + 1) +
          static_cast<std::size_t>(x0 / kSegment);
      const auto guard = lock_counted(locks_[segment % kLocks].mutex, contention);
      // Not every mode is monotone along rows: between the first and the last there may be holes, which are
      // clear and win nothing.
      for (std::int32_t x = first; x <= last; ++x) {
        Key& pixel = out.at(x, y);
        const Key& key = found[static_cast<std::size_t>(x - x0)];
        if (key < pixel) pixel = key;
      }
    }

    std::array<Lock, kLocks> locks_;
  };
};

const KernelRegistration<TriangleLocks> kRegistration;

}  // namespace
}  // namespace rasterbench
