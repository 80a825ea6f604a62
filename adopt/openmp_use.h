// How a program uses OpenMP, found out from outside: whether its loops take their schedule from OMP_SCHEDULE.
//
// Three kinds of evidence, the strongest that there is counts: what the program asked of its OpenMP runtime
// while it ran (a preloaded library, openmp_probe.cpp, stands between them and counts), then the names that
// its file imports. Where neither says it, only times can.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace rasterbench {

/// What a program's file says without being run.
struct ProgramFile {
  std::string kind;                  ///< "dynamic ELF", "static ELF", "script", "other"
  std::vector<std::string> imports;  ///< names that a dynamic ELF file takes from libraries, sorted
};

/// Reads the file; never throws for what is in it.
ProgramFile inspect_program(const std::filesystem::path& path);

/// Counts of the probe: its keys are those of openmp_probe.cpp. Empty where it did not report.
using ProbeCounts = std::map<std::string, std::int64_t>;

/// Reads what the probe wrote; several processes' counts are added.
ProbeCounts read_probe(const std::filesystem::path& path);

enum class ScheduleUse { kRuntime, kFixed, kNoOpenMp, kUndecided };

struct OpenMpUse {
  ScheduleUse use = ScheduleUse::kUndecided;
  std::string evidence;  ///< "calls", "imports" or "none"
  std::string text;      ///< one sentence for whoever wrote the program
};

/// Decides from what there is.
OpenMpUse decide_schedule_use(const ProgramFile& file, const ProbeCounts& probe);

/// "runtime", "fixed", "no_openmp", "undecided".
const char* to_string(ScheduleUse use);

/// The environment variable that says where the probe writes.
inline constexpr const char* kProbeVariable = "RASTERBENCH_OPENMP_PROBE";
inline constexpr const char* kProbeLibrary = "librasterbench_openmp_probe.so";

}  // namespace rasterbench
