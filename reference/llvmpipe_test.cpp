#include "reference/llvmpipe.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "pipeline/resolve.h"
#include "reference/end_to_end.h"
#include "reference/specification.h"
#include "scene/scene.h"

namespace rasterbench {
namespace {

FrameSettings settings_of(int width, int height) {
  return {.width = width, .height = height, .fill = FillRule::kTopLeft};
}

Picture drawn(const Scene& scene, const FrameSettings& settings) {
  const auto renderer = make_llvmpipe_renderer(scene, settings);
  renderer->draw();
  renderer->draw();  // as every timed frame, it follows another one
  return picture_of(*renderer, settings);
}

/// Against the truth of the same pipeline in wider arithmetic.
Comparison judged(const Scene& scene, const FrameSettings& settings, const Picture& picture,
                  const PictureBound& bound) {
  const EndToEndTruth truth =
      render_end_to_end(scene, settings.width, settings.height, settings.fill, NearRule::kClip, 1);
  return compare_with_double(truth.truth, picture.ids, picture.depths, scene.model.triangles,
                             sized_camera(scene, settings), NearRule::kClip, bound);
}

/// A camera on the z axis whose rows are exact in float32: (x, y, 0) is at pixel (32 + 16 x, 32 - 16 y)
/// of 64.
Scene exact_scene(std::vector<Triangle> triangles) {
  Scene scene;
  scene.model.triangles = std::move(triangles);
  scene.parameters.camera = {0, 0, 2};
  scene.parameters.theta = std::numbers::pi / 2;
  scene.parameters.near_plane = 0.5;
  scene.parameters.far_plane = 8;
  return scene;
}
Vec3 at_pixel(float x, float y) { return {(x - 32) / 16, (32 - y) / 16, 0}; }

class Llvmpipe : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_llvmpipe()) GTEST_SKIP() << llvmpipe_missing();
    for (const auto& [name, value] : llvmpipe_variables(1))
      value.empty() ? unsetenv(name.c_str()) : setenv(name.c_str(), value.c_str(), 1);
    try {
      llvmpipe_version();
    } catch (const InputError& error) {
      GTEST_SKIP() << error.what();
    }
  }
};

TEST_F(Llvmpipe, SaysWhatItIs) {
  EXPECT_NE(llvmpipe_version().renderer.find("llvmpipe"), std::string::npos);
  EXPECT_NE(llvmpipe_version().version.find("Mesa"), std::string::npos);
}

TEST_F(Llvmpipe, AgreesWithTheTruthWithinItsBound) {
  const FrameSettings settings = settings_of(320, 180);
  for (const char* model : {"teapot:triangles=5000", "terrain:triangles=5000", "layers:triangles=500,depth=4",
                            "confetti:triangles=5000,size=16,distribution=heavy"}) {
    const Scene scene = open_scene(model, "");
    const Comparison verdict = judged(scene, settings, drawn(scene, settings), llvmpipe_bound());
    EXPECT_EQ(verdict.errors, 0) << model << ", the first at " << verdict.worst_pixel;
    EXPECT_GT(verdict.identical, verdict.pixels * 99 / 100) << model;
  }
}

// The bound must be one: neither a picture that lies half a pixel beside nor one that is a little too deep
// passes.
TEST_F(Llvmpipe, BoundCatchesAShiftAndADepth) {
  const FrameSettings settings = settings_of(320, 180);
  const Scene scene = open_scene("teapot:triangles=500", "");
  const Picture picture = drawn(scene, settings);
  Picture shifted = picture;
  std::shift_left(shifted.ids.begin(), shifted.ids.end(), 1);
  std::shift_left(shifted.depths.begin(), shifted.depths.end(), 1);
  EXPECT_GT(judged(scene, settings, shifted, llvmpipe_bound()).errors, 100);
  Picture deeper = picture;
  for (std::size_t i = 0; i < deeper.ids.size(); ++i)
    if (deeper.ids[i] >= 0) deeper.depths[i] += 0x1p-8f;
  EXPECT_GT(judged(scene, settings, deeper, llvmpipe_bound()).errors, 1000);
}

// It is the snapping that the bound is for: in the bound of exact edges and double geometry it has errors.
TEST_F(Llvmpipe, IsNotExact) {
  const FrameSettings settings = settings_of(640, 360);
  const Scene scene = open_scene("teapot:triangles=43000", "");
  const Picture picture = drawn(scene, settings);
  EXPECT_EQ(judged(scene, settings, picture, llvmpipe_bound()).errors, 0);
  EXPECT_GT(judged(scene, settings, picture, ModeBound{.edge_form = EdgeForm::kExact, .edge_unit = 0}).errors,
            0);
}

