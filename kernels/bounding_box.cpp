// bounding_box: triangles one after the other; the rows of a triangle's bounding box in parallel.
//
// What one gets by putting a parallel loop around the inner loop of a serial rasterizer: no two threads ever
// share a pixel, but all of them meet after every triangle, so that small triangles pay for the meeting and
// not for the work.
#include "kernels/fragments.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

struct BoundingBox {
  static constexpr KernelInfo kInfo{.name = "bounding_box",
                                    .parallel_unit = "a row of one triangle's bounding box",
                                    .synchronisation = "a barrier after each triangle",
                                    .work = "T + B",
                                    .unit = LoopUnit::kBoxRow};

  template <NumericMode Mode>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) {
      for (std::int64_t i = 0; i < in.size(); ++i) {
        const auto triangle = in.prepare(i);
        const PixelBox& box = triangle.box;
        if (box.empty()) continue;
        execution.loop(box.y1 - box.y0, [&](std::int64_t row, int) {
          const std::int32_t y = box.y0 + static_cast<std::int32_t>(row);
          for_each_fragment<Mode>(triangle, {box.x0, y, box.x1, y + 1},
                                  [&](auto x, auto, const auto& key) { keep_nearest(out.at(x, y), key); });
        });
      }
    }
  };
};

const KernelRegistration<BoundingBox> kRegistration;

}  // namespace
}  // namespace rasterbench
