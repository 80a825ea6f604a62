// Where the threads of a point really ran, from what every sample saw of them.
#pragma once

#include "harness/run.h"
#include "machine/topology.h"

namespace rasterbench {

/// {CPU: samples in which the thread was seen on it}, CPUs ascending.
Json samples_by_cpu(const PointState& state, std::size_t thread);

/// Times that the thread was seen on another CPU than the time before: within a sample, and between two
/// samples of one launch (another launch is another process, whose threads have not moved).
std::int64_t migrations_of(const PointState& state, std::size_t thread);

/// `placement` of records.md; null for a point whose threads were not looked at (a peer's, or without
/// stamps). Precondition: at least one sample.
Json placement_of(const PointState& state, const Topology& topology);

}  // namespace rasterbench
