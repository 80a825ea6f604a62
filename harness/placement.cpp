#include "harness/placement.h"

#include <map>
#include <set>
#include <string>

namespace rasterbench {
namespace {

const Json& threads_of(const Sample& sample) { return sample.answer.at("per_thread"); }

/// Whether two threads were seen at one place in the first, or in the last sighting of a sample. These are
/// taken in one loop, in which all threads run at once; elsewhere one may have come where another had left.
template <class Shares>
bool any_two_share(const Json& threads, Shares shares) {
  for (const char* sighting : {"first_cpu", "last_cpu"})
    for (std::size_t a = 0; a < threads.size(); ++a)
      for (std::size_t b = a + 1; b < threads.size(); ++b) {
        const int cpu_a = threads[a].at(sighting), cpu_b = threads[b].at(sighting);
        if (cpu_a >= 0 && cpu_b >= 0 && shares(cpu_a, cpu_b)) return true;
      }
  return false;
}

}  // namespace

Json samples_by_cpu(const PointState& state, std::size_t thread) {
  std::map<int, int> samples;
  for (const Sample& sample : state.samples)
    for (const int cpu : threads_of(sample).at(thread).at("cpus")) ++samples[cpu];
  Json json = Json::object();
  for (const auto& [cpu, count] : samples) json[std::to_string(cpu)] = count;
  return json;
}

std::int64_t migrations_of(const PointState& state, std::size_t thread) {
  std::int64_t migrations = 0;
  std::map<int, int> last_cpu;  // by launch
  for (const Sample& sample : state.samples) {
    const Json& seen = threads_of(sample).at(thread);
    const int first = seen.at("first_cpu");
    if (first < 0) continue;
    migrations += seen.at("moves").get<std::int64_t>();
    const auto before = last_cpu.find(sample.launch);
    migrations += before != last_cpu.end() && before->second != first;
    last_cpu[sample.launch] = seen.at("last_cpu");
  }
  return migrations;
}

Json placement_of(const PointState& state, const Topology& topology) {
  std::set<int> cpus, cores, packages, nodes;
  std::int64_t migrations = 0, sharing_cpu = 0, sharing_core = 0;
  const std::size_t threads = threads_of(state.samples.back()).size();
  for (std::size_t thread = 0; thread < threads; ++thread) migrations += migrations_of(state, thread);
  for (const Sample& sample : state.samples) {
    for (const Json& thread : threads_of(sample))
      for (const int cpu : thread.at("cpus")) {
        const CpuPlace place = topology.of(cpu);
        cpus.insert(cpu);
        if (place.core >= 0) cores.insert(place.core);
        if (place.package >= 0) packages.insert(place.package);
        if (place.numa_node >= 0) nodes.insert(place.numa_node);
      }
    sharing_cpu += any_two_share(threads_of(sample), [](int a, int b) { return a == b; });
    sharing_core +=
        any_two_share(threads_of(sample), [&](int a, int b) { return topology.share_core(a, b); });
  }
  if (cpus.empty()) return nullptr;
  const auto count = [](const std::set<int>& seen) {
    return seen.empty() ? Json("unavailable: hwloc cannot read the topology") : Json(seen.size());
  };
  const Json& last = state.samples.back().answer;
  return {{"binding", last.contains("binding") ? last.at("binding") : Json()},
          {"migrations", migrations},
          {"cpus", cpus.size()},
          {"cores", count(cores)},
          {"packages", count(packages)},
          {"numa_nodes", count(nodes)},
          {"samples_sharing_cpu", sharing_cpu},
          {"samples_sharing_core", sharing_core}};
}

}  // namespace rasterbench
