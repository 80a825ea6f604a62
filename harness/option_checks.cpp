#include "harness/option_checks.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>

namespace rasterbench {
namespace {

/// What all of `text` says as a Number, if it says one.
template <class Number>
std::optional<Number> parsed(const std::string& text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

}  // namespace

CLI::Validator number_check(double least, double most) {
  const std::string range = fmt::format("a number from {:g} to {:g}", least, most);
  return {[=](const std::string& text) {
            const auto value = parsed<double>(text);
            return value && *value >= least && *value <= most
                       ? std::string()
                       : fmt::format("must be {}, not {}", range, text);
          },
          ""};
}

CLI::Validator whole_number_check(std::int64_t least, std::int64_t most) {
  const std::string range = most == std::numeric_limits<std::int64_t>::max()
                                ? fmt::format("a whole number from {} on, less than 2^63", least)
                                : fmt::format("a whole number from {} to {}", least, most);
  return {[=](const std::string& text) {
            const auto value = parsed<std::int64_t>(text);
            return value && *value >= least && *value <= most
                       ? std::string()
                       : fmt::format("must be {}, not {}", range, text);
          },
          ""};
}

}  // namespace rasterbench
