// Scene parameters: the text file of the course contract, and the defaults of generated scenes.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "scene/camera.h"
#include "scene/model.h"

namespace rasterbench {

/// 8-bit sRGB-as-is colour, no transfer function (the course contract).
struct Rgb {
  std::uint8_t r = 0, g = 0, b = 0;
};

/// What a scene parameter file says. Defaults: what `render MODEL` uses without one.
struct SceneParameters {
  Rgb object{210, 215, 225};
  Rgb background{28, 32, 40};
  Vec3d camera{0.70, 0.78, 1.51};
  int height = 1080;           ///< pixels; the file has height first
  int width = 1920;            ///< pixels
  double theta = 0.785398163;  ///< vertical field of view, radians
  double near_plane = 0.1;
  double far_plane = 10.0;
};

/// Reads a scene parameter file: object RGB, background RGB, camera x y z, height width, theta, near far; any
/// white space separates. Throws InputError with file, line and field. "theta in (pi, 180]" asks "degrees?".
SceneParameters read_scene_parameters(const std::filesystem::path& path);

/// The line of each field of a scene parameter file: "object red" ... "camera x" ... "height", "width",
/// "theta", "near", "far".
using FieldLines = std::map<std::string, std::int64_t, std::less<>>;

/// Checks every field (accuracy.md, section 1); `file` is named in the error, with the field's line where
/// `lines` has it.
void check_scene_parameters(const SceneParameters& parameters, const std::string& file,
                            const FieldLines& lines = {});

/// Checks `parameters` and writes them so that read_scene_parameters gives the same values to the bit.
void write_scene_parameters(const SceneParameters& parameters, const std::filesystem::path& path);

/// Parameters that frame `model`: a camera on the default direction, far enough away that the bounding sphere
/// about the origin is in view, near and far just outside of it. Corners that are not finite are left out; a
/// model without extent gets the defaults.
SceneParameters framing_parameters(const Model& model);

/// The camera of these parameters, sampling at pixel centres.
Camera make_camera(const SceneParameters& parameters);

}  // namespace rasterbench
