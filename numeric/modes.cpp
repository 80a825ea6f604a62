#include "numeric/modes.h"

#include <algorithm>
#include <vector>

namespace rasterbench {

std::span<const ModeInfo> mode_infos() {
  static const std::vector<ModeInfo> infos = [] {
    std::vector<ModeInfo> all;
    for_each_mode([&]<NumericMode Mode>() { all.push_back(Mode::kInfo); });
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

}  // namespace rasterbench
