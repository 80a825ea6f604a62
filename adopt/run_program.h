// Runs somebody else's program once: in a process group of its own, with limits, in an environment that is
// said.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace rasterbench {

/// What to run and what it may use.
struct ProgramRun {
  std::vector<std::string> words;  ///< the program's path, then its arguments
  std::filesystem::path folder;    ///< where it runs
  /// Set, or unset where the value is empty. OMP_*, GOMP_*, KMP_* and LD_PRELOAD of this process are not
  /// handed on.
  std::map<std::string, std::string> variables = {};
  double limit_seconds = 60;         ///< then the whole group is killed
  std::uint64_t max_file_bytes = 0;  ///< of any file that it writes; 0: no limit
  bool watch = false;  ///< look at its threads and memory every few milliseconds: not for timed runs
  std::function<bool()> stop = {};  ///< asked a few times a second: true kills the group
};

/// How a run ended.
enum class RunEnd {
  kExited,      ///< by itself; `code` is its exit code
  kSignalled,   ///< `code` is the signal
  kTimeLimit,   ///< killed at the time limit
  kStopped,     ///< killed because stop() said so
  kNotStarted,  ///< `code` is the errno of exec
};

struct ProgramResult {
  RunEnd end = RunEnd::kNotStarted;
  int code = 0;
  double seconds = 0;      ///< wall time from before the process exists until it has ended
  double cpu_seconds = 0;  ///< user and system time of all its threads
  /// The most memory that it was seen to have. Not the kernel's ru_maxrss, in which exec counts this
  /// process's own; 0: not watched, or over before it was looked at.
  std::int64_t max_rss_bytes = 0;
  int most_threads = 0;  ///< seen at once, at least so many; 0: not watched
  std::string output;    ///< stdout and stderr together, the last kOutputBytes of them
};

inline constexpr std::size_t kOutputBytes = 64 * 1024;

/// Runs the program to its end, or kills it and all of its group. What it leaves running in its group is
/// killed, too. A child that leaves the group (a daemon) escapes. Throws Error where the system has no
/// process, pipe or thread left.
ProgramResult run_program(const ProgramRun& run);

/// "exit code 3", "signal 11 (Segmentation fault)", "no end within 60 s", ...
std::string describe_end(const ProgramRun& run, const ProgramResult& result);

}  // namespace rasterbench
