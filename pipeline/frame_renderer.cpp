#include "pipeline/frame_renderer.h"

#include <stdexcept>
#include <string>
#include <utility>

namespace rasterbench {
namespace {

/// Clear and geometry, then the strategy's raster stage, then resolve.
template <NumericMode Mode>
class FrameRenderer final : public Renderer {
 public:
  FrameRenderer(const RendererSetup& setup, std::unique_ptr<StagedStrategy<Mode>> strategy)
      : scene_(*setup.scene),
        settings_(checked(setup.settings)),
        camera_(sized_camera(scene_, settings_)),
        depth_map_(depth_map(camera_, Mode::kDepthFunction)),
        permutation_seed_(setup.permutation_seed),
        count_(setup.count),
        execution_(make_execution(setup.execution)),
        screen_(scene_.model.triangles.size()),
        keys_(settings_.pixels(), "the visibility buffer", settings_.pages()),
        colours_(settings_.pixels(), "the colour buffer", settings_.pages()),
        depths_(settings_.pixels(), "the depth buffer", settings_.pages()),
        strategy_(std::move(strategy)) {
    if (settings_.generality == Generality::kMinimal)
      settings_.geometry.needs =
          analyse_needs(scene_.model.triangles, make_screen_transform(camera_, Mode::kDepthFunction),
                        settings_.geometry.near_rule)
              .needs;
  }

  const FrameReport& draw() override {
    const int width = settings_.width;
    Visibility<Mode> visibility{keys_.span(), width};

    report_.seconds.clear = seconds_of([&] {
      execution_->uniform_loop(settings_.height, [&](std::int64_t y, int) {
        std::fill_n(visibility.row(y), width, Mode::kClear);
      });
    });
    report_.seconds.geometry = seconds_of([&] {
      screen_.transform(scene_.model.triangles, make_screen_transform(camera_, Mode::kDepthFunction),
                        settings_.geometry, *execution_);
    });
    if (permutation_seed_ != 0) screen_.shuffle(permutation_seed_);
    execution_->reset_tally();
    report_.seconds.raster = seconds_of([&] {
      if constexpr (CountingMode<Mode>) {
        CountingExecution counting(*execution_);
        strategy_->draw(staged(), visibility, counting);
        calls_ = counting.calls();
      } else {
        strategy_->draw(staged(), visibility, *execution_);
      }
    });
    report_.reset_tally();
    report_.add_tally(*execution_);
    // Without vectors there are no stores past the caches: a block of its own would be one more copy.
    const bool streaming = settings_.techniques.streaming && settings_.geometry.isa != Isa::kBaseline;
    report_.seconds.resolve = seconds_of([&] {
      execution_->uniform_loop(settings_.height, [&](std::int64_t y, int) {
        resolve_row<Mode>(visibility.row(y), width, scene_, settings_.tie, depth_map_, settings_.geometry.isa,
                          colours_.data() + y * width, depths_.data() + y * width, streaming);
      });
    });
    report_.counts = screen_.counts();
    if (count_) report_.counters = count_work();
    return report_;
  }

  std::span<const std::uint32_t> colours() const override { return colours_.span(); }
  std::span<const float> depths() const override { return depths_.span(); }
  Execution* execution() override { return execution_.get(); }

  std::vector<std::int32_t> ids() const override {
    std::vector<std::int32_t> ids(keys_.size(), -1);
    const auto count = static_cast<std::int64_t>(scene_.model.triangles.size());
    for (std::size_t i = 0; i < ids.size(); ++i)
      if (!(keys_[i] == Mode::kClear))
        ids[i] = static_cast<std::int32_t>(swap_rank(settings_.tie, count, Mode::rank(keys_[i])));
    return ids;
  }

  std::vector<double> values() const override {
    std::vector<double> values(keys_.size());
    std::transform(keys_.data(), keys_.data() + keys_.size(), values.begin(), Mode::value);
    return values;
  }

  std::size_t bytes() const override {
    return strategy_->bytes() + screen_.bytes() +
           settings_.pixels() * (sizeof(typename Mode::Key) + sizeof(std::uint32_t) + sizeof(float));
  }