TEST_F(Llvmpipe, FillsTopLeft) {
  const Vec3 a = at_pixel(10.5f, 10.5f), b = at_pixel(20.5f, 10.5f), c = at_pixel(20.5f, 20.5f),
             d = at_pixel(10.5f, 20.5f);
  const Picture picture = drawn(exact_scene({{a, b, c}, {a, c, d}}), settings_of(64, 64));
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      EXPECT_EQ(picture.ids[static_cast<std::size_t>(y * 64 + x)] >= 0,
                x >= 10 && x < 20 && y >= 10 && y < 20)
          << x << ',' << y;
}

TEST_F(Llvmpipe, FirstOfEqualDepthsWinsAndTheNearestOfOthers) {
  const Triangle wall{at_pixel(0, 0), at_pixel(64, 0), at_pixel(32, 64)};
  Triangle nearer = wall;
  for (Vec3* corner : {&nearer.a, &nearer.b, &nearer.c}) corner->z = 0.5f;
  const std::size_t middle = 20 * 64 + 32;
  EXPECT_EQ(drawn(exact_scene({wall, wall}), settings_of(64, 64)).ids[middle], 0);
  EXPECT_EQ(drawn(exact_scene({wall, nearer, wall}), settings_of(64, 64)).ids[middle], 1);
}

TEST_F(Llvmpipe, ColoursAreThoseOfTheIds) {
  const FrameSettings settings = settings_of(320, 180);
  const Scene scene = open_scene("teapot:triangles=5000", "");
  const Picture picture = drawn(scene, settings);
  std::size_t background = 0;
  for (std::size_t i = 0; i < picture.ids.size(); ++i) {
    const std::int32_t id = picture.ids[i];
    background += id < 0;
    ASSERT_EQ(picture.colours[i], id < 0 ? pack_rgba(scene.parameters.background)
                                         : shade_flat(scene.model.triangles[static_cast<std::size_t>(id)],
                                                      scene.parameters.object));
    ASSERT_EQ(id < 0, picture.depths[i] == 1);
  }
  EXPECT_GT(background, 0u);
  EXPECT_LT(background, picture.ids.size());
}

TEST_F(Llvmpipe, ClipsAtTheNearPlaneAndLeavesOutWhatIsNotFinite) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const FrameSettings settings = settings_of(64, 64);
  const Scene scene = exact_scene({{{-4, -1, -4}, {4, -1, -4}, {0, -0.25f, 3}},  // reaches behind the camera
                                   {at_pixel(10, 10), {nan, 0, 0}, at_pixel(50, 50)},
                                   {at_pixel(4, 4), at_pixel(60, 4), at_pixel(32, 20)}});
  const Picture picture = drawn(scene, settings);
  const Comparison verdict = judged(scene, settings, picture, llvmpipe_bound());
  EXPECT_EQ(verdict.errors, 0) << verdict.worst_pixel;
  for (const std::int32_t id : {0, 2}) EXPECT_GT(std::ranges::count(picture.ids, id), 50) << id;
  EXPECT_EQ(std::ranges::count(picture.ids, 1), 0);
}

TEST_F(Llvmpipe, RefusesWhatOpenGlDoesNotHave) {
  const Scene scene = open_scene("teapot:triangles=500", "");
  FrameSettings settings = settings_of(64, 64);
  settings.fill = FillRule::kClosed;
  EXPECT_THROW(make_llvmpipe_renderer(scene, settings), InputError);
  EXPECT_THROW(make_llvmpipe_renderer(scene, settings_of(65536, 1)), InputError);
}

TEST_F(Llvmpipe, OneThreadIsTheApplications) {
  const Scene scene = open_scene("teapot:triangles=500", "");
  drawn(scene, settings_of(64, 64));
  EXPECT_EQ(observed_llvmpipe_threads(), 1);
  EXPECT_EQ(llvmpipe_variables(1).at("LP_NUM_THREADS"), "0");
  EXPECT_EQ(llvmpipe_variables(3).at("LP_NUM_THREADS"), "3");
}

// In a process of its own, since Mesa chooses its driver once: the answer is a refusal, or there is no
// softpipe.
TEST(LlvmpipeDeathTest, RefusesAnotherDriver) {
  if (!has_llvmpipe()) GTEST_SKIP() << llvmpipe_missing();
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  constexpr int kRefused = 3, kNoOther = 4;
  EXPECT_EXIT(
      {
        setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
        setenv("GALLIUM_DRIVER", "softpipe", 1);
        try {
          std::exit(llvmpipe_version().renderer.find("llvmpipe") != std::string::npos ? kNoOther : 0);
        } catch (const InputError& error) {
          std::exit(std::string(error.what()).starts_with("llvmpipe: ") ? kRefused : 1);
        }
      },
      [](int status) {
        return WIFEXITED(status) && (WEXITSTATUS(status) == kRefused || WEXITSTATUS(status) == kNoOther);
      },
      "");
}

}  // namespace
}  // namespace rasterbench
