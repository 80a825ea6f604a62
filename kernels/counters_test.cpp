// Counted frames: the picture of the others, and counts that are those of a scene computed by hand.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "kernels/kernel.h"
#include "reference/specification.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

constexpr int kSide = 32;  // of the image, in pixels

/// A right triangle with legs of `legs` px from (x, y) px, as seen from (0, 0, 3) with a field of view of 90
/// degrees in an image of kSide^2, at z = 0 or nearer.
Triangle right_triangle(double x, double y, double legs, double z = 0) {
  const auto at = [z](double px, double py) {
    return Vec3{static_cast<float>((px / 16 - 1) * (3 - z)), static_cast<float>((1 - py / 16) * (3 - z)),
                static_cast<float>(z)};
  };
  return {at(x, y), at(x + legs, y), at(x, y + legs)};
}

/// Legs end a quarter of a pixel behind a whole number n, so that no centre lies on an edge: n^2 samples in
/// the box, n (n + 1) / 2 of them inside.
Scene scene_by_hand() {
  Scene scene;
  scene.model.triangles = {right_triangle(0, 0, 4.25),        // 16 samples, 10 inside, 3 of them hidden
                           right_triangle(10.6, 10.6, 0.3),   // between samples
                           right_triangle(40, 0, 4.25),       // beside the image
                           right_triangle(8, 8, 16.25),       // 256 samples, 136 inside
                           right_triangle(0, 0, 2.25, 0.5)};  // 4 samples, 3 inside, in front of the first
  scene.parameters.camera = {0, 0, 3};
  scene.parameters.theta = 1.5707963267948966;
  scene.parameters.near_plane = 1;
  scene.parameters.far_plane = 10;
  return scene;
}

FrameSettings small_settings() {
  FrameSettings settings{.width = kSide, .height = kSide};
  settings.tile = 16;
  return settings;
}

FrameReport counted(const Scene& scene, const char* kernel, const char* mode,
                    const ExecutionConfig& execution = {}) {
  const auto renderer = make_renderer(
      kernel, mode, {.scene = &scene, .settings = small_settings(), .execution = execution, .count = true});
  renderer->draw();
  return renderer->draw();  // of the second frame: nothing of the first is counted again
}

constexpr const char* kStaged[] = {"all_pixels",       "bounding_box", "triangle_locks", "triangle_atomics",
                                   "triangle_private", "row_parallel", "tile_parallel",  "scanline"};
constexpr const char* kCountedModes[] = {"f32", "fixed_8", "filtered"};

TEST(Counters, OfASceneByHand) {
  const Scene scene = scene_by_hand();
  SizeClasses sizes;
  sizes.without_sample = 1;
  sizes.by_side = {1, 1, 0, 1, 0, 0, 0};
  for (const char* mode : kCountedModes)
    for (const char* kernel : kStaged) {
      SCOPED_TRACE(std::string(kernel) + " " + mode);
      const FrameReport report = counted(scene, kernel, mode);
      const WorkCounters& c = report.counters;
      EXPECT_EQ(report.counts.off_screen, 1);
      EXPECT_EQ(c.sizes, sizes);
      EXPECT_EQ(c.samples_in_boxes, 16 + 256 + 4);
      EXPECT_EQ(c.fragments_passed, 10 + 136 + 3);
      EXPECT_EQ(c.covered_pixels, 10 + 136);
      EXPECT_EQ(c.visible_triangles, 3);
      const std::string name = kernel;
      EXPECT_EQ(c.fragments_tested, name == "all_pixels" ? 5 * kSide * kSide : name == "scanline" ? 0 : 276);
      EXPECT_EQ(*c.edge_tests > 0, name == "scanline");
      EXPECT_EQ(c.merges,
                name == "triangle_private" ? std::optional<std::int64_t>((4 + 16) * kSide) : std::nullopt);
      const std::int64_t pixels = kSide * kSide;
      EXPECT_EQ(c.clear_bytes, (StageBytes{0, pixels * 8}));
      EXPECT_EQ(c.geometry_bytes, (StageBytes{5 * 36, 5 * 40}));
      EXPECT_EQ(c.resolve_bytes, (StageBytes{pixels * 8 + 3 * 36, pixels * 8}));
      const StageBytes least{5 * 40 + 146 * 8, 146 * 8};  // screen triangles and keys
      EXPECT_TRUE(c.raster_bytes->read >= least.read && c.raster_bytes->written >= least.written);
      ASSERT_EQ(c.per_worker.size(), 1u);
      const WorkerWork& work = c.per_worker[0];
      EXPECT_EQ(work.triangles, 4);  // the one beside the image is not set up
      EXPECT_EQ(work.bin_entries, c.bin_entries.value_or(0));
      EXPECT_EQ(work.fragments_tested, c.fragments_tested);
      EXPECT_EQ(work.fragments_passed, 10 + 136 + 3);
      EXPECT_GE(work.bytes, 4 * 40 + 149 * 8);  // screen triangles and keys
      EXPECT_EQ(work.bytes == 4 * 40 + 149 * 8, work.bin_entries == 0);
      EXPECT_EQ(c.raster_bytes == least,
                name == "bounding_box" || name == "triangle_locks" || name == "triangle_atomics");
    }
}

