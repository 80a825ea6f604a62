#include "scene/scene.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <memory>
#include <new>

#include "base/error.h"
#include "base/suggest.h"
#include "scene/dat.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

namespace fs = std::filesystem;

std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

bool is_file(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return fs::exists(status) && !fs::is_directory(status);
}

/// Whether MODEL means a file: one that exists, or a name that no generator's specification can look like. A
/// folder called "teapot" does not hide the generator.
bool means_file(const std::string& model) {
  const std::string name = model.substr(0, model.find(':'));
  return is_file(model) || model.find('/') != std::string::npos || name.find('.') != std::string::npos ||
         lower_case(model).ends_with(".dat");
}

Model read_model(const std::string& model) {
  const std::string extension = lower_case(fs::path(model).extension().string());
  if (extension == ".dat" || !is_file(model)) return read_dat(model);  // which says what is wrong with it
  if (extension == ".xz")
    throw InputError({.file = model}, "compressed files are not read; try xz -dk on it first");
  throw InputError({.file = model},
                   extension.empty()
                       ? "has no extension that says its format; supported: .dat"
                       : fmt::format("'{}' files are not supported yet; supported: .dat", extension));
}

Scene run_generator(const std::string& specification) {
  const std::string name = specification.substr(0, specification.find(':'));
  std::vector<std::string> names;
  for (const Generator& generator : generators()) names.push_back(generator.name);
  if (std::find(names.begin(), names.end(), name) == names.end())
    throw InputError(unknown_name("generator", name, names) +
                     fmt::format(" (and there is no file '{}')", specification));
  return generate(specification);
}

}  // namespace

Scene open_scene(const std::string& model, const std::string& scene_file) {
  if (model.empty()) throw InputError("MODEL: the name is empty");
  std::optional<SceneParameters>
      parameters;  // read first: a mistake in them should not wait for a large model
  if (!scene_file.empty()) parameters = read_scene_parameters(scene_file);

  Scene scene;
  if (means_file(model)) {
    scene.model = read_model(model);
    if (!parameters) parameters = framing_parameters(scene.model);
  } else {
    scene = run_generator(model);
  }
  if (parameters) scene.parameters = *parameters;
  return scene;
}

std::string scene_hash(const Scene& scene) {
  const SceneParameters& p = scene.parameters;
  const std::array<std::uint8_t, 6> colours = {p.object.r,     p.object.g,     p.object.b,
                                               p.background.r, p.background.g, p.background.b};
  const std::array<double, 6> numbers = {p.camera.x, p.camera.y,   p.camera.z,
                                         p.theta,    p.near_plane, p.far_plane};

  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_128bits_reset(state.get());
  XXH3_128bits_update(state.get(), scene.model.triangles.data(),
                      scene.model.triangles.size() * sizeof(Triangle));
  XXH3_128bits_update(state.get(), colours.data(), sizeof(colours));
  XXH3_128bits_update(state.get(), numbers.data(), sizeof(numbers));
  const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace rasterbench
