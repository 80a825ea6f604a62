// A frame: world triangles in memory -> RGBA8 + float32 depth in memory, in stages, around one kernel.
//
//   clear     every key of the visibility buffer            (rows)
//   geometry  world triangles -> screen triangles           (batches of triangles)
//   raster    screen triangles -> visibility buffer         (the kernel; the loop under study)
//   resolve   visibility buffer -> colours and depths       (rows)
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/buffer.h"
#include "execution/execution.h"
#include "numeric/mode.h"
#include "pipeline/counters.h"
#include "pipeline/geometry.h"
#include "pipeline/needs.h"
#include "pipeline/techniques.h"
#include "scene/scene.h"

namespace rasterbench {

/// Everything that the picture depends on besides the scene and the numeric mode.
struct FrameSettings {
  int width = 0;
  int height = 0;
  FillRule fill = FillRule::kClosed;
  TieRule tie = TieRule::kFirst;
  GeometryOptions geometry = {};
  int tile = 64;  ///< side of the tiles in pixels, for the kernels that have tiles; never changes the picture
  /// kMinimal: the renderer sets geometry.needs from the scene; kFull: geometry.needs is taken as it is.
  Generality generality = Generality::kMinimal;
  Techniques techniques = {};  ///< never change the picture

  PixelBox bounds() const { return {0, 0, width, height}; }
  SampleGrid grid() const { return {fill, width, height}; }
  Pages pages() const { return techniques.huge_pages ? Pages::kHuge : Pages::kSmall; }
  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};

/// rank and id: each is the other's image under the same bijection.
inline std::uint32_t swap_rank(TieRule tie, std::int64_t triangle_count, std::uint32_t rank_or_id) {
  return tie == TieRule::kFirst ? rank_or_id : static_cast<std::uint32_t>(triangle_count - 1 - rank_or_id);
}

/// What a staged kernel is given: the screen triangles, of which those with id < 0 draw nothing.
template <NumericMode Mode>
struct StagedTriangles {
  std::span<const ScreenTriangle<typename Mode::Real>> triangles;
  const FrameSettings& settings;
  std::int64_t triangle_count;  ///< of the scene: ids are below it

  std::int64_t size() const { return static_cast<std::int64_t>(triangles.size()); }

  /// Set-up of triangle i; its box is empty where it draws nothing and lies within the image otherwise.
  typename Mode::Prepared prepare(std::int64_t i) const {
    const auto& triangle = triangles[static_cast<std::size_t>(i)];
    if (triangle.id < 0) return {};
    auto prepared =
        Mode::prepare(triangle, settings.grid(),
                      swap_rank(settings.tie, triangle_count, static_cast<std::uint32_t>(triangle.id)));
    prepared.box = intersect(prepared.box, settings.bounds());
    return prepared;
  }
};

/// The visibility buffer: per pixel the smallest key so far; row 0 on top.
template <NumericMode Mode>
struct Visibility {
  std::span<typename Mode::Key> keys;
  int width;

  typename Mode::Key* row(std::int64_t y) { return keys.data() + y * width; }
  typename Mode::Key& at(std::int64_t x, std::int64_t y) { return row(y)[x]; }
};

/// Seconds per stage; empty where a kernel has no such stage, because another one does its work.
struct StageSeconds {
  std::optional<double> clear, geometry, raster, resolve;
  double total() const {
    return clear.value_or(0) + geometry.value_or(0) + raster.value_or(0) + resolve.value_or(0);
  }

  /// Adds stage by stage; what is empty in `other` stays as it is.
  StageSeconds& operator+=(const StageSeconds& other) {
    for (auto stage :
         {&StageSeconds::clear, &StageSeconds::geometry, &StageSeconds::raster, &StageSeconds::resolve})
      if (other.*stage) this->*stage = (this->*stage).value_or(0) + *(other.*stage);
    return *this;
  }
};

/// Seconds that `stage()` takes.
template <class Stage>
double seconds_of(Stage stage) {
  const auto begin = std::chrono::steady_clock::now();
  stage();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Empty where either is.
inline std::optional<double> sum_of_known(std::optional<double> a, std::optional<double> b) {
  return a && b ? std::optional(*a + *b) : std::nullopt;
}

/// What one frame did, besides its picture.
struct FrameReport {
  StageSeconds seconds;
  GeometryCounts counts;
  std::vector<WorkerTally> raster_tally;  ///< per worker, of the raster stage
  /// Of the raster stage, in the loop under study; empty where Execution::loop_seconds() is.
  std::optional<double> loop_seconds = 0.0;
  WorkCounters counters;  ///< of a renderer that counts; empty otherwise

  void reset_tally() {
    raster_tally.clear();
    loop_seconds = 0.0;
  }
  /// Adds what `execution` has tallied since its last reset, which was the begin of a raster stage.
  void add_tally(const Execution& execution) {
    raster_tally.resize(execution.tally().size());
    for (std::size_t worker = 0; worker < raster_tally.size(); ++worker)
      raster_tally[worker] += execution.tally()[worker];
    loop_seconds = sum_of_known(loop_seconds, execution.loop_seconds());
  }
};

/// Draws frames of one point: one scene, kernel, numeric mode and execution. Owns every buffer of the point
/// (Invariant 4).
class Renderer {
 public:
  virtual ~Renderer() = default;

  /// Draws one frame; the picture stays valid until the next one.
  virtual const FrameReport& draw() = 0;

  /// RGBA8 (red in the lowest byte, alpha 255) and depth (1 = background), row 0 on top.
  virtual std::span<const std::uint32_t> colours() const = 0;
  virtual std::span<const float> depths() const = 0;

  /// Ids of the visible triangles of the last frame, -1 = background: read back from the keys, outside the
  /// timed frame.
  virtual std::vector<std::int32_t> ids() const = 0;

  /// Depth values of the last frame as the mode stores them, of its depth function, far_value() where there
  /// is no triangle: more than depths() can say where the format is not float32 d. Read back like ids().
  virtual std::vector<double> values() const = 0;

  /// Bytes of all buffers of the point.
  virtual std::size_t bytes() const = 0;

  /// What runs its loops; null where another program draws.
  virtual Execution* execution() { return nullptr; }
};

/// What a renderer is made of. The scene must outlive it.
struct RendererSetup {
  const Scene* scene;
  FrameSettings settings;
  ExecutionConfig execution;
  /// Not 0: the screen triangles reach the kernel in a random order of this seed. For verification: the
  /// picture must not care.
  std::uint64_t permutation_seed = 0;
  /// Whether Renderer::ids() will be asked for: a kernel that has them nowhere else then writes them.
  bool keeps_ids = true;
  /// Bytes that a kernel which bins may fill before it draws what it has binned.
  std::size_t stream_budget = std::size_t{1} << 30;
  /// Fills FrameReport::counters. The picture is the same; the times are not those of a frame.
  bool count = false;
};

/// The camera of `scene` for an image of the size in `settings`.
inline Camera sized_camera(const Scene& scene, const FrameSettings& settings) {
  SceneParameters parameters = scene.parameters;
  parameters.width = settings.width;
  parameters.height = settings.height;
  return make_camera(parameters);
}

}  // namespace rasterbench
