#include "machine/topology.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>

namespace rasterbench {
namespace {

TEST(Topology, SeesEveryCpuThatThisProcessMayUse) {
  const Topology topology(cpu_places());
  cpu_set_t mask;
  ASSERT_EQ(sched_getaffinity(0, sizeof mask, &mask), 0);
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &mask)) {
      const CpuPlace place = topology.of(cpu);
      EXPECT_EQ(place.cpu, cpu);
      EXPECT_GE(place.core, 0);
      EXPECT_GE(place.numa_node, 0);
    }
  EXPECT_TRUE(std::is_sorted(topology.places().begin(), topology.places().end(),
                             [](const CpuPlace& a, const CpuPlace& b) { return a.cpu < b.cpu; }));
}

TEST(Topology, SiblingsShareACoreAndStrangersDoNot) {
  const Topology topology({{2, 0, 0, 0}, {0, 0, 0, 0}, {1, 1, 0, 0}});
  EXPECT_TRUE(topology.share_core(0, 2));
  EXPECT_TRUE(topology.share_core(1, 1));
  EXPECT_FALSE(topology.share_core(0, 1));
}

TEST(Topology, WhatItDoesNotKnowSharesNothing) {
  const Topology topology({});
  EXPECT_EQ(topology.of(7).cpu, 7);
  EXPECT_EQ(topology.of(7).core, -1);
  EXPECT_TRUE(topology.share_core(7, 7));
  EXPECT_FALSE(topology.share_core(7, 8));
}

}  // namespace
}  // namespace rasterbench
