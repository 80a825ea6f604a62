// Values of TOML tables, with errors that name file, line and key.
#pragma once

#include <fmt/format.h>
#include <toml++/toml.h>

#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/suggest.h"

namespace rasterbench::extremes {

/// Reads the values of one table and remembers which keys were asked for, so that the others are errors.
class TableReader {
 public:
  TableReader(const toml::table& table, std::string file) : table_(table), file_(std::move(file)) {}

  [[noreturn]] void fail(const toml::node& node, const std::string& key, const std::string& message) const {
    throw InputError(
        {.file = file_, .line = static_cast<std::int64_t>(node.source().begin.line), .field = key}, message);
  }
  /// An error of the table itself.
  [[noreturn]] void fail(const std::string& key, const std::string& message) const {
    fail(table_, key, message);
  }

  const std::string& file() const { return file_; }

  const toml::node* find(const std::string& key) {
    known_.push_back(key);
    return table_.get(key);
  }

  std::string text(const std::string& key, const std::string& fallback = {}) {
    const toml::node* node = find(key);
    if (!node) return fallback;
    if (!node->is_string()) fail(*node, key, "must be a string");
    return *node->value<std::string>();
  }

  bool flag(const std::string& key) {
    const toml::node* node = find(key);
    if (!node) return false;
    if (!node->is_boolean()) fail(*node, key, "must be true or false");
    return *node->value<bool>();
  }

  std::int64_t integer(const std::string& key, std::int64_t fallback, std::int64_t low, std::int64_t high) {
    const toml::node* node = find(key);
    return node ? integer_of(*node, key, low, high) : fallback;
  }

  std::int64_t integer_of(const toml::node& node, const std::string& key, std::int64_t low,
                          std::int64_t high) const {
    const auto value = node.value<std::int64_t>();
    if (!node.is_integer() || *value < low || *value > high)
      fail(node, key, fmt::format("must be a whole number from {} to {}", low, high));
    return *value;
  }

  double number(const std::string& key, double fallback) {
    const toml::node* node = find(key);
    return node ? number_of(*node, key) : fallback;
  }

  /// A number, or a string that C reads as one: "0x1p-149" says bits that decimal digits would hide.
  double number_of(const toml::node& node, const std::string& key) const {
    if (node.is_number()) {
      if (const auto value = node.value<double>()) return *value;
    } else if (node.is_string()) {
      const std::string text = *node.value<std::string>();
      char* end = nullptr;
      const double value = std::strtod(text.c_str(), &end);
      if (!text.empty() && *end == '\0') return value;
    }
    fail(node, key, "must be a number, or a string such as \"0x1.8p-3\"");
  }

  /// Calls visit(node) for the elements of a list.
  template <class Visit>
  void each(const std::string& key, Visit visit) {
    const toml::node* node = find(key);
    if (!node) return;
    if (!node->is_array() || node->as_array()->empty()) fail(*node, key, "must be a list with elements");
    for (const toml::node& element : *node->as_array()) visit(element);
  }

  std::vector<std::string> strings(const std::string& key) {
    std::vector<std::string> values;
    each(key, [&](const toml::node& node) {
      if (!node.is_string()) fail(node, key, "must be a list of strings");
      values.push_back(*node.value<std::string>());
    });
    return values;
  }

  /// Lists of numbers: `count` of them in each element of the list.
  std::vector<std::vector<double>> rows(const std::string& key, std::size_t count) {
    std::vector<std::vector<double>> rows;
    each(key, [&](const toml::node& node) { rows.push_back(row(node, key, count)); });
    return rows;
  }

  std::vector<double> row(const toml::node& node, const std::string& key, std::size_t count) const {
    const toml::array* array = node.as_array();
    if (array == nullptr || array->size() != count)
      fail(node, key, fmt::format("must be a list of {} numbers", count));
    std::vector<double> numbers;
    for (const toml::node& element : *array) numbers.push_back(number_of(element, key));
    return numbers;
  }

  /// Calls read(TableReader&) on an inline table, whose unknown keys are then errors.
  template <class Read>
  void table(const std::string& key, const std::string& where, Read read) {
    const toml::node* node = find(key);
    if (!node) return;
    if (!node->is_table()) fail(*node, key, "must be a table");
    TableReader reader(*node->as_table(), file_);
    read(reader);
    reader.reject_unknown_keys(where);
  }

  /// Calls visit(name, node) for every key of the table; all are then known.
  template <class Visit>
  void each_key(Visit visit) {
    for (const auto& [key, node] : table_) {
      known_.emplace_back(key.str());
      visit(known_.back(), node);
    }
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

}  // namespace rasterbench::extremes
