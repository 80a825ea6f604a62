#include "base/table_reader.h"

#include <cstdlib>

namespace rasterbench {

void TableReader::fail(const toml::node& node, std::string_view key, const std::string& message) const {
  throw InputError(
      {.file = file_, .line = static_cast<std::int64_t>(node.source().begin.line), .field = std::string(key)},
      message);
}

void TableReader::fail(std::string_view key, const std::string& message) const { fail(table_, key, message); }

const toml::node* TableReader::find(const std::string& key) {
  known_.push_back(key);
  return table_.get(key);
}

void TableReader::number(const std::string& key, double low, double high, double& value) {
  const toml::node* node = find(key);
  if (!node) return;
  const auto read = node->value<double>();  // empty for an integer that no double holds
  if (!node->is_number() || !read || !(*read >= low) || !(*read <= high))
    fail(*node, key, fmt::format("must be a number from {:g} to {:g}", low, high));
  value = *read;
}

void TableReader::exact_number(const std::string& key, double& value) {
  if (const toml::node* node = find(key)) value = exact_number_of(*node, key);
}

std::vector<double> TableReader::exact_numbers(const toml::node& node, const std::string& key,
                                               std::size_t count) const {
  const toml::array* array = node.as_array();
  if (array == nullptr || array->size() != count)
    fail(node, key, fmt::format("must be a list of {} numbers", count));
  std::vector<double> numbers;
  for (const toml::node& element : *array) numbers.push_back(exact_number_of(element, key));
  return numbers;
}

double TableReader::exact_number_of(const toml::node& node, const std::string& key) const {
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

std::int64_t TableReader::integer_of(const toml::node& node, const std::string& key, std::int64_t low,
                                     std::int64_t high) const {
  const auto value = node.value<std::int64_t>();
  if (!node.is_integer() || *value < low || *value > high)
    fail(node, key, fmt::format("must be a whole number from {} to {}", low, high));
  return *value;
}

void TableReader::boolean(const std::string& key, bool& value) {
  const toml::node* node = find(key);
  if (!node) return;
  if (!node->is_boolean()) fail(*node, key, "must be true or false");
  value = *node->value<bool>();
}

void TableReader::text(const std::string& key, std::string& value) {
  const toml::node* node = find(key);
  if (!node) return;
  if (!node->is_string()) fail(*node, key, "must be a string");
  value = *node->value<std::string>();
}

void TableReader::each(const std::string& key, FunctionRef<void(const toml::node&)> visit) {
  const toml::node* node = find(key);
  if (!node) return;
  const toml::array* array = node->as_array();
  if (!array) return visit(*node);
  if (array->empty()) fail(*node, key, "is an empty list");
  for (const toml::node& element : *array) visit(element);
}

void TableReader::each_element(const std::string& key, FunctionRef<void(const toml::node&)> visit) {
  const toml::node* node = find(key);
  if (!node) return;
  const toml::array* array = node->as_array();
  if (!array || array->empty()) fail(*node, key, "must be a list with elements");
  for (const toml::node& element : *array) visit(element);
}

void TableReader::each_key(FunctionRef<void(const std::string&, const toml::node&)> visit) {
  for (const auto& [key, node] : table_) {
    const std::string name(key.str());
    known_.push_back(name);
    visit(name, node);
  }
}

void TableReader::string_list(const std::string& key, std::vector<std::string>& values) {
  each_element(key, [&](const toml::node& node) {
    if (!node.is_string()) fail(node, key, "must be a list of strings");
    values.push_back(*node.value<std::string>());
  });
}

void TableReader::words(const std::string& key, const std::vector<std::string>& known,
                        const std::string& fallback, std::vector<std::string>& values) {
  strings(key, values, [&](const std::string& word) {
    if (std::find(known.begin(), known.end(), word) == known.end())
      throw InputError(unknown_name("value", word, known));
    return word;
  });
  if (values.empty()) values.push_back(fallback);
}

void TableReader::table(const std::string& key, const std::string& where,
                        FunctionRef<void(TableReader&)> read) {
  const toml::node* node = find(key);
  if (!node) return;
  if (!node->is_table()) fail(*node, key, "must be a table");
  TableReader reader(*node->as_table(), file_);
  read(reader);
  reader.reject_unknown_keys(where);
}

void TableReader::reject_unknown_keys(const std::string& where) const {
  for (const auto& [key, node] : table_)
    if (const std::string name(key.str()); std::find(known_.begin(), known_.end(), name) == known_.end())
      throw InputError(
          {.file = file_, .line = static_cast<std::int64_t>(key.source().begin.line), .field = name},
          unknown_name("key of " + where, name, known_));
}

toml::table parse_toml(std::string_view text, const std::string& file) {
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw InputError({.file = file, .line = static_cast<std::int64_t>(error.source().begin.line)},
                     std::string(error.description()));
  }
}

}  // namespace rasterbench
