// Kernels: the strategies under comparison. Each is one file in this folder that registers itself; see
// bounding_box.cpp for the shape of one.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "numeric/modes.h"
#include "pipeline/frame_renderer.h"

namespace rasterbench {

/// What one iteration of the loop under study draws.
enum class LoopUnit {
  kTriangle,  ///< a screen triangle: those of the scene first, then further pieces of clipped ones
  kPixel,     ///< a pixel of the image, row by row
  kRow,       ///< KernelInfo::rows rows of the image
  kTile,      ///< a square tile, row of tiles by row of tiles
  kBoxRow,    ///< a row of one triangle's box, in a loop of its own for each triangle
};

/// What a kernel declares of itself.
struct KernelInfo {
  std::string_view name;
  std::string_view parallel_unit;    ///< what one iteration of the loop under study is
  std::string_view synchronisation;  ///< how threads keep out of each other's pixels
  std::string_view work;  ///< complexity: T triangles, P pixels of the image, B pixels of all bounding boxes
  bool tests_every_pixel = false;  ///< costs T x P edge tests, so that a study has to predict its time
  bool has_tiles = false;          ///< FrameSettings::tile matters to its speed
  Techniques techniques = kFrameTechniques;  ///< those that it has: the others make no difference to it
  bool hidden = false;                       ///< not listed: a canary
  LoopUnit unit = LoopUnit::kTriangle;
  int rows = 1;  ///< that an iteration draws, where the unit is a row
  /// Side in pixels of the tiles that it makes of FrameSettings::tile; null: that itself.
  int (*tile_side)(int tile) = nullptr;
  /// What a numeric mode must have to suit, said of modes that do not.
  std::string_view needs = "needs a key of one 64-bit word, which this mode's depth does not fit";
};

/// A registered kernel and the numeric modes that can carry it.
class Kernel {
 public:
  using Make = std::function<std::unique_ptr<Renderer>(const RendererSetup&)>;
  struct Variant {
    std::string_view mode;
    Make make;  ///< empty where the mode does not suit; `reason` says why
    std::string_view reason;
  };

  Kernel(const KernelInfo& info, std::vector<Variant> variants)
      : info_(info), variants_(std::move(variants)) {}
  const KernelInfo& info() const { return info_; }
  std::span<const Variant> variants() const { return variants_; }

  /// The variant for a mode of the list.
  const Variant& variant(std::string_view mode) const;

 private:
  KernelInfo info_;
  std::vector<Variant> variants_;
};

/// Every kernel, hidden ones included, in the order of the CMake list.
std::span<const Kernel> kernels();

/// Throws InputError with a did-you-mean.
const Kernel& find_kernel(std::string_view name);

/// The one place where a kernel, a mode and a setup become a renderer. Throws InputError where the mode does
/// not suit.
std::unique_ptr<Renderer> make_renderer(std::string_view kernel, std::string_view mode,
                                        const RendererSetup& setup);

void register_kernel(Kernel kernel);

/// A kernel's `Strategy` in one mode, as the stages around it see it. It has
///   void draw(const StagedTriangles<Mode>&, Visibility<Mode>, Execution&)
/// and, if it keeps memory or knows what it did, bytes() and count() as StagedStrategy has them.
template <NumericMode Mode, class Strategy>
class KernelStrategy final : public StagedStrategy<Mode> {
 public:
  void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) override {
    strategy_.draw(in, out, execution);
  }
  std::size_t bytes() const override {
    if constexpr (requires { strategy_.bytes(); }) return strategy_.bytes();
    return 0;
  }
  void count([[maybe_unused]] WorkCounters& counters) const override {
    if constexpr (requires { strategy_.count(counters); }) strategy_.count(counters);
  }

 private:
  Strategy strategy_;
};

/// Registers `Definition`, which has a KernelInfo `kInfo` and a nested class template `Strategy<Mode>`, for
/// every mode that the constraints on Strategy admit.
template <class Definition>
struct KernelRegistration {
  KernelRegistration() {
    std::vector<Kernel::Variant> variants;
    for_each_mode([&]<NumericMode Mode>() {
      if constexpr (requires { typename Definition::template Strategy<Mode>; }) {
        if (const auto reason = find_mode(Mode::kInfo.name)->unavailable; !reason.empty()) {
          variants.push_back({Mode::kInfo.name, {}, reason});
          return;
        }
        variants.push_back({Mode::kInfo.name,
                            [](const RendererSetup& setup) -> std::unique_ptr<Renderer> {
                              if constexpr (is_counted<Mode>())
                                if (setup.count) return make<Counted<Mode>>(setup);
                              return make<Mode>(setup);
                            },
                            {}});
      } else {
        variants.push_back({Mode::kInfo.name, {}, Definition::kInfo.needs});
      }
    });
    variants.push_back({kRayCastInfo.name, {}, "has no rays: ray_cast is a kernel of its own"});
    register_kernel(Kernel(Definition::kInfo, std::move(variants)));
  }

 private:
  /// Whether counted frames of a mode count its calls; strategies with loops of their own have none to count.
  template <NumericMode Mode>
  static constexpr bool is_counted() {
    if constexpr (CountableMode<Mode>) return requires {
        typename Definition::template Strategy<Counted<Mode>>;
      };
    return false;
  }

  template <NumericMode Mode>
  static std::unique_ptr<Renderer> make(const RendererSetup& setup) {
    using Strategy = typename Definition::template Strategy<Mode>;
    return make_frame_renderer(setup, std::make_unique<KernelStrategy<Mode, Strategy>>());
  }
};

}  // namespace rasterbench
