// What the system says of the machine's CPUs while something is timed: how busy they were, how much of them a
// hypervisor kept, how fast they ran.
#pragma once

#include <filesystem>
#include <istream>
#include <optional>
#include <string>
#include <variant>

namespace rasterbench {

/// CPU seconds of the whole machine since it started.
struct CpuTimes {
  double busy = 0;    ///< of processes, the kernel and interrupts
  double stolen = 0;  ///< that a virtual CPU wanted and the hypervisor gave to others
};

/// The first line of /proc/stat (proc(5)); empty where there is none.
std::optional<CpuTimes> parse_cpu_times(std::istream& stat);
std::optional<CpuTimes> read_cpu_times();

/// CPU seconds of this process and of the children that it has waited for (getrusage(2)).
double own_cpu_seconds();

/// A number, or why there is none: "unavailable: REASON".
using Reading = std::variant<double, std::string>;

/// The one-minute load average.
Reading read_load_average();

/// The highest frequency of any CPU at this moment, in MHz: idle CPUs are slow without slowing anything.
/// `cpus` is the system's folder of them, which tests replace.
Reading read_frequency_mhz(const std::filesystem::path& cpus = "/sys/devices/system/cpu");

/// How often cores and packages were slowed down since the start because they were hot, summed over all CPUs.
Reading read_throttle_count(const std::filesystem::path& cpus = "/sys/devices/system/cpu");

}  // namespace rasterbench
