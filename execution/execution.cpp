#include "execution/execution.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <omp.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <set>
#include <thread>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#include "base/error.h"
#include "base/suggest.h"
#include "execution/loop_trace.h"
#include "execution/stamp_clock.h"

namespace rasterbench {
namespace {

std::vector<Schedule>& registry() {
  static std::vector<Schedule> all;
  return all;
}

bool flushes_denormals() {
#if defined(__SSE2__)
  return (_mm_getcsr() & 0x8040u) != 0;  // FTZ | DAZ
#else
  return false;
#endif
}

}  // namespace

std::string to_string(const ExecutionConfig& config) {
  if (config.schedule.empty()) return config.backend;
  if (!config.chunk) return fmt::format("{}:{}", config.backend, config.schedule);
  return fmt::format("{}:{},{}", config.backend, config.schedule, *config.chunk);
}

Execution::Execution(const ExecutionConfig& config)
    : config_(config),
      stamped_(std::getenv("RASTERBENCH_NO_STAMPS") == nullptr),
      tally_(static_cast<std::size_t>(config.threads)),
      sightings_(static_cast<std::size_t>(config.threads)) {
  if (stamped_) StampClock::calibrate();
}

void Execution::loop(std::int64_t n, LoopBody body) {
  if (!stamped_ || ++loops_ > kTimedLoops) return run_loop(n, body);
  const double begin = StampClock::now();
  run_loop(n, body);
  loop_seconds_ += StampClock::now() - begin;
}

std::optional<double> Execution::loop_seconds() const {
  return stamped_ && loops_ <= kTimedLoops ? std::optional(loop_seconds_) : std::nullopt;
}

void Execution::reset_tally() {
  std::fill(tally_.begin(), tally_.end(), WorkerTally{});
  loop_seconds_ = 0;
  loops_ = 0;
}

void Execution::reset_sightings() {
  for (Sightings& sightings : sightings_) {
    sightings.first = sightings.last = -1;
    sightings.moves = 0;
    sightings.cpus.clear();  // keeps its memory: the next sighting lies in a timed frame
  }
}

void Sightings::look() {
  const int cpu = sched_getcpu();  // a load from the thread's restartable-sequence area: about 2 ns
  if (cpu == last) return;
  if (first < 0)
    first = cpu;
  else
    ++moves;
  last = cpu;
  if (std::find(cpus.begin(), cpus.end(), cpu) == cpus.end()) cpus.push_back(cpu);
}

ObservedThreads observe_threads(Execution& execution) {
  using Clock = std::chrono::steady_clock;
  const int wanted = execution.threads();
  std::atomic<int> arrived{0};
  std::atomic<bool> flushed{false};
  std::vector<int> cpu_of(static_cast<std::size_t>(wanted), -1);
  const auto deadline = Clock::now() + std::chrono::seconds(2);
  execution.uniform_loop(wanted, [&](std::int64_t, int worker) {
    int& cpu = cpu_of[static_cast<std::size_t>(worker)];
    if (cpu == -1) arrived.fetch_add(1);
    cpu = std::max(0, sched_getcpu());
    if (flushes_denormals()) flushed = true;
    // Nobody leaves before all are there, so that one thread cannot do the work of two.
    while (arrived.load() < wanted && Clock::now() < deadline) std::this_thread::yield();
  });
  ObservedThreads observed;
  observed.count = arrived.load();
  observed.denormals_flushed = flushed;
  for (const int cpu : cpu_of)
    if (cpu >= 0) observed.cpus.push_back(cpu);
  return observed;
}

std::span<const Schedule> schedules() { return registry(); }

std::vector<std::string> backends() {
  std::vector<std::string> names;
  for (const Schedule& schedule : registry())
    if (std::find(names.begin(), names.end(), schedule.backend) == names.end())
      names.push_back(schedule.backend);
  return names;
}

bool is_left_out(const std::string& backend) {
  const std::vector<std::string> built = backends();
  return backend == "tbb" && std::find(built.begin(), built.end(), backend) == built.end();
}

const Schedule& find_schedule(const ExecutionConfig& config) {
  const std::vector<std::string> known_backends = backends();
  if (std::find(known_backends.begin(), known_backends.end(), config.backend) == known_backends.end())
    throw InputError({.field = "backend"}, unknown_name("backend", config.backend, known_backends));
  std::vector<std::string> names;
  for (const Schedule& schedule : registry()) {
    if (schedule.backend != config.backend) continue;
    if (schedule.name == config.schedule) {
      if (config.chunk && schedule.chunk.empty())
        throw InputError(
            {.field = "chunk"},
            fmt::format("{} takes no chunk", to_string({config.backend, config.schedule, {}, 1})));
      if (config.chunk && *config.chunk < 1) throw InputError({.field = "chunk"}, "must be at least 1");
      return schedule;
    }
    names.push_back(schedule.name);
  }
  throw InputError({.field = "schedule"},
                   config.backend == "serial"
                       ? "serial takes no schedule"
                       : unknown_name(config.backend + " schedule", config.schedule, names));
}

std::unique_ptr<Execution> make_execution(const ExecutionConfig& config) {
  const Schedule& schedule = find_schedule(config);
  if (config.threads < 1) throw InputError({.field = "threads"}, "must be at least 1");
  if (config.backend == "serial" && config.threads != 1)
    throw InputError({.field = "threads"}, "serial runs on one thread");
  auto execution = schedule.make(config);
  return config.trace ? make_traced(std::move(execution)) : std::move(execution);
}

ScheduleRegistration::ScheduleRegistration(Schedule schedule) { registry().push_back(std::move(schedule)); }

int available_cpus() {
  // OMP_PROC_BIND narrows the mask of the main thread to one CPU; the OpenMP runtime counted before it did
  // that.
  cpu_set_t mask;
  CPU_ZERO(&mask);
  const int allowed = sched_getaffinity(0, sizeof mask, &mask) == 0 ? CPU_COUNT(&mask) : 1;
  return std::max(allowed, omp_get_num_procs());
}

int default_threads() { return std::min(available_cpus(), omp_get_max_threads()); }

std::string openmp_runtime() {
  // The file that answers this program's own calls: both runtimes may be loaded, as under LD_PRELOAD.
#if defined(__clang__)
  constexpr const char* kParallelRegion = "__kmpc_fork_call";
#else
  constexpr const char* kParallelRegion = "GOMP_parallel";
#endif
  const auto file_of = [](const char* name) {
    Dl_info info{};
    void* const symbol = dlsym(RTLD_DEFAULT, name);
    return symbol && dladdr(symbol, &info) ? info.dli_fbase : nullptr;
  };
  const void* const called = file_of(kParallelRegion);
  if (!called) return "unknown";
  // Only LLVM's runtime exports the Intel interface, beside that of libgomp.
  return called == file_of("kmp_get_blocktime") ? "libomp" : "libgomp";
}

}  // namespace rasterbench
