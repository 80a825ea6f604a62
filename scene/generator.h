// Generators: models from a name and a few numbers, the same bytes for the same specification everywhere.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/scene.h"

namespace rasterbench {

/// One KEY of a generator: a number with a default and a range, or one word of a list.
struct GeneratorKey {
  std::string name = {};
  std::string meaning = {};             ///< one line for `list scenes`
  double default_value = 0;             ///< for a number; for a word, the index into words
  double minimum = 0, maximum = 0;      ///< inclusive range of a number
  bool integer = false;                 ///< numbers may be written 1e6; integer ones must have no fraction
  std::vector<std::string> words = {};  ///< not empty: the value is one of these words
};

/// The largest seed: a specification's numbers are doubles, and up to here no two integers are the same one.
inline constexpr double kMaxSeed = 9007199254740991;  // 2^53 - 1

/// The values of a specification, every key present.
class GeneratorValues {
 public:
  explicit GeneratorValues(std::map<std::string, double> values) : values_(std::move(values)) {}
  double number(const std::string& key) const { return values_.at(key); }
  std::int64_t integer(const std::string& key) const { return static_cast<std::int64_t>(values_.at(key)); }

 private:
  std::map<std::string, double> values_;
};

/// A generator: registered beside its function, in its own file (adding a generator is adding one file).
struct Generator {
  std::string name;
  std::string meaning;  ///< one line: what it stresses
  std::vector<GeneratorKey> keys;
  std::function<Scene(const GeneratorValues&)> make;  ///< Scene.model.name is filled in by generate()
};

/// Every registered generator, by name.
std::span<const Generator> generators();

/// Puts a generator into the list; used by a namespace-scope constant in the generator's file.
struct GeneratorRegistration {
  explicit GeneratorRegistration(Generator generator);
};

/// Runs "NAME[:KEY=VALUE,...]". Throws InputError (with a did-you-mean) on an unknown name or key, a key
/// given twice or a bad value.
Scene generate(std::string_view specification);

/// An empty list with room for `count` triangles. Throws InputError, naming the count, when the machine has
/// not the memory.
std::vector<Triangle> room_for_triangles(std::int64_t count);

/// A small random generator with the same sequence everywhere (SplitMix64; Steele, Lea, Flood, OOPSLA 2014):
/// the distributions of <random> differ between standard libraries.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits();  ///< 64 uniform bits
  double uniform();      ///< in [0, 1), 53 bits
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

 private:
  std::uint64_t state_;
};

}  // namespace rasterbench
