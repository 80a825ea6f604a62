// Every kind of value, and the line of every refusal.
#include "base/table_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace rasterbench {
namespace {

constexpr std::string_view kTable = R"(whole = 7
real = 0.5
bits = "0x1p-149"
nan = nan
huge = 9223372036854775807
yes = true
word = "one"
words = ["one", "two"]
empty = []
mixed = ["one", 2]
rows = [[1, "0x1.8p1"], [3, 4]]
inner = {a = 1, b = 2}
)";

class Reading : public testing::Test {
 protected:
  /// What read(reader) throws, "" where it throws nothing.
  template <class Read>
  std::string error(Read read) {
    TableReader reader(table_, "t.toml");
    try {
      read(reader);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  toml::table table_ = parse_toml(kTable, "t.toml");
  TableReader reader_{table_, "t.toml"};
};

TEST_F(Reading, AMissingKeyLeavesTheValue) {
  int whole = -3;
  double real = -3;
  bool yes = true;
  std::string word = "kept";
  std::vector<std::string> words{"kept"};
  reader_.integer("none", 0, 1, whole);
  reader_.number("none", 0, 1, real);
  reader_.exact_number("none", real);
  reader_.boolean("none", yes);
  reader_.text("none", word);
  reader_.string_list("none", words);
  reader_.each("none", [](const toml::node&) { FAIL(); });
  reader_.each_element("none", [](const toml::node&) { FAIL(); });
  reader_.table("none", "nothing", [](TableReader&) { FAIL(); });
  EXPECT_EQ(reader_.find("none"), nullptr);
  EXPECT_EQ(whole, -3);
  EXPECT_EQ(real, -3);
  EXPECT_TRUE(yes);
  EXPECT_EQ(word, "kept");
  EXPECT_EQ(words, std::vector<std::string>{"kept"});
}

TEST_F(Reading, ValuesHaveTheirTypes) {
  std::int32_t whole = 0;
  std::int64_t huge = 0;
  double real = 0, bits = 0, nan = 0;
  bool yes = false;
  std::string word;
  reader_.integer("whole", 7, 7, whole);
  reader_.integer("huge", 0, std::numeric_limits<std::int64_t>::max(), huge);
  reader_.number("real", 0.5, 0.5, real);
  reader_.exact_number("bits", bits);
  reader_.exact_number("nan", nan);
  reader_.boolean("yes", yes);
  reader_.text("word", word);
  EXPECT_EQ(whole, 7);
  EXPECT_EQ(huge, std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(real, 0.5);
  EXPECT_EQ(bits, double{std::numeric_limits<float>::denorm_min()});
  EXPECT_TRUE(std::isnan(nan));
  EXPECT_TRUE(yes);
  EXPECT_EQ(word, "one");
}

TEST_F(Reading, AnotherTypeOrRangeIsRefusedAtItsLine) {
  std::int64_t whole = 0;
  double real = 0;
  bool yes = false;
  std::string word;
  const auto integer = [&](const char* key, std::int64_t low, std::int64_t high) {
    return error([&](TableReader& r) { r.integer(key, low, high, whole); });
  };
  const auto number = [&](const char* key, double low, double high) {
    return error([&](TableReader& r) { r.number(key, low, high, real); });
  };
  EXPECT_EQ(integer("whole", 8, 9), "t.toml:1: whole: must be a whole number from 8 to 9");
  EXPECT_EQ(integer("whole", 5, 6), "t.toml:1: whole: must be a whole number from 5 to 6");
  EXPECT_EQ(integer("real", 0, 9), "t.toml:2: real: must be a whole number from 0 to 9");
  EXPECT_EQ(number("real", 0.6, 1), "t.toml:2: real: must be a number from 0.6 to 1");
  EXPECT_EQ(number("real", 0, 0.4), "t.toml:2: real: must be a number from 0 to 0.4");
  EXPECT_EQ(number("bits", 0, 1), "t.toml:3: bits: must be a number from 0 to 1");
  EXPECT_EQ(number("nan", 0, 1), "t.toml:4: nan: must be a number from 0 to 1");
  EXPECT_EQ(number("huge", 0, 1e19), "t.toml:5: huge: must be a number from 0 to 1e+19") << "no double";
  EXPECT_EQ(error([&](TableReader& r) { r.exact_number("word", real); }),
            "t.toml:7: word: must be a number, or a string such as \"0x1.8p-3\"");
  EXPECT_EQ(error([&](TableReader& r) { r.boolean("whole", yes); }),
            "t.toml:1: whole: must be true or false");
  EXPECT_EQ(error([&](TableReader& r) { r.text("yes", word); }), "t.toml:6: yes: must be a string");
  EXPECT_EQ(whole, 0);
  EXPECT_EQ(real, 0);
}

TEST_F(Reading, ListsMayBeASingleValueOrMayNot) {
  std::vector<std::string> one, two, list;
  const auto itself = [](const std::string& word) { return word; };
  reader_.strings("word", one, itself);
  reader_.strings("words", two, itself);
  reader_.string_list("words", list);
  EXPECT_EQ(one, std::vector<std::string>{"one"});
  EXPECT_EQ(two, (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(list, two);
  EXPECT_EQ(error([&](TableReader& r) { r.strings("empty", one, itself); }),
            "t.toml:9: empty: is an empty list");
  EXPECT_EQ(error([&](TableReader& r) { r.strings("mixed", one, itself); }),
            "t.toml:10: mixed: must be a string or a list of strings");
  EXPECT_EQ(error([&](TableReader& r) { r.string_list("mixed", list); }),
            "t.toml:10: mixed: must be a list of strings");
  for (const char* key : {"word", "empty"})
    EXPECT_NE(error([&](TableReader& r) { r.string_list(key, list); }).find("must be a list with elements"),
              std::string::npos);
}

TEST_F(Reading, WordsAreKnownOrHaveAFallback) {
  std::vector<std::string> words, none;
  reader_.words("words", {"one", "two"}, "two", words);
  reader_.words("none", {"one", "two"}, "two", none);
  EXPECT_EQ(words, (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(none, std::vector<std::string>{"two"});
  EXPECT_EQ(error([&](TableReader& r) {
              r.words("words", {"one", "twos"}, "one", words);
            }),
            "t.toml:8: words: unknown value 'two'; did you mean 'twos'?");
}

TEST_F(Reading, WhatAParserThrowsIsPlaced) {
  std::vector<int> values;
  EXPECT_EQ(error([&](TableReader& r) {
              r.strings("word", values, [](const std::string&) -> int { throw InputError("not so"); });
            }),
            "t.toml:7: word: not so");
  EXPECT_TRUE(values.empty());
}

TEST_F(Reading, RowsHaveTheirLength) {
  std::vector<std::vector<double>> rows;
  reader_.each_element(
      "rows", [&](const toml::node& node) { rows.push_back(reader_.exact_numbers(node, "rows", 2)); });
  EXPECT_EQ(rows, (std::vector<std::vector<double>>{{1, 3}, {3, 4}}));
  const auto refused = [&](const char* key) {
    return error([&](TableReader& r) { r.exact_numbers(*r.find(key), key, 3); });
  };
  EXPECT_EQ(refused("words"), "t.toml:8: words: must be a list of 3 numbers");
  EXPECT_EQ(refused("whole"), "t.toml:1: whole: must be a list of 3 numbers");
}

TEST_F(Reading, KeysThatNobodyAskedForAreRefused) {
  const std::string message = error([](TableReader& r) {
    r.table("inner", "the inner table", [](TableReader& inner) { inner.find("a"); });
  });
  EXPECT_EQ(message, "t.toml:12: b: unknown key of the inner table 'b'; did you mean 'a'?");
  EXPECT_EQ(error([](TableReader& r) { r.table("whole", "it", [](TableReader&) {}); }),
            "t.toml:1: whole: must be a table");
  std::string keys;
  reader_.table("inner", "the inner table", [&](TableReader& inner) {
    inner.each_key([&](const std::string& key, const toml::node& node) {
      keys += key + std::to_string(inner.integer_of(node, key, 1, 2));
    });
  });
  EXPECT_EQ(keys, "a1b2");
  EXPECT_EQ(error([](TableReader& r) {
              r.each_key([](const std::string&, const toml::node&) {});
              r.reject_unknown_keys("a file");
            }),
            "");
}

TEST_F(Reading, ATableFailsWhereItBegins) {
  EXPECT_EQ(error([](TableReader& r) {
              r.table("inner", "it", [](TableReader& inner) { inner.fail("c", "is missing"); });
            }),
            "t.toml:12: c: is missing");
}

TEST(ParseToml, SaysWhereTextIsNotToml) {
  EXPECT_EQ(parse_toml("a = 1", "t.toml").size(), 1u);
  try {
    parse_toml("a = 1\nb =", "t.toml");
    FAIL() << "nothing was thrown";
  } catch (const InputError& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with("t.toml:2: ")) << error.what();
  }
}

}  // namespace
}  // namespace rasterbench
