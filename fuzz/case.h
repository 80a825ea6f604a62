// A case of the fuzzer: a few triangles and what they are drawn into, small enough to be printed as a test.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "numeric/screen.h"
#include "pipeline/frame.h"
#include "scene/scene.h"

namespace rasterbench::fuzz {

/// What the corners of a case are.
enum class Space {
  kScreen,  ///< (x, y, d) as a numeric mode is given them: pixels, and the depth of the course contract
  kWorld,   ///< world points, which the whole pipeline draws
};

struct FuzzCase {
  Space space = Space::kScreen;
  /// The image's size and, in the world, the camera.
  SceneParameters parameters{.height = 16, .width = 16};
  FillRule fill = FillRule::kClosed;
  NearRule near_rule = NearRule::kClip;  ///< in the world
  std::uint64_t seed = 0;                ///< of a relation's own choices: which permutation, which shift
  std::vector<Triangle> triangles = {};  ///< the id of a triangle is its index
};

/// The screen triangles that a numeric mode draws, with ids of their own: relations reorder them and let
/// several share one.
struct ScreenInput {
  std::vector<ScreenTriangle<float>> triangles;  ///< d is that of the course contract
  std::int32_t ids = 0;                          ///< every id is below it
  int width = 0, height = 0;                     ///< pixels
  FillRule fill = FillRule::kClosed;
  TieRule tie = TieRule::kFirst;
};

/// Of a case in screen space.
ScreenInput screen_input(const FuzzCase& fuzz_case);

/// Of a case in world space.
Scene scene_of(const FuzzCase& fuzz_case);
FrameSettings settings_of(const FuzzCase& fuzz_case);

/// A corner's depth as a value of `function`, rounded once: an affine map, as the true one is, for a near
/// plane at a quarter of the far plane's distance.
float depth_value(float d, DepthFunction function);

/// The triangles of `input` as a mode of vertex format `Real` and `function` is given them.
template <class Real>
std::vector<ScreenTriangle<Real>> triangles_for(const ScreenInput& input, DepthFunction function) {
  std::vector<ScreenTriangle<Real>> triangles;
  for (const ScreenTriangle<float>& t : input.triangles) {
    ScreenTriangle<Real> converted{{}, {}, {}, t.id};
    for (int i = 0; i < 3; ++i) {
      converted.x[i] = t.x[i];
      converted.y[i] = t.y[i];
      converted.d[i] = depth_value(t.d[i], function);
    }
    triangles.push_back(converted);
  }
  return triangles;
}

/// A GoogleTest called `name` (letters and digits) that fails as long as `relation` does not hold for
/// `mode`; floats are hexadecimal, so that it is the same case to the bit. `kernels`: those that were asked,
/// empty for all.
std::string as_test(const FuzzCase& fuzz_case, std::string_view name, std::string_view relation,
                    std::string_view mode, const std::vector<std::string>& kernels);

/// Writes `stem`.dat and `stem`.txt for `rasterbench render`. A case in screen space becomes the world
/// triangles that a camera sees there, as nearly as float32 world coordinates can say it; false: not to the
/// bit. Throws InputError if a file cannot be written.
bool write_pair(const FuzzCase& fuzz_case, const std::filesystem::path& stem);

}  // namespace rasterbench::fuzz
