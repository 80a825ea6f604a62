// The runner: the process that draws frames for the coordinator, one request a line on stdin, one answer a
// line on stdout.
#pragma once

#include <string>
#include <vector>

#include "harness/point.h"

namespace rasterbench {

/// Serves requests until stdin ends:
///   {"op": "verify", "point": {...}}                  -> Verifier::judge
///   {"op": "sample", "point": {...}, "name", "frames"} -> {"ms", "stages", "loop_ms", "per_thread",
///   "threads_observed", "runtime_observed" (of OpenMP's points), "counters"}
///   {"op": "peer"}                                    -> {"renderer", "version"} of this process's llvmpipe
///   {"op": "limit", "threads", "read_bytes", "write_bytes", "seconds"} -> measure_limit()
///   {"op": "explain", "point": {...}, "samples"}      -> explain_point()
///   {"op": "image", "point": {...}, "path"}           -> {} after writing the picture
/// What a peer cannot do on this machine is answered {"skip": reason}; a request that fails, {"error": text}.
/// `benchmark_flags` go to Google Benchmark.
int run_runner(const std::vector<std::string>& benchmark_flags);

/// The variables that make a process an environment; throws InputError with the reason where the machine
/// cannot.
std::map<std::string, std::string> environment_variables(const Environment& environment);

}  // namespace rasterbench
