// What fused_tiles has and no other kernel: streams, rounds, size classes, techniques. That its pictures are
// those of the specification under every execution, kernels_test.cpp holds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <span>

#include "kernels/kernel.h"
#include "kernels/rough_order.h"
#include "kernels/tile_streams.h"
#include "reference/specification.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

TEST(TileStreams, HandOutBlocksWithRoom) {
  TileStreams<3> streams;
  streams.grow(4);
  streams.reset(2);
  EXPECT_TRUE(streams.blocks(1).empty());
  constexpr int kCapacity = TileStreams<3>::kCapacity;
  for (int i = 0; i < kCapacity; ++i) {
    auto& block = streams.room(1, 1);
    block.fields[0][block.size++] = static_cast<std::uint32_t>(i);
  }
  EXPECT_EQ(streams.used_blocks(), 1);  // one entry at a time fills a block to the end
  auto& second = streams.room(1);
  EXPECT_EQ(second.size, 0);
  EXPECT_EQ(streams.blocks(1).front().size, kCapacity);
  second.size = kCapacity - TileStreams<3>::kOverhang;
  EXPECT_EQ(&streams.room(1), &second);
  ++second.size;  // a vector would no longer fit
  EXPECT_EQ(streams.room(1).size, 0);
  EXPECT_EQ(streams.blocks(1).size(), 3u);
  EXPECT_EQ(streams.entries(1), 2 * kCapacity - TileStreams<3>::kOverhang + 1);
  EXPECT_EQ(streams.entries(0), 0);
}

TEST(TileStreams, KeepTheirBlocksAndNeverMoveThem) {
  TileStreams<3> streams;
  streams.grow(1);
  streams.reset(1);
  const auto* first = streams.room(0).fields;
  const std::size_t bytes = streams.bytes();
  streams.grow(streams.spare_blocks() + 1);  // another chunk
  EXPECT_GT(streams.bytes(), bytes);
  EXPECT_EQ(streams.blocks(0).front().fields, first);
  const std::int64_t spare = streams.spare_blocks();
  std::int64_t taken = 0;
  for (; streams.spare_blocks() > 0; ++taken) streams.room(0).size = TileStreams<3>::kCapacity;
  EXPECT_EQ(taken, spare + 1);  // the first one was taken already, and was empty
  const std::size_t all = streams.bytes();
  streams.reset(1);
  EXPECT_EQ(streams.used_blocks(), 0);
  EXPECT_EQ(streams.room(0).fields, first);  // after a reset from the first block on
  EXPECT_EQ(streams.bytes(), all);
}

TEST(StreamBounds, HoldAllThatIsAdded) {
  StreamBounds bounds = StreamBounds::none();
  bounds.add({0.5f, {3, 4, 10, 12}});
  bounds.add({0.25f, {5, 1, 6, 30}});
  EXPECT_TRUE(bounds.are_known());
  EXPECT_EQ(bounds.nearest(), 0.25f);
  EXPECT_EQ(bounds.pixels(), (PixelBox{3, 1, 10, 30}));
  bounds.add({});  // lies anywhere
  EXPECT_FALSE(bounds.are_known());
  bounds.add({0.5f, {3, 4, 10, 12}});
  EXPECT_FALSE(bounds.are_known());
}

/// Places by which the values of sorted indices are out of order.
std::size_t disorder(const std::vector<float>& values, std::vector<std::uint32_t> sorted) {
  auto exact = sorted;
  std::stable_sort(exact.begin(), exact.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return values[a] < values[b]; });
  std::size_t most = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    // Equal values may stand in any order.
    const auto [low, high] =
        std::equal_range(exact.begin(), exact.end(), sorted[i],
                         [&](std::uint32_t a, std::uint32_t b) { return values[a] < values[b]; });
    const auto first = static_cast<std::size_t>(low - exact.begin()),
               end = static_cast<std::size_t>(high - exact.begin());
    most = std::max(most, i < first ? first - i : i >= end ? i + 1 - end : 0);
  }
  return most;
}

TEST(SortRoughly, MovesNothingFar) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Random random(3);
  const auto draw = [&](double low, double high) { return static_cast<float>(random.uniform(low, high)); };
  std::vector<std::vector<float>> cases(7);
  for (int i = 0; i < 300; ++i) {
    cases[0].push_back(draw(0, 1));
    cases[1].push_back(draw(-1e-30, 1e-30));
    cases[2].push_back(draw(-3e38, 3e38));
    cases[3].push_back(i == 7 ? -1.0f : draw(0.999, 0.9999));  // one far from all others
    cases[4].push_back(i % 50 == 0 ? -kInfinity : i % 50 == 1 ? kInfinity : draw(0, 1));
    cases[5].push_back(5);
    cases[6].push_back(1 - 0.001f / draw(0.001, 10));  // as depths of a camera are
  }
  std::vector<std::uint32_t> room;
  for (const auto& values : cases) {
    std::vector<std::uint32_t> indices;
    for (std::uint32_t i = 0; i < values.size(); ++i)
      if (i % 3 != 0 || i < 9) indices.push_back(i);
    auto sorted = indices;
    sort_roughly(values.data(), sorted, room);
    EXPECT_LE(disorder(values, sorted), 8) << &values - cases.data();
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(sorted, indices) << "a permutation";
  }
}

