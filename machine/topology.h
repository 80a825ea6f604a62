// Where the machine's CPUs lie: which of them share a core, a package, a NUMA node.
#pragma once

#include <span>
#include <vector>

namespace rasterbench {

/// A CPU as the system numbers it. The others are hwloc's logical indices, over the whole machine; -1: hwloc
/// does not know.
struct CpuPlace {
  int cpu = 0;
  int core = -1;
  int package = -1;
  int numa_node = -1;
};

/// Every CPU that hwloc sees, in ascending order; empty where it cannot read the topology.
std::vector<CpuPlace> cpu_places();

/// Looks CPUs up.
class Topology {
 public:
  explicit Topology(std::vector<CpuPlace> places);

  std::span<const CpuPlace> places() const { return places_; }
  /// The place of `cpu`, with unknown surroundings where the topology does not have it.
  CpuPlace of(int cpu) const;
  /// Whether two CPUs are one, or siblings of one core.
  bool share_core(int a, int b) const;

 private:
  std::vector<CpuPlace> places_;
};

}  // namespace rasterbench
