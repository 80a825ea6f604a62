#include "scene/generator.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "base/buffer.h"
#include "base/error.h"
#include "base/suggest.h"

namespace rasterbench {
namespace {

/// In a function, so that it exists before the first registration, whatever the order of the files'
/// initialisation.
std::vector<Generator>& registry() {
  static std::vector<Generator> list;
  return list;
}

double parse_value(const GeneratorKey& key, std::string_view text, const Place& place) {
  if (!key.words.empty()) {
    const auto word = std::find(key.words.begin(), key.words.end(), text);
    if (word == key.words.end()) throw InputError(place, unknown_name("value", text, key.words));
    return static_cast<double>(word - key.words.begin());
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw InputError(place, fmt::format("'{}' is not a number", text));
  if (key.integer && value != std::floor(value))
    throw InputError(place, fmt::format("{} is not an integer", text));
  if (value < key.minimum || value > key.maximum)
    throw InputError(place, fmt::format("{} is not in {}..{}", text, key.minimum, key.maximum));
  return value;
}

template <class Named>
std::vector<std::string> names_of(const std::vector<Named>& list) {
  std::vector<std::string> names;
  for (const Named& named : list) names.push_back(named.name);
  return names;
}

template <class Named>
const Named& find_named(const std::vector<Named>& list, std::string_view name, const char* kind,
                        const Place& place) {
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const Named& named) { return named.name == name; });
  if (found == list.end()) throw InputError(place, unknown_name(kind, name, names_of(list)));
  return *found;
}

GeneratorValues parse_values(const Generator& generator, std::string_view text,
                             const std::string& specification) {
  std::map<std::string, double> values;
  while (!text.empty()) {
    const std::string_view item = text.substr(0, text.find(','));
    text.remove_prefix(std::min(text.size(), item.size() + 1));
    const std::size_t equals = item.find('=');
    if (equals == std::string_view::npos)
      throw InputError({.file = specification}, fmt::format("'{}' is not KEY=VALUE", item));
    const std::string name(item.substr(0, equals));
    const GeneratorKey& key = find_named(generator.keys, name, "key", {.file = specification});
    const Place place{.file = specification, .field = name};
    if (!values.emplace(name, parse_value(key, item.substr(equals + 1), place)).second)
      throw InputError(place, "given twice");
  }
  for (const GeneratorKey& key : generator.keys) values.emplace(key.name, key.default_value);
  return GeneratorValues(std::move(values));
}

}  // namespace

std::span<const Generator> generators() { return registry(); }

GeneratorRegistration::GeneratorRegistration(Generator generator) {
  std::vector<Generator>& list = registry();
  const auto place = std::lower_bound(list.begin(), list.end(), generator,
                                      [](const Generator& a, const Generator& b) { return a.name < b.name; });
  if (place != list.end() && place->name == generator.name)
    throw std::logic_error("two generators are called " + generator.name);
  list.insert(place, std::move(generator));
}

Scene generate(std::string_view specification) {
  const std::string whole(specification);
  const std::size_t colon = specification.find(':');
  const Generator& generator =
      find_named(registry(), specification.substr(0, colon), "generator", {.file = whole});
  std::string_view arguments;
  if (colon != std::string_view::npos) {
    arguments = specification.substr(colon + 1);
    if (arguments.empty()) throw InputError({.file = whole}, "no KEY=VALUE after ':'");
    if (arguments.back() == ',') throw InputError({.file = whole}, "no KEY=VALUE after the last ','");
  }
  Scene scene = generator.make(parse_values(generator, arguments, whole));
  scene.model.name = whole;
  return scene;
}

std::vector<Triangle> room_for_triangles(std::int64_t count) {
  const std::size_t size = static_cast<std::size_t>(count);
  checked_bytes(size, sizeof(Triangle), fmt::format("a model of {} triangles", count));
  std::vector<Triangle> triangles;
  triangles.reserve(size);
  return triangles;
}

std::uint64_t Random::bits() {
  std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

double Random::uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

}  // namespace rasterbench
