#include "base/isa.h"

#include <hwy/targets.h>

#include <array>
#include <vector>

#include "base/error.h"
#include "base/isa_dispatch.h"
#include "base/suggest.h"

namespace rasterbench {
namespace {

constexpr std::array kIsas{Isa::kBaseline, Isa::kSse4, Isa::kAvx2, Isa::kAvx512};

}  // namespace

std::string_view to_string(Isa isa) {
  constexpr std::array<std::string_view, kIsas.size()> kNames{"baseline", "sse4", "avx2", "avx512"};
  return kNames[static_cast<std::size_t>(isa)];
}

std::span<const Isa> all_isas() { return kIsas; }

bool is_supported(Isa isa) {
  return isa == Isa::kBaseline || (hwy::SupportedTargets() & highway_target(isa)) != 0;
}

Isa best_isa() {
  static const Isa best = [] {
    Isa widest = Isa::kBaseline;
    for (const Isa isa : kIsas)
      if (is_supported(isa)) widest = isa;
    return widest;
  }();
  return best;
}

Isa parse_isa(const std::string& text, std::string_view field) {
  if (text == "best") return best_isa();
  std::vector<std::string> names{"best"};
  for (const Isa isa : kIsas) {
    if (text == to_string(isa)) return isa;
    names.emplace_back(to_string(isa));
  }
  throw InputError({.field = std::string(field)}, unknown_name("instruction set", text, names));
}

}  // namespace rasterbench
