// A table of a study file: typed values, lists, and errors that name file, line and key.
#pragma once

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>
#include <vector>

#include "base/error.h"
#include "base/suggest.h"

namespace rasterbench {

/// Reads the values of one table and remembers which keys were asked for, so that the others are errors.
class TableReader {
 public:
  TableReader(const toml::table& table, std::string file) : table_(table), file_(std::move(file)) {}

  [[noreturn]] void fail(const toml::node& node, const std::string& key, const std::string& message) const {
    throw InputError(
        {.file = file_, .line = static_cast<std::int64_t>(node.source().begin.line), .field = key}, message);
  }

  /// Runs `parse`, putting file and line in front of what it throws.
  template <class Parse>
  auto located(const toml::node& node, const std::string& key, Parse parse) const {
    try {
      return parse();
    } catch (const InputError& error) {
      fail(node, key, error.what());
    }
  }

  const toml::node* find(const std::string& key) {
    known_.push_back(key);
    return table_.get(key);
  }

  void number(const std::string& key, double low, double high, double& value) {
    const toml::node* node = find(key);
    if (!node) return;
    const auto read = node->value<double>();  // empty for an integer that no double holds
    if (!node->is_number() || !read || !(*read >= low) || !(*read <= high))
      fail(*node, key, fmt::format("must be a number from {:g} to {:g}", low, high));
    value = *read;
  }

  void integer(const std::string& key, std::int64_t low, std::int64_t high, auto& value) {
    const toml::node* node = find(key);
    if (!node) return;
    const auto read = node->value<std::int64_t>();
    if (!node->is_integer() || *read < low || *read > high)
      fail(*node, key, fmt::format("must be a whole number from {} to {}", low, high));
    value = static_cast<std::remove_reference_t<decltype(value)>>(*read);
  }

  void boolean(const std::string& key, bool& value) {
    const toml::node* node = find(key);
    if (!node) return;
    if (!node->is_boolean()) fail(*node, key, "must be true or false");
    value = *node->value<bool>();
  }

  void text(const std::string& key, std::string& value) {
    const toml::node* node = find(key);
    if (!node) return;
    if (!node->is_string()) fail(*node, key, "must be a string");
    value = *node->value<std::string>();
  }

  /// Calls visit(node) for the elements of a list, or for a single value.
  void each(const std::string& key, const std::function<void(const toml::node&)>& visit) {
    const toml::node* node = find(key);
    if (!node) return;
    const toml::array* array = node->as_array();
    if (!array) return visit(*node);
    if (array->empty()) fail(*node, key, "is an empty list");
    for (const toml::node& element : *array) visit(element);
  }

  /// A list of strings (or one), each turned into a value by parse(string).
  template <class Value, class Parse>
  void strings(const std::string& key, std::vector<Value>& values, Parse parse) {
    each(key, [&](const toml::node& node) {
      if (!node.is_string()) fail(node, key, "must be a string or a list of strings");
      values.push_back(located(node, key, [&] { return parse(*node.value<std::string>()); }));
    });
  }

  void words(const std::string& key, const std::vector<std::string>& known, const std::string& fallback,
             std::vector<std::string>& values) {
    strings(key, values, [&](const std::string& word) {
      if (std::find(known.begin(), known.end(), word) == known.end())
        throw InputError(unknown_name("value", word, known));
      return word;
    });
    if (values.empty()) values.push_back(fallback);
  }

  void reject_unknown_keys(const std::string& where) const {
    for (const auto& [key, node] : table_)
      if (const std::string name(key.str()); std::find(known_.begin(), known_.end(), name) == known_.end())
        throw InputError(
            {.file = file_, .line = static_cast<std::int64_t>(key.source().begin.line), .field = name},
            unknown_name("key of " + where, name, known_));
  }

 private:
  const toml::table& table_;
  std::string file_;
  std::vector<std::string> known_;
};

/// The table of a whole file. Throws InputError with the line where `text` is not TOML.
inline toml::table parse_toml(const std::string& text, const std::string& file) {
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw InputError({.file = file, .line = static_cast<std::int64_t>(error.source().begin.line)},
                     std::string(error.description()));
  }
}

}  // namespace rasterbench
