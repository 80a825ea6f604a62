// One study at a time in a folder.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>

#include "base/error.h"

namespace rasterbench {

/// Two studies writing into one folder would destroy both: the first holds a lock until it ends.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder) {
    file_ = open((folder / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (file_ < 0) throw InputError({.file = folder.string(), .field = "--out"}, "cannot be written");
    if (flock(file_, LOCK_EX | LOCK_NB) != 0) {
      close(file_);
      throw InputError({.file = folder.string(), .field = "--out"},
                       "another study is writing into this folder");
    }
  }
  ~FolderLock() { close(file_); }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int file_;
};

}  // namespace rasterbench
