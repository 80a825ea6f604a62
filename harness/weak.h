// Weak scaling: work that grows with the threads, so that each thread always has the same share of it.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "harness/point.h"

namespace rasterbench {

/// What stands behind a number in a study file that grows with the threads: "triangles=25000*threads".
inline const std::string kTimesThreads = "*threads";

inline const std::vector<std::string> kWeakKinds{"triangles", "pixels"};

/// The picture of a weak sweep on one number of threads.
struct WeakStep {
  std::string scene;  ///< SceneReference::name
  int width = 0;      ///< pixels
  int height = 0;
};

/// The pictures that one scene and size of a weak sweep stand for, as a study file writes them.
struct WeakSeries {
  std::string kind;               ///< of kWeakKinds: what grows
  std::string scene;              ///< "confetti", or "confetti:triangles=25000*threads" where it has no name
  std::string size;               ///< "960x540*threads"
  std::map<int, WeakStep> steps;  ///< by threads

  bool has(const Point& point) const;
};

/// `scene` with N times the triangles, N the number of threads, in place of "triangles=T*threads". A named
/// scene is then called NAME-xN, the others like their model. Throws InputError where the model has no such
/// key.
SceneReference scene_for_threads(SceneReference scene, int threads);

/// A picture with N times the pixels and the same view: both sides times the square root of N, rounded, so
/// that the number of pixels is off by less than 1 / width + 1 / height. Throws InputError beyond the largest
/// picture.
std::pair<int, int> size_for_threads(std::pair<int, int> size, int threads);

}  // namespace rasterbench
