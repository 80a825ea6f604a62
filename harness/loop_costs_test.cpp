// Traces and costs of the loops of kernels, and the heat map of costs that are known.
#include "harness/loop_costs.h"

#include <gtest/gtest.h>

#include <numeric>

#include "base/error.h"
#include "harness/cost_image.h"

namespace rasterbench {
namespace {

Point small_point(const std::string& kernel, const std::string& numeric = "f32") {
  Point point;
  point.scene = parse_scene_reference("teapot:triangles=300");
  point.width = 96;
  point.height = 64;
  point.kernel = kernel;
  point.numeric = numeric;
  point.execution = {"openmp", "dynamic", {}, 2, nullptr};
  point.tile = 32;
  return point;
}

Scene scene_of(const Point& point) { return open_scene(point.scene.model, {}); }

TEST(LoopShapes, AreThoseOfTheKernels) {
  EXPECT_EQ(loop_shape(small_point("triangle_atomics")).unit, "triangle");
  EXPECT_EQ(loop_shape(small_point("triangle_atomics")).width, 0);
  EXPECT_EQ(loop_shape(small_point("all_pixels")).columns, 96);
  EXPECT_EQ(loop_shape(small_point("row_parallel")).width, 96);
  EXPECT_EQ(loop_shape(small_point("row_parallel")).height, 1);
  EXPECT_EQ(loop_shape(small_point("scanline")).height, 16);
  EXPECT_EQ(loop_shape(small_point("tile_parallel")).width, 32);
  EXPECT_EQ(loop_shape(small_point("tile_parallel")).columns, 3);
  Point odd = small_point("fused_tiles", "fixed_8");
  odd.tile = 50;
  EXPECT_EQ(loop_shape(odd).width, 32);  // of its powers of two
}

/// A loop has as many iterations as its shape says; their costs add up to about the loop.
TEST(LoopCosts, HaveOneForEachIteration) {
  for (const auto& [kernel, n] :
       {std::pair{"row_parallel", 64u}, {"tile_parallel", 6u}, {"scanline", 4u}, {"all_pixels", 96u * 64u}}) {
    SCOPED_TRACE(kernel);
    const Point point = small_point(kernel);
    const LoopCosts costs = measure_loop_costs(point, scene_of(point), 3);
    EXPECT_EQ(costs.seconds.size(), n);
    EXPECT_EQ(costs.colours.size(), 96u * 64u);
    EXPECT_GT(costs.serial_loop_seconds, 0);
    EXPECT_GT(costs.stamp_seconds, 0);
    const double sum = std::accumulate(costs.seconds.begin(), costs.seconds.end(), 0.0);
    EXPECT_GT(sum, 0.2 * costs.serial_loop_seconds);
    EXPECT_LT(sum, 5 * costs.serial_loop_seconds);
  }
}

TEST(LoopCosts, AreRefusedWhereLoopsDiffer) {
  const Point point = small_point("bounding_box");
  EXPECT_THROW(measure_loop_costs(point, scene_of(point), 1), InputError);
  EXPECT_GT(trace_frames(point, scene_of(point), 1).loops.size(), 1u);  // but traced they can be
}

TEST(TracedFrames, GiveFilesThatHoldEveryIteration) {
  const Point point = small_point("row_parallel");
  const TracedFrame frame = trace_frames(point, scene_of(point), 3);
  EXPECT_GT(frame.untraced_seconds, 0);
  const Json json = Json::parse(trace_text(point, loop_shape(point), frame, Json()));
  std::vector<int> seen(64);
  for (const Json& event : json.at("traceEvents")) {
    if (event.at("ph") == "M") continue;
    EXPECT_EQ(event.at("name"), "chunk");
    EXPECT_EQ(event.at("cat"), "raster");
    EXPECT_LT(event.at("tid").get<int>(), 2);
    EXPECT_EQ(event.at("args").at("first"), event.at("args").at("last"));  // dynamic,1
    ++seen.at(event.at("args").at("first"));
    EXPECT_LE(event.at("ts").get<double>() + event.at("dur").get<double>(), 1e6 * frame.seconds * 1.5);
  }
  for (const int times : seen) EXPECT_EQ(times, 1);
  EXPECT_EQ(json.at("metadata").at("iterations"), 64);
  EXPECT_EQ(json.at("metadata").at("chunks"), 64);
  EXPECT_EQ(json.at("metadata").at("unit"), "row");
  EXPECT_EQ(json.at("metadata").at("tile"), nullptr);
}

/// An iteration that does not exist cannot be joined away: as many chunks go in as the file says.
TEST(TracedFrames, JoinChunksWhereTheFileWouldBeTooLarge) {
  const Point point = small_point("triangle_atomics");
  TracedFrame frame;
  frame.loops = {{.iterations = 1'000'000, .begin = 1, .end = 2}};
  frame.begin = 1;
  frame.seconds = frame.untraced_seconds = 1;
  frame.chunks.resize(1);
  for (std::int64_t i = 0; i < 1'000'000; ++i) {
    const double at = 1 + 1e-6 * static_cast<double>(i);
    frame.chunks[0].push_back({.loop = 0, .first = i, .last = i, .begin = at, .end = at + 5e-7});
  }
  const std::string text = trace_text(point, loop_shape(point), frame, Json());
  EXPECT_LT(text.size(), 50'000'000u);
  const Json json = Json::parse(text);
  EXPECT_EQ(json.at("metadata").at("chunks_an_event"), 4);
  std::int64_t iterations = 0, next = 0;
  for (const Json& event : json.at("traceEvents")) {
    if (event.at("ph") == "M") continue;
    EXPECT_EQ(event.at("args").at("first"), next);
    next = event.at("args").at("last").get<std::int64_t>() + 1;
    iterations += event.at("args").at("iterations").get<std::int64_t>();
  }
  EXPECT_EQ(iterations, 1'000'000);
}

TEST(CostFiles, SumUpBlocksWhereTheyWouldBeTooLarge) {
  const Point point = small_point("triangle_atomics");
  LoopCosts costs;
  costs.seconds.assign(5'000'001, 1e-6);
  const Json json = Json::parse(costs_text(point, "abc", loop_shape(point), costs,
                                           {{{"openmp:dynamic,1", {2e-6, 1e-7}}, {"tbb:auto", {}}}, 4e-7}));
  EXPECT_EQ(json.at("iterations"), 5'000'001);
  EXPECT_EQ(json.at("iterations_a_cost"), 2);
  EXPECT_EQ(json.at("cost_us").size(), 2'500'001u);
  EXPECT_EQ(json.at("cost_us").at(0), 2.0);
  EXPECT_EQ(json.at("cost_us").back(), 1.0);
  EXPECT_EQ(json.at("dispatch_us").at("openmp:dynamic,1"), 0.1);
  EXPECT_EQ(json.at("start_us").at("openmp:dynamic,1"), 2.0);
  EXPECT_EQ(json.at("steal_us"), 0.4);
  EXPECT_TRUE(json.at("dispatch_us").at("tbb:auto").is_null());
  EXPECT_TRUE(json.at("start_us").at("tbb:auto").is_null());
  EXPECT_EQ(json.at("scene_hash"), "abc");
  for (const char* axis : {"fill", "near", "isa", "techniques", "generality"})
    EXPECT_EQ(json.at(axis), point_config(point).at(axis)) << axis;
}

TracedFrame frame_of(double loop_seconds, std::size_t chunks) {
  TracedFrame frame;
  frame.loops = {{.iterations = 1, .begin = 0, .end = loop_seconds}};
  frame.chunks = {std::vector<TracedChunk>(chunks)};
  return frame;
}

TEST(TracedFrames, AreKeptInBoundedNumber) {
  FramesNearMedian few;
  for (const double seconds : {3.0, 1.0, 2.0}) few.add(frame_of(seconds, 1));
  EXPECT_EQ(few.take().loops[0].end, 2);
  FramesNearMedian many;
  for (int i = 0; i < 1000; ++i) many.add(frame_of((i * 389) % 1000, 1));  // each of 0 .. 999 once
  EXPECT_EQ(many.kept(), FramesNearMedian::kMostFrames);
  EXPECT_NEAR(many.take().loops[0].end, 499, 50);
  FramesNearMedian large;
  const std::size_t half = FramesNearMedian::kMostBytes / sizeof(TracedChunk) / 2 + 1;
  for (const double seconds : {3.0, 1.0, 2.0}) large.add(frame_of(seconds, half));
  EXPECT_EQ(large.kept(), 1u);
}

TEST(CostImages, ShowEachTileWhereItIs) {
  const Point point = small_point("tile_parallel");
  LoopCosts costs;
  costs.seconds = {0, 0, 0, 0, 8e-6, 0};  // of three columns and two rows: the middle one below
  costs.colours.assign(96 * 64, 0xff000000u);
  const CostImage image = cost_image(point, scene_of(point), loop_shape(point), costs);
  EXPECT_EQ(image.unit, "us a tile");
  EXPECT_DOUBLE_EQ(image.high, 8);
  const std::uint32_t cold = image.colours[0];
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 96; ++x)
      EXPECT_EQ(image.colours[static_cast<std::size_t>(y * 96 + x)] != cold, y >= 32 && x >= 32 && x < 64);
  EXPECT_GT(image.colours[50 * 96 + 50] & 255, 170u);  // 0.7 of viridis' yellow over black
}

TEST(CostImages, SpreadATriangleOverItsBox) {
  Point point = small_point("triangle_atomics");
  point.width = point.height = 32;
  Scene scene;  // seen from (0, 0, 3) with a field of view of 90 degrees: 16 px a unit at z = 0, over 3
  const auto at = [](double px, double py) {
    return Vec3{static_cast<float>((px / 16 - 1) * 3), static_cast<float>((1 - py / 16) * 3), 0};
  };
  scene.model.triangles = {{at(4.25, 8.25), at(11.75, 8.25), at(4.25, 11.75)},
                           {at(100, 0), at(101, 0), at(100, 1)}};
  scene.parameters.camera = {0, 0, 3};
  scene.parameters.theta = 1.5707963267948966;
  scene.parameters.near_plane = 1;
  scene.parameters.far_plane = 10;
  LoopCosts costs;
  costs.seconds = {32e-9, 32e-9};  // the second one is beside the picture
  costs.colours.assign(32 * 32, 0xff000000u);
  const CostImage image = cost_image(point, scene, loop_shape(point), costs);
  EXPECT_EQ(image.unit, "ns a pixel");
  EXPECT_NEAR(image.high, 1, 1e-9);  // 8 x 4 pixels
  EXPECT_NEAR(image.shown, 0.5, 1e-9);
  for (std::size_t y = 0; y < 32; ++y)
    for (std::size_t x = 0; x < 32; ++x)
      EXPECT_EQ(image.colours[y * 32 + x] != image.colours[0], y >= 8 && y < 12 && x >= 4 && x < 12);
}

}  // namespace
}  // namespace rasterbench
