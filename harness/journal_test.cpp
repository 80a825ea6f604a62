#include "harness/journal.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "base/error.h"

namespace rasterbench {
namespace {

class JournalTest : public testing::Test {
 protected:
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("journal_test." + std::to_string(getpid()));
  ~JournalTest() override { std::filesystem::remove(path_); }
};

TEST_F(JournalTest, KeepsWhatIsAppendedAcrossOpenings) {
  Journal(path_).append({{"event", "start"}});
  Journal(path_).append({{"event", "sample"}, {"ms", 1.25}});
  const auto events = read_journal(path_);
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[1].at("ms"), 1.25);
}

TEST_F(JournalTest, DropsAnInterruptedLastLine) {
  Journal(path_).append({{"event", "start"}});
  std::ofstream(path_, std::ios::app) << R"({"event": "sam)";
  EXPECT_EQ(read_journal(path_).size(), 1u);
  Journal(path_).append({{"event", "sample"}});  // must not continue the torn line
  EXPECT_EQ(read_journal(path_).at(1).at("event"), "sample");
}

TEST_F(JournalTest, NamesTheLineThatIsNotJson) {
  std::ofstream(path_) << "{\"event\": \"start\"}\nnonsense\n";
  try {
    read_journal(path_);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.what(), path_.string() + ":2: is not a JSON object");
  }
}

}  // namespace
}  // namespace rasterbench
