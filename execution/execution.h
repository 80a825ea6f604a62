// An execution: how the iterations of a loop are dealt to threads. Backend + schedule (or partitioner) +
// chunk (or grain) + threads, all chosen at run time; the loop body is the same code under every one of them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/function_ref.h"
#include "execution/contention.h"

namespace rasterbench {

class LoopTrace;

/// What to run a loop with. `chunk` empty: the runtime's own default.
struct ExecutionConfig {
  std::string backend = "serial";
  std::string schedule;  ///< empty for serial
  std::optional<int> chunk;
  int threads = 1;
  /// Records how Execution::loop() deals its iterations (loop_trace.h); null in every frame that is a sample.
  LoopTrace* trace = nullptr;
};

/// "serial", "openmp:static", "openmp:dynamic,16", "tbb:auto".
std::string to_string(const ExecutionConfig& config);

/// One iteration of a loop, run by one of the workers 0 .. threads-1. Must not throw.
using LoopBody = FunctionRef<void(std::int64_t iteration, int worker)>;

/// What one worker did since the last reset. Padded: each worker writes its own.
struct alignas(64) WorkerTally {
  std::int64_t iterations = 0;
  /// Times that the runtime handed it iterations. Where OpenMP does not tell (guided, auto) runs of
  /// consecutive iterations, of which two that follow each other count once.
  std::int64_t chunks = 0;
  double busy_seconds = 0;  ///< between its first and last stamp in each loop
  int cpu = -1;             ///< where it ran last
  Contention contention;

  WorkerTally& operator+=(const WorkerTally& other) {
    iterations += other.iterations;
    chunks += other.chunks;
    busy_seconds += other.busy_seconds;
    contention += other.contention;
    if (other.cpu >= 0) cpu = other.cpu;
    return *this;
  }
};

/// The CPUs on which one worker was seen, at the begin and the end of the loops since the last reset. Padded:
/// each worker writes its own.
struct alignas(64) Sightings {
  int first = -1;          ///< CPU of the first sighting; -1: never seen
  int last = -1;           ///< and of the last one
  std::int64_t moves = 0;  ///< times that it was seen on another CPU than the time before
  std::vector<int> cpus;   ///< each CPU once, in the order of their first sightings

  /// Notes the CPU that the calling thread runs on. Allocates only where the thread has moved.
  void look();
};

/// Runs loops. One object belongs to one point: what a runtime learns in one frame (an affinity) never
/// reaches another.
class Execution {
 public:
  explicit Execution(const ExecutionConfig& config);
  virtual ~Execution() = default;
  Execution(const Execution&) = delete;
  Execution& operator=(const Execution&) = delete;

  const ExecutionConfig& config() const { return config_; }
  int threads() const { return config_.threads; }

  /// The loop under study: iterations 0 .. n-1 under the configured schedule. Returns when all are done.
  void loop(std::int64_t n, LoopBody body);

  /// Loops that every strategy shares (clear, geometry, binning, resolve): the same backend and threads,
  /// dealt evenly, so that a schedule under study changes the loop under study only.
  virtual void uniform_loop(std::int64_t n, LoopBody body) = 0;

  std::span<const WorkerTally> tally() const { return tally_; }
  /// Seconds that loop() took since the last reset, from its call to its return: with start and join. Empty
  /// after more than kTimedLoops calls, which are so short that two more stamps would show, and without
  /// stamps.
  std::optional<double> loop_seconds() const;
  static constexpr int kTimedLoops = 64;
  /// Where the body of a loop counts what held its worker up.
  Contention& contention_of(int worker) { return tally_of(worker).contention; }
  void reset_tally();

  /// Where each worker was seen. Apart from the tally, which a frame resets before its raster stage: a sample
  /// may have many frames, and all of their loops.
  std::span<const Sightings> sightings() const { return sightings_; }
  void reset_sightings();

 protected:
  virtual void run_loop(std::int64_t n, LoopBody body) = 0;

  WorkerTally& tally_of(int worker) { return tally_[static_cast<std::size_t>(worker)]; }
  Sightings& sightings_of(int worker) { return sightings_[static_cast<std::size_t>(worker)]; }
  /// Whether loops are stamped and counted: always, but where RASTERBENCH_NO_STAMPS is set in the environment
  /// to measure what that costs. Tallies then stay empty.
  bool is_stamped() const { return stamped_; }

 private:
  ExecutionConfig config_;
  bool stamped_;
  std::vector<WorkerTally> tally_;
  double loop_seconds_ = 0;
  std::int64_t loops_ = 0;  // since the last reset
  std::vector<Sightings> sightings_;
};

/// Which threads really run: measured by a loop whose iterations wait for each other.
struct ObservedThreads {
  int count = 0;
  std::vector<int> cpus;           ///< CPU of each observed worker
  bool denormals_flushed = false;  ///< some worker has FTZ or DAZ set in MXCSR: the modes' bits would change
};
ObservedThreads observe_threads(Execution& execution);

/// A schedule of a backend: registered beside its function, in its own file (adding one is adding one file).
struct Schedule {
  std::string backend;
  std::string name;     ///< empty for serial
  std::string meaning;  ///< one line
  std::string chunk;    ///< what its chunk means, or empty if it takes none
  std::function<std::unique_ptr<Execution>(const ExecutionConfig&)> make;
};

/// Every schedule of this build, in the order of registration.
std::span<const Schedule> schedules();

/// Names of the backends of this build.
std::vector<std::string> backends();

/// Backends that a build can be made without (oneTBB was not found): asking for one is a visible skip, not an
/// error.
bool is_left_out(const std::string& backend);

/// Throws InputError (with a did-you-mean) unless this build can run `config`.
const Schedule& find_schedule(const ExecutionConfig& config);

std::unique_ptr<Execution> make_execution(const ExecutionConfig& config);

/// Puts a schedule into the list; used by a namespace-scope constant in the schedule's file.
struct ScheduleRegistration {
  explicit ScheduleRegistration(Schedule schedule);
};

/// CPUs that this process may run on (its affinity mask when it started, before any binding of threads).
int available_cpus();

/// Threads to use where nobody says how many: all CPUs, or what OMP_NUM_THREADS says if that is fewer.
int default_threads();

/// Name of the OpenMP runtime that runs this program's loops: "libgomp", "libomp" or "unknown".
std::string openmp_runtime();

}  // namespace rasterbench
