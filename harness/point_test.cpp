#include "harness/point.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace rasterbench {
namespace {

Point sample_point() {
  Point point;
  point.scene = {"racer", "racer.dat", "racer.txt"};
  point.width = 640;
  point.height = 480;
  point.kernel = "tile_parallel";
  point.execution = {"openmp", "dynamic", 16, 2};
  return point;
}

TEST(Point, NameHoldsEveryAxisAndOnlyUnusualExtras) {
  Point point = sample_point();
  EXPECT_EQ(point_name(point), "racer/640x480/tile_parallel/f32/closed/clip/openmp:dynamic,16/2");
  point.environment = {"close", "active", "libomp"};
  point.tile = 32;
  point.cache = "cold";
  point.generality = Generality::kFull;
  EXPECT_EQ(point_name(point),
            "racer/640x480/tile_parallel/f32/closed/clip/openmp:dynamic,16/2/binding:close/wait:active/"
            "runtime:libomp/"
            "tile:32/cache:cold/generality:full");
}

TEST(Point, SurvivesJson) {
  Point point = sample_point();
  point.fill = FillRule::kTopLeft;
  point.near_rule = NearRule::kOff;
  point.generality = Generality::kFull;
  point.execution.chunk.reset();
  const Point back = point_from_json(Json::parse(point_to_json(point).dump()));
  EXPECT_EQ(point_name(back), point_name(point));
  EXPECT_EQ(back.scene.parameters, "racer.txt");
  EXPECT_FALSE(back.execution.chunk);
}

TEST(Point, KeepsTheTechniquesThatItsKernelHas) {
  const auto with = [](const std::string& kernel, const std::string& techniques) {
    Point point = sample_point();
    point.kernel = kernel;
    if (kernel == "fused_tiles") point.numeric = "fixed_8";
    if (kernel == "ray_cast") point.numeric = "ray_cast";
    point.techniques = parse_techniques(techniques, "x");
    return point;
  };
  const auto config_of = [](const Point& point) { return point_config(point).at("techniques"); };
  const bool has_vectors = best_isa() != Isa::kBaseline;
  const std::string of_frame = has_vectors ? "streaming+huge_pages" : "huge_pages";

  EXPECT_EQ(config_of(with("tile_parallel", "all")), of_frame);
  EXPECT_EQ(config_of(with("tile_parallel", "all-fragments")), of_frame);
  EXPECT_EQ(config_of(with("tile_parallel", "huge_pages")), "huge_pages");
  EXPECT_EQ(config_of(with("tile_parallel", "fragments")), "none");
  EXPECT_EQ(config_of(with("ray_cast", "all")), "none");
  EXPECT_EQ(config_of(with("fused_tiles", "all-fragments-blocks-front_to_back")), of_frame);
  EXPECT_EQ(config_of(with("fused_tiles", "all")), has_vectors ? "all" : "all-streaming");
  EXPECT_TRUE(config_of(peer_point("llvmpipe", {}, 1, 1, 1)).is_null());

  // What makes no difference makes no other point; in the name only what is missing.
  EXPECT_EQ(point_name(with("tile_parallel", "all")), point_name(sample_point()));
  EXPECT_EQ(point_name(with("tile_parallel", "all-fragments")), point_name(sample_point()));
  EXPECT_EQ(point_name(with("ray_cast", "none")), point_name(with("ray_cast", "all")));
  EXPECT_EQ(point_name(with("tile_parallel", "none")), point_name(sample_point()) + "/techniques:none");
  EXPECT_TRUE(point_name(with("fused_tiles", "front_to_back")).ends_with("/techniques:front_to_back"));

  // Stores past the caches are vectors'.
  Point scalar = with("tile_parallel", "all");
  scalar.isa = Isa::kBaseline;
  EXPECT_EQ(config_of(scalar), "huge_pages");
  EXPECT_EQ(point_name(scalar).find("techniques"), std::string::npos);

  for (const char* techniques : {"all", "none", "all-fragments", "front_to_back"}) {
    const Point point = with("fused_tiles", techniques);
    const Point back = point_from_json(Json::parse(point_to_json(point).dump()));
    EXPECT_EQ(back.settings().techniques, point.settings().techniques);
    EXPECT_EQ(point_name(back), point_name(point));
  }
}

TEST(Point, PeersHaveAProcessForEachNumberOfThreads) {
  const Point one = peer_point("llvmpipe", parse_scene_reference("teapot"), 64, 48, 1);
  const Point two = peer_point("llvmpipe", parse_scene_reference("teapot"), 64, 48, 2);
  EXPECT_TRUE(is_peer(one));
  EXPECT_FALSE(is_peer(Point{}));
  EXPECT_EQ(point_name(two), "teapot/64x48/llvmpipe/llvmpipe/top-left/clip/llvmpipe/2");
  EXPECT_NE(one.environment, two.environment);
  EXPECT_NE(one.environment, Environment{});
  for (const Point& point : {one, two}) {
    const Point back = point_from_json(Json::parse(point_to_json(point).dump()));
    EXPECT_EQ(point_name(back), point_name(point));
    EXPECT_EQ(back.environment, point.environment);
  }
  EXPECT_TRUE(point_config(one).at("schedule").is_null());
  EXPECT_TRUE(point_config(one).at("tile").is_null());
}

TEST(Point, SceneReferences) {
  EXPECT_EQ(parse_scene_reference("a/city.dat@a/city_street.txt").name, "city@city_street");
  EXPECT_EQ(parse_scene_reference("a/city.dat@b/city.txt").name, "city");
  EXPECT_EQ(parse_scene_reference("a/city.dat").parameters, "");
  EXPECT_EQ(parse_scene_reference("terrain:roughness=0.5").name, "terrain:roughness=0.5");
  EXPECT_EQ(parse_scene_reference("terrain:roughness=0.5").model, "terrain:roughness=0.5");
}

TEST(Point, ParsesExecutionsAndSizes) {
  EXPECT_EQ(to_string(parse_execution("openmp:guided,8", "x")), "openmp:guided,8");
  EXPECT_EQ(to_string(parse_execution("serial", "x")), "serial");
  EXPECT_EQ(parse_size("1x65536", "x"), (std::pair{1, 65536}));
  for (const char* bad : {"", "x", "10", "0x5", "5x0", "65537x1", "-1x5", "10x10x10", "1e3x5", " 5x5"})
    EXPECT_THROW(parse_size(bad, "x"), InputError) << bad;
  for (const char* bad : {"openmp:dynamic,", "openmp:dynamic,0", "openmp:dynamic,-1", "openmp:dynamic,2x"})
    EXPECT_THROW(parse_execution(bad, "x"), InputError) << bad;
}

}  // namespace
}  // namespace rasterbench
