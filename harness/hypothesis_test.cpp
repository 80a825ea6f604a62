#include "harness/hypothesis.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "base/error.h"

namespace rasterbench {
namespace {

const std::string kSweeps = R"(
[[sweep]]
scene = [{name = "pot", model = "teapot:triangles=300"}, {name = "bits", model = "confetti:triangles=50"}]
size = "64x48"
kernel = ["tile_parallel", "scanline"]
execution = ["serial", "openmp:static", "openmp:dynamic,4"]
threads = [1, "max"]
[[sweep]]
weak = "triangles"
scene = {name = "load", model = "confetti:triangles=50*threads"}
size = "32x24"
kernel = "scanline"
execution = "openmp:static"
threads = [1, "max"]
)";

class HypothesisTest : public testing::Test {
 protected:
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("hypothesis_test." + std::to_string(getpid()) + ".toml");
  ~HypothesisTest() override { std::filesystem::remove(path_); }

  Study read(const std::string& keys, StudyOptions options = {}) {
    std::ofstream(path_) << "[[hypothesis]]\n" << keys << kSweeps;
    if (!options.cpus) options.cpus = 2;
    return read_study(path_, options);
  }
  std::string error_of(const std::string& keys) {
    try {
      read(keys);
    } catch (const InputError& error) {
      const std::string what = error.what(), prefix = path_.string() + ":";
      return what.starts_with(prefix) ? what.substr(prefix.size()) : what;
    }
    return "no error";
  }
};

const std::string kGood =
    "claim = \"x\"\nwhere = {scene = \"pot\", threads = \"max\"}\n"
    "faster = {kernel = \"scanline\", execution = \"openmp:dynamic,4\"}\n"
    "slower = {kernel = \"scanline\", execution = \"openmp:static\"}\nby = 0.05\n";

TEST_F(HypothesisTest, SelectsOnePointASide) {
  const Study study = read(kGood);
  ASSERT_EQ(study.hypotheses.size(), 1u);
  const Hypothesis& hypothesis = study.hypotheses[0];
  EXPECT_EQ(hypothesis.claim, "x");
  EXPECT_EQ(hypothesis.by, 0.05);
  EXPECT_EQ(hypothesis.untested, "");
  EXPECT_EQ(hypothesis.faster,
            std::vector<std::string>{"pot/64x48/scanline/f32/closed/clip/openmp:dynamic,4/2"});
  EXPECT_EQ(hypothesis.slower,
            std::vector<std::string>{"pot/64x48/scanline/f32/closed/clip/openmp:static/2"});
  for (const PlannedPoint& planned : study.points)
    if (planned.name == hypothesis.faster[0]) {
      EXPECT_EQ(planned.partners, hypothesis.slower);
    }
}

TEST_F(HypothesisTest, SelectsTheBestOfSeveral) {
  const Study study = read(
      "claim = \"x\"\nwhere = {scene = \"pot\", threads = 2}\n"
      "faster = {kernel = \"scanline\", best = true}\n"
      "slower = {kernel = [\"tile_parallel\"], execution = [\"openmp:static\", \"openmp:dynamic,4\"], best = "
      "true}\n");
  EXPECT_EQ(study.hypotheses[0].faster.size(), 2u);
  EXPECT_EQ(study.hypotheses[0].slower.size(), 2u);
  EXPECT_EQ(study.hypotheses[0].by, 0);
}

TEST_F(HypothesisTest, SelectsWeakPointsByWhatTheFileWrites) {
  const Study study = read(
      "claim = \"x\"\nwhere = {scene = \"load\"}\nfaster = {threads = \"max\"}\nslower = {threads = 1}\n");
  EXPECT_EQ(study.hypotheses[0].faster,
            std::vector<std::string>{"load-x2/32x24/scanline/f32/closed/clip/openmp:static/2"});
  EXPECT_EQ(study.hypotheses[0].slower,
            std::vector<std::string>{"load-x1/32x24/scanline/f32/closed/clip/openmp:static/1"});
}

TEST_F(HypothesisTest, ErrorsNameLineAndKey) {
  const auto spoilt = [](const std::string& what, const std::string& by) {
    std::string text = kGood;
    return text.replace(text.find(what), what.size(), by);
  };
  EXPECT_EQ(error_of(kGood), "no error");
  EXPECT_EQ(error_of(spoilt("claim = \"x\"", "calim = \"x\"")),
            "2: calim: unknown key of [[hypothesis]] 'calim'; did you mean 'claim'?");
  EXPECT_EQ(error_of(spoilt("claim = \"x\"", "")),
            "1: claim: is missing: say in a sentence what is expected");
  EXPECT_EQ(error_of(spoilt("by = 0.05", "by = -1")), "6: by: must be a number from -0.99 to 1e+06");
  EXPECT_EQ(error_of(spoilt("slower = ", "slow = ")).substr(0, 8), "5: slow:");
  EXPECT_NE(error_of(spoilt("\"scanline\"", "\"scanlin\""))
                .find("4: kernel: kernel: unknown kernel 'scanlin'; did you mean"),
            std::string::npos)
      << error_of(spoilt("\"scanline\"", "\"scanlin\""));
  EXPECT_NE(error_of(spoilt("\"pot\"", "\"pott\"")).find("did you mean 'pot'"), std::string::npos);
  EXPECT_NE(error_of(spoilt("execution = ", "exec = ")).find("4: exec: unknown key of a selection"),
            std::string::npos);
  EXPECT_EQ(error_of(spoilt("openmp:dynamic,4", "openmp:dynamic")),
            "4: faster: selects no point: none of the 12 that are left has this execution");
  EXPECT_EQ(
      error_of(spoilt("kernel = \"scanline\", ", "")),
      "4: faster: selects 2 points, such as pot/64x48/tile_parallel/f32/closed/clip/openmp:dynamic,4/2 and "
      "pot/64x48/scanline/f32/closed/clip/openmp:dynamic,4/2, which differ in kernel, tile: say "
      "which, or add best = true to mean the fastest");
  EXPECT_NE(
      error_of(spoilt("execution = \"openmp:dynamic,4\"", "execution = \"openmp:dynamic,4\", threads = 1"))
          .find("faster: threads is in where, too"),
      std::string::npos);
  EXPECT_EQ(
      error_of("claim = \"x\"\nwhere = {scene = \"pot\", kernel = \"scanline\", execution = \"serial\"}\n"
               "faster = {}\nslower = {}\n"),
      "1: slower: selects pot/64x48/scanline/f32/closed/clip/serial/1, as faster does: nothing to compare");
}

TEST_F(HypothesisTest, IsNotTestedWhereThisMachineOrTheCommandLineLeavesNothing) {
  StudyOptions one;
  one.cpus = 1;
  const std::string scales =
      "claim = \"x\"\nwhere = {scene = \"pot\", kernel = \"scanline\", execution = \"openmp:static\"}\n"
      "faster = {threads = \"max\"}\nslower = {threads = 1}\n";
  EXPECT_EQ(read(scales).hypotheses[0].untested, "");
  EXPECT_EQ(read(scales, one).hypotheses[0].untested.substr(0, 31), "on this machine both sides are ");
  StudyOptions other;
  other.sizes = {"16x16"};
  const std::string sized =
      "claim = \"x\"\nwhere = {size = \"64x48\", scene = \"pot\", execution = \"serial\"}\n"
      "faster = {kernel = \"scanline\"}\nslower = {kernel = \"tile_parallel\"}\n";
  EXPECT_EQ(read(sized).hypotheses[0].untested, "");
  EXPECT_EQ(read(sized, other).hypotheses[0].untested, "--scene or --size replaces what it speaks of");
}

TEST_F(HypothesisTest, WhatIsComparedStaysInOneShard) {
  const auto families = [](const Study& study) { return study.families; };
  const std::string across =
      "claim = \"x\"\nwhere = {kernel = \"scanline\", execution = \"serial\"}\n"
      "faster = {scene = \"bits\"}\nslower = {scene = \"pot\"}\n";
  EXPECT_EQ(families(read(kGood)), 3u);  // pot, bits, and the two pictures of the weak series as one
  EXPECT_EQ(families(read(across)), 2u);
}

TEST_F(HypothesisTest, AFilterKeepsTheNames) {
  StudyOptions options;
  options.filter = std::regex("dynamic");
  const Study study = read(kGood, options);
  EXPECT_EQ(study.hypotheses[0].slower.size(), 1u);
  EXPECT_TRUE(std::none_of(study.points.begin(), study.points.end(), [&](const PlannedPoint& planned) {
    return planned.name == study.hypotheses[0].slower[0];
  }));
}

TEST_F(HypothesisTest, WeakPointsAreSampledWithTheirBase) {
  const Study study = read(kGood);
  ASSERT_EQ(study.weak.size(), 1u);
  EXPECT_EQ(study.weak[0].scene, "load");
  EXPECT_EQ(study.weak[0].steps.at(2).scene, "load-x2");
  const auto last = std::find_if(study.points.begin(), study.points.end(), [](const PlannedPoint& planned) {
    return planned.name == "load-x2/32x24/scanline/f32/closed/clip/openmp:static/2";
  });
  ASSERT_NE(last, study.points.end());
  EXPECT_EQ(last->partners,
            std::vector<std::string>{"load-x1/32x24/scanline/f32/closed/clip/openmp:static/1"});
  EXPECT_EQ(study.scenes.at("load-x2").model.triangles.size(), 100u);
}

}  // namespace
}  // namespace rasterbench
