// row_parallel: rows of the image in parallel; a row draws the triangles whose boxes cross it.
//
// A thread owns its rows, so pixels need no synchronisation. Triangles are binned by row first (bins.h):
// without that every row would look at every triangle. A triangle costs an entry per row that it crosses, and
// neighbouring rows differ in work as the scene does: the loop for which schedules are compared.
#include "kernels/bins.h"
#include "kernels/fragments.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

struct RowParallel {
  static constexpr KernelInfo kInfo{.name = "row_parallel",
                                    .parallel_unit = "a row of the image",
                                    .synchronisation = "none: an iteration owns its row",
                                    .work = "T + heights of all boxes + B",
                                    .unit = LoopUnit::kRow};

  template <NumericMode Mode>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) {
      bins_.build(in, in.settings.width, 1, execution);
      execution.loop(bins_.cells(), [&](std::int64_t row, int) {
        const auto y = static_cast<std::int32_t>(row);
        bins_.for_each_triangle(row, [&](const auto& triangle) {
          for_each_fragment<Mode>(triangle, {triangle.box.x0, y, triangle.box.x1, y + 1},
                                  [&](auto x, auto, const auto& key) { keep_nearest(out.at(x, y), key); });
        });
      });
    }

    std::size_t bytes() const { return bins_.bytes(); }
    void count(WorkCounters& counters) const { bins_.count(counters); }

   private:
    Bins<Mode> bins_;
  };
};

const KernelRegistration<RowParallel> kRegistration;

}  // namespace
}  // namespace rasterbench