 private:
  /// Refuses an image whose buffers, together with a copy for its ids and its file, exceed the memory at
  /// hand: pages are taken when they are touched, so that each buffer alone would seem to fit.
  static const FrameSettings& checked(const FrameSettings& settings) {
    checked_bytes(settings.pixels(), sizeof(typename Mode::Key) + 2 * (sizeof(std::uint32_t) + sizeof(float)),
                  "an image of " + std::to_string(settings.width) + "x" + std::to_string(settings.height));
    return settings;
  }

  StagedTriangles<Mode> staged() const {
    return {screen_.span(), settings_, static_cast<std::int64_t>(scene_.model.triangles.size())};
  }

  /// The last frame's counters, from what it left behind.
  WorkCounters count_work() const {
    WorkCounters counters;
    if constexpr (CountingMode<Mode>) {
      counters.fragments_tested = counters.edge_tests = counters.fragments_passed = 0;
      for (const ModeCalls& calls : calls_) {
        *counters.fragments_tested += calls.samples;
        *counters.edge_tests += calls.edges;
        *counters.fragments_passed += calls.keys;
        const auto of = [](std::int64_t n, std::size_t size) { return n * static_cast<std::int64_t>(size); };
        counters.per_worker.push_back(
            {.triangles = calls.set_ups,
             .bin_entries = calls.entries,
             .fragments_tested = calls.samples,
             .fragments_passed = calls.keys,
             .bytes = of(calls.set_ups, sizeof(screen_.span()[0])) +
                      of(calls.entries, sizeof(std::uint32_t) + sizeof(typename Mode::Prepared)) +
                      of(calls.keys, sizeof(typename Mode::Key))});
      }
    }
    count_boxes(staged(), counters);
    count_visible(ids(), counters);
    const auto bytes_of = [](std::int64_t n, std::size_t size) {
      return n * static_cast<std::int64_t>(size);
    };
    const auto pixels = static_cast<std::int64_t>(settings_.pixels());
    const auto slots = bytes_of(staged().size(), sizeof(screen_.span()[0]));
    const auto covered_keys = bytes_of(*counters.covered_pixels, sizeof(typename Mode::Key));
    counters.clear_bytes = {0, bytes_of(pixels, sizeof(typename Mode::Key))};
    counters.geometry_bytes = {bytes_of(staged().triangle_count, sizeof(Triangle)), slots};
    counters.raster_bytes = {slots + covered_keys, covered_keys};
    counters.resolve_bytes = {bytes_of(pixels, sizeof(typename Mode::Key)) +
                                  bytes_of(*counters.visible_triangles, sizeof(Triangle)),
                              bytes_of(pixels, sizeof(std::uint32_t) + sizeof(float))};
    strategy_->count(counters);
    return counters;
  }

  const Scene& scene_;
  FrameSettings settings_;
  Camera camera_;
  DepthMap depth_map_;
  std::uint64_t permutation_seed_;
  bool count_;
  std::vector<ModeCalls> calls_;  // of each worker in the last counted frame
  std::unique_ptr<Execution> execution_;
  ScreenTriangles<typename Mode::Real> screen_;
  Buffer<typename Mode::Key> keys_;
  Buffer<std::uint32_t> colours_;
  Buffer<float> depths_;
  std::unique_ptr<StagedStrategy<Mode>> strategy_;
  FrameReport report_;
};

/// The renderer of `strategy` where that is one of `Mode`, which takes it; else null.
template <NumericMode Mode>
std::unique_ptr<Renderer> renderer_in(const RendererSetup& setup, std::unique_ptr<AnyStrategy>& strategy) {
  auto* const own = dynamic_cast<StagedStrategy<Mode>*>(strategy.get());
  if (own == nullptr) return nullptr;
  strategy.release();
  return std::make_unique<FrameRenderer<Mode>>(setup, std::unique_ptr<StagedStrategy<Mode>>(own));
}

}  // namespace

std::unique_ptr<Renderer> make_frame_renderer(const RendererSetup& setup,
                                              std::unique_ptr<AnyStrategy> strategy) {
  std::unique_ptr<Renderer> renderer;
  for_each_mode([&]<NumericMode Mode>() {
    if (!renderer) renderer = renderer_in<Mode>(setup, strategy);
    if constexpr (CountableMode<Mode>)
      if (!renderer) renderer = renderer_in<Counted<Mode>>(setup, strategy);
  });
  if (!renderer) throw std::logic_error("a strategy of no mode");
  return renderer;
}

}  // namespace rasterbench
