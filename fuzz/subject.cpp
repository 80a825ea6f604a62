#include "fuzz/subject.h"

#include <fmt/format.h>

#include "base/error.h"
#include "numeric/modes.h"

namespace rasterbench::fuzz {

std::span<const Subject> subjects() {
  static const std::vector<Subject> all = [] {
    std::vector<Subject> available;
    for_each_mode([&]<NumericMode Mode>() {
      if (find_mode(Mode::kInfo.name)->unavailable.empty()) available.push_back(make_subject<Mode>());
    });
    return available;
  }();
  return all;
}

const Subject& find_subject(std::string_view mode) {
  const ModeInfo& info = available_mode(mode, "--numeric");
  for (const Subject& subject : subjects())
    if (subject.info.name == info.name) return subject;
  throw InputError({.field = "--numeric"}, fmt::format("{} draws no screen triangles", mode));
}

}  // namespace rasterbench::fuzz
