// The TOML side of studies: keys, values and their errors.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "harness/study.h"

namespace rasterbench {

/// The machine that a study is planned for.
struct PlanTarget {
  int cpus = 1;               ///< what "max" means
  Isa best = Isa::kBaseline;  ///< what "best" means
};

/// One [[sweep]]: the values of each axis.
struct Sweep {
  std::vector<SceneReference> scenes;
  std::vector<std::pair<int, int>> sizes;  ///< empty: each scene's own
  std::vector<std::string> kernels;
  std::vector<std::string> peers;
  std::vector<std::string> numerics;
  std::vector<FillRule> fills;
  std::vector<NearRule> nears;
  std::vector<ExecutionConfig> executions;  ///< threads not yet set
  std::vector<int> threads;
  std::vector<Environment> environments;
  std::vector<int> tiles;
  std::vector<std::string> caches;
  std::vector<Generality> generalities;
  std::vector<Isa> isas;
  std::vector<Techniques> techniques;
  std::string weak;                      ///< of kWeakKinds, or empty: what grows with the threads
  std::vector<std::string> weak_scenes;  ///< of a weak sweep, each of `scenes` as the file writes it
  std::vector<std::string> weak_sizes;   ///< the same of `sizes`
};

/// Name, question, seed and [sampling] of a study file, and its text; no points yet.
Study read_study_file(const std::filesystem::path& file);

/// The [[sweep]] tables of `text`. Scenes and sizes, if not empty, replace those of every sweep. A weak sweep
/// becomes one for each number of threads, with the scenes and sizes of that.
std::vector<Sweep> read_sweeps(const std::filesystem::path& file, const std::string& text,
                               const PlanTarget& target, const std::vector<std::string>& scenes,
                               const std::vector<std::string>& sizes);

/// Calls `visit` for every combination of a sweep. An axis that does not apply to a point is not multiplied:
/// serial has one thread, kernels without tiles one tile size, and modes without screen triangles no geometry
/// stage that could be more or less general. Peers have scene, size and threads only.
void span_points(const Sweep& sweep, const std::map<std::string, Scene>& scenes,
                 const std::function<void(const Point&)>& visit);

}  // namespace rasterbench
