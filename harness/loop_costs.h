// The loop under study of a point, iteration by iteration: how it was dealt in a traced frame, what each of
// its iterations costs, and what handing out a chunk costs. None of it is taken in a frame that is a sample.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "execution/loop_trace.h"
#include "harness/point.h"
#include "harness/schedule_costs.h"

namespace rasterbench {

/// What an iteration of a point's loop draws.
struct LoopShape {
  std::string unit;           ///< "row", "tile", "triangle" or "pixel"
  int width = 0, height = 0;  ///< of the pixels that an iteration owns; 0: it owns none
  int columns = 1;            ///< iterations beside each other, where it owns pixels
};
LoopShape loop_shape(const Point& point);

/// One traced frame.
struct TracedFrame {
  std::vector<TracedLoop> loops;
  std::vector<std::vector<TracedChunk>> chunks;  ///< by worker
  double begin = 0;                              ///< of the frame: seconds of LoopTrace::now()
  double seconds = 0;
  double untraced_seconds = 0;  ///< median of as many frames without stamps
};

/// Of any number of frames the one whose loop takes the median time, in bounded memory: kept are the few that
/// are nearest to the median so far. Exact up to kMostFrames frames whose chunks take at most kMostBytes;
/// beyond, the nearest to the median of those that were kept.
class FramesNearMedian {
 public:
  static constexpr std::size_t kMostFrames = 11;
  static constexpr std::size_t kMostBytes = std::size_t{256} << 20;

  void add(TracedFrame frame);
  /// Precondition: a frame was added.
  TracedFrame take();
  std::size_t kept() const { return kept_.size(); }

 private:
  std::vector<double> seconds_;  // in loops, of every frame
  std::vector<TracedFrame> kept_;
  std::size_t bytes_ = 0;  // of the chunks in kept_
};

/// Traces `frames` (>= 1) frames of `point`, after untimed ones, and returns that of FramesNearMedian. Throws
/// InputError where the kernel does not suit the mode or has too many loops for a trace, Error where its
/// threads do not run, the kernel has no loop, or its chunks do not fit in memory.
TracedFrame trace_frames(const Point& point, const Scene& scene, int frames);

/// What the iterations cost on one thread.
struct LoopCosts {
  /// Seconds of each iteration: the median over the frames, without what the stamps add; 0 where that is
  /// more than the iteration took.
  std::vector<double> seconds;
  double stamp_seconds = 0;            ///< of an iteration
  double serial_loop_seconds = 0;      ///< median time of the loop without stamps
  std::vector<std::uint32_t> colours;  ///< of the picture
};

/// Measures them in `frames` serial frames of `point`, after an untimed one. Throws InputError where a frame
/// has loops of several lengths, so that an iteration has no place in the picture.
LoopCosts measure_loop_costs(const Point& point, const Scene& scene, int frames);

/// trace.json and costs.json: harness/records.md.
std::string trace_text(const Point& point, const LoopShape& shape, const TracedFrame& frame,
                       const Json& image);
std::string costs_text(const Point& point, const std::string& scene_hash, const LoopShape& shape,
                       const LoopCosts& costs, const ScheduleCosts& schedules);

}  // namespace rasterbench
