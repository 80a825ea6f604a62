// The loop under study of a point, iteration by iteration: how it was dealt in a traced frame, what each of
// its iterations costs, and what handing out a chunk costs. None of it is taken in a frame that is a sample.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "execution/loop_trace.h"
#include "harness/point.h"

namespace rasterbench {

/// What an iteration of a point's loop draws.
struct LoopShape {
  std::string unit;           ///< "row", "tile", "triangle" or "pixel"
  int width = 0, height = 0;  ///< of the pixels that an iteration owns; 0: it owns none
  int columns = 1;            ///< iterations beside each other, where it owns pixels
};
LoopShape loop_shape(const Point& point);

/// One traced frame: of several the one whose loop took the median time.
struct TracedFrame {
  std::vector<TracedLoop> loops;
  std::vector<std::vector<TracedChunk>> chunks;  ///< by worker
  double begin = 0;                              ///< of the frame: seconds of LoopTrace::now()
  double seconds = 0;
  double untraced_seconds = 0;  ///< median of as many frames without stamps
};

/// Traces `frames` (>= 1) frames of `point`, after an untimed one. Throws InputError where the kernel does
/// not suit the mode, Error where its threads do not run or the kernel has no loop.
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

/// What a schedule costs in a loop whose iterations do nothing.
struct ScheduleCost {
  double start_seconds = 0;  ///< of a loop with one chunk for each thread: to start it and to wait for all
  /// That a thread spends on a further chunk, while all others do the same: beyond what the iterations take
  /// under the backend's static schedule. 0 where more iterations do not make more chunks, so that all their
  /// cost is in start_seconds.
  double chunk_seconds = 0;
};

/// By to_string(ExecutionConfig): every schedule of this build that has threads, with its own chunk and with
/// 1 and 16. Takes about a second.
std::map<std::string, ScheduleCost> measure_schedules(int threads);

/// trace.json and costs.json: harness/records.md.
std::string trace_text(const Point& point, const LoopShape& shape, const TracedFrame& frame,
                       const Json& image);
std::string costs_text(const Point& point, const LoopShape& shape, const LoopCosts& costs,
                       const std::map<std::string, ScheduleCost>& schedules);

}  // namespace rasterbench
