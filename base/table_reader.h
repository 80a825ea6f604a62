// A table of a TOML file: typed values, lists, and errors that name file, line and key.
#pragma once

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/error.h"
#include "base/function_ref.h"
#include "base/suggest.h"

namespace rasterbench {

/// Reads the values of one table and remembers which keys were asked for, so that the others are errors. A
/// key that is missing leaves the caller's value as it is; one that has another type or is out of range is an
/// InputError with its line. The table must outlive the reader.
class TableReader {
 public:
  TableReader(const toml::table& table, std::string file) : table_(table), file_(std::move(file)) {}

  /// Throws InputError at the line of `node`.
  [[noreturn]] void fail(const toml::node& node, std::string_view key, const std::string& message) const;
  /// Throws InputError at the line where the table begins.
  [[noreturn]] void fail(std::string_view key, const std::string& message) const;

  /// Runs `parse`, putting file and line in front of what it throws.
  template <class Parse>
  auto located(const toml::node& node, const std::string& key, Parse parse) const {
    try {
      return parse();
    } catch (const InputError& error) {
      fail(node, key, error.what());
    }
  }

  /// The value of a key, or nullptr. The key is known from now on.
  const toml::node* find(const std::string& key);

  /// A number, low <= number <= high.
  void number(const std::string& key, double low, double high, double& value);
  /// Any number, or a string that C reads as one: "0x1p-149" says bits that decimal digits would hide.
  void exact_number(const std::string& key, double& value);
  /// The same `count` times: what `node`, a value or an element of `key`, lists.
  std::vector<double> exact_numbers(const toml::node& node, const std::string& key, std::size_t count) const;

  /// A whole number, low <= number <= high; Value is any integer type that holds both.
  template <class Value>
  void integer(const std::string& key, std::int64_t low, std::int64_t high, Value& value) {
    if (const toml::node* node = find(key)) value = static_cast<Value>(integer_of(*node, key, low, high));
  }
  /// The same of `node`, a value or an element of `key`.
  std::int64_t integer_of(const toml::node& node, const std::string& key, std::int64_t low,
                          std::int64_t high) const;

  void boolean(const std::string& key, bool& value);
  void text(const std::string& key, std::string& value);

  /// Calls visit(node) for the elements of a list, or for a single value.
  void each(const std::string& key, FunctionRef<void(const toml::node&)> visit);
  /// Calls visit(node) for the elements of a list, which alone is allowed.
  void each_element(const std::string& key, FunctionRef<void(const toml::node&)> visit);
  /// Calls visit(key, node) for every key of the table; all are then known.
  void each_key(FunctionRef<void(const std::string&, const toml::node&)> visit);

  /// A list of strings (or one), each turned into a value by parse(string).
  template <class Value, class Parse>
  void strings(const std::string& key, std::vector<Value>& values, Parse parse) {
    each(key, [&](const toml::node& node) {
      if (!node.is_string()) fail(node, key, "must be a string or a list of strings");
      values.push_back(located(node, key, [&] { return parse(*node.value<std::string>()); }));
    });
  }
  /// A list of strings, which alone is allowed.
  void string_list(const std::string& key, std::vector<std::string>& values);
  /// A list of words (or one) of those that are `known`; `fallback` where there is none.
  void words(const std::string& key, const std::vector<std::string>& known, const std::string& fallback,
             std::vector<std::string>& values);

  /// Calls read(reader) with a reader of the table under `key`, whose unknown keys are then errors; `where`
  /// names the table in them.
  void table(const std::string& key, const std::string& where, FunctionRef<void(TableReader&)> read);

  /// Throws InputError at the first key that nobody asked for; `where` names the table.
  void reject_unknown_keys(const std::string& where) const;

 private:
  double exact_number_of(const toml::node& node, const std::string& key) const;

  const toml::table& table_;
  std::string file_;
  std::vector<std::string> known_;
};

/// The table of a whole file, `file` in errors. Throws InputError with the line where `text` is not TOML.
toml::table parse_toml(std::string_view text, const std::string& file);

}  // namespace rasterbench
