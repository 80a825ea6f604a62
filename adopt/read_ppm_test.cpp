#include "adopt/read_ppm.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "scene/test_folder.h"

namespace rasterbench {
namespace {

PpmFile read_text(const std::string& bytes, int width = 2, int height = 1) {
  const TestFolder folder;
  return read_ppm(folder.file("x.ppm", bytes), width, height);
}

const std::string kHead = "P6\n2 1\n255\n";

TEST(ReadPpm, Pixels) {
  const PpmFile file = read_text(kHead + "abcdef");
  EXPECT_EQ(file.problem, "");
  EXPECT_EQ(file.note, "");
  EXPECT_EQ(file.pixels, (std::vector<std::uint32_t>{0xff636261u, 0xff666564u}));
}

TEST(ReadPpm, CommentsAndAnyWhiteSpace) {
  EXPECT_EQ(read_text("P6 # made by hand 9 9\n2\t1\r255 abcdef").problem, "");
  EXPECT_EQ(read_text("P6\n2 1\n255\n\nabcde").pixels.front() & 0xff,
            std::uint32_t{'\n'});  // a pixel, not a space
}

TEST(ReadPpm, BytesAfterTheLastPixelAreNoted) {
  EXPECT_EQ(read_text(kHead + "abcdefg").note, "1 bytes follow the last pixel");
}

TEST(ReadPpm, Refused) {
  const std::pair<std::string, std::string> cases[] = {
      {"", "is empty"},
      {"P3\n2 1\n255\n1 2 3 4 5 6\n", "ASCII"},
      {"\x89PNG", "P6"},
      {"P6\n2 1", "header"},
      {"P6\n2 1\n255", "header"},
      {"P6\nx 1\n255\nabcdef", "header"},
      {"P6\n-2 1\n255\nabcdef", "header"},
      {"P6\n99999999999999999999 1\n255\nabcdef", "header"},
      {"P6\n999999999 999999999\n255\nabcdef", "999999999 x 999999999"},
      {"P6\n1 2\n255\nabcdef", "swapped"},
      {"P6\n2 1\n65535\nabcdef", "65535"},
      {kHead + "abcde", "ends after 16 of 17 bytes"}};
  for (const auto& [bytes, word] : cases) {
    const PpmFile file = read_text(bytes);
    EXPECT_TRUE(file.pixels.empty()) << bytes;
    EXPECT_NE(file.problem.find(word), std::string::npos) << file.problem;
  }
}

TEST(ReadPpm, NoPlainFile) {
  const TestFolder folder;
  EXPECT_NE(read_ppm(folder / "none.ppm", 2, 1).problem, "");
  EXPECT_EQ(read_ppm("/dev/zero", 2, 1).problem, "is no plain file");
  ASSERT_EQ(mkfifo((folder / "pipe.ppm").c_str(), 0600), 0);
  EXPECT_EQ(read_ppm(folder / "pipe.ppm", 2, 1).problem, "is no plain file");
}

}  // namespace
}  // namespace rasterbench
