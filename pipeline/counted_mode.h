// Counting what kernels ask of a numeric mode, without a line of it in the kernels: a counted frame runs the
// same strategy in the mode Counted<Mode>.
#pragma once

#include <concepts>
#include <cstdint>
#include <vector>

#include "execution/execution.h"
#include "numeric/modes.h"

namespace rasterbench {

/// What one worker asked of a mode. Padded: each worker writes its own.
struct alignas(64) ModeCalls {
  std::int64_t set_ups = 0;  ///< triangles
  std::int64_t entries = 0;  ///< triangles of the bins that were gone through
  std::int64_t samples = 0;  ///< whole coverage tests, inside() and covers()
  std::int64_t edges = 0;    ///< tests of single edges
  std::int64_t keys = 0;     ///< fragments that were given a depth and a key
};

/// Where the thread that runs an iteration of a counted loop counts: modes are static functions, so that
/// nothing else can tell them. Set around every iteration by CountingExecution.
inline constinit thread_local ModeCalls* calls_of_this_thread = nullptr;

/// `Mode` with the same bits, counting the calls of kernels. Calls of a mode to itself are not counted.
template <NumericMode Mode>
requires(!RunMode<Mode>)  // runs of pixels would have to be counted as well
    struct Counted : Mode {
  using Prepared = typename Mode::Prepared;
  using Uncounted = Mode;

  template <class... Arguments>
  static Prepared prepare(const Arguments&... arguments) {
    if (calls_of_this_thread) ++calls_of_this_thread->set_ups;  // null: asked for outside of a loop
    return Mode::prepare(arguments...);
  }
  /// The box before the edges: the whole of it is one test.
  static bool covers(const Prepared& prepared, std::int32_t x, std::int32_t y) {
    ++calls_of_this_thread->samples;
    return rasterbench::covers<Mode>(prepared, x, y);
  }
  static bool inside(const Prepared& prepared, std::int32_t x, std::int32_t y) {
    ++calls_of_this_thread->samples;
    return Mode::inside(prepared, x, y);
  }
  static bool inside_edge(const Prepared& prepared, int e, std::int32_t x, std::int32_t y) {
    ++calls_of_this_thread->edges;
    return Mode::inside_edge(prepared, e, x, y);
  }
  template <class Depth>
  static typename Mode::Key key(Depth depth, std::uint32_t rank) {
    ++calls_of_this_thread->keys;
    return Mode::key(depth, rank);
  }
};

template <class Mode>
concept CountingMode = NumericMode<Mode> && requires {
  typename Mode::Uncounted;
};

/// The modes whose calls are counted: one of each kind of edge arithmetic. Each costs another compilation of
/// every kernel.
template <class Mode>
concept CountableMode = std::same_as<Mode, F32> || std::same_as<Mode, Fixed8> || std::same_as<Mode, Filtered>;

/// Runs the loops of another execution, with each iteration counting into the slot of its worker.
class CountingExecution final : public Execution {
 public:
  /// `inner` must outlive this. What the calling thread does between loops is counted with worker 0.
  explicit CountingExecution(Execution& inner)
      : Execution(inner.config()), inner_(inner), calls_(static_cast<std::size_t>(inner.threads())) {
    calls_of_this_thread = calls_.data();
  }
  ~CountingExecution() override { calls_of_this_thread = nullptr; }

  void run_loop(std::int64_t n, LoopBody body) override {
    inner_.loop(n, [&](std::int64_t i, int worker) { run(i, worker, body); });
    calls_of_this_thread = calls_.data();
  }
  void uniform_loop(std::int64_t n, LoopBody body) override {
    inner_.uniform_loop(n, [&](std::int64_t i, int worker) { run(i, worker, body); });
    calls_of_this_thread = calls_.data();
  }

  /// Of each worker, since this was made.
  const std::vector<ModeCalls>& calls() const { return calls_; }

 private:
  void run(std::int64_t i, int worker, LoopBody& body) {
    calls_of_this_thread = &calls_[static_cast<std::size_t>(worker)];
    body(i, worker);
    calls_of_this_thread = nullptr;
  }

  Execution& inner_;
  std::vector<ModeCalls> calls_;
};

}  // namespace rasterbench
