// The coordinator: runs a study by asking runner processes, journals every answer, and makes the records.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "harness/study.h"

namespace rasterbench {

struct CoordinatorOptions {
  std::filesystem::path out;  ///< DIR of records.md
  bool resume = false;
  bool replace = false;  ///< an existing DIR is kept as DIR.previous
  std::map<std::string, std::string> custom_context;
  std::vector<std::string> benchmark_flags;  ///< for Google Benchmark in the runner processes
  std::filesystem::path benchmark_out;       ///< a report of Google Benchmark's own reporters, or empty
  std::string benchmark_out_format = "json";
  std::string benchmark_format;  ///< the same on stdout, or empty
};

/// Runs the study to its end. Returns the exit code: 0, or 1 if a point failed. Throws Interrupted on Ctrl-C,
/// with the journal complete but for the sample that was under way.
int run_study(const Study& study, const StudyOptions& study_options, const CoordinatorOptions& options);

}  // namespace rasterbench
