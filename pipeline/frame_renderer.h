// The stages of a frame around one staged kernel in one numeric mode, and their pieces.
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

/// The raster stage of a staged frame in some mode.
class AnyStrategy {
 public:
  virtual ~AnyStrategy() = default;
};

/// In one mode; it may keep memory between frames, and is made afresh for every point.
template <NumericMode Mode>
class StagedStrategy : public AnyStrategy {
 public:
  virtual void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) = 0;
  /// Memory of its own.
  virtual std::size_t bytes() const = 0;
  /// What it knows of its last frame: sets fields, adds to raster_bytes.
  virtual void count(WorkCounters& counters) const = 0;
};

/// A renderer with the stages of a staged frame around a strategy, which is a StagedStrategy of one of the
/// modes or of a counted one. Compiled here, once a mode, and not once a kernel and mode.
std::unique_ptr<Renderer> make_frame_renderer(const RendererSetup& setup,
                                              std::unique_ptr<AnyStrategy> strategy);

}  // namespace rasterbench
