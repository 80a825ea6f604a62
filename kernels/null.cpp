// null: draws nothing. A canary: a verification that lets it pass is broken. Hidden from lists.
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

struct Null {
  static constexpr KernelInfo kInfo{.name = "null",
                                    .parallel_unit = "nothing",
                                    .synchronisation = "none",
                                    .work = "0",
                                    .hidden = true,
                                    .needs = "is a canary: two modes are enough"};

  template <NumericMode Mode>
  requires std::same_as<Mode, F32> || std::same_as<Mode, F64>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>&, Visibility<Mode>, Execution&) {}
  };
};

const KernelRegistration<Null> kRegistration;

}  // namespace
}  // namespace rasterbench
