#include "machine/cost_ladder.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <memory>

#include "base/buffer.h"
#include "base/error.h"
#include "kernels/fragments.h"
#include "machine/loops.h"
#include "machine/team.h"
#include "pipeline/counted_mode.h"
#include "pipeline/resolve.h"

namespace rasterbench {
namespace {

/// The steps of a frame, in its order.
enum class Step { kRead, kTransform, kReject, kClip, kSetUp, kBox, kCoverage, kKey, kKeep, kShade };
constexpr int kSteps = static_cast<int>(Step::kShade) + 1;

// 4.5 KiB of triangles: whole blocks of sum_words(), and with what is made of them it stays in a core's
// caches.
constexpr std::size_t kBatch = 128;
static_assert(kBatch * sizeof(Triangle) % (kBlockWords * sizeof(std::uint64_t)) == 0);

std::string test_names(const SceneNeeds& needs) {
  std::string names;
  const auto add = [&](bool needed, const char* name) {
    if (needed) names += (names.empty() ? "" : ", ") + std::string(name);
  };
  add(needs.finite_test, "finite");
  add(needs.zero_area_test, "zero area");
  add(needs.behind_reject, "behind the camera");
  add(needs.far_reject, "beyond far");
  add(needs.off_screen_reject, "off screen");
  return names;
}

template <NumericMode Mode>
class Ladder {
 public:
  Ladder(const Scene& scene, const FrameSettings& settings, int threads)
      : scene_(scene),
        settings_(settings),
        camera_(sized_camera(scene, settings)),
        transform_(make_screen_transform(camera_, Mode::kDepthFunction)),
        team_(threads),
        workers_(static_cast<std::size_t>(threads)),
        count_(scene.model.triangles.size()),
        batches_((count_ + kBatch - 1) / kBatch),
        triangles_(batches_ * kBatch, "the triangles of the cost ladder"),
        keys_(settings.pixels(), "the visibility buffer"),
        colours_(settings.pixels(), "the colour buffer"),
        depths_(settings.pixels(), "the depth buffer") {
    if (settings_.generality == Generality::kMinimal)
      settings_.geometry.needs =
          analyse_needs(scene_.model.triangles, transform_, settings_.geometry.near_rule).needs;
    parallel(static_cast<std::int64_t>(batches_), [&](std::int64_t batch, Worker&) {
      const std::size_t first = static_cast<std::size_t>(batch) * kBatch;
      std::copy_n(scene_.model.triangles.begin() + static_cast<std::ptrdiff_t>(first), size_of(first),
                  triangles_.data() + first);
    });
  }

  /// Seconds of the front part up to `last`.
  double climb(Step last) {
    for (Worker& worker : workers_) worker.results = 0;
    double seconds = 0;
    if (last >= Step::kKeep)
      seconds += parallel(settings_.height, [&](std::int64_t y, Worker&) {
        std::fill_n(visibility().row(y), settings_.width, Mode::kClear);
      });
    seconds += parallel(static_cast<std::int64_t>(batches_), [&](std::int64_t batch, Worker& worker) {
      run(last, static_cast<std::size_t>(batch) * kBatch, worker);
    });
    if (last == Step::kShade)
      seconds += parallel(settings_.height, [&](std::int64_t y, Worker&) {
        resolve_row<Mode>(visibility().row(y), settings_.width, scene_, settings_.tie,
                          depth_map(camera_, Mode::kDepthFunction), settings_.geometry.isa,
                          colours_.data() + y * settings_.width, depths_.data() + y * settings_.width);
      });
    return seconds;
  }

  /// What the last climb() up to `step` handed on.
  std::int64_t results(Step step) const {
    if (step == Step::kRead) return static_cast<std::int64_t>(count_);
    if (step == Step::kShade) return static_cast<std::int64_t>(settings_.pixels());
    std::int64_t sum = 0;
    for (const Worker& worker : workers_) sum += worker.results;
    return sum;
  }

