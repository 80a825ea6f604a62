#include "pipeline/techniques.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "base/error.h"

namespace rasterbench {
namespace {

/// Every set of techniques, by the bits of a number.
std::vector<Techniques> every_set() {
  const auto infos = technique_infos();
  std::vector<Techniques> all;
  for (unsigned bits = 0; bits < 1u << infos.size(); ++bits) {
    Techniques techniques;
    for (std::size_t i = 0; i < infos.size(); ++i) techniques.*infos[i].switched = (bits >> i & 1u) != 0;
    all.push_back(techniques);
  }
  return all;
}

std::string error_of(const std::string& text) {
  try {
    parse_techniques(text, "--techniques");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Techniques, TheTableHasEverySwitchOnce) {
  // A switch that the table lacked would be no part of any text.
  EXPECT_EQ(technique_infos().size(), sizeof(Techniques) / sizeof(bool));
  std::set<std::string_view> names;
  for (const TechniqueInfo& info : technique_infos()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_FALSE(info.meaning.empty());
    EXPECT_EQ(info.name.find_first_of("+-/ "), std::string_view::npos) << info.name;  // separators of texts
    Techniques only = kNoTechniques;
    only.*info.switched = true;
    EXPECT_EQ(to_string(only), info.name);
  }
}

TEST(Techniques, ATextForEachSetGivesItBack) {
  std::set<std::string> texts;
  for (const Techniques& techniques : every_set()) {
    const std::string text = to_string(techniques);
    EXPECT_TRUE(texts.insert(text).second) << text;
    EXPECT_EQ(parse_techniques(text, "x"), techniques) << text;
  }
}

TEST(Techniques, TextsAreCanonical) {
  EXPECT_EQ(to_string(Techniques{}), "all");
  EXPECT_EQ(to_string(kNoTechniques), "none");
  EXPECT_EQ(to_string(kFrameTechniques), "streaming+huge_pages");
  EXPECT_EQ(to_string(parse_techniques("huge_pages+streaming", "x")), "streaming+huge_pages");
  EXPECT_EQ(to_string(parse_techniques("all-fragments", "x")), "all-fragments");
  EXPECT_EQ(to_string(parse_techniques("huge_pages+streaming+front_to_back", "x")),
            "front_to_back+streaming+huge_pages");
  EXPECT_EQ(to_string(parse_techniques("huge_pages+streaming+front_to_back+blocks", "x")), "all-fragments");
  EXPECT_EQ(to_string(parse_techniques("all-fragments-front_to_back", "x")), "blocks+streaming+huge_pages");
}

TEST(Techniques, ErrorsNameTheFieldAndTheNearestName) {
  EXPECT_EQ(error_of("streeming"), "--techniques: unknown technique 'streeming'; did you mean 'streaming'?");
  EXPECT_EQ(error_of("streaming+hugepages"),
            "--techniques: unknown technique 'hugepages'; did you mean 'huge_pages'?");
  EXPECT_EQ(error_of("all-fragment"),
            "--techniques: unknown technique 'fragment'; did you mean 'fragments'?");
  EXPECT_EQ(error_of("nonne"), "--techniques: unknown technique 'nonne'; did you mean 'none'?");
  EXPECT_EQ(error_of("all+streaming"), "--techniques: 'all' stands alone, not among names joined by '+'");
  for (const char* bad :
       {"", "all-", "+", "streaming+", "streaming,huge_pages", "none-streaming", "all-all", "ALL"})
    EXPECT_EQ(error_of(bad).find("--techniques: unknown technique '"), 0u) << bad;
}

TEST(Techniques, InCommonAreThoseOfBoth) {
  for (const Techniques& a : every_set()) {
    EXPECT_EQ(common_techniques(a, {}), a);
    EXPECT_EQ(common_techniques(a, kNoTechniques), kNoTechniques);
    for (const Techniques& b : every_set()) EXPECT_EQ(common_techniques(a, b), common_techniques(b, a));
  }
  EXPECT_EQ(to_string(common_techniques(parse_techniques("all-huge_pages", "x"), kFrameTechniques)),
            "streaming");
}

}  // namespace
}  // namespace rasterbench
