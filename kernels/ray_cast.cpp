// ray_cast: one ray per sample, traced by Embree through a bounding-volume hierarchy.
//
// The other way round: a rasterizer asks of each triangle which pixels it covers, a ray asks of each pixel
// which triangle it meets, in time that grows with the logarithm of the triangles (Wald et al., Embree: a
// kernel framework for efficient CPU ray tracing, SIGGRAPH 2014). Pixels are independent, so tiles need no
// synchronisation; what the rasterizers do without is the hierarchy, which every frame builds afresh from its
// world triangles. The build is Embree's own, on as many threads as the execution has, but of oneTBB whatever
// the backend.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "kernels/kernel.h"
#include "reference/embree.h"
#include "reference/ray_cast_frame.h"

namespace rasterbench {
namespace {

constexpr KernelInfo kInfo{.name = "ray_cast",
                           .parallel_unit = "a square tile (--tile, 64 pixels)",
                           .synchronisation = "none: an iteration owns its tile",
                           .work = "T log T to build, P log T to trace",
                           .has_tiles = true,
                           .techniques = kNoTechniques,
                           .unit = LoopUnit::kTile,
                           .needs = "casts rays: its arithmetic is Embree's"};

/// Triangles in the order in which Embree gets them. Permuted ones are a copy, for verification only.
class Slots {
 public:
  Slots(std::span<const Triangle> triangles, std::uint64_t seed) : triangles_(triangles) {
    if (seed == 0) return;
    ids_.resize(triangles.size());
    std::iota(ids_.begin(), ids_.end(), 0u);
    Random random(seed);
    for (std::size_t i = ids_.size(); i > 1; --i) std::swap(ids_[i - 1], ids_[random.bits() % i]);
    for (const std::uint32_t id : ids_) permuted_.push_back(triangles[id]);
    triangles_ = permuted_;
  }
  std::span<const Triangle> triangles() const { return triangles_; }
  std::span<const std::uint32_t> ids() const { return ids_; }

 private:
  std::span<const Triangle> triangles_;
  std::vector<Triangle> permuted_;
  std::vector<std::uint32_t> ids_;
};

class RayCast final : public Renderer {
 public:
  explicit RayCast(const RendererSetup& setup)
      : scene_(*setup.scene),
        settings_(checked(setup.settings)),
        execution_(make_execution(setup.execution)),
        slots_(scene_.model.triangles, setup.permutation_seed),
        rays_(slots_.triangles(), slots_.ids(), sized_camera(scene_, settings_),
              ray_cast_options(settings_, scene_.model.triangles.size(), execution_->threads())),
        keys_(settings_.pixels(), "the visibility buffer"),
        colours_(settings_.pixels(), "the colour buffer"),
        depths_(settings_.pixels(), "the depth buffer") {}

  const FrameReport& draw() override {
    report_.seconds.geometry = seconds_of([&] {
      copy_triangles();
      rays_.build();
    });
    execution_->reset_tally();
    report_.seconds.raster = seconds_of([&] { trace(); });
    report_.reset_tally();
    report_.add_tally(*execution_);
    report_.seconds.resolve = seconds_of([&] {
      const std::int64_t width = settings_.width;
      execution_->uniform_loop(settings_.height, [&](std::int64_t y, int) {
        resolve_row<Keys>(keys_.data() + y * width, settings_.width, scene_, settings_.tie, DepthMap{},
                          Isa::kBaseline, colours_.data() + y * width, depths_.data() + y * width);
      });
    });
    return report_;
  }

  std::span<const std::uint32_t> colours() const override { return colours_.span(); }
  std::span<const float> depths() const override { return depths_.span(); }
  Execution* execution() override { return execution_.get(); }

  std::vector<std::int32_t> ids() const override {
    std::vector<std::int32_t> ids(keys_.size(), -1);
    for (std::size_t i = 0; i < ids.size(); ++i)
      if (keys_[i] != Keys::kClear)
        ids[i] = static_cast<std::int32_t>(swap_rank(settings_.tie, triangle_count(), Keys::rank(keys_[i])));
    return ids;
  }

  std::vector<double> values() const override {
    std::vector<double> values;
    values.reserve(keys_.size());
    for (const Keys::Key key : keys_.span()) values.push_back(Keys::value(key));
    return values;
  }

  std::size_t bytes() const override {
    return rays_.bytes() + keys_.bytes() + colours_.bytes() + depths_.bytes();
  }

 private:
  using Keys = F32;  // any mode whose keys are PackedKeys, for resolve_row

  static const FrameSettings& checked(const FrameSettings& settings) {
    check_ray_cast_settings(settings);
    checked_bytes(settings.pixels(), sizeof(Keys::Key) + 2 * (sizeof(std::uint32_t) + sizeof(float)),
                  fmt::format("an image of {}x{}", settings.width, settings.height));
    return settings;
  }

  std::int64_t triangle_count() const { return static_cast<std::int64_t>(scene_.model.triangles.size()); }

  void copy_triangles() {
    constexpr std::size_t kBatch = 1024;  // triangles; 36 KiB
    const std::size_t count = slots_.triangles().size();
    counts_.assign((count + kBatch - 1) / kBatch, {});
    execution_->uniform_loop(static_cast<std::int64_t>(counts_.size()), [&](std::int64_t batch, int) {
      const std::size_t first = static_cast<std::size_t>(batch) * kBatch;
      rays_.copy(first, std::min(kBatch, count - first), counts_[static_cast<std::size_t>(batch)]);
    });
    report_.counts = std::accumulate(counts_.begin(), counts_.end(), GeometryCounts{},
                                     [](GeometryCounts sum, const GeometryCounts& c) { return sum += c; });
  }

  void trace() {
    const int side = settings_.tile, width = settings_.width, height = settings_.height;
    const std::int64_t columns = (width + side - 1) / side, rows = (height + side - 1) / side;
    execution_->loop(columns * rows, [&](std::int64_t tile, int) {
      const int x0 = static_cast<int>(tile % columns) * side, y0 = static_cast<int>(tile / columns) * side;
      for (int y = y0; y < std::min(height, y0 + side); ++y) {
        const SampleRays::Row row = rays_.rays().row(y);
        Keys::Key* const keys = keys_.data() + std::int64_t{y} * width;
        for (int x = x0; x < std::min(width, x0 + side); ++x)
          keys[x] = ray_cast_key(rays_, row.at(x), settings_, slots_.triangles().size());
      }
    });
  }

  const Scene& scene_;
  FrameSettings settings_;
  std::unique_ptr<Execution> execution_;
  Slots slots_;
  RayScene rays_;
  Buffer<Keys::Key> keys_;
  Buffer<std::uint32_t> colours_;
  Buffer<float> depths_;
  std::vector<GeometryCounts> counts_;  // per batch
  FrameReport report_;
};

std::vector<Kernel::Variant> variants() {
  std::vector<Kernel::Variant> all;
  for (const ModeInfo& mode : mode_infos()) {
    if (mode.has_screen_triangles) {
      all.push_back({mode.name, {}, kInfo.needs});
    } else if (!has_embree()) {
      all.push_back({mode.name, {}, "Embree was not found at build time"});
    } else {
      all.push_back(
          {mode.name, [](const RendererSetup& setup) { return std::make_unique<RayCast>(setup); }, {}});
    }
  }
  return all;
}

const bool kRegistered = (register_kernel(Kernel(kInfo, variants())), true);

}  // namespace
}  // namespace rasterbench
