// The list of numeric modes: adding one is one header and its name here.
#pragma once

#include <span>
#include <string_view>
#include <tuple>

#include "numeric/f32.h"
#include "numeric/f64.h"
#include "numeric/fixed_8.h"

namespace rasterbench {

using AllModes = std::tuple<F32, F64, Fixed8>;

/// Calls visit.template operator()<Mode>() for every mode, in the order of the list.
template <class Visitor>
void for_each_mode(Visitor&& visit) {
  [&]<class... Modes>(std::tuple<Modes...>*) {
    (visit.template operator()<Modes>(), ...);
  }(static_cast<AllModes*>(nullptr));
}

/// Names and promises of every mode.
std::span<const ModeInfo> mode_infos();

/// The info of a mode by name, or null.
const ModeInfo* find_mode(std::string_view name);

}  // namespace rasterbench
