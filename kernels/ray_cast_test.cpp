// The kernel ray_cast: the same picture under every execution, tile, order of the triangles and frame; what
// it refuses; and what it leaves as it was.
#include <fmt/format.h>
#include <gtest/gtest.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#include <algorithm>
#include <array>

#include "kernels/kernel.h"
#include "reference/embree.h"
#include "reference/ray_cast_frame.h"
#include "scene/generator.h"
#include "scene/test_folder.h"

namespace rasterbench {
namespace {

constexpr const char* kKernel = "ray_cast";
constexpr const char* kMode = "ray_cast";

class RayCastKernel : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_embree()) GTEST_SKIP() << embree_version();
  }
};

/// Triangles that cross the near plane, coincide, are degenerate or not finite, from (0, 0, 3) with a field
/// of view of 90 degrees.
Scene mixed_scene() {
  Scene scene;
  scene.parameters.camera = {0, 0, 3};
  scene.parameters.theta = 1.5707963267948966;
  scene.parameters.near_plane = 1;
  scene.parameters.far_plane = 10;
  Random random(5);
  const auto point = [&](double depth) {
    return Vec3{static_cast<float>(random.uniform(-3, 3)), static_cast<float>(random.uniform(-3, 3)),
                static_cast<float>(random.uniform(-2, depth))};
  };
  auto& triangles = scene.model.triangles;
  for (int i = 0; i < 150; ++i) {
    const Triangle t{point(6), point(6), point(6)};
    triangles.push_back(t);
    if (i % 3 == 0) triangles.push_back({t.a, t.c, t.b});  // the same place, the other way round
    if (i % 50 == 0) triangles.push_back({t.a, t.a, t.b});
    if (i % 50 == 1) triangles.push_back({t.a, {std::nanf(""), 0, 0}, t.b});
  }
  return scene;
}

std::vector<ExecutionConfig> executions() {
  std::vector<ExecutionConfig> all;
  for (const Schedule& schedule : schedules()) {
    if (schedule.backend == "serial") {
      all.push_back({});
    } else {
      for (const int threads : {1, 2, 3}) all.push_back({schedule.backend, schedule.name, {}, threads});
    }
  }
  return all;
}

TEST_F(RayCastKernel, EqualsItsSpecification) {
  struct Case {
    const char* name;
    Scene scene;
    TieRule tie;
  };
  for (const auto& [name, scene, tie] :
       {Case{"mixed", mixed_scene(), TieRule::kFirst},
        Case{"layers", generate("layers:triangles=300,depth=3"), TieRule::kFirst},
        Case{"confetti", generate("confetti:triangles=600,size=9,distribution=heavy,seed=3"),
             TieRule::kLast}}) {
    FrameSettings settings{.width = 120, .height = 67, .tie = tie};
    const Picture expected = render_ray_cast_specification(scene, settings);
    ASSERT_GT(std::count_if(expected.ids.begin(), expected.ids.end(), [](int id) { return id >= 0; }), 100);
    std::uint64_t seed = 0;
    for (const ExecutionConfig& execution : executions()) {
      settings.tile = std::array{64, 8, 1000, 13}[seed % 4];
      const auto renderer = make_renderer(kKernel, kMode, {&scene, settings, execution, seed});
      for (int frame = 0; frame < 2; ++frame) {
        const FrameReport& report = renderer->draw();
        ASSERT_EQ(differing_pixels(picture_of(*renderer, settings), expected), 0)
            << fmt::format("{} on {} threads, {}, tile {}, permutation {}, frame {}", to_string(execution),
                           execution.threads, name, settings.tile, seed, frame);
        EXPECT_EQ(report.counts.triangles, static_cast<std::int64_t>(scene.model.triangles.size()));
        EXPECT_EQ(report.counts.drawn, expected.counts.drawn);
        EXPECT_EQ(report.counts.non_finite, expected.counts.non_finite);
        EXPECT_EQ(report.counts.zero_area, expected.counts.zero_area);
      }
      ++seed;
    }
  }
}

TEST_F(RayCastKernel, LastWinsTieRule) {
  Scene scene = mixed_scene();
  const Triangle behind{{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}}, in_front{{-9, -9, 1}, {9, -9, 1}, {0, 9, 1}};
  scene.model.triangles = {in_front, behind, in_front, behind, behind};
  for (const TieRule tie : {TieRule::kFirst, TieRule::kLast}) {
    const auto renderer = make_renderer(kKernel, kMode, {&scene, {.width = 8, .height = 8, .tie = tie}, {}});
    renderer->draw();
    EXPECT_EQ(renderer->ids(), std::vector<std::int32_t>(64, tie == TieRule::kFirst ? 0 : 2));
  }
}

// d of 1 - 1e-9 is 1 in float32, which is not drawn, as in other modes.
TEST_F(RayCastKernel, DepthsThatRoundToTheFarPlaneAreNotDrawn) {
  Scene scene = mixed_scene();
  scene.model.triangles = {{{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}}};
  scene.parameters.near_plane = 1e-9;
  scene.parameters.far_plane = 1e9;
  const auto renderer = make_renderer(kKernel, kMode, {&scene, {.width = 8, .height = 8}, {}});
  renderer->draw();
  EXPECT_EQ(renderer->ids(), std::vector<std::int32_t>(64, -1));
  EXPECT_EQ(renderer->depths()[27], 1);
}

