// How a loop was dealt: its chunks, or what each of its iterations costs. For frames that are traced: stamps
// around every iteration cost more than a short iteration does, so that no such frame is a sample.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "execution/execution.h"

namespace rasterbench {

/// Iterations first .. last of loop `loop`, which one worker ran one after the other.
struct TracedChunk {
  std::int64_t loop = 0;  ///< of this frame, from 0
  std::int64_t first = 0, last = 0;
  double begin = 0, end = 0;  ///< seconds of LoopTrace::now()
};

/// One call of Execution::loop().
struct TracedLoop {
  std::int64_t iterations = 0;
  double begin = 0, end = 0;  ///< seconds of LoopTrace::now()
};

/// Takes down what Execution::loop() does, for an Execution whose config has it as `trace`. uniform_loop() is
/// not traced.
///
/// A chunk is what the runtime handed out at once, as far as that can be seen. oneTBB passes each range to
/// the body. OpenMP does not say: a chunk is a run of consecutive iterations of one thread, cut where the
/// schedule's rule begins a chunk: at the multiples of its size (dynamic, static with a chunk), and under
/// guided where libgomp does. Where the rule is not known (guided of another runtime) two chunks in a row
/// that follow each other are seen as one; static without a chunk, which auto of libgomp is, has one a
/// thread.
class LoopTrace {
 public:
  enum class Detail {
    kLoops,   ///< begin and end of each loop: nothing within it, so that it takes as long as an untraced one
    kChunks,  ///< and its chunks
    kIterations,  ///< and the seconds of each iteration in place of chunks
  };
  explicit LoopTrace(Detail detail) : detail_(detail) {}

  Detail detail() const { return detail_; }
  /// Forgets what was taken down.
  void clear();

  const std::vector<TracedLoop>& loops() const { return loops_; }
  /// By worker, each in the order in which it ran them.
  std::vector<std::vector<TracedChunk>> chunks() const;
  /// Seconds of each iteration, its stamps included; summed over the loops of the frame, which must be of one
  /// length: whether they are is `loops_alike()`.
  const std::vector<double>& iteration_seconds() const { return iteration_seconds_; }
  bool loops_alike() const;

  /// What the Execution calls: around a loop, around every iteration in it, and, where it knows, before the
  /// first iteration of a chunk.
  void begin_loop(std::int64_t n, int workers);
  void end_loop();
  void add(int worker, std::int64_t iteration, double begin, double end);
  void begin_chunk(int worker);

  /// Where chunks are known to begin: at the multiples of this many iterations (0: not known), or at each of
  /// the iterations in `begins`, which are in order and those of the next loop.
  void cut_at_multiples(std::int64_t chunk) { multiple_ = chunk; }
  void cut_at(std::vector<std::int64_t> begins) { begins_ = std::move(begins); }

  /// Seconds of a monotonic clock.
  static double now();
  /// Seconds that a pair of stamps adds to what lies between them: the median of many empty pairs.
  static double stamp_seconds();

 private:
  struct alignas(64) Worker {
    std::vector<TracedChunk> chunks;
    bool cut = true;  // the next iteration begins a chunk
  };

  Detail detail_;
  std::int64_t multiple_ = 0;
  std::vector<std::int64_t> begins_;
  std::vector<TracedLoop> loops_;
  std::vector<Worker> workers_;
  std::vector<double> iteration_seconds_;
};

/// Where the chunks of a loop of `n` iterations begin under libgomp's schedule(guided, chunk): each is the
/// number of iterations that are left over the threads, rounded up, and not below `chunk`
/// (gomp_iter_guided_next, libgomp/iter.c of gcc 12). The same whichever thread takes which.
std::vector<std::int64_t> libgomp_guided_begins(std::int64_t n, int threads, std::int64_t chunk);

/// `inner` with its loops taken down in inner->config().trace. Made by make_execution().
std::unique_ptr<Execution> make_traced(std::unique_ptr<Execution> inner);

}  // namespace rasterbench