TEST(Counters, OfBins) {
  const Scene scene = scene_by_hand();
  struct Expected {
    const char* kernel;
    std::int64_t tiles, touched, entries;
  };
  for (const Expected& e : {Expected{"tile_parallel", 4, 4, 1 + 4 + 1},
                            {"tile_simd", 4, 4, 1 + 4 + 1},
                            {"row_parallel", kSide, 4 + 16, 4 + 16 + 2},
                            {"scanline", 2, 2, 1 + 2 + 1}}) {
    const WorkCounters c = counted(scene, e.kernel, "fixed_8").counters;
    EXPECT_EQ(c.tiles, e.tiles) << e.kernel;
    EXPECT_EQ(c.tiles_touched, e.touched) << e.kernel;
    EXPECT_EQ(c.bin_entries, e.entries) << e.kernel;
  }
  EXPECT_EQ(counted(scene, "bounding_box", "fixed_8").counters.tiles, std::nullopt);
}

TEST(Counters, WhatIsNotCountedIsAbsent) {
  const Scene scene = scene_by_hand();
  const WorkCounters vectors = counted(scene, "tile_simd", "fixed_8").counters;
  EXPECT_EQ(vectors.fragments_tested, std::nullopt);
  EXPECT_TRUE(vectors.per_worker.empty());
  EXPECT_EQ(vectors.samples_in_boxes, 276);
  const WorkCounters wide = counted(scene, "tile_parallel", "f64").counters;
  EXPECT_EQ(wide.fragments_passed, std::nullopt);
  EXPECT_EQ(wide.bin_entries, 6);
  const auto timed = make_renderer("tile_parallel", "f32", {&scene, small_settings(), {}});
  EXPECT_EQ(timed->draw().counters.covered_pixels, std::nullopt);
}

