// A child process that answers JSON lines: a runner of points, in an environment of its own.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <map>
#include <string>

#include "base/error.h"
#include "harness/point.h"

namespace rasterbench {

/// The child died, hung or answered nonsense. Not bad input: the point that was asked for fails, the study
/// goes on.
class ProcessError : public Error {
 public:
  using Error::Error;
};

/// The user pressed Ctrl-C (or sent TERM).
class Interrupted : public Error {
 public:
  using Error::Error;
  int exit_code() const override { return 1; }
};

/// Set by the handlers that catch_interrupts() installs.
extern std::atomic<bool> interrupted;
void catch_interrupts();

class Process {
 public:
  /// Starts this program again with `arguments` and with `variables` set (an empty value unsets). The child
  /// is killed when this process dies, and does not see its Ctrl-C.
  Process(const std::vector<std::string>& arguments, const std::map<std::string, std::string>& variables);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Sends a line and waits for the answer. Throws ProcessError (also for an answer {"error": ...}), or
  /// Interrupted.
  Json ask(const Json& request, double timeout_seconds);

  /// Stops and continues the child: threads that wait actively must not disturb another process's samples.
  void pause();
  void resume();

  /// CPU seconds that the child has used so far; 0 when it is dead: it then counts with the children of this
  /// process.
  double cpu_seconds() const;

  bool alive() const { return pid_ > 0; }

 private:
  std::string read_line(double timeout_seconds);
  void kill_and_reap();
  std::string how_it_died();

  pid_t pid_ = -1;
  int to_child_ = -1;
  int from_child_ = -1;
  bool paused_ = false;
  std::string pending_;
};

}  // namespace rasterbench
