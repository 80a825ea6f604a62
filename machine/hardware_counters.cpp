#include "machine/hardware_counters.h"

#include <fmt/format.h>
#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

namespace rasterbench {
namespace {

struct EventKind {
  const char* name;
  std::uint32_t type;
  std::uint64_t config;
  bool user_only = true;
};

constexpr std::uint64_t read_misses(std::uint64_t cache) {
  return cache | std::uint64_t{PERF_COUNT_HW_CACHE_OP_READ} << 8 |
         std::uint64_t{PERF_COUNT_HW_CACHE_RESULT_MISS} << 16;
}

constexpr std::array kKinds{
    EventKind{"cycles", PERF_TYPE_HARDWARE, PERF_COUNT_HW_CPU_CYCLES},
    EventKind{"instructions", PERF_TYPE_HARDWARE, PERF_COUNT_HW_INSTRUCTIONS},
    EventKind{"branches", PERF_TYPE_HARDWARE, PERF_COUNT_HW_BRANCH_INSTRUCTIONS},
    EventKind{"branch_misses", PERF_TYPE_HARDWARE, PERF_COUNT_HW_BRANCH_MISSES},
    EventKind{"l1d_read_misses", PERF_TYPE_HW_CACHE, read_misses(PERF_COUNT_HW_CACHE_L1D)},
    EventKind{"llc_misses", PERF_TYPE_HARDWARE, PERF_COUNT_HW_CACHE_MISSES},
    EventKind{"dtlb_read_misses", PERF_TYPE_HW_CACHE, read_misses(PERF_COUNT_HW_CACHE_DTLB)},
    EventKind{"task_clock", PERF_TYPE_SOFTWARE, PERF_COUNT_SW_TASK_CLOCK},
    EventKind{"context_switches", PERF_TYPE_SOFTWARE, PERF_COUNT_SW_CONTEXT_SWITCHES, false},
    EventKind{"page_faults", PERF_TYPE_SOFTWARE, PERF_COUNT_SW_PAGE_FAULTS}};

/// One event of one thread; closed with it.
class Counter {
 public:
  Counter(const EventKind& kind, int thread) {
    perf_event_attr attributes{};
    attributes.size = sizeof attributes;
    attributes.type = kind.type;
    attributes.config = kind.config;
    attributes.disabled = 1;
    attributes.exclude_kernel = kind.user_only;
    attributes.exclude_hv = 1;
    attributes.read_format = PERF_FORMAT_TOTAL_TIME_ENABLED | PERF_FORMAT_TOTAL_TIME_RUNNING;
    file_ = static_cast<int>(syscall(SYS_perf_event_open, &attributes, thread, -1, -1,
                                     static_cast<unsigned long>(PERF_FLAG_FD_CLOEXEC)));
    if (file_ < 0) error_ = errno;
  }
  ~Counter() {
    if (file_ >= 0) close(file_);
  }
  Counter(Counter&& other) noexcept : file_(std::exchange(other.file_, -1)), error_(other.error_) {}
  Counter(const Counter&) = delete;
  Counter& operator=(const Counter&) = delete;
  Counter& operator=(Counter&&) = delete;

  /// errno of the refusal, or 0.
  int error() const { return error_; }

  void start() { control(PERF_EVENT_IOC_ENABLE); }
  void stop() { control(PERF_EVENT_IOC_DISABLE); }

  /// Empty where the event never had its turn.
  std::optional<HardwareReport::Count> read() const {
    struct {
      std::uint64_t value, enabled, running;
    } raw{};
    if (file_ < 0 || ::read(file_, &raw, sizeof raw) != static_cast<ssize_t>(sizeof raw)) return {};
    return scaled_count(raw.value, raw.enabled, raw.running);
  }

 private:
  void control(unsigned long request) {
    if (file_ >= 0 && ioctl(file_, request, 0) != 0) {
      error_ = errno;
      close(std::exchange(file_, -1));
    }
  }

