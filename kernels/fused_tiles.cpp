// fused_tiles: sort-middle with both ends fused to it, so that a frame has two loops.
//
// The front end takes world triangles a batch at a time, transforms them in L1 and hands what may cover a
// sample to the tiles: tiny triangles as the fragments that they cover, others as triangles (tile_streams.h).
// The back end, which is the loop under study, takes one tile at a time, draws it in L1 and writes its
// colours and depths to memory. No array of screen triangles, no visibility buffer, and each byte of the
// picture written once. Abrash, Rasterization on Larrabee, 2009, has the tiles and triangles in lanes; Laine
// & Karras, High-performance software rasterization on GPUs, 2011, the size classes.
//
// Modes: fixed_8 in integers, and filtered in float32 with error bounds, which leaves to the scalar
// specification what it cannot decide (tile_filtered-inl.h). At 1920x1080 on one thread filtered takes 1.05
// to 1.10 times the time of fixed_8 for triangles of 2 to 450 pixels (1.07 to 1.12 with AVX2), most of it
// for orientations and gradients in double and for bounds, and 1.01 times for large ones (1.03 with AVX2).
//
// Memory: the streams take 12 bytes for each fragment of a tiny triangle and 40 bytes for each tile that
// another triangle's box touches, in blocks of 48 entries, of each worker and tile the last one partly empty,
// and 64 bytes for each block; they are kept between frames. Where a scene would fill more than the budget of
// the streams (RendererSetup), the frame is drawn in rounds: front end until it is full, tiles, and so on,
// with 8 bytes a pixel for what was drawn so far. A budget that is too small for one batch of triangles is
// exceeded by it.
#include <fmt/format.h>

#include <atomic>
#include <bit>
#include <numeric>

#include "kernels/kernel.h"
#include "kernels/tile_lanes.h"

namespace rasterbench {
namespace {

/// log2 of the side of the tiles: that of `tile` rounded down to a power of two from 8 to 128.
int tile_shift(int tile) {
  return static_cast<int>(std::bit_width(static_cast<unsigned>(std::clamp(tile, 8, 128)))) - 1;
}

constexpr KernelInfo kInfo{
    .name = "fused_tiles",
    .parallel_unit = "a square tile (--tile, 64 pixels; a power of two from 8 to 128)",
    .synchronisation = "none: a worker fills streams of its own, an iteration owns its tile",
    .work = "T + tiles of all boxes + B, in vectors",
    .has_tiles = true,
    .techniques = {},  // all
    .unit = LoopUnit::kTile,
    .tile_side = [](int tile) { return 1 << tile_shift(tile); },
    .needs = "has its loops in the integers of fixed_8 and the floats of filtered"};

/// Of both modes, whose screen triangles and keys are the same.
constexpr DepthFunction kDepthFunction = Fixed8::kDepthFunction;
static_assert(Filtered::kDepthFunction == kDepthFunction && Filtered::kClear == Fixed8::kClear);

class FusedTiles final : public Renderer {
 public:
  FusedTiles(const RendererSetup& setup, std::string_view mode)
      : scene_(*setup.scene),
        settings_(checked(setup.settings)),
        camera_(sized_camera(scene_, settings_)),
        permutation_seed_(setup.permutation_seed),
        stream_budget_(setup.stream_budget),
        count_(setup.count),
        is_fixed_(is_fixed_8(mode)),
        execution_(make_execution(setup.execution)),
        front_end_lanes_(front_end_lanes(settings_.geometry.isa, mode)),
        draw_tile_(tile_lanes(settings_.geometry.isa, mode)),
        tile_settings_{.grid = TileGrid(settings_.width, settings_.height, tile_shift(settings_.tile)),
                       .fill = settings_.fill,
                       .tie = settings_.tie,
                       .triangle_count = static_cast<std::int64_t>(triangles().size()),
                       .techniques = settings_.techniques},
        batches_((triangles().size() + kBatch - 1) / kBatch),
        workers_(static_cast<std::size_t>(execution_->threads())),
        colours_(settings_.pixels(), "the colour buffer", settings_.pages()),
        depths_(settings_.pixels(), "the depth buffer", settings_.pages()),
        ids_(setup.keeps_ids ? settings_.pixels() : 0, "the ids") {
    if (settings_.generality == Generality::kMinimal)
      settings_.geometry.needs = analyse_needs(triangles(), make_screen_transform(camera_, kDepthFunction),
                                               settings_.geometry.near_rule)
                                     .needs;
    order_.resize(batches_.size());
    std::iota(order_.begin(), order_.end(), 0u);
    if (permutation_seed_ != 0) {  // the batches here, the triangles of each as it is taken
      Random random(permutation_seed_);
      for (std::size_t i = order_.size(); i > 1; --i) std::swap(order_[i - 1], order_[random.bits() % i]);
    }
    for (std::unique_ptr<Worker>& worker : workers_) {
      worker = std::make_unique<Worker>(tile_settings_.grid);
      worker->scratch.isa = settings_.geometry.isa;
      front_ends_.push_back(&worker->front_end);
    }
  }

