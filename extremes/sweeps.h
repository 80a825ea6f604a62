// Stability sweeps: one property of a scene taken to its extreme, every mode judged along the way.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/scene.h"

namespace rasterbench::extremes {

/// One property and the values it takes, from harmless to extreme.
struct Sweep {
  std::string name;
  std::string parameter;  ///< what is varied, with its unit
  bool by_truth;          ///< judged by the end-to-end truth; otherwise by the exact oracle
  double first, last;     ///< of the parameter, spaced evenly in its logarithm
  int steps;              ///< values unless somebody asks for another number
  bool powers_of_two;     ///< values are rounded to powers of two
  std::function<Scene(double)> make;
};

std::span<const Sweep> sweeps();

/// The values of a sweep, `steps` >= 2 of them; fewer powers of two where there are not so many.
std::vector<double> parameter_values(const Sweep& sweep, int steps);

/// One mode at one value of the parameter.
struct SweepPoint {
  std::string_view numeric;
  std::int64_t pixels = 0;
  std::int64_t drawn = 0;  ///< by the judge
  std::int64_t wrong = 0;  ///< ids that differ from the judge's; of the truth, its ambiguous ones left out
  std::int64_t unexplained = 0;  ///< beyond the mode's bound, in id or in depth
  /// Largest distance in pixels of a misclassified sample to the edge; known to the oracle only.
  std::optional<double> worst_distance;
  double max_depth_error_steps = 0;  ///< of d where the id is right, in steps of 2^-24

  bool is_broken() const;  ///< more than kBrokenShare of the drawn pixels are wrong
};

/// Draws the scene in each of `modes` (kernel tile_parallel) and judges it. Throws InputError.
std::vector<SweepPoint> measure(const Sweep& sweep, double value, std::span<const std::string_view> modes,
                                int threads);

}  // namespace rasterbench::extremes