  int file_ = -1;
  int error_ = 0;
};

std::vector<int> threads_of_this_process() {
  std::vector<int> ids;
  std::error_code unreadable;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task", unreadable)) {
    const std::string name = entry.path().filename();
    int id = 0;
    if (std::from_chars(name.data(), name.data() + name.size(), id).ec == std::errc()) ids.push_back(id);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::string reason_of(int error) {
  std::string why;
  if (error == ENOENT || error == EOPNOTSUPP || error == ENODEV) {
    why = "the machine has no such counter, as many virtual machines have none";
  } else if (error == EACCES || error == EPERM) {
    int level = 0;
    std::ifstream file("/proc/sys/kernel/perf_event_paranoid");
    why = file >> level ? fmt::format("perf_event_paranoid is {}", level) : "not permitted";
  } else if (error == EMFILE) {
    why = "more threads and events than the limit of open files";
  } else if (error == ENOSYS) {
    why = "the kernel has no perf_event_open";
  }
  const std::string text = std::strerror(error);
  return why.empty() ? text : fmt::format("{} ({})", text, why);
}

bool ran(const std::vector<std::optional<HardwareReport::Count>>& counts) {
  return std::any_of(counts.begin(), counts.end(),
                     [](const auto& count) { return count && count->value > 0; });
}

}  // namespace

std::size_t HardwareReport::index_of(std::string_view name) const {
  return static_cast<std::size_t>(
      std::find_if(events.begin(), events.end(), [&](const Event& event) { return event.name == name; }) -
      events.begin());
}

std::optional<double> HardwareReport::total(std::string_view name) const {
  const std::size_t event = index_of(name);
  if (threads.empty()) return {};
  double sum = 0;
  for (const Thread& thread : threads) {
    if (!thread.counts[event]) return {};
    sum += thread.counts[event]->value;
  }
  return sum;
}

std::optional<HardwareReport::Count> scaled_count(std::uint64_t value, std::uint64_t enabled,
                                                  std::uint64_t running) {
  if (enabled == 0) return HardwareReport::Count{};
  if (running == 0) return {};
  const double share = static_cast<double>(running) / static_cast<double>(enabled);
  return HardwareReport::Count{static_cast<double>(value) / share, share};
}

HardwareReport count_hardware(FunctionRef<void()> work) {
  const std::vector<int> ids = threads_of_this_process();
  std::vector<std::vector<Counter>> counters(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i)
    for (const EventKind& kind : kKinds) counters[i].emplace_back(kind, ids[i]);

  for (auto& of_thread : counters)
    for (Counter& counter : of_thread) counter.start();
  work();
  for (auto& of_thread : counters)
    for (Counter& counter : of_thread) counter.stop();

  HardwareReport report;
  for (const EventKind& kind : kKinds) report.events.push_back({kind.name, {}});
  for (std::size_t i = 0; i < ids.size(); ++i) {
    HardwareReport::Thread thread{.id = ids[i], .counts = {}};
    bool ended = false;
    for (std::size_t event = 0; event < kKinds.size(); ++event) {
      const Counter& counter = counters[i][event];
      thread.counts.push_back(counter.read());
      ended |= counter.error() == ESRCH;  // between the list of threads and this
      if (counter.error() != 0 && counter.error() != ESRCH && report.events[event].unavailable.empty())
        report.events[event].unavailable = reason_of(counter.error());
    }
    if (!ended && ran(thread.counts)) report.threads.push_back(std::move(thread));
  }
  for (std::size_t event = 0; event < kKinds.size(); ++event) {
    std::string& reason = report.events[event].unavailable;
    const bool missed = std::any_of(report.threads.begin(), report.threads.end(),
                                    [&](const auto& thread) { return !thread.counts[event]; });
    if (missed && reason.empty()) reason = "too short: it never had its turn on the CPU's counters";
    if (reason.empty()) continue;
    for (auto& thread : report.threads)
      thread.counts[event].reset();  // of some threads only, it would mislead
  }
  return report;
}

}  // namespace rasterbench
