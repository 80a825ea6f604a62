#include "harness/study.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "base/error.h"

namespace rasterbench {
namespace {

class StudyTest : public testing::Test {
 protected:
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("study_test." + std::to_string(getpid()) + ".toml");
  ~StudyTest() override { std::filesystem::remove(path_); }

  Study read(const std::string& text, const StudyOptions& options = {}) {
    std::ofstream(path_) << text;
    return read_study(path_, options);
  }
  std::string error_of(const std::string& text) {
    try {
      read(text);
    } catch (const InputError& error) {
      const std::string what = error.what(), prefix = path_.string() + ":";
      return what.starts_with(prefix) ? what.substr(prefix.size()) : what;
    }
    return "no error";
  }
};

const std::string kSweep = R"(
[[sweep]]
scene = "teapot:triangles=300"
size = "64x48"
)";

std::vector<std::string> names(const Study& study) {
  std::vector<std::string> all;
  for (const PlannedPoint& point : study.points)
    all.push_back(point.name.substr(point.name.find("64x48/") + 6));
  return all;
}

TEST_F(StudyTest, SpansTheCrossProductOnce) {
  const Study study = read(kSweep + R"(
kernel = ["scanline", "tile_parallel"]
execution = ["serial", "openmp:static", "openmp:auto"]
chunk = ["default", 4]
threads = [1, 1]
)");
  EXPECT_EQ(
      names(study),
      (std::vector<std::string>{
          "scanline/f32/closed/clip/serial/1", "scanline/f32/closed/clip/openmp:static/1",
          "scanline/f32/closed/clip/openmp:static,4/1", "scanline/f32/closed/clip/openmp:auto/1",
          "tile_parallel/f32/closed/clip/serial/1", "tile_parallel/f32/closed/clip/openmp:static/1",
          "tile_parallel/f32/closed/clip/openmp:static,4/1", "tile_parallel/f32/closed/clip/openmp:auto/1"}));
}

TEST_F(StudyTest, TechniquesMultiplyTheKernelsThatHaveThem) {
  const Study study = read(kSweep + R"(
kernel = ["scanline", "fused_tiles"]
numeric = "fixed_8"
execution = "openmp:static"
threads = 1
techniques = ["none", "huge_pages", "huge_pages+fragments", "all-fragments"]
isa = "baseline"
)");
  const std::string rest = std::string("/fixed_8/closed/clip/openmp:static/1") +
                           (best_isa() == Isa::kBaseline ? "" : "/isa:baseline");
  EXPECT_EQ(names(study),
            (std::vector<std::string>{"scanline" + rest + "/techniques:none", "scanline" + rest,
                                      "fused_tiles" + rest + "/techniques:none",
                                      "fused_tiles" + rest + "/techniques:huge_pages",
                                      "fused_tiles" + rest + "/techniques:fragments+huge_pages",
                                      "fused_tiles" + rest + "/techniques:blocks+front_to_back+huge_pages"}));
  for (const PlannedPoint& planned : study.points)
    EXPECT_EQ(comparison_of(planned.point), comparison_of(study.points.front().point));
  EXPECT_NE(error_of(kSweep + "kernel = \"scanline\"\ntechniques = \"streeming\"\n")
                .find("techniques: techniques: unknown technique 'streeming'; did you mean 'streaming'?"),
            std::string::npos);
}

TEST_F(StudyTest, PeersHaveSceneSizeAndThreadsOnly) {
  const Study study = read(kSweep + R"(
kernel = "tile_parallel"
peer = "llvmpipe"
numeric = ["f32", "f64"]
fill = ["closed", "top-left"]
execution = ["serial"]
cache = ["warm", "cold"]
threads = [1, 2]
)");
  const auto peers = std::count_if(study.points.begin(), study.points.end(),
                                   [](const PlannedPoint& planned) { return is_peer(planned.point); });
  EXPECT_EQ(peers, 2);
  EXPECT_EQ(study.points.size(), 10u);
  for (const PlannedPoint& planned : study.points) {
    EXPECT_FALSE(is_literal_program(planned.point));
    if (is_peer(planned.point) && !has_llvmpipe()) {
      EXPECT_EQ(planned.skip, llvmpipe_missing());
    }
  }
  EXPECT_NE(error_of(kSweep + "peer = \"llvmpipe\"\nfill = \"closed\"\n").find("fill: is an axis of kernels"),
            std::string::npos);
  EXPECT_NE(error_of(kSweep + "peer = \"mesa\"\n").find("unknown peer 'mesa'"), std::string::npos);
}

TEST_F(StudyTest, SkipsWithReasons) {
  const Study study = read(kSweep + R"(
kernel = ["all_pixels", "triangle_atomics"]
numeric = ["f64"]
execution = "openmp:static"
threads = [1, 60000]
[sampling]
point_seconds = 0.01
)");
  ASSERT_EQ(study.points.size(), 4u);
  EXPECT_NE(study.points[0].skip.find("exceeds the point's time limit of 0.01 s"), std::string::npos);
  EXPECT_NE(study.points[1].skip.find("needs --oversubscribe"), std::string::npos);
  EXPECT_NE(study.points[2].skip.find("triangle_atomics cannot run in mode f64"), std::string::npos);
}

TEST_F(StudyTest, ErrorsNameLineKeyAndSuggest) {
  EXPECT_EQ(error_of("nmae = \"x\"\n"), "1: nmae: unknown key of a study 'nmae'; did you mean 'name'?");
  EXPECT_EQ(error_of(kSweep + "kernel = \"tile_paralel\"\nexecution = \"serial\"\n"),
            "5: kernel: kernel: unknown kernel 'tile_paralel'; did you mean 'tile_parallel'?");
  EXPECT_EQ(error_of(kSweep + "kernels = \"all\"\nexecution = \"serial\"\nkernel = \"all\"\n"),
            "5: kernels: unknown key of [[sweep]] 'kernels'; did you mean 'kernel'?");
  EXPECT_EQ(error_of("[sampling]\ntarget = 2\n"), "2: target: must be a number from 0.0001 to 1");
  EXPECT_EQ(error_of("name = \"x\"\n"), " sweep: a study needs at least one [[sweep]]");
  EXPECT_EQ(error_of("name = \"x\"\nseed = =\n").substr(0, 2), "2:");
  EXPECT_EQ(error_of(kSweep + "kernel = []\nexecution = \"serial\"\n"), "5: kernel: is an empty list");
}

TEST_F(StudyTest, ScenesMayBeNamed) {
  const std::string rest = "kernel = \"scanline\"\nexecution = \"serial\"\nsize = \"8x8\"\n";
  const Study study = read("[[sweep]]\nscene = {name = \"pot\", model = \"teapot:triangles=300\"}\n" + rest);
  EXPECT_EQ(study.points.at(0).name, "pot/8x8/scanline/f32/closed/clip/serial/1");
  EXPECT_EQ(error_of("[[sweep]]\nscene = {name = \"a/b\", model = \"teapot\"}\n" + rest),
            "2: name: must not hold a '/': points are named by paths");
  EXPECT_EQ(error_of("[[sweep]]\nscene = {name = \"a\"}\n" + rest), "2: model: is missing from this scene");
  const std::string twice =
      "[[sweep]]\nscene = [{name = \"a\", model = \"teapot:triangles=300\"}, "
      "{name = \"a\", model = \"teapot:triangles=400\"}]\n";
  EXPECT_NE(error_of(twice + rest).find("two scenes are named 'a'"), std::string::npos);
}

TEST_F(StudyTest, FilterAndShardsPartition) {
  const std::string text = kSweep + R"(
kernel = "all"
execution = ["serial", "openmp:static"]
threads = [1, 2]
)";
  StudyOptions options;
  options.filter = std::regex("serial");
  EXPECT_EQ(read(text, options).points.size(), 8u);
  options.filter_excludes = true;
  EXPECT_EQ(read(text, options).points.size(), 16u);