TEST(SortRoughly, TakesFewValues) {
  std::vector<std::uint32_t> room;
  for (const std::vector<float>& values :
       {std::vector<float>{}, {2}, {-0.0f, 0.0f}, {0x1p-149f, 0, 0x1p-148f}}) {
    std::vector<std::uint32_t> indices(values.size());
    for (std::uint32_t i = 0; i < indices.size(); ++i) indices[i] = i;
    sort_roughly(values.data(), indices, room);
    EXPECT_LE(disorder(values, indices), 1);
  }
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

constexpr const char* kModes[] = {"fixed_8", "filtered"};

std::unique_ptr<Renderer> fused(const Scene& scene, const FrameSettings& settings, const Rest& rest = {},
                                const char* mode = "fixed_8") {
  return make_renderer(
      "fused_tiles", mode,
      {&scene, settings, rest.execution, rest.seed, rest.keeps_ids, rest.budget, rest.count});
}

/// Pixels in which a frame differs from the specification, on every instruction set of this CPU.
std::int64_t differing(const Scene& scene, FrameSettings settings, const char* mode, const Rest& rest = {}) {
  const Picture expected = render_specification(scene, mode, settings);
  std::int64_t sum = 0;
  for (const Isa isa : all_isas()) {
    if (!is_supported(isa)) continue;
    settings.geometry.isa = isa;
    const auto renderer = fused(scene, settings, rest, mode);
    for (int frame = 0; frame < 2; ++frame) {
      renderer->draw();
      sum += differing_pixels(picture_of(*renderer, settings), expected);
    }
  }
  return sum;
}

TEST(FusedTiles, DrawInRoundsWhatTheStreamsCannotHold) {
  const Scene scenes[] = {much_clipped(), generate("confetti:triangles=3000,size=40"),
                          generate("teapot:triangles=20000")};
  for (const char* mode : kModes)
    for (const Scene& scene : scenes)
      for (const FillRule fill : {FillRule::kClosed, FillRule::kTopLeft}) {
        const FrameSettings settings{.width = 150, .height = 70, .fill = fill, .tile = 8};
        EXPECT_EQ(differing(scene, settings, mode, {.budget = 1}), 0);
        const Rest on_threads{.execution = {"openmp", "dynamic", {}, 3}, .seed = 5, .budget = 1};
        EXPECT_EQ(differing(scene, settings, mode, on_threads), 0);
      }
}

TEST(FusedTiles, ASmallBudgetMakesRounds) {
  const Scene scene = generate("confetti:triangles=30000,size=40");
  const FrameSettings settings{.width = 150, .height = 70, .tile = 8};
  // Counted once a round.
  const auto touched = [&](std::size_t budget) {
    return *fused(scene, settings, {.budget = budget, .count = true})->draw().counters.tiles_touched;
  };
  EXPECT_GT(touched(1), touched(std::size_t{1} << 30));
}

/// The world point that a camera at (0, 0, 3) with a field of view of 90 degrees shows at (x, y) px of a
/// square image, at depth z.
Vec3 at_pixel(double x, double y, int side, double z = 0) {
  return {static_cast<float>((2 * x / side - 1) * (3 - z)), static_cast<float>((1 - 2 * y / side) * (3 - z)),
          static_cast<float>(z)};
}

Scene seen_from_front(std::vector<Triangle> triangles) {
  Scene scene;
  scene.model.triangles = std::move(triangles);
  scene.parameters.camera = {0, 0, 3};
  scene.parameters.theta = 1.5707963267948966;
  scene.parameters.near_plane = 1;
  scene.parameters.far_plane = 10;
  return scene;
}

TEST(FusedTiles, SmallTrianglesOnCornersOfTilesFindRoomInAllFour) {
  std::vector<Triangle> triangles;
  constexpr int kSide = 512;
  for (int i = 1; i <= 16; ++i)
    for (int j = 1; j <= 16; ++j) {
      const double x = 16 * i, y = 16 * j;
      triangles.push_back({at_pixel(x - 1.6, y - 1.6, kSide), at_pixel(x + 1.6, y - 1.6, kSide),
                           at_pixel(x, y + 1.6, kSide)});
    }
  const FrameSettings settings{.width = kSide, .height = kSide, .tile = 8};
  for (const char* mode : kModes) EXPECT_EQ(differing(seen_from_front(triangles), settings, mode), 0);
}

TEST(FusedTiles, HugeTrianglesBesideSmallOnesStayOutOfTheirLanes) {
  constexpr int kSide = 64;
  Random random(17);
  for (int trial = 0; trial < 40; ++trial) {
    const auto far = [&] { return random.uniform(-12000, 12000); };
    std::vector<Triangle> triangles;
    for (int i = 0; i < 3; ++i)
      triangles.push_back({at_pixel(far(), far(), kSide, 1), at_pixel(far(), far(), kSide, 1),
                           at_pixel(far(), far(), kSide, 1)});
    for (int i = 0; i < 3; ++i) {
      const double x = random.uniform(2, 55), y = random.uniform(2, 55);
      triangles.push_back(
          {at_pixel(x, y, kSide), at_pixel(x + 3.6, y + 0.3, kSide), at_pixel(x + 0.2, y + 3.6, kSide)});
    }
    for (const char* mode : kModes)
      EXPECT_EQ(differing(seen_from_front(triangles), {.width = kSide, .height = kSide}, mode), 0) << trial;
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
  for (const char* mode : kModes)
    for (const Scene& scene : scenes)
      for (int bits = 0; bits < 16; ++bits) {
        FrameSettings settings{.width = 131, .height = 67};
        settings.techniques = {(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, (bits & 8) != 0};
        EXPECT_EQ(differing(scene, settings, mode), 0) << bits;
      }
}

TEST(FusedTiles, LastWinsTieRule) {
  const Scene scene = generate("layers:triangles=60,depth=1");
  Scene twice = scene;  // every triangle has a twin at its depth
  for (const Triangle& t : scene.model.triangles) twice.model.triangles.push_back(t);
  for (const char* mode : kModes)
    for (const TieRule tie : {TieRule::kFirst, TieRule::kLast})
      EXPECT_EQ(differing(twice, {.width = 60, .height = 40, .tie = tie}, mode), 0);
}

TEST(FusedTiles, WritesIdsOnlyWhenAsked) {
  const Scene scene = generate("teapot:triangles=300");
  const FrameSettings settings{.width = 40, .height = 30};
  const auto with = fused(scene, settings), without = fused(scene, settings, {.keeps_ids = false});
  with->draw();
  without->draw();
  EXPECT_TRUE(std::equal(with->colours().begin(), with->colours().end(), without->colours().begin()));
  EXPECT_EQ(without->bytes() + settings.pixels() * sizeof(std::int32_t), with->bytes());
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
  ASSERT_EQ(report.raster_tally.size(), 1u);
  EXPECT_EQ(report.raster_tally[0].iterations, 16);  // tiles: the batches of the geometry stage are not in it
  EXPECT_LE(report.raster_tally[0].busy_seconds, *report.seconds.raster);
  ASSERT_TRUE(report.loop_seconds);
  EXPECT_GT(*report.loop_seconds, 0);
  EXPECT_LE(*report.loop_seconds, *report.seconds.raster);

  const Scene dust = generate("teapot:triangles=30000");
  const auto of_dust = fused(dust, settings, {.count = true});
  const WorkCounters& c = of_dust->draw().counters;
  EXPECT_GT(*c.binned_fragments, 100);  // triangles of less than a pixel
  EXPECT_EQ(c.geometry_bytes->written, 40 * *c.bin_entries + 12 * *c.binned_fragments);
}

/// Both modes draw the scenes as the specification does, with these tiles and techniques, by either fill
/// rule.
void expect_specified(std::span<const Scene> scenes, std::initializer_list<int> tiles,
                      std::initializer_list<const char*> techniques) {
  for (const char* mode : kModes)
    for (const Scene& scene : scenes)
      for (const int tile : tiles)
        for (const char* names : techniques) {
          const FrameSettings settings{.width = 203,
                                       .height = 149,
                                       .fill = tile == 32 ? FillRule::kClosed : FillRule::kTopLeft,
                                       .tile = tile,
                                       .techniques = parse_techniques(names, "x")};
          EXPECT_EQ(differing(scene, settings, mode), 0) << mode << " " << tile << " " << names;
        }
}

TEST(FusedTiles, DrawLargeTrianglesByBlocks) {
  // Walls of the size of tiles and blocks, in both orders; triangles larger than the image; cut ones.
  const Scene scenes[] = {generate("layers:triangles=60,depth=3"),
                          generate("layers:triangles=2000,depth=3,order=back-to-front"),
                          generate("confetti:triangles=300,size=500"), much_clipped()};
  expect_specified(scenes, {8, 16, 32, 128}, {"all", "all-front_to_back", "all-blocks", "none"});
}

TEST(FusedTiles, LeaveOutWhatIsHidden) {
  const Scene scene = generate("layers:triangles=400,depth=8");
  FrameSettings settings{.width = 512, .height = 512};
  settings.geometry.isa = best_isa();
  const auto hidden = [&] {
    return *fused(scene, settings, {.count = true})->draw().counters.hidden_entries;
  };
  // 8 walls of 50 triangles; each tile sees about 4 of a wall. Blocks hide more than whole tiles.
  const auto by_blocks = hidden();
  settings.techniques.blocks = false;
  const auto by_tiles = hidden();
  EXPECT_GT(by_tiles, 100);
  EXPECT_GT(by_blocks, by_tiles);
  settings.techniques.front_to_back = false;
  EXPECT_EQ(hidden(), 0);
}

/// Entries that a frame of these triangles leaves out, whose camera is that of seen_from_front().
std::int64_t hidden_of(const std::vector<Triangle>& triangles, FrameSettings settings) {
  const Scene scene = seen_from_front(triangles);
  settings.geometry.isa = best_isa();
  return *fused(scene, settings, {.count = true})->draw().counters.hidden_entries;
}

/// A triangle over the whole image of seen_from_front(), w in front of the camera.
Triangle wall(float w) { return {{-4 * w, -4 * w, 3 - w}, {12 * w, -4 * w, 3 - w}, {-4 * w, 12 * w, 3 - w}}; }

TEST(FusedTiles, LeaveOutWhatIsHiddenInTilesThatTheImageCuts) {
  std::vector<Triangle> walls;
  for (int i = 0; i < 20; ++i) walls.push_back(wall(5 - 0.1f * static_cast<float>(i)));
  // A tile of 8 x 8 blocks, of which the image has 3 x 1, and one of 16.
  for (const char* techniques : {"all", "all-blocks"})
    for (const int tile : {16, 128}) {
      const FrameSettings settings{
          .width = 48, .height = 16, .tile = tile, .techniques = parse_techniques(techniques, "x")};
      EXPECT_EQ(hidden_of(walls, settings), 19 * (tile == 16 ? 3 : 1)) << techniques << " " << tile;
    }
}

TEST(FusedTiles, LeaveOutThinTrianglesThatAreHidden) {
  // 50 by 2 pixels, four blocks long, in the middle of the image.
  std::vector<Triangle> slivers{wall(2)};
  for (int i = 0; i < 30; ++i) slivers.push_back({{-3, 0.01f, -1}, {3, 0.02f, -1}, {0, -0.2f, -1}});
  EXPECT_EQ(hidden_of(slivers, {.width = 64, .height = 64, .tile = 64}), 30);
}

TEST(FusedTiles, LeaveOutNeighboursThatAreHidden) {
  // A carpet of small triangles behind a wall of two, which comes last.
  std::vector<Triangle> triangles;
  const auto at = [](int i) { return -3.96f + 0.22f * static_cast<float>(i); };  // 3.5 pixels apart
  for (int y = 0; y < 36; ++y)
    for (int x = 0; x < 36; ++x)
      triangles.push_back({{at(x), at(y), -1}, {at(x + 1), at(y), -1}, {at(x), at(y + 1), -1}});
  const FrameSettings settings{.width = 128, .height = 128, .tile = 64};
  const std::int64_t alone = hidden_of(triangles, settings);
  triangles.push_back(wall(2));
  EXPECT_EQ(alone, 0);
  EXPECT_GT(hidden_of(triangles, settings), 1200);  // of 1296, and some in two tiles
  FrameSettings unordered = settings;
  unordered.techniques.front_to_back = false;
  EXPECT_EQ(hidden_of(triangles, unordered), 0);
}

TEST(FusedTiles, DrawNeighboursInOrderOfDepth) {
  // Meshes with much behind them, and triangles strewn over the image, from a pixel to a tile.
  const Scene scenes[] = {generate("teapot:triangles=3000"), generate("teapot:triangles=30000"),
                          generate("confetti:triangles=4000,size=6"),
                          generate("layers:triangles=20000,depth=5,order=back-to-front")};
  expect_specified(scenes, {8, 32, 128}, {"all", "all-fragments", "all-front_to_back"});
}

TEST(FusedTiles, OneNearTriangleDoesNotSpoilTheOrder) {
  std::vector<Triangle> walls;
  for (int i = 0; i < 40; ++i) walls.push_back(wall(5 - 0.1f * static_cast<float>(i)));  // back to front
  const FrameSettings settings{.width = 64, .height = 64, .tile = 64};
  const std::int64_t without = hidden_of(walls, settings);
  walls.push_back({{-0.3f, -0.3f, 1.999f}, {0.3f, -0.3f, 1.999f}, {0, 0.3f, 1.999f}});
  EXPECT_GE(hidden_of(walls, settings), without - 8);
}

}  // namespace
}  // namespace rasterbench
