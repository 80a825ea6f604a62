#include "harness/weak.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "base/error.h"

namespace rasterbench {

bool WeakSeries::has(const Point& point) const {
  const auto step = steps.find(point.execution.threads);
  return step != steps.end() && step->second.scene == point.scene.name && step->second.width == point.width &&
         step->second.height == point.height;
}

SceneReference scene_for_threads(SceneReference scene, int threads) {
  const std::string key = "triangles=";
  const std::size_t end = scene.model.find(kTimesThreads);
  const std::size_t at = scene.model.rfind(key, end);
  double triangles = 0;
  const char* const first = scene.model.data() + at + key.size();
  const char* const last = scene.model.data() + end;
  if (end == std::string::npos || at == std::string::npos ||
      scene.model.find(kTimesThreads, end + 1) != std::string::npos)
    throw InputError(
        fmt::format("'{}' does not grow: weak = \"triangles\" needs one \"triangles=N{}\" of a generator",
                    scene.model, kTimesThreads));
  if (const auto [stop, error] = std::from_chars(first, last, triangles);
      error != std::errc() || stop != last)
    throw InputError(
        fmt::format("'{}' is not a number", std::string_view(first, static_cast<std::size_t>(last - first))));
  const bool named = scene.name != scene.model;
  scene.model.replace(at + key.size(), end + kTimesThreads.size() - at - key.size(),
                      fmt::format("{:.0f}", triangles * threads));
  scene.name = named ? fmt::format("{}-x{}", scene.name, threads) : scene.model;
  return scene;
}

std::pair<int, int> size_for_threads(std::pair<int, int> size, int threads) {
  const double factor = std::sqrt(static_cast<double>(threads));
  const double width = std::round(size.first * factor), height = std::round(size.second * factor);
  if (width > kMaxImageSide || height > kMaxImageSide)
    throw InputError(fmt::format("{}x{} times {} threads is larger than {} pixels", size.first, size.second,
                                 threads, kMaxImageSide));
  return {static_cast<int>(width), static_cast<int>(height)};
}

}  // namespace rasterbench
