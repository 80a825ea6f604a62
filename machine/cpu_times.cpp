#include "machine/cpu_times.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <initializer_list>

namespace rasterbench {
namespace {

bool is_cpu_folder(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  return name.size() > 3 && name.starts_with("cpu") &&
         std::all_of(name.begin() + 3, name.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

/// The numbers in the files `names` of every CPU, folded by `fold`; what is missing is "unavailable".
template <class Fold>
Reading fold_cpus(const std::filesystem::path& cpus, std::initializer_list<const char*> names, Fold fold) {
  std::optional<double> result;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(cpus, error)) {
    if (!is_cpu_folder(entry.path())) continue;
    for (const char* name : names) {
      std::ifstream file(entry.path() / name);
      if (double value = 0; file >> value) result = result ? fold(*result, value) : value;
    }
  }
  if (result) return *result;
  return fmt::format("unavailable: no {}", (cpus / "cpu*" / *names.begin()).string());
}

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

}  // namespace

std::optional<CpuTimes> parse_cpu_times(std::istream& stat) {
  std::string word;
  double user = 0, nice = 0, system = 0, idle = 0, iowait = 0, irq = 0, softirq = 0, steal = 0;
  if (!(stat >> word >> user >> nice >> system >> idle >> iowait >> irq >> softirq >> steal) || word != "cpu")
    return std::nullopt;
  const double second = static_cast<double>(sysconf(_SC_CLK_TCK));  // in ticks
  return CpuTimes{.busy = (user + nice + system + irq + softirq) / second, .stolen = steal / second};
}

std::optional<CpuTimes> read_cpu_times() {
  std::ifstream file("/proc/stat");
  return parse_cpu_times(file);
}

double own_cpu_seconds() {
  double seconds = 0;
  for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    seconds += seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
  }
  return seconds;
}

Reading read_load_average() {
  std::ifstream file("/proc/loadavg");
  if (double load = 0; file >> load) return load;
  return "unavailable: no /proc/loadavg";
}

Reading read_frequency_mhz(const std::filesystem::path& cpus) {
  const Reading khz =
      fold_cpus(cpus, {"cpufreq/scaling_cur_freq"}, [](double a, double b) { return std::max(a, b); });
  if (const double* value = std::get_if<double>(&khz)) return *value / 1e3;
  return khz;
}

Reading read_throttle_count(const std::filesystem::path& cpus) {
  return fold_cpus(cpus, {"thermal_throttle/core_throttle_count", "thermal_throttle/package_throttle_count"},
                   [](double a, double b) { return a + b; });
}

}  // namespace rasterbench
