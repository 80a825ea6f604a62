#include "scene/dat.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstring>

#include "scene/test_folder.h"

namespace rasterbench {
namespace {

std::string int_bytes(std::int32_t value) {
  std::string bytes(4, '\0');
  std::memcpy(bytes.data(), &value, 4);
  return bytes;
}

/// A file that says `claimed` triangles and then holds `bytes` bytes.
std::string dat(std::int32_t claimed, std::size_t bytes) {
  return int_bytes(claimed) + std::string(bytes, '\1');
}

Model three_triangles() {
  Model model;
  for (int i = 0; i < 3; ++i) {
    const float f = static_cast<float>(i);
    model.triangles.push_back({{f, 0.1f, -2.5f}, {1e30f, f, -0.0f}, {1e-40f, 3, f}});
  }
  return model;
}

TEST(Dat, ARoundTripKeepsEveryBit) {
  const TestFolder folder;
  const Model model = three_triangles();
  write_dat(model, folder / "x.dat");
  const Model back = read_dat(folder / "x.dat");
  ASSERT_EQ(back.triangles.size(), 3u);
  EXPECT_EQ(std::memcmp(back.triangles.data(), model.triangles.data(), 3 * sizeof(Triangle)), 0);
  EXPECT_EQ(back.name, (folder / "x.dat").string());
}

TEST(Dat, TheLayoutIsThatOfTheContract) {
  const TestFolder folder;
  write_dat(three_triangles(), folder / "x.dat");
  const std::string bytes = read_bytes(folder / "x.dat");
  ASSERT_EQ(bytes.size(), 4u + 3 * 36);
  EXPECT_EQ(bytes.substr(0, 4), std::string("\3\0\0\0", 4));
  EXPECT_EQ(bytes.substr(4 + 36, 4), std::string("\0\0\x80\x3f", 4)) << "A.x of the second triangle, 1.0f";
}

TEST(Dat, NoTrianglesIsAModel) {
  const TestFolder folder;
  write_dat({}, folder / "x.dat");
  EXPECT_TRUE(read_dat(folder / "x.dat").triangles.empty());
}

TEST(Dat, ShortFiles) {
  const TestFolder folder;
  const auto error = [&](const std::string& bytes) {
    const std::string path = folder.file("x.dat", bytes).string();
    const std::string text = input_error([&] { read_dat(path); });
    EXPECT_TRUE(text.starts_with(path + ": ")) << text;
    return text.substr(std::min(text.size(), path.size() + 2));
  };
  EXPECT_EQ(error(""), "the file is empty");
  EXPECT_EQ(error("abc"), "byte 0: T needs 4 bytes, the file has 3");
  EXPECT_EQ(error(dat(2, 71)), "byte 0: T says 2 triangles, the file holds 1 (75 bytes)");
  EXPECT_EQ(error(dat(1, 0)), "byte 0: T says 1 triangles, the file holds 0 (4 bytes)");
  EXPECT_EQ(error(dat(2147483647, 36)), "byte 0: T says 2147483647 triangles, the file holds 1 (40 bytes)");
  EXPECT_EQ(error(dat(-1, 36)), "byte 0: T is -1; a number of triangles cannot be negative");
  EXPECT_EQ(error(dat(-2147483647 - 1, 36)),
            "byte 0: T is -2147483648; a number of triangles cannot be negative");
}

TEST(Dat, BytesLeftOverAreAWarning) {
  const TestFolder folder;
  for (const std::size_t extra : {std::size_t{1}, std::size_t{36}, std::size_t{100}}) {
    const std::string path = folder.file("x.dat", dat(2, 72 + extra)).string();
    testing::internal::CaptureStderr();
    const Model model = read_dat(path);
    EXPECT_EQ(testing::internal::GetCapturedStderr(),
              "warning: " + path + ": T says 2 triangles, the file holds " + std::to_string(2 + extra / 36) +
                  "; the last " + std::to_string(extra) + " bytes are ignored\n");
    EXPECT_EQ(model.triangles.size(), 2u);
  }
}

TEST(Dat, NoWarningWhenAllIsWell) {
  const TestFolder folder;
  const auto path = folder.file("x.dat", dat(2, 72));
  testing::internal::CaptureStderr();
  read_dat(path);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Dat, WhatIsNotAFile) {
  const TestFolder folder;
  EXPECT_EQ(input_error([&] { read_dat(folder / "no.dat"); }),
            (folder / "no.dat").string() + ": cannot open: No such file or directory");
  std::filesystem::create_directory(folder / "folder.dat");
  EXPECT_EQ(input_error([&] { read_dat(folder / "folder.dat"); }),
            (folder / "folder.dat").string() + ": cannot read: Is a directory");
  EXPECT_EQ(input_error([&] { read_dat("/dev/null"); }),
            "/dev/null: is not a plain file: T cannot be checked against its size");
  const auto loop = folder / "loop.dat";
  std::filesystem::create_symlink(loop, loop);
  EXPECT_EQ(input_error([&] { read_dat(loop); }),
            loop.string() + ": cannot open: Too many levels of symbolic links");
}

TEST(Dat, AFileWithoutPermission) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may read everything";
  const TestFolder folder;
  const auto path = folder.file("x.dat", dat(2, 72));
  ::chmod(path.c_str(), 0);
  EXPECT_EQ(input_error([&] { read_dat(path); }), path.string() + ": cannot open: Permission denied");
}

}  // namespace
}  // namespace rasterbench
