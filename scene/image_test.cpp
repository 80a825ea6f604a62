#include "scene/image.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <cstring>
#include <memory>
#include <vector>

#include "scene/test_folder.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace rasterbench {
namespace {

constexpr std::uint32_t pixel(std::uint32_t r, std::uint32_t g, std::uint32_t b) {
  return r | g << 8 | b << 16 | 0x7f000000u;
}

TEST(Image, PpmByteByByte) {
  const TestFolder folder;
  const std::vector<std::uint32_t> pixels = {pixel(1, 2, 3), pixel(255, 128, 0), pixel(10, 13, 32),
                                             pixel(0, 0, 0), pixel(4, 5, 6),     pixel(7, 8, 255)};
  write_image(folder / "x.ppm", pixels, 3, 2);
  const std::string expected =
      std::string("P6\n3 2\n255\n") + std::string("\1\2\3\xff\x80\0\n\r \0\0\0\4\5\6\7\10\xff", 18);
  EXPECT_EQ(read_bytes(folder / "x.ppm"), expected);
  write_image(folder / "UPPER.PPM", pixels, 3, 2);
  EXPECT_EQ(read_bytes(folder / "UPPER.PPM"), expected);
}

TEST(Image, PngComesBackAsItWas) {
  const TestFolder folder;
  constexpr int kWidth = 123, kHeight = 45;
  std::vector<std::uint32_t> pixels;
  for (std::uint32_t i = 0; i < kWidth * kHeight; ++i)
    pixels.push_back(pixel(i * 7 % 256, i / 3 % 256, i * i % 256));
  write_image(folder / "x.Png", pixels, kWidth, kHeight);

  const std::string file = read_bytes(folder / "x.Png");
  int width = 0, height = 0, channels = 0;
  const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> back(
      stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(file.data()), static_cast<int>(file.size()),
                            &width, &height, &channels, 3),
      &stbi_image_free);
  ASSERT_NE(back, nullptr);
  EXPECT_EQ(width, kWidth);
  EXPECT_EQ(height, kHeight);
  EXPECT_EQ(channels, 3);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    ASSERT_EQ(pixels[i], pixel(back.get()[3 * i], back.get()[3 * i + 1], back.get()[3 * i + 2])) << i;
}

TEST(Image, PathsAndSizesAreChecked) {
  const std::vector<std::uint32_t> pixels(6);
  check_image_path("a.ppm");
  check_image_path("folder.x/a.PNG");
  EXPECT_EQ(input_error([] { check_image_path("a.jpg"); }),
            "a.jpg: '.jpg' is not a known image extension; known: .ppm, .png");
  EXPECT_EQ(input_error([] { check_image_path("png"); }),
            "png: '' is not a known image extension; known: .ppm, .png");
  EXPECT_EQ(input_error([&] { write_image("a.ppm", pixels, 2, 2); }), "a.ppm: 6 values are not 2x2");
  EXPECT_EQ(input_error([&] { write_image("a.ppm", pixels, -2, -3); }), "a.ppm: 6 values are not -2x-3");
}

TEST(Image, NpyIsWhatNumpyWrites) {
  const TestFolder folder;
  const std::vector<std::int32_t> ids = {-1, 0, 1, 2, 3, 2147483647};
  write_npy(folder / "ids.npy", ids, 3, 2);
  const std::string bytes = read_bytes(folder / "ids.npy");
  ASSERT_EQ(bytes.size(), 128u + 24);
  EXPECT_EQ(bytes.substr(0, 10), std::string("\x93NUMPY\1\0\x76\0", 10));
  const std::string header = "{'descr': '<i4', 'fortran_order': False, 'shape': (2, 3), }";
  EXPECT_EQ(bytes.substr(10, 118), header + std::string(117 - header.size(), ' ') + "\n");
  EXPECT_EQ(std::memcmp(bytes.data() + 128, ids.data(), 24), 0);

  const std::vector<float> depths = {1, -1, 0.5f, -0.0f};
  write_npy(folder / "depth.npy", depths, 4, 1);
  const std::string other = read_bytes(folder / "depth.npy");
  EXPECT_NE(other.find("'<f4', 'fortran_order': False, 'shape': (1, 4), }"), std::string::npos);
  EXPECT_EQ(std::memcmp(other.data() + other.size() - 16, depths.data(), 16), 0);
  EXPECT_EQ((other.size() - 16) % 64, 0u);
}

