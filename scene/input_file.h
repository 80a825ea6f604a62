// A file opened for reading, with errors that name it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace rasterbench {

/// Opens `path` for reading. Every failure is an InputError that names the path and says why.
class InputFile {
 public:
  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// True for a plain file: its size is known. False for a pipe or a device.
  bool is_regular() const { return regular_; }
  std::uint64_t size() const { return size_; }

  /// Reads up to `count` bytes into `bytes`; fewer only at the end of the file.
  std::size_t read(void* bytes, std::size_t count);

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  bool regular_ = false;
  std::uint64_t size_ = 0;
};

}  // namespace rasterbench
