// Every stress case, in modes of each kind: nothing happens that must not.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "base/error.h"
#include "extremes/run.h"

namespace rasterbench::extremes {
namespace {

const std::vector<Case>& catalogue() {
  static const std::vector<Case> all = read_catalogue(built_in_catalogue(), "extremes/catalogue.toml");
  return all;
}

TEST(Catalogue, HoldsEveryNumberedCase) {
  std::set<int> numbers;
  std::set<std::string> names;
  for (const Case& one : catalogue()) {
    numbers.insert(one.number);
    EXPECT_TRUE(names.insert(one.name).second) << one.name << " is there twice";
  }
  for (int number = 1; number <= 45; ++number) EXPECT_TRUE(numbers.contains(number)) << number;
}

/// The text of one case whose requirement is `must`.
std::string triangle_case(const std::string& must) {
  return R"([[case]]
number = 12
name = "one"
what = "one triangle"
screen = [[8,8,4, 40,8,4, 8,40,4]]
must = )" +
         must + "\n";
}

TEST(Catalogue, RefusesWhatItDoesNotKnow) {
  for (const char* must : {"{ pixel = 3 }", "{ }", "{ pixels = -1 }", "{ match = [\"orakel\"] }",
                           "{ wrong_at_most = { f23 = 1 } }", "{ same_as = { change = \"turned\" } }"}) {
    try {
      read_catalogue(triangle_case(must), "file.toml");
      ADD_FAILURE() << must;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("file.toml:"), std::string::npos) << error.what();
    }
  }
}

constexpr std::array<std::string_view, 5> kModes{"f32", "f64", "fixed_8", "filtered", "exact"};

TEST(Extremes, ARequirementThatDoesNotHoldIsWrong) {
  const auto verdicts = [](const std::string& must) {
    const auto cases = read_catalogue(triangle_case(must), "file.toml");
    return run_case(cases.at(0), kModes, "tile_parallel", Part::kAll, 2).findings;
  };
  for (const char* must : {"{ pixels = 3 }", "{ owners = [[10, 10, -1]] }", "{ counts = { zero_area = 1 } }",
                           "{ nothing_tested = true }"})
    for (const Finding& finding : verdicts(must)) {
      EXPECT_EQ(finding.verdict, Verdict::kWrong) << must;
      EXPECT_FALSE(finding.explanation.empty()) << must;
    }
  for (const Finding& finding : verdicts("{ match = [\"oracle\"], owners = [[10, 10, 0]] }"))
    EXPECT_EQ(finding.verdict, Verdict::kEqual) << finding.explanation;
}

class EveryCase : public testing::TestWithParam<std::size_t> {};

TEST_P(EveryCase, HappensAsItMust) {
  const Case& one = catalogue().at(GetParam());
  const CaseResult result = run_case(one, kModes, "tile_parallel", Part::kAll, 2);
  ASSERT_FALSE(result.findings.empty());
  for (std::size_t i = 0; i < result.findings.size(); ++i) {
    const Finding& finding = result.findings[i];
    const std::string_view mode = result.in_any_mode ? "any mode" : kModes[i];
    EXPECT_NE(finding.verdict, Verdict::kWrong) << mode << ": " << finding.explanation;
    if (mode == "exact" && one.must.match_oracle && !one.must.match_truth && !one.must.match_rays) {
      EXPECT_EQ(finding.verdict, Verdict::kEqual) << finding.explanation;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryCase, testing::Range(std::size_t{0}, catalogue().size()),
                         [](const auto& test) {
                           std::string name = catalogue().at(test.param).name;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace rasterbench::extremes