  const FrameReport& draw() override {
    report_.seconds = {};
    report_.reset_tally();
    for (Batch& batch : batches_) batch = {};
    for (const auto& worker : workers_) worker->scratch.hidden_entries = 0;
    WorkCounters counters;
    bool first_round = true, last_round = false;
    while (!last_round) {
      StageSeconds seconds;
      seconds.geometry = seconds_of([&] { last_round = fill_streams(); });
      if (count_) count_streams(counters);
      execution_->reset_tally();
      seconds.raster = seconds_of([&] { draw_tiles(first_round, last_round); });
      report_.add_tally(*execution_);
      report_.seconds += seconds;
      first_round = false;
    }
    report_.counts = std::accumulate(batches_.begin(), batches_.end(), GeometryCounts{},
                                     [](GeometryCounts sum, const Batch& b) { return sum += b.counts; });
    if (count_) {
      count_rest(counters);
      report_.counters = counters;
    }
    return report_;
  }

  std::span<const std::uint32_t> colours() const override { return colours_.span(); }
  std::span<const float> depths() const override { return depths_.span(); }
  Execution* execution() override { return execution_.get(); }

  std::vector<std::int32_t> ids() const override {
    if (ids_.size() != settings_.pixels()) throw std::logic_error("fused_tiles was not asked to keep ids");
    return {ids_.data(), ids_.data() + ids_.size()};
  }

  std::vector<double> values() const override {
    return {depths_.data(), depths_.data() + depths_.size()};  // the far plane lies at 1 in both
  }

  std::size_t bytes() const override {
    std::size_t sum = colours_.bytes() + depths_.bytes() + ids_.bytes() + kept_depths_.bytes() +
                      kept_ranks_.bytes() + batches_.size() * sizeof(batches_[0]) +
                      order_.size() * sizeof(order_[0]);
    for (const auto& worker : workers_)
      sum += sizeof(Worker) + worker->front_end.bytes() + worker->scratch.bytes() +
             worker->extra.capacity() * sizeof(worker->extra[0]);
    return sum;
  }

 private:
  static constexpr std::size_t kBatch = ScreenBatch<float>::kSize;

  /// What becomes of kBatch triangles.
  struct Batch {
    GeometryCounts counts;
    std::size_t parts_done = 0;  ///< ScreenBatches of this frame that were drawn or are in the streams
    bool done = false;
  };

  struct Worker {
    explicit Worker(const TileGrid& grid) : scratch(grid) {}

    FrontEnd front_end;
    TileScratch scratch;
    ScreenBatch<float> screen;
    std::vector<ScreenTriangle<float>> extra;  ///< further pieces of clipped triangles
    bool is_full = false;                      ///< its survivors found no room in the streams
  };

  static const FrameSettings& checked(const FrameSettings& settings) {
    checked_bytes(settings.pixels(), 3 * (sizeof(std::uint32_t) + sizeof(float)),
                  fmt::format("an image of {}x{}", settings.width, settings.height));
    return settings;
  }

  std::span<const Triangle> triangles() const { return scene_.model.triangles; }

