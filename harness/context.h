// What is the same for all points of a study: machine, build, environment (context.json).
#pragma once

#include "harness/study.h"

namespace rasterbench {

/// The hash of this program's file: what --resume compares, since a commit says nothing of a dirty tree.
std::string build_id();

/// The object of records.md without id, started, finished, points and images.
Json describe_context(const Study& study, const StudyOptions& options,
                      const std::map<std::string, std::string>& custom);

/// `machine`, and the variables of `environment` that are set, of context.json.
Json describe_machine();
Json relevant_environment();
/// The name of the CPU, or "unavailable: REASON".
std::string cpu_model();

/// Now, ISO 8601, UTC.
std::string utc_now();

}  // namespace rasterbench
