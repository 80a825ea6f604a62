// What fused_tiles has and no other kernel: streams, rounds, size classes, techniques. That its pictures are
// those of the specification under every execution, kernels_test.cpp holds.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "kernels/kernel.h"
#include "kernels/tile_streams.h"
#include "reference/specification.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

TEST(TileStreams, HandOutBlocksWithRoom) {
  TileStreams<3> streams;
  streams.grow(4);
  streams.reset(2);
  EXPECT_EQ(streams.blocks(1), nullptr);
  constexpr int kCapacity = TileStreams<3>::kCapacity;
  for (int i = 0; i < kCapacity; ++i) {
    auto& block = streams.room(1, 1);
    block.fields[0][block.size++] = static_cast<std::uint32_t>(i);
  }
  EXPECT_EQ(streams.used_blocks(), 1);  // one entry at a time fills a block to the end
  auto& second = streams.room(1);
  EXPECT_EQ(second.size, 0);
  EXPECT_EQ(second.next->size, kCapacity);
  second.size = kCapacity - TileStreams<3>::kOverhang;
  EXPECT_EQ(&streams.room(1), &second);
  ++second.size;  // a vector would no longer fit
  EXPECT_NE(&streams.room(1), &second);
  EXPECT_EQ(streams.entries(1), 2 * kCapacity - TileStreams<3>::kOverhang + 1);
  EXPECT_EQ(streams.entries(0), 0);
}

TEST(TileStreams, KeepTheirBlocksAndNeverMoveThem) {
  TileStreams<3> streams;
  streams.grow(1);
  streams.reset(1);
  const auto* first = &streams.room(0);
  const std::size_t bytes = streams.bytes();
  streams.grow(streams.spare_blocks() + 1);  // another chunk
  EXPECT_GT(streams.bytes(), bytes);
  EXPECT_EQ(streams.blocks(0), first);
  const std::int64_t spare = streams.spare_blocks();
  std::int64_t taken = 0;
  for (; streams.spare_blocks() > 0; ++taken) streams.room(0).size = TileStreams<3>::kCapacity;
  EXPECT_EQ(taken, spare + 1);  // the first one was taken already, and was empty
  const std::size_t all = streams.bytes();
  streams.reset(1);
  EXPECT_EQ(streams.used_blocks(), 0);
  EXPECT_EQ(&streams.room(0), first);  // after a reset from the first block on
  EXPECT_EQ(streams.bytes(), all);
}

/// Many triangles across the near plane and the guard band, so that a batch has more pieces than fit in one.
Scene much_clipped() {
  Random random(11);
  const auto point = [&] {
    return Vec3{static_cast<float>(random.uniform(-400, 400)), static_cast<float>(random.uniform(-400, 400)),
                static_cast<float>(random.uniform(-2, 3.001))};
  };
  Scene scene;
  for (int i = 0; i < 400; ++i) scene.model.triangles.push_back({point(), point(), point()});
  scene.parameters.camera = {0, 0, 3};
  scene.parameters.theta = 1.5707963267948966;
  scene.parameters.near_plane = 0.001f;
  scene.parameters.far_plane = 10;
  return scene;
}

/// What a RendererSetup has besides its scene and settings.
struct Rest {
  ExecutionConfig execution = {};
  std::uint64_t seed = 0;
  std::size_t budget = std::size_t{1} << 30;
  bool keeps_ids = true, count = false;
};

std::unique_ptr<Renderer> fused(const Scene& scene, const FrameSettings& settings, const Rest& rest = {}) {
  return make_renderer(
      "fused_tiles", "fixed_8",
      {&scene, settings, rest.execution, rest.seed, rest.keeps_ids, rest.budget, rest.count});
}

TEST(FusedTiles, DrawInRoundsWhatTheStreamsCannotHold) {
  const Scene scenes[] = {much_clipped(), generate("confetti:triangles=3000,size=40"),
                          generate("teapot:triangles=20000")};
  for (const Scene& scene : scenes)
    for (const FillRule fill : {FillRule::kClosed, FillRule::kTopLeft}) {
      FrameSettings settings{.width = 150, .height = 70, .fill = fill, .tile = 8};
      settings.geometry.isa = best_isa();
      const Picture expected = render_specification(scene, "fixed_8", settings);
      for (const int threads : {1, 3})
        for (const std::uint64_t seed : {0u, 5u}) {
          Rest rest{.seed = seed, .budget = 1};
          if (threads > 1) rest.execution = {"openmp", "dynamic", {}, threads};
          const auto renderer = fused(scene, settings, rest);
          const std::size_t before = renderer->bytes();
          for (int frame = 0; frame < 2; ++frame) {
            renderer->draw();
            EXPECT_EQ(differing_pixels(picture_of(*renderer, settings), expected), 0) << threads << frame;
          }
          // What is drawn so far takes 8 bytes a pixel: a sign that there were rounds.
          EXPECT_GE(renderer->bytes(), before + 8 * settings.pixels());
        }
    }
}

