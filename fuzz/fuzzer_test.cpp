// The fuzzer finds bugs that are planted, shrinks them to what matters, and finds nothing where there is
// nothing.
#include "fuzz/fuzzer.h"

#include <gtest/gtest.h>

#include <cstring>

#include "fuzz/broken_modes.h"
#include "fuzz/generate.h"

namespace rasterbench::fuzz {
namespace {

FuzzOptions options_for(std::vector<Subject> modes, const std::vector<std::string>& relation_names) {
  FuzzOptions options{.seed = 1, .seconds = 60, .cases = 300, .modes = std::move(modes)};
  for (const std::string& name : relation_names) options.relations.push_back(&find_relation(name));
  options.kernels = listed_kernels();
  return options;
}

/// The only finding of a run that has to have one.
template <class Mode>
Finding find_in(const std::string& relation) {
  const FuzzReport report = run_fuzz(options_for({make_subject<Mode>()}, {relation}));
  EXPECT_EQ(report.findings.size(), 1u) << relation << " does not see it";
  return report.findings.empty() ? Finding{} : report.findings.front();
}

/// Bits of all coordinates that are not zero.
int bits_to_read(const FuzzCase& fuzz_case) {
  int sum = 0;
  for (const Triangle& t : fuzz_case.triangles)
    for (const Vec3* p : {&t.a, &t.b, &t.c})
      for (const float v : {p->x, p->y, p->z}) sum += v != 0;
  return sum;
}

TEST(PlantedBug, UnorderedFmaIsOneTriangle) {
  const Finding finding = find_in<UnorderedFma>("turn");
  EXPECT_EQ(finding.minimal.triangles.size(), 1u);
  // The pieces of a triangle do not fit either.
  for (const char* relation : {"split", "midpoints"}) {
    const FuzzReport report = run_fuzz(options_for({make_subject<UnorderedFma>()}, {relation}));
    EXPECT_GT(report.tallies.at(relation).observed.at("unordered_fma"), 0) << relation;
  }
}

TEST(PlantedBug, NarrowBoxIsOneTriangleOfOnePixel) {
  for (const char* relation : {"oracle", "mirror", "midpoints", "split"}) {
    const Finding finding = find_in<NarrowBox>(relation);
    EXPECT_EQ(finding.minimal.triangles.size(), 1u) << relation;
    EXPECT_LE(finding.minimal.parameters.width * finding.minimal.parameters.height, 4) << relation;
    EXPECT_LE(bits_to_read(finding.minimal), 6) << relation;
  }
}

TEST(PlantedBug, TieByOrderIsTwoTrianglesOrOneAndItsCopy) {
  for (const auto& [relation, triangles] : {std::pair{"order", 2u}, {"duplicate", 1u}}) {
    const Finding finding = find_in<TieByOrder>(relation);
    EXPECT_EQ(finding.minimal.triangles.size(), triangles) << relation;
    EXPECT_EQ(finding.minimal.parameters.width * finding.minimal.parameters.height, 1) << relation;
  }
}

TEST(PlantedBug, BottomRightIsOneTriangleWithASampleOnAnEdge) {
  const Finding finding = find_in<BottomRight>("oracle");
  EXPECT_EQ(finding.minimal.triangles.size(), 1u);
  EXPECT_EQ(finding.minimal.fill, FillRule::kTopLeft);
}

TEST(PlantedBug, SwappedDepthsAreFoundByTheOracle) {
  const Finding finding = find_in<SwappedDepths>("oracle");
  EXPECT_LE(finding.minimal.triangles.size(), 2u);
}

TEST(PlantedBug, BoundsThatAreNotKeptAreFoundByTheOracle) {
  EXPECT_EQ(find_in<PlaneThatClaimsCross>("oracle").minimal.triangles.size(), 1u);
  EXPECT_EQ(find_in<GridThatClaimsAFinerOne>("oracle").minimal.triangles.size(), 1u);
  EXPECT_EQ(find_in<TrustingFilter>("oracle").minimal.triangles.size(), 1u);
}

TEST(PlantedBug, CanaryKernelsAreFound) {
  for (const char* kernel : {"null", "stale"}) {
    FuzzOptions options = options_for({find_subject("f32")}, {"kernels"});
    options.kernels = {kernel};
    options.cases = 10;
    const FuzzReport report = run_fuzz(options);
    ASSERT_EQ(report.findings.size(), 1u) << kernel;
    EXPECT_EQ(report.findings[0].minimal.triangles.size(), 1u) << kernel;
    EXPECT_NE(report.findings[0].what.find(kernel), std::string::npos);
  }
}

TEST(Fuzzer, UnboundedModesAreObservedOnly) {
  FuzzOptions options = options_for({find_subject("two_product")}, {"turn", "mirror", "split"});
  const FuzzReport report = run_fuzz(options);
  EXPECT_TRUE(report.findings.empty());
  EXPECT_GT(report.tallies.at("turn").observed.at("two_product"), 0);
}

TEST(Fuzzer, ALimitEndsTheSequenceAndChangesNothingInIt) {
  FuzzOptions options =
      options_for({make_subject<TieByOrder>(), make_subject<NarrowBox>()}, {"order", "oracle"});
  options.cases = 60;
  const FuzzReport shorter = run_fuzz(options);
  options.cases = 120;
  const FuzzReport longer = run_fuzz(options);
  ASSERT_FALSE(shorter.findings.empty());
  ASSERT_GE(longer.findings.size(), shorter.findings.size());
  for (std::size_t i = 0; i < shorter.findings.size(); ++i)
    EXPECT_EQ(as_test(shorter.findings[i], options), as_test(longer.findings[i], options));
  options.seed = 2;
  const FuzzReport other = run_fuzz(options);
  EXPECT_NE(as_test(other.findings.at(0), options), as_test(longer.findings.at(0), options));
}

TEST(Fuzzer, EndsWhenItIsToldTo) {
  FuzzOptions options = options_for({find_subject("f32")}, {"turn"});
  int questions = 0;
  const FuzzReport report = run_fuzz(options, {.stop = [&] { return ++questions > 20; }});
  EXPECT_TRUE(report.stopped);
  EXPECT_LT(report.cases, 20);
  options.cases = 5;
  EXPECT_EQ(run_fuzz(options).cases, 5);
  options.seconds = 0;
  EXPECT_EQ(run_fuzz(options).cases, 0);
}

TEST(Fuzzer, FindsNothingInTheModesKernelsAndReferencesAsTheyAre) {
  FuzzOptions options{.seed = 20, .seconds = 3};
  options.modes.assign(subjects().begin(), subjects().end());
  for (const Relation& relation : relations()) options.relations.push_back(&relation);
  options.kernels = listed_kernels();
  const FuzzReport report = run_fuzz(options);
  EXPECT_GT(report.cases, 0);
  for (const Finding& finding : report.findings) ADD_FAILURE() << as_test(finding, options);
}

}  // namespace
}  // namespace rasterbench::fuzz
