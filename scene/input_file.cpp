#include "scene/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "base/error.h"

namespace rasterbench {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* action, int error) {
  throw InputError({.file = path.string()},
                   std::string("cannot ") + action + ": " + std::generic_category().message(error));
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& path) : path_(path) {
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) fail(path, "open", errno);
  struct stat status = {};
  const int error = ::fstat(descriptor_, &status) != 0 ? errno : S_ISDIR(status.st_mode) ? EISDIR : 0;
  if (error != 0) {
    ::close(descriptor_);  // the destructor of a half-made object does not run
    fail(path, "read", error);
  }
  regular_ = S_ISREG(status.st_mode);
  size_ = regular_ ? static_cast<std::uint64_t>(status.st_size) : 0;
}

InputFile::~InputFile() { ::close(descriptor_); }

std::size_t InputFile::read(void* bytes, std::size_t count) {
  char* const begin = static_cast<char*>(bytes);
  std::size_t done = 0;
  while (done < count) {  // Linux gives at most 2 GiB at a time
    const ssize_t got = ::read(descriptor_, begin + done, count - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(path_, "read", errno);
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

}  // namespace rasterbench
