// A scene: model + parameters. Opens a MODEL argument, which is a file or a generator's specification.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "scene/model.h"
#include "scene/parameters.h"

namespace rasterbench {

struct Scene {
  Model model;
  SceneParameters parameters;
};

/// Opens MODEL ("x.dat" or "teapot:triangles=43000") with the parameters of `scene_file`, or, where that is
/// empty, with the generator's own parameters or those that frame the model. Throws InputError.
Scene open_scene(const std::string& model, const std::string& scene_file);

/// A 128-bit hash (XXH3), as 32 hex digits, of the triangles' bytes and every parameter but the image size.
std::string scene_hash(const Scene& scene);

}  // namespace rasterbench