TEST(Image, NpyIsReadBack) {
  const TestFolder folder;
  const std::vector<std::int32_t> ids = {-1, 0, 1, 2, 3, 2147483647};
  write_npy(folder / "ids.npy", ids, 3, 2);
  const Array<std::int32_t> array = read_npy_ids(folder / "ids.npy");
  EXPECT_EQ(array.width, 3);
  EXPECT_EQ(array.height, 2);
  EXPECT_EQ(array.values, ids);
  const std::vector<float> depths = {1, -1, 0.5f, -0.0f};
  write_npy(folder / "depth.npy", depths, 4, 1);
  EXPECT_EQ(read_npy_depths(folder / "depth.npy").values, depths);
  const auto error = [&](const std::string& bytes) {
    const auto path = folder.file("bad.npy", bytes);
    return input_error([&] { read_npy_ids(path); }).substr(path.string().size() + 2);
  };
  const std::string bytes = read_bytes(folder / "ids.npy");
  EXPECT_EQ(error(""), "is no NumPy array of version 1.0");
  EXPECT_EQ(error(bytes.substr(0, 9)), "is no NumPy array of version 1.0");
  EXPECT_EQ(error(bytes.substr(0, 100)), "ends within its header");
  EXPECT_EQ(error(bytes.substr(0, 130)), "holds 2 bytes of values in place of 24");
  EXPECT_EQ(error(bytes + "x"), "holds 25 bytes of values in place of 24");
  EXPECT_EQ(error(read_bytes(folder / "depth.npy")),
            "header: expected <i4 values of shape (height, width) in C order");
}

TEST(WriteFile, ReplacesAndLeavesNothingElse) {
  const TestFolder folder;
  write_file(folder / "x", "one");
  write_file(folder / "x", "two");
  EXPECT_EQ(read_bytes(folder / "x"), "two");
  EXPECT_EQ(folder.entries(), 1);
  write_file(folder / std::string(255, 'n'), "the longest name");
  EXPECT_EQ(folder.entries(), 2);
}

TEST(WriteFile, FollowsALink) {
  const TestFolder folder;
  folder.file("target", "old");
  std::filesystem::create_symlink("target", folder / "link");
  write_file(folder / "link", "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(read_bytes(folder / "target"), "new");
}

TEST(WriteFile, WhereItCannot) {
  const TestFolder folder;
  const auto error = [](const std::filesystem::path& path) {
    const std::string text = input_error([&] { write_file(path, "x"); });
    EXPECT_TRUE(text.starts_with(path.string() + ": cannot write: ")) << text;
    return text.substr(std::min(text.size(), path.string().size() + 16));
  };
  EXPECT_EQ(error(folder / "no/such/x.ppm"), "No such file or directory");
  EXPECT_EQ(error(folder.file("file", "") / "x.ppm"), "Not a directory");
  std::filesystem::create_directory(folder / "folder");
  EXPECT_EQ(error(folder / "folder"), "Is a directory");
  EXPECT_EQ(folder.entries(), 2);
}

TEST(WriteFile, ADeviceStaysADevice) {
  write_file("/dev/null", "gone");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_EQ(input_error([] { write_file("/dev/full", "x"); }),
            "/dev/full: cannot write: No space left on device");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

TEST(WriteFile, AFullDiskLeavesTheOldFile) {
  const TestFolder folder;
  write_file(folder / "x.npy", "old");
  // A limit on the size of files stands for the disk: the first part is written, then no more.
  rlimit old_limit = {};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old_limit), 0);
  rlimit limit = old_limit;
  limit.rlim_cur = 1000;
  void (*const old_handler)(int) = ::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  const std::vector<float> values(1000);
  const std::string error = input_error([&] { write_npy(folder / "x.npy", values, 1000, 1); });
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &old_limit), 0);
  ::signal(SIGXFSZ, old_handler);

  EXPECT_EQ(error, (folder / "x.npy").string() + ": cannot write: File too large");
  EXPECT_EQ(read_bytes(folder / "x.npy"), "old");
  EXPECT_EQ(folder.entries(), 1) << "the temporary file is gone";
}

}  // namespace
}  // namespace rasterbench