TEST(FusedTiles, TheBudgetBoundsTheirMemory) {
  const Scene scene = generate("confetti:triangles=200000,size=60");
  FrameSettings settings{.width = 640, .height = 360};
  settings.geometry.isa = best_isa();
  const auto bytes = [&](std::size_t budget) {
    const auto renderer = fused(scene, settings, {.budget = budget});
    renderer->draw();
    return renderer->bytes();
  };
  const std::size_t bounded = bytes(std::size_t{1} << 20), unbounded = bytes(std::size_t{1} << 30);
  EXPECT_LT(2 * bounded, unbounded);
}

TEST(FusedTiles, NoTechniqueChangesThePicture) {
  const Scene scenes[] = {generate("confetti:triangles=500,size=30,distribution=heavy"),
                          generate("layers:triangles=200,depth=5"), generate("teapot:triangles=3000")};
  for (const Scene& scene : scenes) {
    FrameSettings settings{.width = 131, .height = 67};
    const Picture expected = render_specification(scene, "fixed_8", settings);
    settings.geometry.isa = best_isa();
    for (int bits = 0; bits < 16; ++bits) {
      settings.techniques = {(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, (bits & 8) != 0};
      const auto renderer = fused(scene, settings);
      renderer->draw();
      EXPECT_EQ(differing_pixels(picture_of(*renderer, settings), expected), 0) << bits;
    }
  }
}

TEST(FusedTiles, LastWinsTieRule) {
  const Scene scene = generate("layers:triangles=60,depth=1");
  Scene twice = scene;  // every triangle has a twin at its depth
  for (const Triangle& t : scene.model.triangles) twice.model.triangles.push_back(t);
  for (const TieRule tie : {TieRule::kFirst, TieRule::kLast}) {
    const FrameSettings settings{.width = 60, .height = 40, .tie = tie};
    const auto renderer = fused(twice, settings);
    renderer->draw();
    EXPECT_EQ(
        differing_pixels(picture_of(*renderer, settings), render_specification(twice, "fixed_8", settings)),
        0);
  }
}

TEST(FusedTiles, WritesIdsOnlyWhenAsked) {
  const Scene scene = generate("teapot:triangles=300");
  const FrameSettings settings{.width = 40, .height = 30};
  const auto with = fused(scene, settings), without = fused(scene, settings, {.keeps_ids = false});
  with->draw();
  without->draw();
  EXPECT_TRUE(std::equal(with->colours().begin(), with->colours().end(), without->colours().begin()));
  EXPECT_LT(without->bytes(), with->bytes() + 1);
  EXPECT_THROW(without->ids(), std::logic_error);
}

TEST(FusedTiles, CountsItsStreams) {
  // One wall of two triangles over the whole image, in front of one of 58 that each reach several tiles.
  Scene scene = generate("layers:triangles=60,depth=1");
  FrameSettings settings{.width = 128, .height = 128, .tile = 32};
  settings.geometry.isa = best_isa();
  const auto renderer = fused(scene, settings, {.count = true});
  const FrameReport& report = renderer->draw();
  EXPECT_EQ(report.counters.tiles, 16);
  EXPECT_LE(*report.counters.tiles_touched, 16);
  EXPECT_GT(*report.counters.bin_entries, static_cast<std::int64_t>(scene.model.triangles.size()));
  EXPECT_EQ(report.counters.binned_fragments, 0);
  EXPECT_FALSE(report.seconds.clear || report.seconds.resolve);
  EXPECT_TRUE(report.seconds.geometry && report.seconds.raster);

  const Scene dust = generate("teapot:triangles=30000");
  const auto of_dust = fused(dust, settings, {.count = true});
  const WorkCounters& c = of_dust->draw().counters;
  EXPECT_GT(*c.binned_fragments, 100);  // triangles of less than a pixel
  EXPECT_EQ(c.geometry_bytes->written, 40 * *c.bin_entries + 12 * *c.binned_fragments);
}

TEST(FusedTiles, LeaveOutWhatIsHidden) {
  const Scene scene = generate("layers:triangles=400,depth=8");
  FrameSettings settings{.width = 512, .height = 512};
  settings.geometry.isa = best_isa();
  const auto hidden = [&] {
    return *fused(scene, settings, {.count = true})->draw().counters.hidden_entries;
  };
  EXPECT_GT(hidden(), 100);
  settings.techniques.front_to_back = false;
  EXPECT_EQ(hidden(), 0);
}

}  // namespace
}  // namespace rasterbench