  const std::string two = text + "numeric = [\"f32\", \"fixed_8\"]\n";
  std::vector<std::string> all, comparisons;
  for (int shard = 1; shard <= 2; ++shard) {
    StudyOptions part;
    part.shard = shard;
    part.shards = 2;
    std::vector<std::string> own;
    for (const PlannedPoint& planned : read(two, part).points) {
      all.push_back(planned.name);
      own.push_back(comparison_of(planned.point));
    }
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
    comparisons.insert(comparisons.end(), own.begin(), own.end());
  }
  std::sort(all.begin(), all.end());
  EXPECT_EQ(all.size(), 60u);  // ten kernels carry one of the modes, each in three executions
  EXPECT_EQ(std::unique(all.begin(), all.end()), all.end());
  EXPECT_EQ(comparisons.size(), 2u);
  EXPECT_NE(comparisons.at(0), comparisons.at(1)) << "a comparison is in two shards";
  StudyOptions too_many;
  too_many.shards = 3;
  EXPECT_THROW(read(two, too_many), InputError);
}

TEST_F(StudyTest, AFamilyHasAllInstructionSetsOfAPicture) {
  const std::string text = R"(
[[sweep]]
scene = "teapot:triangles=100"
size = ["64x48", "32x24"]
kernel = ["tile_parallel"]
numeric = ["f32", "fixed_8"]
execution = ["serial", "openmp:static"]
threads = [1, 2]
isa = ["baseline", "avx2"]
)";
  const Study study = read(text);
  EXPECT_EQ(study.families, 4u);
  std::map<std::string, std::size_t> family_of_picture;
  for (const PlannedPoint& planned : study.points) {
    const Point& point = planned.point;
    const auto [known, is_new] =
        family_of_picture.emplace(std::to_string(point.width) + point.numeric, planned.family);
    EXPECT_EQ(known->second, planned.family) << planned.name;
  }
  EXPECT_EQ(family_of_picture.size(), 4u);
}

TEST_F(StudyTest, APlanForAnotherMachineHasItsThreadsAndInstructionSet) {
  StudyOptions options;
  options.cpus = 12;
  options.isa = Isa::kSse4;
  const Study study = read(R"(
[[sweep]]
scene = "teapot:triangles=100"
kernel = ["tile_parallel"]
execution = ["openmp:static"]
threads = ["max", 13]
)",
                           options);
  ASSERT_EQ(study.points.size(), 2u);
  EXPECT_EQ(study.points[0].point.execution.threads, 12);
  EXPECT_EQ(study.points[0].skip, "");
  EXPECT_EQ(study.points[0].point.isa, Isa::kSse4);
  EXPECT_NE(study.points[1].skip.find("13 threads on 12 CPUs"), std::string::npos) << study.points[1].skip;
}

}  // namespace
}  // namespace rasterbench
