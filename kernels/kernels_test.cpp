// Invariant 0: every kernel, execution, tile size and order of the screen triangles equals the scalar
// specification of its mode bit for bit; and the canary does not.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "kernels/kernel.h"
#include "reference/specification.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

struct TestScene {
  std::string name;
  Scene scene;
  int width, height;
};

Triangle triangle(Vec3 a, Vec3 b, Vec3 c) { return {a, b, c}; }

/// A scene of hand-made triangles, seen from (0, 0, 3) with a field of view of 90 degrees and near 1, far 10.
Scene from_front(std::vector<Triangle> triangles) {
  Scene scene;
  scene.model.triangles = std::move(triangles);
  scene.parameters.camera = {0, 0, 3};
  scene.parameters.theta = 1.5707963267948966;
  scene.parameters.near_plane = 1;
  scene.parameters.far_plane = 10;
  return scene;
}

Scene crossing_near() {
  Random random(5);
  const auto point = [&] {
    return Vec3{static_cast<float>(random.uniform(-3, 3)), static_cast<float>(random.uniform(-3, 3)),
                static_cast<float>(random.uniform(-2, 6))};
  };
  std::vector<Triangle> triangles;
  for (int i = 0; i < 60; ++i) triangles.push_back(triangle(point(), point(), point()));
  return from_front(triangles);
}

/// Triangles whose edges run through pixel centres, each twice with opposite windings: ties everywhere. Of an
/// image of 32 px, 8 cells a side have 4 px, and 32 cells have one, whose centre lies on the diagonal.
Scene lattice(int cells = 8) {
  std::vector<Triangle> triangles;
  const auto at = [&](int i) { return static_cast<float>(i) * 6.0f / static_cast<float>(cells) - 3.0f; };
  for (int i = 0; i < cells; ++i)
    for (int j = 0; j < cells; ++j) {
      const Vec3 a{at(j), at(i), 0}, b{at(j + 1), at(i), 0}, c{at(j + 1), at(i + 1), 0},
          d{at(j), at(i + 1), 0};
      for (const Triangle& t : {triangle(a, b, c), triangle(a, c, d), triangle(c, b, a), triangle(d, c, a)})
        triangles.push_back(t);
    }
  return from_front(triangles);
}