  Rung describe(Step step) const {
    const SceneNeeds& needs = settings_.geometry.needs;
    switch (step) {
      case Step::kRead:
        return {"read", "the world triangles are read and added up", "triangles"};
      case Step::kTransform:
        return {"transform",
                fmt::format("view, projection and viewport of every corner ({}), no test",
                            to_string(settings_.geometry.isa)),
                "triangles"};
      case Step::kReject: {
        const std::string names = test_names(needs);
        return {"reject",
                names.empty() ? "no test: this scene needs none" : "tests that this scene needs: " + names,
                "triangles"};
      }
      case Step::kClip:
        return {"clip",
                needs.near_clip && needs.guard_clip ? "at the near plane and the guard band"
                : needs.near_clip                   ? "at the near plane"
                : needs.guard_clip                  ? "at the guard band"
                                                    : "nothing: no plane cuts a triangle of this scene",
                "screen triangles"};
      case Step::kSetUp:
        return {"set-up", "corners ordered (and snapped), edges, depth plane, box; one at a time",
                "screen triangles"};
      case Step::kBox:
        return {"box", "those whose box has no sample of the image are left out", "screen triangles"};
      case Step::kCoverage:
        return {"coverage", "the edge tests of every sample of a box", "samples inside"};
      case Step::kKey:
        return {"key", "depth and key of every sample inside", "keys"};
      case Step::kKeep:
        return {"keep", "the visibility buffer is cleared; atomic minimum of the keys", "keys"};
      case Step::kShade:
        return {"shade", "resolve: colours and depths from the visibility buffer", "pixels"};
    }
    return {};
  }

 private:
  /// What one thread has for itself; padded.
  struct alignas(64) Worker {
    std::vector<ScreenTriangle<typename Mode::Real>> slots, pieces;
    std::vector<typename Mode::Prepared> prepared;
    GeometryCounts counts;
    std::int64_t results = 0;
    std::uint64_t sum = 0;  // so that what is computed is used
  };

  Visibility<Mode> visibility() { return {keys_.span(), settings_.width}; }
  std::size_t size_of(std::size_t first) const { return std::min(kBatch, count_ - first); }

  template <class Body>
  double parallel(std::int64_t n, Body body) {
    std::atomic<std::int64_t> next{0};
    return team_.run([&](int thread) {
      Worker& worker = workers_[static_cast<std::size_t>(thread)];
      for (std::int64_t i = next++; i < n; i = next++) body(i, worker);
    });
  }

  /// The tests and cuts that the geometry stage makes up to `last`.
  GeometryOptions geometry_up_to(Step last) const {
    GeometryOptions options = settings_.geometry;
    if (last < Step::kReject) {
      options.cull_back_faces = false;
      options.needs = {.finite_test = false,
                       .zero_area_test = false,
                       .behind_reject = false,
                       .far_reject = false,
                       .off_screen_reject = false};
    }
    if (last < Step::kClip) options.needs.near_clip = options.needs.guard_clip = false;
    return options;
  }

  void run(Step last, std::size_t first, Worker& w) {
    const std::size_t n = size_of(first);
    if (last == Step::kRead) {
      w.sum += sum_words(reinterpret_cast<const std::uint64_t*>(triangles_.data() + first),
                         kBatch * sizeof(Triangle) / sizeof(std::uint64_t));
      return;
    }
    w.slots.resize(kBatch);
    w.pieces.clear();
    w.counts = {};
    transform_triangles<typename Mode::Real>(triangles_.span().subspan(first, n),
                                             static_cast<std::int32_t>(first), transform_,
                                             geometry_up_to(last), w.slots.data(), w.pieces, w.counts);
    if (last <= Step::kClip) {
      w.results += last == Step::kClip ? w.counts.pieces : w.counts.drawn;
      return;
    }
    w.prepared.clear();
    for (std::size_t i = 0; i < n; ++i) prepare(w.slots[i], w);
    for (const auto& piece : w.pieces) prepare(piece, w);
    if (last == Step::kSetUp) {
      w.results += static_cast<std::int64_t>(w.prepared.size());
      return;
    }
    for (const auto& prepared : w.prepared) draw(last, prepared, w);
  }

