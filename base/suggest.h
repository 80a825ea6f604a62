// "did you mean": the nearest known name to one that is not known.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace rasterbench {

/// "unknown KIND 'WORD'; did you mean 'X'?", or with the list of all known names where none is near.
std::string unknown_name(std::string_view kind, std::string_view word, std::span<const std::string> known);

}  // namespace rasterbench