Scene nasty() {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  return from_front({triangle({0, 0, 0}, {0, 0, 0}, {1, 1, 0}), triangle({0, 0, 0}, {0, 0, 0}, {0, 0, 0}),
                     triangle({-1, -1, 0}, {0, 0, 0}, {1, 1, 0}), triangle({nan, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                     triangle({inf, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                     triangle({-1e9f, -1e9f, 0}, {1e9f, 0, 0}, {0, 1e9f, 0}),
                     triangle({-1e30f, -1, 0}, {1e30f, 0, 0}, {0, 1e30f, -1}),
                     triangle({1e-42f, 0, 0}, {0, 1e-42f, 0}, {1, 1, 0}),
                     triangle({-1, 0.00001f, 0.5f}, {1, 0, 0.5f}, {1, 0.00002f, 0.5f}),
                     triangle({-0.0f, -0.0f, 1}, {0.3f, 0, 1}, {0, 0.3f, 1})});
}

/// The world point that from_front() shows at (x, y) px of an image of 32 x 32, at z = 0 or nearer.
Vec3 at_pixel(double x, double y, double z = 0) {
  return {static_cast<float>((x / 16 - 1) * (3 - z)), static_cast<float>((1 - y / 16) * (3 - z)),
          static_cast<float>(z)};
}

/// Long slivers across the image, thinner than a pixel, in front of each other.
Scene slivers() {
  Random random(6);
  std::vector<Triangle> triangles;
  for (int i = 0; i < 80; ++i) {
    const double ax = random.uniform(-8, 40), ay = random.uniform(-8, 40);
    const double bx = random.uniform(-8, 40), by = random.uniform(-8, 40);
    const double t = random.uniform(), width = std::pow(10.0, random.uniform(-5, 0.5));
    triangles.push_back(
        triangle(at_pixel(ax, ay, random.uniform(-1, 1)), at_pixel(bx, by, random.uniform(-1, 1)),
                 at_pixel(ax + t * (bx - ax) + width, ay + t * (by - ay) - width, random.uniform(-1, 1))));
  }
  return from_front(triangles);
}

/// Edges that come from far outside and run along whole diagonals, rows and columns of centres: float32
/// cannot tell on which side those lie. And triangles whose side AB, prolonged within its box, meets centres
/// of rows that the triangle covers elsewhere: two products cover such rows in two parts.
Scene uncertain() {
  std::vector<Triangle> triangles;
  for (int i = 0; i < 8; ++i) {
    const double from = -1000 - 16 * i, to = 1000 + 8 * i, third = i % 2 == 0 ? 3000 : -3000;
    const double z = i / 32.0;  // one behind the other, so that not every pixel is a tie
    const auto add = [&](double ax, double ay, double bx, double by, double cx, double cy) {
      triangles.push_back(triangle(at_pixel(ax, ay, z), at_pixel(bx, by, z), at_pixel(cx, cy, z)));
    };
    add(from + i, from, to + i, to, third, -third);
    add(from + i, -from + 32, to + i, -to + 32, third, third);
    add(from, i + 0.5, to, i + 0.5, 16, third);
    add(2 * i + 0.5, from, 2 * i + 0.5, to, third, 16);
  }
  for (int i = 0; i < 3; ++i) {
    const double x = 2.5 + 5 * i, y = 2.5 + 9 * i, z = 0.5;  // in front of the others
    triangles.push_back(triangle(at_pixel(x, y, z), at_pixel(x + 3, y + 3, z), at_pixel(x + 12, y + 6, z)));
  }
  return from_front(triangles);
}

/// Each mode is drawn in the first scenes; some modes in all of them.
constexpr std::size_t kScenesOfEveryMode = 7;

std::vector<TestScene> test_scenes() {
  std::vector<TestScene> scenes;
  const Scene confetti = generate("confetti:triangles=150,size=9,distribution=heavy,seed=3");
  scenes.push_back({"confetti", confetti, 150, 40});
  scenes.push_back({"confetti 7x5", confetti, 7, 5});
  scenes.push_back({"crossing near", crossing_near(), 80, 50});
  scenes.push_back({"lattice", lattice(), 32, 32});
  scenes.push_back({"nasty", nasty(), 64, 48});
  scenes.push_back({"slivers", slivers(), 32, 32});
  scenes.push_back({"uncertain", uncertain(), 32, 32});
  // Up to here: kScenesOfEveryMode.
  scenes.push_back({"fine lattice", lattice(32), 32, 32});
  scenes.push_back({"confetti 1x1", confetti, 1, 1});
  scenes.push_back({"confetti 1000x1", confetti, 1000, 1});
  scenes.push_back({"teapot", generate("teapot:triangles=500"), 67, 49});
  scenes.push_back({"layers", generate("layers:triangles=100,depth=3"), 70, 35});
  scenes.push_back({"terrain", generate("terrain:triangles=500,seed=2"), 65, 37});
  scenes.push_back({"behind", from_front({triangle({0, 0, 4}, {1, 0, 5}, {0, 1, 4})}), 20, 20});
  scenes.push_back({"empty", from_front({}), 20, 20});
  return scenes;
}

/// The modes that differ in what a kernel sees of them: one per edge arithmetic and kind of key that is not
/// the sum of others. They are drawn under every execution.
constexpr std::string_view kThoroughModes[] = {"f32", "f64", "fixed_8", "filtered", "exact"};

std::vector<ExecutionConfig> test_executions(bool thorough) {
  if (!thorough) {
    std::vector<ExecutionConfig> some{{}, {"openmp", "dynamic", {}, 2}, {"openmp", "static", 5, 3}};
    if (!is_left_out("tbb")) some.push_back({"tbb", "auto", {}, 2});
    return some;
  }
  std::vector<ExecutionConfig> all;
  for (const Schedule& schedule : schedules()) {
    if (schedule.backend == "serial") {
      all.push_back({});
      continue;
    }
    all.push_back({schedule.backend, schedule.name, {}, 2});
    if (!schedule.chunk.empty()) all.push_back({schedule.backend, schedule.name, 5, 3});
  }
  return all;
}

/// Those of this CPU: the specification has none of them.
const std::vector<Isa>& test_isas() {
  static const std::vector<Isa> isas = [] {
    std::vector<Isa> supported;
    std::copy_if(all_isas().begin(), all_isas().end(), std::back_inserter(supported), is_supported);
    return supported;
  }();
  return isas;
}

class EveryKernel : public testing::TestWithParam<std::tuple<std::string, std::string>> {};

TEST_P(EveryKernel, EqualsTheSpecification) {
  const auto& [kernel, mode] = GetParam();
  if (const auto& variant = find_kernel(kernel).variant(mode); !variant.make)
    GTEST_SKIP() << kernel << " in " << mode << ": " << variant.reason;
  const bool thorough = std::count(std::begin(kThoroughModes), std::end(kThoroughModes), mode) > 0;
  std::vector<TestScene> scenes = test_scenes();
  if (!thorough) scenes.resize(kScenesOfEveryMode);
  int variant = 0;
  for (const TestScene& test : scenes)
    for (const FillRule fill : {FillRule::kClosed, FillRule::kTopLeft}) {
      FrameSettings settings{.width = test.width, .height = test.height, .fill = fill};
      const Picture expected = render_specification(test.scene, mode, settings);
      for (const ExecutionConfig& execution : test_executions(thorough)) {
        // Vary what must not matter along with the execution; every other one permutes the screen triangles.
        settings.tile = std::array{64, 8, 1000, 13, 29}[static_cast<std::size_t>(variant % 5)];
        settings.geometry.isa = test_isas()[static_cast<std::size_t>(variant) % test_isas().size()];
        const std::uint64_t seed = variant % 2 == 0 ? 0 : static_cast<std::uint64_t>(variant);
        ++variant;
        const auto renderer = make_renderer(kernel, mode, {&test.scene, settings, execution, seed});
        for (int frame = 0; frame < 2;
             ++frame) {  // the second frame meets what the first left in the buffers
          renderer->draw();
          ASSERT_EQ(differing_pixels(picture_of(*renderer, settings), expected), 0) << fmt::format(
              "{} {} {} on {}, {}, tile {}, {}, permutation {}, frame {}", kernel, mode, to_string(execution),
              test.name, fill == FillRule::kClosed ? "closed" : "top-left", settings.tile,
              to_string(settings.geometry.isa), seed, frame);
        }
      }
    }
}

/// Kernels and modes of screen triangles; ray_cast_test.cpp is about the others.
std::vector<std::string> kernel_names() {
  std::vector<std::string> names;
  for (const Kernel& kernel : kernels())
    if (!kernel.info().hidden && !kernel.variant("ray_cast").make) names.emplace_back(kernel.info().name);
  return names;
}

std::vector<std::string> mode_names() {
  std::vector<std::string> names;
  for (const ModeInfo& info : mode_infos())
    if (info.has_screen_triangles) names.emplace_back(info.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(All, EveryKernel,
                         testing::Combine(testing::ValuesIn(kernel_names()), testing::ValuesIn(mode_names())),
                         [](const auto& test) {
                           std::string name = std::get<0>(test.param) + "_" + std::get<1>(test.param);
                           std::replace(name.begin(), name.end(), '-', '_');  // googletest takes no hyphens
                           return name;
                         });

/// How many samples of a scene's boxes have an edge that float32 cannot decide.
std::int64_t uncertain_samples(const TestScene& test) {
  const FrameSettings settings{.width = test.width, .height = test.height};
  std::vector<ScreenTriangle<float>> screen(test.scene.model.triangles.size()), extra;
  GeometryCounts counts;
  transform_triangles<float>(test.scene.model.triangles, 0,
                             make_screen_transform(sized_camera(test.scene, settings)), {}, screen.data(),
                             extra, counts);
  screen.insert(screen.end(), extra.begin(), extra.end());
  std::int64_t uncertain = 0;
  for (const auto& triangle : screen) {
    if (triangle.id < 0) continue;
    const auto prepared = Filtered::prepare(triangle, FillRule::kClosed, 0);
    const PixelBox box = intersect(prepared.box, settings.bounds());
    for (int y = box.y0; y < box.y1; ++y)
      for (int x = box.x0; x < box.x1; ++x)
        for (int e = 0; e < 3; ++e)
          uncertain += std::abs(Filtered::edge_value(prepared, e, x, y)) <= prepared.error;
  }
  return uncertain;
}

TEST(Kernels, TheScenesReachTheExactArithmeticOfFiltered) {
  std::int64_t most = 0;
  for (const TestScene& test : test_scenes()) {
    const std::int64_t uncertain = uncertain_samples(test);
    if (test.name == "lattice") {
      EXPECT_GT(uncertain, 100);
    }
    most = std::max(most, uncertain);
  }
  EXPECT_GT(most, 1000);
}

TEST(Kernels, LastWinsTieRule) {
  const Scene scene = lattice();
  for (const TieRule tie : {TieRule::kFirst, TieRule::kLast}) {
    FrameSettings settings{.width = 32, .height = 32, .tie = tie};
    const auto renderer = make_renderer("triangle_atomics", "f32", {&scene, settings, {}});
    renderer->draw();
    const Picture expected = render_specification(scene, "f32", settings);
    EXPECT_EQ(differing_pixels(picture_of(*renderer, settings), expected), 0);
    // Four triangles of each cell lie in one plane: the first of them has the winding (a, b, c), the last (d,
    // c, a).
    EXPECT_EQ(expected.ids[0] % 4 < 2, tie == TieRule::kFirst);
  }
}

TEST(Kernels, CanaryDrawsNothingAndDiffers) {
  const Scene scene = generate("teapot:triangles=2000");
  const FrameSettings settings{.width = 64, .height = 36};
  const auto renderer = make_renderer("null", "f32", {&scene, settings, {}});
  renderer->draw();
  EXPECT_GT(differing_pixels(picture_of(*renderer, settings), render_specification(scene, "f32", settings)),
            100);
}

TEST(Kernels, StaleCanaryDrawsOnceOnly) {
  const Scene scene = generate("teapot:triangles=2000");
  const FrameSettings settings{.width = 64, .height = 36};
  const auto renderer = make_renderer("stale", "f32", {&scene, settings, {}});
  const Picture expected = render_specification(scene, "f32", settings);
  renderer->draw();
  EXPECT_EQ(differing_pixels(picture_of(*renderer, settings), expected), 0);
  renderer->draw();
  EXPECT_GT(differing_pixels(picture_of(*renderer, settings), expected), 100);
}

TEST(Kernels, UnknownNamesSuggest) {
  EXPECT_THROW(
      {
        try {
          find_kernel("tile_paralel");
        } catch (const InputError& error) {
          EXPECT_STREQ(error.what(), "kernel: unknown kernel 'tile_paralel'; did you mean 'tile_parallel'?");
          throw;
        }
      },
      InputError);
  EXPECT_THROW(find_kernel("tile_parallel").variant("f23"), InputError);
}

TEST(Kernels, AtomicsSkipModesWithoutAPackedKey) {
  const Scene scene = from_front({});
  const FrameSettings settings{.width = 4, .height = 4};
  EXPECT_THROW(make_renderer("triangle_atomics", "f64", {&scene, settings, {}}), InputError);
}

}  // namespace
}  // namespace rasterbench