  void prepare(const ScreenTriangle<typename Mode::Real>& triangle, Worker& w) {
    if (triangle.id < 0) return;
    w.prepared.push_back(Mode::prepare(triangle, settings_.grid(),
                                       swap_rank(settings_.tie, static_cast<std::int64_t>(count_),
                                                 static_cast<std::uint32_t>(triangle.id))));
  }

  void draw(Step last, const typename Mode::Prepared& prepared, Worker& w) {
    const PixelBox box = intersect(prepared.box, settings_.bounds());
    if (box.empty()) return;
    std::int64_t results = 0;
    std::uint64_t sum = 0;
    if (last == Step::kBox) {
      ++results;
    } else if (last == Step::kCoverage) {
      for (std::int32_t y = box.y0; y < box.y1; ++y)
        for (std::int32_t x = box.x0; x < box.x1; ++x) results += Mode::inside(prepared, x, y);
    } else if (last == Step::kKey) {
      for_each_fragment<Mode>(prepared, box, [&](auto, auto, std::uint64_t key) {
        sum += key;
        ++results;
      });
    } else {
      Visibility<Mode> out = visibility();
      for_each_fragment<Mode>(prepared, box, [&](auto x, auto y, std::uint64_t key) {
        std::atomic_ref<std::uint64_t> pixel(out.at(x, y));
        std::uint64_t seen = pixel.load(std::memory_order_relaxed);
        while (key < seen && !pixel.compare_exchange_weak(seen, key, std::memory_order_relaxed)) {
        }
        ++results;
      });
    }
    w.results += results;
    w.sum += sum;
  }

  const Scene& scene_;
  FrameSettings settings_;
  Camera camera_;
  ScreenTransform transform_;
  Team team_;
  std::vector<Worker> workers_;
  std::size_t count_, batches_;
  Buffer<Triangle> triangles_;  // in whole batches, aligned for sum_words()
  Buffer<std::uint64_t> keys_;
  Buffer<std::uint32_t> colours_;
  Buffer<float> depths_;
};

template <NumericMode Mode>
CostLadder measure(const Scene& scene, const FrameSettings& settings, int threads, int repetitions,
                   FunctionRef<void(int)> progress) {
  Ladder<Mode> ladder(scene, settings, threads);
  CostLadder result{.threads = threads, .mode = std::string(Mode::kInfo.name), .rungs = {}};
  for (int step = 0; step < kSteps; ++step) result.rungs.push_back(ladder.describe(static_cast<Step>(step)));
  for (int repetition = -1; repetition < repetitions; ++repetition) {
    for (int step = 0; step < kSteps; ++step) {
      Rung& rung = result.rungs[static_cast<std::size_t>(step)];
      const double seconds = ladder.climb(static_cast<Step>(step));
      if (repetition < 0)
        rung.results = ladder.results(static_cast<Step>(step));
      else
        rung.seconds.push_back(seconds);
    }
    progress(repetition + 1);
  }
  return result;
}

}  // namespace

std::vector<std::string_view> cost_ladder_modes() {
  std::vector<std::string_view> names;
  for_each_mode([&]<NumericMode Mode>() {
    if constexpr (CountableMode<Mode>) names.push_back(Mode::kInfo.name);
  });
  return names;
}

CostLadder measure_cost_ladder(const Scene& scene, std::string_view mode, const FrameSettings& settings,
                               int threads, int repetitions, FunctionRef<void(int done)> progress) {
  if (scene.model.triangles.empty())
    throw InputError({.file = scene.model.name}, "has no triangles for a cost ladder");
  std::optional<CostLadder> ladder;
  for_each_mode([&]<NumericMode Mode>() {
    if constexpr (CountableMode<Mode>)
      if (Mode::kInfo.name == mode) ladder = measure<Mode>(scene, settings, threads, repetitions, progress);
  });
  if (!ladder)
    throw InputError({.field = "numeric"}, fmt::format("no cost ladder in mode {}, but in {}", mode,
                                                       fmt::join(cost_ladder_modes(), ", ")));
  return *ladder;
}

}  // namespace rasterbench
