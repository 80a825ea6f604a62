#include "base/buffer.h"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>

#include "base/error.h"

namespace rasterbench {
namespace {

constexpr double kGiB = 1024.0 * 1024.0 * 1024.0;

std::size_t read_number(const char* path, std::size_t fallback) {
  std::ifstream file(path);
  std::size_t value = 0;
  return file >> value ? value : fallback;  // cgroup v2 says "max" where there is no limit
}

}  // namespace

std::size_t available_memory() {
  constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();
  std::size_t available = kUnlimited;
  std::ifstream meminfo("/proc/meminfo");
  for (std::string line; std::getline(meminfo, line);) {
    std::istringstream fields(line);
    std::string name;
    std::size_t kib = 0;
    if (fields >> name >> kib && name == "MemAvailable:") available = kib * 1024;
  }
  const std::size_t limit = read_number("/sys/fs/cgroup/memory.max", kUnlimited);
  if (limit != kUnlimited) {
    const std::size_t used = read_number("/sys/fs/cgroup/memory.current", 0);
    available = std::min(available, limit > used ? limit - used : 0);
  }
  return available;
}

std::size_t checked_bytes(std::size_t count, std::size_t size, const std::string& what) {
  const double wanted = static_cast<double>(count) * static_cast<double>(size);
  const std::size_t available = available_memory();
  if (wanted > static_cast<double>(available))
    throw InputError(fmt::format("{} needs {:.1f} GiB of memory, {:.1f} GiB are available", what,
                                 wanted / kGiB, static_cast<double>(available) / kGiB));
  return count * size;
}

void* map_pages(std::size_t bytes, const std::string& what) {
  void* pages = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED)
    throw InputError(fmt::format("{} needs {:.1f} GiB of memory: the system refused it", what,
                                 static_cast<double>(bytes) / kGiB));
  return pages;
}

void unmap_pages(void* pages, std::size_t bytes) noexcept { munmap(pages, bytes); }

}  // namespace rasterbench
