// The cases in a few modes, and that judges find what is wrong.
#include "extremes/judge_case.h"

#include <gtest/gtest.h>

#include "extremes/run.h"
#include "scene/test_folder.h"

namespace rasterbench::extremes {
namespace {

constexpr std::string_view kKernel = "tile_parallel";
constexpr int kThreads = 2;

/// Fewer triangles where a case has thousands, so that this also takes seconds under a sanitizer.
Case smaller(Case one) {
  if (one.input.construct)
    for (const auto& [key, most] : {std::pair{"triangles", 300.0}, {"count", 60.0}, {"rings", 12.0}})
      if (const auto found = one.input.construct->values.find(key);
          found != one.input.construct->values.end())
        found->second = std::min(found->second, most);
  if (one.must.every_execution) one.input.construct->values["count"] = 8;
  one.parameters.width = one.number == 5 ? 4096 : one.parameters.width;
  return one;
}

std::vector<Case> cases() {
  std::vector<Case> chosen;
  for (const Case& one : read_catalogue(built_in_catalogue(), "catalogue.toml"))
    if (one.number <= 45) chosen.push_back(smaller(one));  // the others are meshes: watertight_test.cpp
  return chosen;
}

class EveryCase : public testing::TestWithParam<Case> {};

TEST_P(EveryCase, HoldsInTheModesThatMatterMost) {
  const std::vector<std::string_view> modes{"f32", "f64", "fixed_8", "filtered", "exact"};
  const CaseResult result = run_case(GetParam(), modes, kKernel, Part::kAll, kThreads);
  const Must& must = GetParam().must;
  ASSERT_EQ(result.findings.size(), result.in_any_mode ? 1 : modes.size());
  for (std::size_t i = 0; i < result.findings.size(); ++i) {
    const Finding& finding = result.findings[i];
    EXPECT_NE(finding.verdict, Verdict::kWrong) << modes[i] << ": " << finding.explanation;
    EXPECT_NE(finding.verdict, Verdict::kNotCarried) << modes[i];
    EXPECT_EQ(finding.verdict == Verdict::kRefused, result.in_any_mode || finding.pixels == 0) << modes[i];
    if (modes[i] == "exact" && must.match_oracle && !must.match_truth && !must.match_rays &&
        must.refusal_or_room.empty()) {
      EXPECT_EQ(finding.verdict, Verdict::kEqual) << finding.explanation;
    }
    // A case that draws nothing by mistake would hold, too.
    const bool is_empty = must.pixels == 0 || result.in_any_mode || finding.verdict == Verdict::kRefused ||
                          GetParam().name == "nearly_collinear" || GetParam().name == "slivers" ||
                          (GetParam().number == 32 && finding.verdict == Verdict::kReported);
    if (!is_empty) {
      EXPECT_GT(finding.drawn, 0) << modes[i];
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EveryCase, testing::ValuesIn(cases()), [](const auto& test) {
  std::string name = std::to_string(test.param.number) + "_" + test.param.name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

Case read_one(const std::string& body) {
  return read_catalogue("[[case]]\nnumber = 1\nname = \"one\"\n" + body, "c.toml").at(0);
}

Finding judged(const std::string& body, std::string_view mode, std::string_view kernel = kKernel) {
  const std::vector<std::string_view> modes{mode};
  return run_case(read_one(body), modes, kernel, Part::kAll, kThreads).findings.at(0);
}

constexpr const char* kTriangle = "screen = [[2,2,2, 30,2,2, 2,30,3]]\nsize = [32, 32]\n";

TEST(JudgeCase, FindsWhatIsNotAsTheCaseSays) {
  const auto verdict = [](const std::string& body) {
    const Finding finding = judged(body, "f32");
    EXPECT_EQ(finding.verdict == Verdict::kWrong, !finding.explanation.empty()) << body;
    return finding.verdict;
  };
  const std::string t = kTriangle;
  EXPECT_EQ(verdict(t + "must = { match = [\"oracle\", \"truth\"], equal = true }"), Verdict::kEqual);
  EXPECT_EQ(verdict(t + "must = { pixels = 3 }"), Verdict::kWrong);
  EXPECT_EQ(verdict(t + "must = { pixels = 0 }"), Verdict::kWrong);
  EXPECT_EQ(verdict(t + "must = { owners = [[4, 4, 0], [31, 31, -1]] }"), Verdict::kEqual);
  EXPECT_EQ(verdict(t + "must = { owners = [[4, 4, 1]] }"), Verdict::kWrong);
  EXPECT_EQ(verdict(t + "must = { owners = [[31, 31, 0]] }"), Verdict::kWrong);
  EXPECT_EQ(verdict(t + "must = { counts = { non_finite = 1 } }"), Verdict::kWrong);
  EXPECT_EQ(verdict(t + "must = { nothing_tested = true }"), Verdict::kWrong);
  EXPECT_EQ(verdict(t + "must = { refusal_or_room = [\"GiB\"] }"), Verdict::kEqual) << "memory suffices";
  EXPECT_EQ(
      verdict("world = [[-1,-1,0, 1,-1,0, 0,1,0]]\nsize = [65535, 65535]\nmust = { match = [\"oracle\"] }"),
      available_memory() < (std::size_t{64} << 30) ? Verdict::kWrong : Verdict::kEqual);
}

TEST(JudgeCase, AnUnboundedModeIsReportedAndNotWrong) {
  const std::string level = "screen = [[3.5,3.5,2, 6.5,3.5,2, 5,7,2]]\nsize = [16, 16]\n";
  const std::string must = "must = { match = [\"oracle\"], equal = true }";
  EXPECT_EQ(judged(level + must, "f32").verdict, Verdict::kEqual);
  const Finding reported = judged(level + must, "two_product");
  EXPECT_EQ(reported.verdict, Verdict::kReported);
  EXPECT_NE(reported.explanation.find("drawn pixels wrong"), std::string::npos) << reported.explanation;
}

TEST(JudgeCase, AModeWithinItsBoundIsSaidToBe) {
  // The corner moves by 1/1000 px when it is snapped to 1/16, and an edge over the samples of a row with it.
  const std::string body = "screen = [[2,4.501,2, 60,4.501,2, 30,20,2]]\nmust = { match = [\"oracle\"] }";
  EXPECT_EQ(judged(body, "f64").verdict, Verdict::kEqual);
  EXPECT_EQ(judged(body, "fixed_4").verdict, Verdict::kWithinBound);
  const Finding finding =
      judged(body.substr(0, body.find("must")) + "must = { match = [\"oracle\"], equal = true }", "fixed_4");
  EXPECT_EQ(finding.verdict, Verdict::kWrong);
  EXPECT_GT(finding.wrong, 40);
}

TEST(JudgeCase, KernelsThatDrawSomethingElseAreFound) {
  const std::string must = "must = { match = [\"oracle\"] }";
  for (const char* canary : {"null", "stale"}) {
    const Finding finding = judged(kTriangle + must, "f32", canary);
    EXPECT_EQ(finding.verdict, Verdict::kWrong) << canary;
    EXPECT_NE(finding.explanation.find("specification of f32"), std::string::npos) << finding.explanation;
  }
  EXPECT_EQ(judged(kTriangle + std::string("must = { every_execution = true }"), "f32", "null").verdict,
            Verdict::kWrong);
}

TEST(JudgeCase, AModeThatAKernelCannotCarryHasNoVerdict) {
  EXPECT_EQ(
      judged(kTriangle + std::string("must = { match = [\"oracle\"] }"), "f64", "triangle_atomics").verdict,
      Verdict::kNotCarried);
}

TEST(JudgeCase, PicturesOfChangedScenesAreCompared) {
  // Two triangles that tie everywhere.
  const std::string tie =
      "screen = [[2,2,2, 30,2,3, 2,30,4], [2,2,2, 30,2,3, 2,30,4]]\nsize = [32, 32]\nfill = [\"closed\"]\n";
  const auto same_as = [](const std::string& input, const std::string& change, std::string_view mode) {
    return judged(input + "must = { same_as = { change = " + change + " } }", mode).verdict;
  };
  for (const char* change : {"\"reversed\"", "\"duplicated\"", "\"positive_zeros\"", "\"mirrored\"",
                             "\"shifted\", x = 2, y = -1", "\"scaled\", factor = \"0x1p-100\""})
    for (const char* mode : {"f32", "f64", "exact", "filtered-unorm16"})
      EXPECT_EQ(same_as(tie, change, mode), Verdict::kEqual) << change << " " << mode;
  // Not a power of two: the corners are other ones.
  EXPECT_EQ(same_as(tie, "\"scaled\", factor = 1.1", "f32"), Verdict::kWrong);
  const std::string teapot = "generator = \"teapot:triangles=300\"\ncamera = [0.7, 0.78, 1.51]\n";
  EXPECT_EQ(same_as(teapot, "\"reversed\"", "f32"), Verdict::kEqual);
  EXPECT_EQ(same_as(teapot, "\"reversed\"", "two_product"), Verdict::kReported);
}

TEST(JudgeCase, EnclosedBackgroundIsNotJoinedToTheBorder) {
  const auto enclosed = [](std::vector<std::int32_t> ids, int width) {
    Picture picture{.width = width, .height = static_cast<int>(ids.size()) / width};
    picture.ids = std::move(ids);
    return enclosed_background(picture);
  };
  EXPECT_EQ(enclosed({-1, -1, -1, -1, 0, -1, -1, -1, -1}, 3), 0);
  EXPECT_EQ(enclosed({0, 0, 0, 0, -1, 0, 0, 0, 0}, 3), 1);
  EXPECT_EQ(enclosed({0, 0, 0, 0, -1, -1, 0, 0, 0}, 3), 0);
  EXPECT_EQ(enclosed({0, 0, 0, 0, 0, -1, -1, 0, 0, 0, -1, 0, 0, 0, 0, -1}, 4), 3);  // diagonals do not join
}

TEST(JudgeReading, ComparesTheOneLine) {
  const auto verdict = [](const std::string& body) { return judge_reading(read_one(body)).verdict; };
  const std::string short_file = "model_file = { claimed = 2, triangles = 1 }\n";
  const std::string long_file = "model_file = { claimed = 1, triangles = 2 }\n";
  EXPECT_EQ(verdict(short_file + "must = { error = [\"case.dat\", \"T says 2\"] }"), Verdict::kRefused);
  EXPECT_EQ(verdict(short_file + "must = { error = [\"T says 3\"] }"), Verdict::kWrong);
  EXPECT_EQ(verdict(short_file + "must = { warning = [\"T says 2\"] }"), Verdict::kWrong);
  EXPECT_EQ(verdict(long_file + "must = { warning = [\"holds 2\"] }"), Verdict::kRefused);
  EXPECT_EQ(verdict(long_file + "must = { warning = [\"holds 3\"] }"), Verdict::kWrong);
  EXPECT_EQ(verdict(long_file + "must = { error = [\"holds 2\"] }"), Verdict::kWrong);
}

}  // namespace
}  // namespace rasterbench::extremes
