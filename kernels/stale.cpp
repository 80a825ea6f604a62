// stale: draws its first frame and nothing after it. A canary: timed frames are not first frames, so a
// verification that looks at first frames only would call it the fastest kernel of all. Hidden from lists.
#include "kernels/fragments.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

struct Stale {
  static constexpr KernelInfo kInfo{.name = "stale",
                                    .parallel_unit = "a triangle, in the first frame",
                                    .synchronisation = "none: serial",
                                    .work = "T + B, then 0",
                                    .hidden = true,
                                    .needs = "is a canary: two modes are enough"};

  template <NumericMode Mode>
  requires std::same_as<Mode, F32> || std::same_as<Mode, F64>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution&) {
      if (drawn_) return;
      drawn_ = true;
      for (std::int64_t i = 0; i < in.size(); ++i) {
        const auto triangle = in.prepare(i);
        for_each_fragment<Mode>(triangle, triangle.box,
                                [&](auto x, auto y, const auto& key) { keep_nearest(out.at(x, y), key); });
      }
    }

   private:
    bool drawn_ = false;
  };
};

const KernelRegistration<Stale> kRegistration;

}  // namespace
}  // namespace rasterbench