  static void permute(ScreenBatch<float>& screen, Random random) {
    const auto get = [&](std::size_t i) {
      return ScreenTriangle<float>{{screen.x[0][i], screen.x[1][i], screen.x[2][i]},
                                   {screen.y[0][i], screen.y[1][i], screen.y[2][i]},
                                   {screen.d[0][i], screen.d[1][i], screen.d[2][i]},
                                   screen.ids[i]};
    };
    for (std::size_t i = kBatch; i > 1; --i) {
      const std::size_t other = random.bits() % i;
      const auto triangle = get(i - 1);
      screen.set(i - 1, get(other));
      screen.set(other, triangle);
    }
  }

  /// Transforms batches into the streams until all are done or no room is left; whether all are.
  bool fill_streams() {
    for (const auto& worker : workers_) worker->front_end.reset(tile_settings_.grid.tiles());
    const ScreenTransform transform = make_screen_transform(camera_, kDepthFunction);
    for (;;) {
      std::atomic<bool> all_done = true;
      execution_->uniform_loop(static_cast<std::int64_t>(batches_.size()), [&](std::int64_t i, int worker) {
        if (!fill(order_[static_cast<std::size_t>(i)], transform,
                  *workers_[static_cast<std::size_t>(worker)]))
          all_done.store(false, std::memory_order_relaxed);
      });
      if (all_done) return true;
      if (!grow_streams()) return false;
    }
  }

  /// One batch; false where some of it found no room.
  bool fill(std::size_t number, const ScreenTransform& transform, Worker& worker) {
    Batch& batch = batches_[number];
    if (batch.done) return true;
    if (worker.is_full) return false;
    const std::size_t first = number * kBatch;
    worker.extra.clear();
    batch.counts = {};
    transform_triangles(triangles().subspan(first, std::min(kBatch, triangles().size() - first)),
                        static_cast<std::int32_t>(first), transform, settings_.geometry, worker.screen,
                        worker.extra, batch.counts);
    if (permutation_seed_ != 0) permute(worker.screen, Random(permutation_seed_ + number));
    if (batch.parts_done == 0 && !append(worker.screen, worker)) return false;
    batch.parts_done = std::max<std::size_t>(batch.parts_done, 1);
    for (std::size_t begin = 0, part = 1; begin < worker.extra.size(); begin += kBatch, ++part) {
      if (part < batch.parts_done) continue;
      for (std::size_t i = 0; i < kBatch; ++i)
        worker.screen.set(i, begin + i < worker.extra.size() ? worker.extra[begin + i]
                                                             : ScreenTriangle<float>{{}, {}, {}, -1});
      if (!append(worker.screen, worker)) return false;
      batch.parts_done = part + 1;
    }
    batch.done = true;
    return true;
  }

  bool append(const ScreenBatch<float>& screen, Worker& worker) {
    front_end_lanes_.select(screen, tile_settings_, worker.front_end);
    worker.is_full = !worker.front_end.has_room();
    if (!worker.is_full) front_end_lanes_.distribute(tile_settings_, worker.front_end);
    return !worker.is_full;
  }

  /// Makes room for the workers that ran out of it; false where that would exceed the budget and there is
  /// something to draw first.
  bool grow_streams() {
    bool empty = true;
    for (const auto& worker : workers_) empty = empty && worker->front_end.empty();
    const bool generous = bytes_grown(true) <= stream_budget_;
    // A batch that fits into no budget is given its room: it has to be drawn.
    const bool may_grow = generous || empty || bytes_grown(false) <= stream_budget_;
    for (const auto& worker : workers_) {
      if (may_grow && worker->is_full) worker->front_end.grow(generous);
      worker->is_full = false;
    }
    return may_grow;
  }

  /// Bytes of all streams once the workers that ran out of room have more.
  std::size_t bytes_grown(bool generous) const {
    std::size_t bytes = 0;
    for (const auto& worker : workers_) {
      bytes += worker->front_end.bytes();
      if (worker->is_full) bytes += worker->front_end.bytes_to_grow(generous);
    }
    return bytes;
  }

  void draw_tiles(bool first_round, bool last_round) {
    if (!last_round && kept_depths_.size() == 0) {
      kept_depths_ = Buffer<float>(settings_.pixels(), "what is drawn so far");
      kept_ranks_ = Buffer<std::int32_t>(settings_.pixels(), "what is drawn so far");
    }
    const TileOutput output{scene_, colours_.data(), depths_.data(), ids_.size() > 0 ? ids_.data() : nullptr};
    execution_->loop(tile_settings_.grid.tiles(), [&](std::int64_t tile, int worker) {
      draw_tile_({tile, front_ends_, kept_depths_.data(), kept_ranks_.data(), first_round, last_round},
                 tile_settings_, workers_[static_cast<std::size_t>(worker)]->scratch, output);
    });
  }

