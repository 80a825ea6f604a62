// Progress of long work on stderr: a bar where it is a terminal, now and then a line elsewhere.
#pragma once

#include <chrono>
#include <string>

namespace rasterbench {

class Progress {
 public:
  Progress();
  ~Progress();

  /// Shows that `done` of `total` steps of `phase` are done; `detail` says what is being done.
  void show(const std::string& phase, double done, double total, const std::string& detail);

  /// Prints a line of its own above the bar.
  void note(const std::string& line);

  /// Takes the bar away, so that a line on stdout does not run into it.
  void clear();

 private:
  bool terminal_;
  bool bar_shown_ = false;
  std::string phase_;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace rasterbench
