#include "numeric/modes.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/suggest.h"

namespace rasterbench {

const char* apart::fma_unavailable() {
#if defined(__x86_64__)
  __builtin_cpu_init();  // kernels ask before the constructors of the run-time library may have run
  return __builtin_cpu_supports("fma") ? "" : "this CPU has no fused multiply-add";
#else
  return "";
#endif
}

std::span<const ModeInfo> mode_infos() {
  static const std::vector<ModeInfo> infos = [] {
    std::vector<ModeInfo> all;
    for_each_mode([&]<NumericMode Mode>() {
      all.push_back(Mode::kInfo);
      if constexpr (requires { Mode::unavailable(); }) all.back().unavailable = Mode::unavailable();
    });
    all.push_back(kRayCastInfo);
#if defined(RASTERBENCH_WITHOUT_EMBREE)
    all.back().unavailable = "Embree was not found when this was built";
#endif
    return all;
  }();
  return infos;
}

const ModeInfo* find_mode(std::string_view name) {
  const auto infos = mode_infos();
  const auto found =
      std::find_if(infos.begin(), infos.end(), [&](const ModeInfo& info) { return info.name == name; });
  return found == infos.end() ? nullptr : &*found;
}

const ModeInfo& available_mode(std::string_view name, std::string_view field) {
  const ModeInfo* info = find_mode(name);
  if (info == nullptr) {
    std::vector<std::string> known;
    for (const ModeInfo& mode : mode_infos()) known.emplace_back(mode.name);
    throw InputError({.field = std::string(field)}, unknown_name("numeric mode", name, known));
  }
  if (!info->unavailable.empty())
    throw InputError({.field = std::string(field)}, fmt::format("{}: {}", name, info->unavailable));
  return *info;
}

}  // namespace rasterbench
