#include "machine/team.h"

#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <system_error>

#include "base/error.h"

namespace rasterbench {
namespace {

int cpus_of_this_thread() {
  cpu_set_t mask;
  CPU_ZERO(&mask);
  return sched_getaffinity(0, sizeof mask, &mask) == 0
             ? CPU_COUNT(&mask)
             : static_cast<int>(std::thread::hardware_concurrency());
}

}  // namespace

Team::Team(int threads) : shifts_(static_cast<std::size_t>(threads)) {
  // OMP_PROC_BIND binds the main thread, and threads inherit that: they would take turns on one CPU.
  if (const int cpus = cpus_of_this_thread(); cpus < threads)
    throw Error(fmt::format("{} threads cannot run at once: the process is bound to {} (see OMP_PROC_BIND)",
                            threads, cpus == 1 ? "one CPU" : fmt::format("{} CPUs", cpus)));
  try {
    for (int thread = 1; thread < threads; ++thread) others_.emplace_back(&Team::serve, this, thread);
  } catch (const std::system_error& error) {
    dissolve();
    throw Error(fmt::format("{} threads cannot be started: {}", threads, error.what()));
  }
}

Team::~Team() { dissolve(); }

void Team::dissolve() {
  dissolved_ = true;
  for (std::thread& other : others_) other.join();
}

double Team::run(FunctionRef<void(int thread)> work) {
  work_ = &work;
  wait();
  work_as(0);
  wait();
  const auto begin = std::min_element(shifts_.begin(), shifts_.end(),
                                      [](const Shift& a, const Shift& b) { return a.begin < b.begin; });
  const auto end = std::max_element(shifts_.begin(), shifts_.end(),
                                    [](const Shift& a, const Shift& b) { return a.end < b.end; });
  return std::chrono::duration<double>(end->end - begin->begin).count();
}

void Team::serve(int thread) {
  for (;;) {
    wait();
    if (dissolved_) return;
    work_as(thread);
    wait();
  }
}

void Team::work_as(int thread) {
  Shift& shift = shifts_[static_cast<std::size_t>(thread)];
  shift.begin = Clock::now();
  (*work_)(thread);
  shift.end = Clock::now();
}

void Team::wait() {
  const int generation = generation_.load();
  if (arrived_.fetch_add(1) + 1 == threads()) {
    arrived_ = 0;
    ++generation_;
  } else {
    while (generation_.load() == generation && !dissolved_) std::this_thread::yield();
  }
}

}  // namespace rasterbench
