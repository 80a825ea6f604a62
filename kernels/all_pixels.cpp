// all_pixels: every pixel asks every triangle whether it is covered.
//
// The definition of visibility written down as a program, and the worst case that every other strategy
// improves on: no bounding box, no order, no data structure, no synchronisation, since a pixel belongs to one
// iteration. Used where a teacher starts; T x P edge tests forbid it for real scenes.
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

struct AllPixels {
  static constexpr KernelInfo kInfo{.name = "all_pixels",
                                    .parallel_unit = "a pixel",
                                    .synchronisation = "none: an iteration owns its pixel",
                                    .work = "T P",
                                    .tests_every_pixel = true,
                                    .unit = LoopUnit::kPixel};

  template <NumericMode Mode>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) {
      const auto count = static_cast<std::size_t>(in.size());
      prepared_.require(count, "the array of prepared triangles");
      execution.uniform_loop(
          in.size(), [&](std::int64_t i, int) { prepared_[static_cast<std::size_t>(i)] = in.prepare(i); });
      const std::int64_t pixels = static_cast<std::int64_t>(out.keys.size());
      execution.loop(pixels, [&](std::int64_t pixel, int) {
        const auto x = static_cast<std::int32_t>(pixel % out.width);
        const auto y = static_cast<std::int32_t>(pixel / out.width);
        auto nearest = out.keys[static_cast<std::size_t>(pixel)];
        for (const auto& triangle : prepared_.span().first(count)) {
          if (!covers<Mode>(triangle, x, y)) continue;
          const auto key = Mode::key(Mode::depth(triangle, x, y), triangle.rank);
          if (key < nearest) nearest = key;
        }
        out.keys[static_cast<std::size_t>(pixel)] = nearest;
      });
    }

    std::size_t bytes() const { return prepared_.bytes(); }
    void count(WorkCounters& counters) const {
      counters.raster_bytes->read += static_cast<std::int64_t>(prepared_.bytes());
      counters.raster_bytes->written += static_cast<std::int64_t>(prepared_.bytes());
    }

   private:
    Buffer<typename Mode::Prepared> prepared_;
  };
};

const KernelRegistration<AllPixels> kRegistration;

}  // namespace
}  // namespace rasterbench
