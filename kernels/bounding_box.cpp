// bounding_box: triangles one after the other; the rows of a triangle's bounding box in parallel.
//
// What one gets by putting a parallel loop around the inner loop of a serial rasterizer: no two threads ever
// share a pixel, but all of them meet after every triangle, so that small triangles pay for the meeting and
// not for the work. Boxes below kParallelPixels are therefore drawn by the calling thread (OpenMP's `if`
// clause by hand).
#include "kernels/fragments.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

struct BoundingBox {
  static constexpr KernelInfo kInfo{.name = "bounding_box",
                                    .parallel_unit = "a row of one triangle's bounding box",
                                    .synchronisation = "a barrier after each triangle",
                                    .work = "T + B"};

  template <NumericMode Mode>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) {
      for (std::int64_t i = 0; i < in.size(); ++i) {
        const auto triangle = in.prepare(i);
        const PixelBox& box = triangle.box;
        if (box.empty()) continue;
        const auto draw_rows = [&](std::int32_t y0, std::int32_t y1) {
          for_each_fragment<Mode>(triangle, {box.x0, y0, box.x1, y1},
                                  [&](auto x, auto y, const auto& key) { keep_nearest(out.at(x, y), key); });
        };
        if (std::int64_t{box.x1 - box.x0} * (box.y1 - box.y0) < kParallelPixels) {
          draw_rows(box.y0, box.y1);
          continue;
        }
        execution.loop(box.y1 - box.y0, [&](std::int64_t row, int) {
          const std::int32_t y = box.y0 + static_cast<std::int32_t>(row);
          draw_rows(y, y + 1);
        });
      }
    }

   private:
    static constexpr std::int64_t kParallelPixels =
        4096;  // about what two threads need to win back one barrier
  };
};

const KernelRegistration<BoundingBox> kRegistration;

}  // namespace
}  // namespace rasterbench