  /// Adds what is in the streams, once a round.
  void count_streams(WorkCounters& counters) const {
    const std::int64_t tiles = tile_settings_.grid.tiles();
    counters.tiles = tiles;
    std::int64_t touched = 0, entries = 0, fragments = 0;
    for (std::int64_t tile = 0; tile < tiles; ++tile) {
      std::int64_t triangles_here = 0, fragments_here = 0;
      for (const FrontEnd* front_end : front_ends_) {
        triangles_here += front_end->small_triangles.entries(tile) + front_end->triangles.entries(tile);
        fragments_here += front_end->fragments.entries(tile);
      }
      touched += triangles_here + fragments_here > 0;
      entries += triangles_here;
      fragments += fragments_here;
    }
    counters.tiles_touched = counters.tiles_touched.value_or(0) + touched;
    counters.bin_entries = counters.bin_entries.value_or(0) + entries;
    counters.binned_fragments = counters.binned_fragments.value_or(0) + fragments;
  }

  void count_rest(WorkCounters& counters) {
    ScreenTriangles<float> screen(triangles().size());
    screen.transform(triangles(), make_screen_transform(camera_, kDepthFunction), settings_.geometry,
                     *execution_);
    if (is_fixed_)
      count_boxes<Fixed8>({screen.span(), settings_, tile_settings_.triangle_count}, counters);
    else
      count_boxes<Filtered>({screen.span(), settings_, tile_settings_.triangle_count}, counters);
    if (ids_.size() > 0) count_visible(ids(), counters);
    counters.hidden_entries = 0;
    for (const auto& worker : workers_) *counters.hidden_entries += worker->scratch.hidden_entries;
    const auto bytes_of = [](std::int64_t n, std::size_t size) {
      return n * static_cast<std::int64_t>(size);
    };
    const std::int64_t streams = bytes_of(*counters.bin_entries, 10 * sizeof(std::uint32_t)) +
                                 bytes_of(*counters.binned_fragments, 3 * sizeof(std::uint32_t));
    counters.geometry_bytes = {bytes_of(tile_settings_.triangle_count, sizeof(Triangle)), streams};
    counters.raster_bytes = {
        streams + bytes_of(counters.visible_triangles.value_or(0), sizeof(Triangle)),
        bytes_of(static_cast<std::int64_t>(settings_.pixels()), sizeof(std::uint32_t) + sizeof(float))};
  }

  const Scene& scene_;
  FrameSettings settings_;
  Camera camera_;
  std::uint64_t permutation_seed_;
  std::size_t stream_budget_;
  bool count_;
  bool is_fixed_;  ///< fixed_8, else filtered
  std::unique_ptr<Execution> execution_;
  FrontEndLanes front_end_lanes_;
  DrawTile draw_tile_;
  TileSettings tile_settings_;
  std::vector<Batch> batches_;
  std::vector<std::uint32_t> order_;  ///< in which the batches are taken
  std::vector<std::unique_ptr<Worker>> workers_;
  std::vector<const FrontEnd*> front_ends_;
  Buffer<std::uint32_t> colours_;
  Buffer<float> depths_;
  Buffer<std::int32_t> ids_;
  Buffer<float> kept_depths_;
  Buffer<std::int32_t> kept_ranks_;
  FrameReport report_;
};

std::vector<Kernel::Variant> variants() {
  std::vector<Kernel::Variant> all;
  for (const ModeInfo& mode : mode_infos()) {
    if (mode.name == Fixed8::kInfo.name || mode.name == Filtered::kInfo.name)
      all.push_back({mode.name,
                     [name = mode.name](const RendererSetup& setup) {
                       return std::make_unique<FusedTiles>(setup, name);
                     },
                     {}});
    else
      all.push_back({mode.name, {}, kInfo.needs});
  }
  return all;
}

const bool kRegistered = (register_kernel(Kernel(kInfo, variants())), true);

}  // namespace
}  // namespace rasterbench