TEST_F(RayCastKernel, LeftOutTrianglesAreCounted) {
  Scene scene = mixed_scene();
  const std::vector<Triangle> once = scene.model.triangles;
  constexpr int kTimes = 8;  // so that they are copied in several batches
  for (int i = 1; i < kTimes; ++i)
    scene.model.triangles.insert(scene.model.triangles.end(), once.begin(), once.end());
  const auto renderer = make_renderer(kKernel, kMode, {&scene, {.width = 8, .height = 8}, {}});
  const GeometryCounts counts = renderer->draw().counts;
  EXPECT_EQ(counts.zero_area, 3 * kTimes);
  EXPECT_EQ(counts.non_finite, 3 * kTimes);
  EXPECT_EQ(counts.triangles, static_cast<std::int64_t>(scene.model.triangles.size()));
  EXPECT_EQ(counts.drawn + 6 * kTimes, counts.triangles);
}

TEST_F(RayCastKernel, AgreesWithTheDoubleRendererWithinTheClasses) {
  for (const Scene& scene : {mixed_scene(), generate("teapot:triangles=2000")}) {
    const FrameSettings settings{.width = 320, .height = 180};
    const auto renderer = make_renderer(kKernel, kMode, {&scene, settings, {}});
    renderer->draw();
    const Camera camera = sized_camera(scene, settings);
    const IdImage truth = render_in_double(scene.model.triangles, camera, FillRule::kClosed, NearRule::kClip);
    const RayCastPicture drawn{
        .picture = {settings.width, settings.height, renderer->ids(), renderer->values()}};
    const RayComparison result =
        compare_with_rays(drawn, truth.ids, truth.depths, scene.model.triangles, camera, F64::kInfo.numbers);
    EXPECT_EQ(result.errors, 0) << "first at " << result.worst_pixel;
    EXPECT_LE(result.max_depth_difference, 0x1p-24);
  }
}

TEST_F(RayCastKernel, CullsBackFaces) {
  Scene scene = mixed_scene();
  scene.model.triangles = {{{-1, -1, 1}, {0, 1, 1}, {1, -1, 1}}, {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}};
  for (const bool cull : {false, true}) {
    FrameSettings settings{.width = 9, .height = 9};
    settings.geometry.cull_back_faces = cull;
    const auto renderer = make_renderer(kKernel, kMode, {&scene, settings, {}});
    renderer->draw();
    EXPECT_EQ(renderer->ids()[4 * 9 + 4], cull ? 1 : 0);
  }
}

TEST_F(RayCastKernel, RefusesWhatRaysDoNotKnow) {
  const Scene scene = mixed_scene();
  EXPECT_EQ(
      input_error([&] {
        make_renderer(kKernel, kMode, {&scene, {.width = 8, .height = 8, .fill = FillRule::kTopLeft}, {}});
      }),
      "--fill: ray_cast knows closed only: a ray on an edge meets both sides");
  EXPECT_EQ(input_error([&] {
              FrameSettings settings{.width = 8, .height = 8};
              settings.geometry.near_rule = NearRule::kOff;
              make_renderer(kKernel, kMode, {&scene, settings, {}});
            }),
            "--near: ray_cast knows clip only: its rays begin on the near plane");
  EXPECT_EQ(input_error([&] {
              make_renderer(kKernel, "f32", {&scene, {.width = 8, .height = 8}, {}});
            }),
            "kernel: ray_cast cannot run in mode f32: casts rays: its arithmetic is Embree's");
}

TEST_F(RayCastKernel, LeavesFloatingPointModesAndThreadsAsTheyWere) {
  const Scene scene = generate("teapot:triangles=20000");
#if defined(__SSE2__)
  const unsigned before = _mm_getcsr();
#endif
  // A renderer on one thread that goes on living must not limit others.
  const auto expect_all_threads = [] {
    for (const ExecutionConfig& config : executions())
      EXPECT_EQ(observe_threads(*make_execution(config)).count, config.threads) << to_string(config);
  };
  const auto serial = make_renderer(kKernel, kMode, {&scene, {.width = 64, .height = 36}, {}});
  expect_all_threads();
  serial->draw();
  expect_all_threads();
  for (const ExecutionConfig& config : executions()) {
    const auto renderer = make_renderer(kKernel, kMode, {&scene, {.width = 64, .height = 36}, config});
    renderer->draw();
#if defined(__SSE2__)
    EXPECT_EQ(_mm_getcsr() & ~0x3fu, before & ~0x3fu);  // but for the sticky flags
#endif
    // While the renderers, and with them Embree's devices, are alive.
    const ObservedThreads observed = observe_threads(*make_execution(config));
    EXPECT_FALSE(observed.denormals_flushed) << to_string(config);
    EXPECT_EQ(observed.count, config.threads) << to_string(config);
  }
}

TEST(RayCastKernelList, SaysWhyOtherModesDoNotSuit) {
  const Kernel& kernel = find_kernel(kKernel);
  for (const ModeInfo& mode : mode_infos()) {
    const bool suits = mode.name == kMode && has_embree();
    EXPECT_EQ(static_cast<bool>(kernel.variant(mode.name).make), suits) << mode.name;
    EXPECT_EQ(kernel.variant(mode.name).reason.empty(), suits) << mode.name;
  }
}

}  // namespace
}  // namespace rasterbench
