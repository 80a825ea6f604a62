// The journal: what a study has done so far, one JSON line an event, appended and flushed as it happens.
#pragma once

#include <filesystem>
#include <vector>

#include "harness/point.h"

namespace rasterbench {

class Journal {
 public:
  /// Opens `path` for appending; an incomplete last line (a kill in mid-write) is cut off. Throws InputError.
  explicit Journal(const std::filesystem::path& path);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Writes one line at once. Throws Error when the disk is full: the study stops and can be
  /// resumed.
  void append(const Json& event);

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

/// The complete lines of a journal. Throws InputError naming the line that is not JSON.
std::vector<Json> read_journal(const std::filesystem::path& path);

}  // namespace rasterbench
