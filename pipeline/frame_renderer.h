// The stages of a frame around one staged kernel in one numeric mode.
#pragma once

#include <algorithm>
#include <cstring>

#include "pipeline/counted_mode.h"
#include "pipeline/frame.h"
#include "pipeline/resolve.h"
#include "scene/generator.h"

namespace rasterbench {

/// The geometry stage as a parallel loop: the screen triangles of a scene in one array. Slot i < T belongs to
/// triangle i; further pieces of clipped triangles follow in the order of their ids, whatever thread made
/// them.
template <class Real>
class ScreenTriangles {
 public:
  explicit ScreenTriangles(std::size_t triangle_count)
      : triangle_count_(triangle_count),
        batches_((triangle_count + kBatch - 1) / kBatch),
        slots_(triangle_count, "the array of screen triangles"),
        extra_(batches_),
        counts_(batches_) {}

  void transform(std::span<const Triangle> triangles, const ScreenTransform& transform,
                 const GeometryOptions& options, Execution& execution) {
    execution.uniform_loop(static_cast<std::int64_t>(batches_), [&](std::int64_t batch, int) {
      const auto b = static_cast<std::size_t>(batch);
      const std::size_t first = b * kBatch;
      extra_[b].clear();
      counts_[b] = {};
      transform_triangles<Real>(triangles.subspan(first, std::min(kBatch, triangle_count_ - first)),
                                static_cast<std::int32_t>(first), transform, options, slots_.data() + first,
                                extra_[b], counts_[b]);
    });
    append_extra(execution);
  }

  /// Puts the triangles into a random order (Fisher & Yates); each keeps its id.
  void shuffle(std::uint64_t seed) {
    Random random(seed);
    for (std::size_t i = size_; i > 1; --i) std::swap(slots_[i - 1], slots_[random.bits() % i]);
  }

  std::span<const ScreenTriangle<Real>> span() const { return slots_.span().first(size_); }
  std::size_t bytes() const { return slots_.size() * sizeof(ScreenTriangle<Real>); }

  GeometryCounts counts() const {
    GeometryCounts sum;
    for (const GeometryCounts& c : counts_) sum += c;
    return sum;
  }

 private:
  static constexpr std::size_t kBatch = 256;  // triangles; 9 KiB in, 10 KiB out: stays in L1

  void append_extra(Execution& execution) {
    size_ = triangle_count_;
    for (const auto& pieces : extra_) size_ += pieces.size();
    if (size_ >
        slots_.size()) {  // happens in a point's first frame only: clipping does not change between frames
      Buffer<ScreenTriangle<Real>> larger(size_, "the array of screen triangles");
      execution.uniform_loop(static_cast<std::int64_t>(batches_), [&](std::int64_t batch, int) {
        const std::size_t first = static_cast<std::size_t>(batch) * kBatch;
        std::copy_n(slots_.data() + first, std::min(kBatch, triangle_count_ - first), larger.data() + first);
      });
      slots_ = std::move(larger);
    }
    ScreenTriangle<Real>* end = slots_.data() + triangle_count_;
    for (const auto& pieces : extra_) end = std::copy(pieces.begin(), pieces.end(), end);
  }

  std::size_t triangle_count_;
  std::size_t batches_;
  std::size_t size_ = 0;
  Buffer<ScreenTriangle<Real>> slots_;
  std::vector<std::vector<ScreenTriangle<Real>>> extra_;  // per batch, so that their order is the ids'
  std::vector<GeometryCounts> counts_;
};

/// Counts the boxes of screen triangles and the samples in them.
template <NumericMode Mode>
void count_boxes(const StagedTriangles<Mode>& triangles, WorkCounters& counters) {
  SizeClasses sizes;
  std::int64_t samples = 0;
  for (std::int64_t i = 0; i < triangles.size(); ++i) {
    if (triangles.triangles[static_cast<std::size_t>(i)].id < 0) continue;
    const PixelBox box = triangles.prepare(i).box;
    sizes.add(box.x1 - box.x0, box.y1 - box.y0);
    if (!box.empty()) samples += std::int64_t{box.x1 - box.x0} * (box.y1 - box.y0);
  }
  counters.sizes = sizes;
  counters.samples_in_boxes = samples;
}

/// Counts the pixels that show a triangle, by Renderer::ids(), and those triangles.
inline void count_visible(const std::vector<std::int32_t>& ids, WorkCounters& counters) {
  std::vector<std::int32_t> shown;
  std::copy_if(ids.begin(), ids.end(), std::back_inserter(shown), [](std::int32_t id) { return id >= 0; });
  counters.covered_pixels = static_cast<std::int64_t>(shown.size());
  std::sort(shown.begin(), shown.end());
  counters.visible_triangles = std::unique(shown.begin(), shown.end()) - shown.begin();
}

/// Renderer for a staged strategy: `Strategy` has
///   void draw(const StagedTriangles<Mode>&, Visibility<Mode>, Execution&)
///   std::size_t bytes() const    memory of its own, if it has any
///   void count(WorkCounters&) const    what it knows of its last frame, if anything: sets fields, adds to
///                                      raster_bytes
/// and may keep memory between frames; it is made afresh for every point.
template <NumericMode Mode, class Strategy>
class FrameRenderer final : public Renderer {
 public:
  explicit FrameRenderer(const RendererSetup& setup)
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
        depths_(settings_.pixels(), "the depth buffer", settings_.pages()) {
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
        strategy_.draw(staged(), visibility, counting);
        calls_ = counting.calls();
      } else {
        strategy_.draw(staged(), visibility, *execution_);
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
    std::size_t of_strategy = 0;
    if constexpr (requires { strategy_.bytes(); }) of_strategy = strategy_.bytes();
    return of_strategy + screen_.bytes() +
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
    if constexpr (requires { strategy_.count(counters); }) strategy_.count(counters);
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
  Strategy strategy_;
  FrameReport report_;
};

}  // namespace rasterbench
