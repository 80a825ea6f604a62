#include "harness/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "base/error.h"

namespace rasterbench {
namespace {

std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError({.file = path.string()}, "cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

Journal::Journal(const std::filesystem::path& path) : path_(path) {
  if (std::filesystem::exists(path)) {
    const std::string text = read_text(path);
    const std::size_t complete = text.rfind('\n') == std::string::npos ? 0 : text.rfind('\n') + 1;
    if (complete != text.size()) std::filesystem::resize_file(path, complete);
  }
  file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (file_ < 0)
    throw InputError({.file = path.string()}, std::string("cannot be written: ") + std::strerror(errno));
}

Journal::~Journal() {
  if (file_ >= 0) close(file_);
}

void Journal::append(const Json& event) {
  const std::string line = dump(event) + "\n";
  std::size_t written = 0;
  while (written < line.size()) {
    const ssize_t n = write(file_, line.data() + written, line.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0)
      throw Error(fmt::format("{}: cannot be written: {}; continue with --resume", path_.string(),
                              std::strerror(errno)));
    written += static_cast<std::size_t>(n);
  }
}

std::vector<Json> read_journal(const std::filesystem::path& path) {
  const std::string text = read_text(path);
  std::vector<Json> events;
  std::size_t begin = 0;
  for (std::int64_t line = 1;; ++line) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) return events;
    try {
      events.push_back(Json::parse(text.begin() + static_cast<std::ptrdiff_t>(begin),
                                   text.begin() + static_cast<std::ptrdiff_t>(end)));
    } catch (const Json::exception&) {
      throw InputError({.file = path.string(), .line = line}, "is not a JSON object");
    }
    begin = end + 1;
  }
}

}  // namespace rasterbench
