// Which CPUs a worker is bound to. OMP_PROC_BIND and OMP_PLACES say it, once per process; the OpenMP runtime
// obeys by itself, and backends of other runtimes ask here, so that a binding means the same under each.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "execution/execution.h"

namespace rasterbench {

/// The place, of 0 .. places-1, of thread `worker` in a team of `threads` (OpenMP 5.2, section 10.1.3):
/// `spread` parts the places into one run of places for each thread, which takes the first of its run; close
/// gives neighbours to neighbours, and several threads to a place where there are more threads than places.
int place_of_worker(int worker, int threads, int places, bool spread);

/// The binding of this process: the CPUs of each place, as the system numbers them. No places: it binds no
/// threads.
struct Binding {
  std::vector<std::vector<int>> places;
  bool spread = false;
};
Binding process_binding();

/// What contradicts `binding` in where the workers of a team were seen, or empty: a worker outside of all
/// places or in two of them, or, where there are places enough for one each, two workers in one place,
/// workers that are not neighbours under close, or not in a run of places of their own under spread. Places
/// count from that of worker 0, and a run has P/T places rounded down or up, as runtimes choose. Workers that
/// were never seen contradict nothing.
std::string broken_binding(std::span<const Sightings> workers, const Binding& binding);

/// The CPUs, as the system numbers them, of each worker of a team of `threads` under the binding of this
/// process; empty where it binds no threads.
std::vector<std::vector<int>> bound_cpus(int threads);

}  // namespace rasterbench
