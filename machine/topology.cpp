#include "machine/topology.h"

#include <hwloc.h>

#include <algorithm>
#include <utility>

namespace rasterbench {
namespace {

int index_of(hwloc_obj_t object) { return object ? static_cast<int>(object->logical_index) : -1; }

/// The first NUMA node that is near to `cpu`: memory hangs beside the tree of hwloc, not in it.
int numa_node_of(hwloc_topology_t topology, hwloc_obj_t cpu) {
  for (hwloc_obj_t node = nullptr;
       (node = hwloc_get_next_obj_by_type(topology, HWLOC_OBJ_NUMANODE, node)) != nullptr;)
    if (hwloc_bitmap_isset(node->cpuset, cpu->os_index)) return index_of(node);
  return -1;
}

}  // namespace

std::vector<CpuPlace> cpu_places() {
  std::vector<CpuPlace> places;
  hwloc_topology_t topology = nullptr;
  if (hwloc_topology_init(&topology) != 0) return places;
  if (hwloc_topology_load(topology) == 0) {
    for (hwloc_obj_t cpu = nullptr;
         (cpu = hwloc_get_next_obj_by_type(topology, HWLOC_OBJ_PU, cpu)) != nullptr;)
      places.push_back({.cpu = static_cast<int>(cpu->os_index),
                        .core = index_of(hwloc_get_ancestor_obj_by_type(topology, HWLOC_OBJ_CORE, cpu)),
                        .package = index_of(hwloc_get_ancestor_obj_by_type(topology, HWLOC_OBJ_PACKAGE, cpu)),
                        .numa_node = numa_node_of(topology, cpu)});
  }
  hwloc_topology_destroy(topology);
  return places;
}

Topology::Topology(std::vector<CpuPlace> places) : places_(std::move(places)) {
  std::sort(places_.begin(), places_.end(),
            [](const CpuPlace& a, const CpuPlace& b) { return a.cpu < b.cpu; });
}

CpuPlace Topology::of(int cpu) const {
  const auto found = std::lower_bound(places_.begin(), places_.end(), cpu,
                                      [](const CpuPlace& place, int wanted) { return place.cpu < wanted; });
  return found != places_.end() && found->cpu == cpu ? *found : CpuPlace{.cpu = cpu};
}

bool Topology::share_core(int a, int b) const {
  const int core = of(a).core;
  return a == b || (core >= 0 && core == of(b).core);
}

}  // namespace rasterbench
