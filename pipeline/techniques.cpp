#include "pipeline/techniques.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "base/error.h"
#include "base/suggest.h"

namespace rasterbench {
namespace {

constexpr TechniqueInfo kInfos[] = {
    {"fragments", "tiny triangles are sampled where they are transformed, not in their tile",
     &Techniques::fragments},
    {"blocks", "large triangles are tested against edges and depths, and drawn, by blocks of 16 x 16 pixels",
     &Techniques::blocks},
    {"front_to_back",
     "a tile draws in order of depth, large triangles one by one, others as neighbours came, and leaves out "
     "what is "
     "hidden",
     &Techniques::front_to_back},
    {"streaming", "colours and depths bypass the caches on their way to memory (not with isa baseline)",
     &Techniques::streaming},
    {"huge_pages", "buffers of pixels lie in pages of 2 MiB where the system has them",
     &Techniques::huge_pages},
};

/// The words between separators; n separators have n + 1 words, which may be empty.
std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> words;
  for (;;) {
    const std::size_t end = text.find(separator);
    words.emplace_back(text.substr(0, end));
    if (end == std::string_view::npos) return words;
    text.remove_prefix(end + 1);
  }
}

/// `also_known` is what may stand in place of a name here, for the did-you-mean.
const TechniqueInfo& find_technique(const std::string& name, const std::string& field,
                                    std::vector<std::string> also_known) {
  for (const TechniqueInfo& info : kInfos) {
    if (info.name == name) return info;
    also_known.emplace_back(info.name);
  }
  throw InputError({.field = field}, unknown_name("technique", name, also_known));
}

}  // namespace

std::span<const TechniqueInfo> technique_infos() { return kInfos; }

Techniques common_techniques(const Techniques& a, const Techniques& b) {
  Techniques common;
  for (const TechniqueInfo& info : kInfos) common.*info.switched = a.*info.switched && b.*info.switched;
  return common;
}

Techniques parse_techniques(const std::string& text, const std::string& field) {
  if (text == "all") return {};
  if (text == "none") return kNoTechniques;
  if (text.starts_with("all-")) {
    Techniques techniques;
    for (const std::string& name : split(std::string_view(text).substr(4), '-'))
      techniques.*find_technique(name, field, {}).switched = false;
    return techniques;
  }
  Techniques techniques = kNoTechniques;
  const std::vector<std::string> names = split(text, '+');
  for (const std::string& name : names) {
    if (names.size() > 1 && (name == "all" || name == "none"))
      throw InputError({.field = field},
                       fmt::format("'{}' stands alone, not among names joined by '+'", name));
    techniques.*find_technique(name, field, {"all", "none"}).switched = true;
  }
  return techniques;
}

std::string to_string(const Techniques& techniques) {
  std::string present, missing;
  std::size_t count = 0;
  for (const TechniqueInfo& info : kInfos) {
    const bool has = techniques.*info.switched;
    count += has;
    std::string& names = has ? present : missing;
    names += (names.empty() ? "" : "+") + std::string(info.name);
  }
  if (count == std::size(kInfos)) return "all";
  if (count == 0) return "none";
  return count + 1 == std::size(kInfos) ? "all-" + missing : present;
}

}  // namespace rasterbench
