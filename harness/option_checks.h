// Checks of option values that CLI11's own let through: they take nan, and clamp whole numbers that do not
// fit.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>

namespace rasterbench {

/// A year: longer than any run, and short enough for the clocks' integers.
inline constexpr double kLongestSeconds = 366.0 * 24 * 3600;

/// A number from `least` to `most`, and not nan.
CLI::Validator number_check(double least, double most);

/// Decimal digits of a whole number from `least` to `most`.
CLI::Validator whole_number_check(std::int64_t least,
                                  std::int64_t most = std::numeric_limits<std::int64_t>::max());

}  // namespace rasterbench
