#include "execution/binding.h"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cstdint>

namespace rasterbench {

int place_of_worker(int worker, int threads, int places, bool spread) {
  if (!spread && threads <= places) return worker;
  return static_cast<int>(std::int64_t{worker} * places / threads);
}

Binding process_binding() {
  const omp_proc_bind_t kind = omp_get_proc_bind();
  Binding binding{.places = {}, .spread = kind == omp_proc_bind_spread};
  if (kind != omp_proc_bind_close && kind != omp_proc_bind_spread && kind != omp_proc_bind_true)
    return binding;
  for (int place = 0; place < omp_get_num_places(); ++place) {
    std::vector<int>& cpus =
        binding.places.emplace_back(static_cast<std::size_t>(omp_get_place_num_procs(place)));
    omp_get_place_proc_ids(place, cpus.data());
  }
  return binding;
}

std::string broken_binding(std::span<const Sightings> workers, const Binding& binding) {
  const int threads = static_cast<int>(workers.size()), places = static_cast<int>(binding.places.size());
  const auto place_of = [&](int cpu) {
    const auto found = std::find_if(binding.places.begin(), binding.places.end(), [&](const auto& cpus) {
      return std::find(cpus.begin(), cpus.end(), cpu) != cpus.end();
    });
    return found == binding.places.end() ? -1 : static_cast<int>(found - binding.places.begin());
  };
  std::vector<int> worker_in(binding.places.size(), -1);
  int first_place = -1;
  for (int worker = 0; worker < threads; ++worker) {
    const Sightings& seen = workers[static_cast<std::size_t>(worker)];
    if (seen.cpus.empty()) continue;
    const int place = place_of(seen.cpus.front());
    for (const int cpu : seen.cpus) {
      if (place_of(cpu) < 0)
        return fmt::format("thread {} was seen on CPU {}, which is in no place", worker, cpu);
      if (place_of(cpu) != place)
        return fmt::format("thread {} left its place: it was seen on CPUs {} and {}", worker,
                           seen.cpus.front(), cpu);
    }
    if (threads > places) continue;
    int& other = worker_in[static_cast<std::size_t>(place)];
    if (other >= 0)
      return fmt::format("threads {} and {} were both seen in the place of CPU {}", other, worker,
                         seen.cpus.front());
    other = worker;
    if (worker == 0) first_place = place;
    if (first_place < 0) continue;
    const int offset = (place - first_place + places) % places;
    const int low = binding.spread ? worker * (places / threads) : worker;
    const int high = binding.spread ? (worker + 1) * ((places + threads - 1) / threads) - 1 : worker;
    if (offset < low || offset > high)
      return fmt::format("thread {} was seen {} places after thread 0, where {} allows {} to {}", worker,
                         offset, binding.spread ? "spread" : "close", low, high);
  }
  return {};
}

std::vector<std::vector<int>> bound_cpus(int threads) {
  const Binding binding = process_binding();
  std::vector<std::vector<int>> cpus;
  if (binding.places.empty()) return cpus;
  const int places = static_cast<int>(binding.places.size());
  for (int worker = 0; worker < threads; ++worker)
    cpus.push_back(
        binding.places[static_cast<std::size_t>(place_of_worker(worker, threads, places, binding.spread))]);
  return cpus;
}

}  // namespace rasterbench
