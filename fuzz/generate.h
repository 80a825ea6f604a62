// Random and adversarial cases.
#pragma once

#include <cstdint>

#include "fuzz/case.h"
#include "scene/generator.h"

namespace rasterbench::fuzz {

/// Case number `index` of the sequence of `seed` in `space`, whatever was made before.
FuzzCase make_case(std::uint64_t seed, std::int64_t index, Space space);

/// A few triangles on the screen: corners on lattices, on samples and one ulp off them, slivers, shared
/// corners and edges, copies, denormals, corners at the guard band; depths on lattices and in common planes.
FuzzCase screen_case(Random& random);

/// A scene: triangles of any size about a camera of any kind, many across its near plane, or a small
/// generated model.
FuzzCase world_case(Random& random);

/// Shorthand of the generators of cases: 0 <= pick(n) < n; one_in(n) is true once in n. Never two throws as
/// arguments of one call or operands of one operator: compilers order them as they like.
class Dice {
 public:
  explicit Dice(Random& random) : random_(random) {}
  int pick(int n) { return static_cast<int>(random_.bits() % static_cast<std::uint64_t>(n)); }
  bool one_in(int n) { return pick(n) == 0; }
  double uniform(double low, double high) { return random_.uniform(low, high); }
  /// 10^exponent, the exponent uniform.
  double magnitude(double low_exponent, double high_exponent);
  std::uint64_t bits() { return random_.bits(); }

 private:
  Random& random_;
};

}  // namespace rasterbench::fuzz
