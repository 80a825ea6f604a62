#include "base/buffer.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <vector>

#include "base/error.h"

namespace rasterbench {
namespace {

constexpr double kGiB = 1024.0 * 1024.0 * 1024.0;

std::size_t read_number(const std::string& path, std::size_t fallback) {
  std::ifstream file(path);
  std::size_t value = 0;
  return file >> value ? value : fallback;  // cgroup v2 says "max" where there is no limit
}

/// What the page cache could give back at once, by a cgroup's memory.stat.
std::size_t reclaimable(const std::string& stat_file) {
  std::ifstream file(stat_file);
  std::string name;
  std::size_t value = 0;
  while (file >> name >> value)
    if (name == "inactive_file" || name == "total_inactive_file") return value;
  return 0;
}

struct CgroupMemory {
  std::size_t limit, used;
};

/// Limit and use of every control group that this process is in, up to the root; both versions of the
/// interface.
std::vector<CgroupMemory> cgroup_limits() {
  std::vector<CgroupMemory> limits;
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    // ID:CONTROLLERS:PATH; the path may hold colons too.
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const bool version_2 = line.starts_with("0::");
    if (!version_2 && line.substr(first + 1, second - first - 1) != "memory") continue;
    const std::string root = version_2 ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory";
    for (std::filesystem::path group = line.substr(second + 1);; group = group.parent_path()) {
      const std::string folder = root + group.string() + "/";
      constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
      const std::size_t limit =
          read_number(folder + (version_2 ? "memory.max" : "memory.limit_in_bytes"), kNone);
      const std::size_t used =
          read_number(folder + (version_2 ? "memory.current" : "memory.usage_in_bytes"), 0);
      const std::size_t cache = reclaimable(folder + "memory.stat");
      if (limit != kNone) limits.push_back({limit, used > cache ? used - cache : 0});
      if (group == group.parent_path()) break;
    }
  }
  return limits;
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
  for (const auto& [limit, used] : cgroup_limits())
    available = std::min(available, limit > used ? limit - used : 0);
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

void* map_pages(std::size_t bytes, const std::string& what, Pages size) {
  constexpr std::size_t kHugePage = std::size_t{2} << 20;
  // A mapping starts anywhere: what lies before its first huge page, and as much less behind it, goes back.
  const std::size_t margin = size == Pages::kHuge && bytes >= kHugePage ? kHugePage : 0;
  void* pages = mmap(nullptr, bytes + margin, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED)
    throw InputError(fmt::format("{} needs {:.1f} GiB of memory: the system refused it", what,
                                 static_cast<double>(bytes) / kGiB));
  if (margin == 0) return pages;
  auto* const mapped = static_cast<std::byte*>(pages);
  const std::size_t before = (kHugePage - reinterpret_cast<std::uintptr_t>(mapped) % kHugePage) % kHugePage;
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const std::size_t end = before + (bytes + page - 1) / page * page;
  if (before > 0) munmap(mapped, before);
  if (bytes + margin > end) munmap(mapped + end, bytes + margin - end);
  madvise(mapped + before, bytes, MADV_HUGEPAGE);  // a wish: where it is not granted, pages are small
  return mapped + before;
}

void unmap_pages(void* pages, std::size_t bytes) noexcept { munmap(pages, bytes); }

}  // namespace rasterbench
