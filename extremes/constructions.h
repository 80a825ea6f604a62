// The families of meshes.h by name, as the catalogue asks for them, and the scene of a case.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "extremes/catalogue.h"
#include "scene/generator.h"

namespace rasterbench::extremes {

/// One family: on the screen (the camera is then not for the case to choose) or in the world.
struct ConstructionKind {
  std::string name;
  std::vector<GeneratorKey> keys;
  bool on_screen = false;
  std::function<Scene(const GeneratorValues&, const SceneParameters&)> make;
};

/// All of them.
std::span<const ConstructionKind> construction_kinds();

/// Throws InputError with a did-you-mean.
const ConstructionKind& find_construction(const std::string& name);

/// What a case draws. Throws InputError. Precondition: the input is none of the files.
Scene scene_of(const Case& one);

/// What `change` makes of a case's scene:
///   reversed        corners B and C of each triangle swapped
///   duplicated      each triangle a second time, reversed, with id T + its own
///   positive_zeros  -0 becomes +0
///   scaled          triangles, camera, near and far times `factor`
///   mirrored        x becomes -x (a screen scene: about the image's middle)
///   shifted         a screen scene moved by (x, y) whole pixels
Scene changed_scene(const Case& one, const Change& change);

/// Names of the changes, and whether one is of screen scenes only.
std::span<const std::string> change_names();
bool needs_screen_scene(const std::string& change);
bool is_on_screen(const CaseInput& input);

}  // namespace rasterbench::extremes