TEST(Counters, PictureAndCountsAreThoseOfOneThread) {
  const Scene scene = generate("confetti:triangles=150,size=9,distribution=heavy,seed=3");
  for (const char* mode : kCountedModes) {
    const Picture expected = render_specification(scene, mode, small_settings());
    for (const char* kernel : kStaged) {
      const WorkCounters serial = counted(scene, kernel, mode).counters;
      EXPECT_EQ(serial.fragments_passed, expected.samples_covered) << kernel;
      EXPECT_EQ(serial.samples_in_boxes, expected.samples_tested) << kernel;
      for (const Schedule& schedule : schedules()) {
        if (schedule.backend == "serial") continue;
        const ExecutionConfig execution{schedule.backend, schedule.name, {}, 3};
        SCOPED_TRACE(std::string(kernel) + " " + mode + " " + to_string(execution));
        const auto renderer = make_renderer(
            kernel, mode,
            {.scene = &scene, .settings = small_settings(), .execution = execution, .count = true});
        const WorkCounters c = renderer->draw().counters;
        EXPECT_EQ(differing_pixels(picture_of(*renderer, small_settings()), expected), 0);
        EXPECT_EQ(c.sizes, serial.sizes);
        EXPECT_EQ(c.fragments_tested, serial.fragments_tested);
        ASSERT_EQ(c.per_worker.size(), 3u);
        std::int64_t triangles = 0, passed = 0;
        for (const WorkerWork& work : c.per_worker) {
          triangles += work.triangles;
          passed += work.fragments_passed;
        }
        EXPECT_EQ(triangles, serial.per_worker[0].triangles);
        EXPECT_EQ(passed, serial.fragments_passed);
        EXPECT_EQ(c.edge_tests, serial.edge_tests);
        EXPECT_EQ(c.fragments_passed, serial.fragments_passed);
        EXPECT_EQ(c.covered_pixels, serial.covered_pixels);
        EXPECT_EQ(c.tiles_touched, serial.tiles_touched);
        EXPECT_EQ(c.bin_entries, serial.bin_entries);
        // Which thread draws into which row is the schedule's: no fewer rows than on one thread.
        EXPECT_GE(c.merges.value_or(0), serial.merges.value_or(0));
      }
    }
  }
}

/// 4,000 triangles in front of each other, the nearest last, so that each fragment is kept when it comes:
/// whatever two threads draw, they draw to the same pixels.
Scene pile() {
  Scene scene = scene_by_hand();
  scene.model.triangles.clear();
  for (int i = 0; i < 4000; ++i) scene.model.triangles.push_back(right_triangle(8, 8, 4.25, i / 8000.0));
  return scene;
}

/// What a frame of the pile counted, of all threads.
Contention contention_of(std::string_view kernel, const ExecutionConfig& execution) {
  const Scene scene = pile();
  const auto renderer = make_renderer(kernel, "f32", {&scene, small_settings(), execution});
  Contention sum;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  do {
    for (const WorkerTally& worker : renderer->draw().raster_tally) sum += worker.contention;
  } while (execution.threads > 1 && sum.failed_exchanges + sum.contended_locks == 0 &&
           std::chrono::steady_clock::now() < end);
  return sum;
}

TEST(Contention, OfTwoThreadsOnTheSamePixels) {
  if (available_cpus() < 2) GTEST_SKIP() << "needs two CPUs";
  const ExecutionConfig two{.backend = "openmp", .schedule = "dynamic", .chunk = 1, .threads = 2};
  const Contention atomics = contention_of("triangle_atomics", two);
  EXPECT_GT(atomics.failed_exchanges, 0);
  EXPECT_EQ(atomics.contended_locks, 0);
  EXPECT_EQ(atomics.lock_wait_seconds, 0);
  const Contention locks = contention_of("triangle_locks", two);
  EXPECT_GT(locks.contended_locks, 0);
  EXPECT_GT(locks.lock_wait_seconds, 0);
  EXPECT_LT(locks.lock_wait_seconds, 20);
  EXPECT_EQ(locks.failed_exchanges, 0);
}

TEST(Contention, OneThreadIsInNobodysWay) {
  for (const std::string_view kernel : {"triangle_atomics", "triangle_locks"}) {
    const Contention alone = contention_of(kernel, {});
    EXPECT_EQ(alone.failed_exchanges + alone.contended_locks, 0) << kernel;
    EXPECT_EQ(alone.lock_wait_seconds, 0) << kernel;
  }
}

TEST(Counters, SizeClassesEndAtTheirLargestSide) {
  SizeClasses sizes;
  for (const std::int32_t side : {1, 2, 3, 4, 5, 64, 65, 1000}) sizes.add(1, side);
  sizes.add(0, 5);
  sizes.add(-3, 7);
  EXPECT_EQ(sizes.without_sample, 2);
  EXPECT_EQ(sizes.by_side, (std::array<std::int64_t, 7>{2, 2, 1, 0, 0, 1, 2}));
}

}  // namespace
}  // namespace rasterbench
