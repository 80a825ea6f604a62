#include "scene/image.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <regex>
#include <string>
#include <system_error>

#include "base/buffer.h"
#include "base/error.h"

// stb's code is compiled here, once, as static functions: it is not written for our warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace rasterbench {

static_assert(std::endian::native == std::endian::little, ".npy arrays are written as they lie, under '<'");

namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, int error) {
  throw InputError({.file = path.string()}, "cannot write: " + std::generic_category().message(error));
}

/// Writes all of `pieces`; 0 or errno.
int write_all(int descriptor, std::span<const std::string_view> pieces) {
  for (std::string_view rest : pieces) {
    while (!rest.empty()) {
      const ssize_t wrote = ::write(descriptor, rest.data(), rest.size());
      if (wrote < 0 && errno == EINTR) continue;
      if (wrote < 0) return errno;
      rest.remove_prefix(static_cast<std::size_t>(wrote));
    }
  }
  return 0;
}

/// write_all, then close: some file systems report a full disk only then.
int write_and_close(int descriptor, std::span<const std::string_view> pieces) {
  const int error = write_all(descriptor, pieces);
  const int close_error = ::close(descriptor) != 0 ? errno : 0;
  return error != 0 ? error : close_error;
}

/// A name in `folder` that no other thread, process or (O_EXCL) machine uses, and its file. Short, so that a
/// target name of the greatest length works too.
struct TemporaryFile {
  fs::path path;
  int descriptor = -1;
};

TemporaryFile create_beside(const fs::path& target) {
  static std::atomic<unsigned> serial{0};
  for (;;) {
    TemporaryFile file;
    file.path = target.parent_path() / fmt::format(".rasterbench-{}-{}.tmp", ::getpid(), serial++);
    file.descriptor = ::open(file.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file.descriptor >= 0) return file;
    if (errno != EEXIST) fail(target, errno);
  }
}

std::string lower_case_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return extension;
}

std::string to_rgb8(std::span<const std::uint32_t> rgba, const std::string& what) {
  std::string rgb(checked_bytes(rgba.size(), 3, what), '\0');
  char* out = rgb.data();
  for (const std::uint32_t pixel : rgba) {
    *out++ = static_cast<char>(pixel & 0xff);
    *out++ = static_cast<char>(pixel >> 8 & 0xff);
    *out++ = static_cast<char>(pixel >> 16 & 0xff);
  }
  return rgb;
}

void write_png(const fs::path& path, const std::string& rgb, int width, int height) {
  // stb counts bytes in int and doubles its output buffer: above this it overflows.
  constexpr std::size_t kMaxPngBytes = std::size_t{1} << 29;
  if (rgb.size() + static_cast<std::size_t>(height) > kMaxPngBytes)
    throw InputError(
        {.file = path.string()},
        fmt::format("{}x{} pixels are too many for the PNG writer; write a .ppm", width, height));
  int length = 0;
  const std::unique_ptr<unsigned char, decltype(&std::free)> png(
      stbi_write_png_to_mem(reinterpret_cast<const unsigned char*>(rgb.data()), 3 * width, width, height, 3,
                            &length),
      &std::free);
  if (!png) throw InputError({.file = path.string()}, "not enough memory for the PNG writer");
  write_file(path,
             std::string_view(reinterpret_cast<const char*>(png.get()), static_cast<std::size_t>(length)));
}

void check_size(const fs::path& path, std::size_t values, int width, int height) {
  if (width < 1 || height < 1 || values != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw InputError({.file = path.string()}, fmt::format("{} values are not {}x{}", values, width, height));
}

void write_array(const fs::path& path, std::string_view descr, std::string_view data, int width, int height) {
  constexpr std::size_t kPreamble = 10;   // magic, version, length of the header
  constexpr std::size_t kAlignment = 64;  // where the data starts, so that it can be mapped
  std::string header =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}, {}), }}", descr, height, width);
  const std::size_t unpadded = kPreamble + header.size() + 1;
  header.append((kAlignment - unpadded % kAlignment) % kAlignment, ' ');
  header += '\n';
  const std::string preamble{'\x93',
                             'N',
                             'U',
                             'M',
                             'P',
                             'Y',
                             1,
                             0,
                             static_cast<char>(header.size() & 0xff),
                             static_cast<char>(header.size() >> 8)};
  const std::array<std::string_view, 3> pieces = {preamble, header, data};
  write_file(path, pieces);
}

}  // namespace

void write_file(const fs::path& path, std::span<const std::string_view> pieces) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) fail(path, EISDIR);
  if (fs::exists(status) &&
      !fs::is_regular_file(status)) {  // renaming onto /dev/null would replace the device
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) fail(path, errno);
    if (const int failed = write_and_close(descriptor, pieces); failed != 0) fail(path, failed);
    return;
  }
  fs::path target = path;
  if (fs::exists(status)) {
    target = fs::canonical(path, error);  // of a link, replace the file and keep the link
    if (error) fail(path, error.value());
  }

  const TemporaryFile temporary = create_beside(target);
  int failed = write_and_close(temporary.descriptor, pieces);
  if (failed == 0 && ::rename(temporary.path.c_str(), target.c_str()) != 0) failed = errno;
  if (failed != 0) {
    ::unlink(temporary.path.c_str());
    fail(path, failed);
  }
}

void write_file(const fs::path& path, std::string_view bytes) { write_file(path, std::span(&bytes, 1)); }

void check_output_path(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code error;
  if (fs::is_directory(path, error)) fail(path, EISDIR);
  if (!fs::exists(folder, error)) fail(path, ENOENT);
  if (!fs::is_directory(folder, error)) fail(path, ENOTDIR);
  if (::access(folder.c_str(), W_OK) != 0) fail(path, errno);
}

void check_image_path(const fs::path& path) {
  const std::string extension = lower_case_extension(path);
  if (extension != ".ppm" && extension != ".png")
    throw InputError({.file = path.string()},
                     fmt::format("'{}' is not a known image extension; known: .ppm, .png", extension));
}

void write_image(const fs::path& path, std::span<const std::uint32_t> rgba, int width, int height) {
  check_image_path(path);
  check_size(path, rgba.size(), width, height);
  const std::string rgb = to_rgb8(rgba, path.string());
  if (lower_case_extension(path) == ".png") return write_png(path, rgb, width, height);
  const std::string header = fmt::format("P6\n{} {}\n255\n", width, height);
  const std::array<std::string_view, 2> pieces = {header, rgb};
  write_file(path, pieces);
}

void write_npy(const fs::path& path, std::span<const std::int32_t> values, int width, int height) {
  check_size(path, values.size(), width, height);
  write_array(path, "<i4", {reinterpret_cast<const char*>(values.data()), values.size_bytes()}, width,
              height);
}

void write_npy(const fs::path& path, std::span<const float> values, int width, int height) {
  check_size(path, values.size(), width, height);
  write_array(path, "<f4", {reinterpret_cast<const char*>(values.data()), values.size_bytes()}, width,
              height);
}

namespace {

template <class Value>
Array<Value> read_npy(const fs::path& path, const std::string& type) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw InputError({.file = path.string()}, "cannot be read");
  constexpr std::size_t kBeforeHeader = 10;  // magic, version 1.0, length of the header in 16 bits
  if (bytes.size() < kBeforeHeader || !bytes.starts_with(std::string("\x93NUMPY\x01\x00", 8)))
    throw InputError({.file = path.string()}, "is no NumPy array of version 1.0");
  const std::size_t header_size =
      static_cast<unsigned char>(bytes[8]) + 256 * std::size_t{static_cast<unsigned char>(bytes[9])};
  if (bytes.size() < kBeforeHeader + header_size)
    throw InputError({.file = path.string()}, "ends within its header");
  const std::string header = bytes.substr(kBeforeHeader, header_size);
  static const std::regex kForm(
      R"re(\{'descr': '(...)', 'fortran_order': False, 'shape': \((\d{1,5}), (\d{1,5})\), \}\s*)re");
  std::smatch parts;
  if (!std::regex_match(header, parts, kForm) || parts[1] != type)
    throw InputError({.file = path.string(), .field = "header"},
                     fmt::format("expected {} values of shape (height, width) in C order", type));
  Array<Value> array{std::stoi(parts[3]), std::stoi(parts[2])};
  array.values.resize(static_cast<std::size_t>(array.width) * static_cast<std::size_t>(array.height));
  const std::size_t wanted = array.values.size() * sizeof(Value), begin = kBeforeHeader + header_size;
  if (bytes.size() - begin != wanted)
    throw InputError({.file = path.string()},
                     fmt::format("holds {} bytes of values in place of {}", bytes.size() - begin, wanted));
  std::memcpy(array.values.data(), bytes.data() + begin, wanted);
  return array;
}

}  // namespace

Array<std::int32_t> read_npy_ids(const fs::path& path) { return read_npy<std::int32_t>(path, "<i4"); }

Array<float> read_npy_depths(const fs::path& path) { return read_npy<float>(path, "<f4"); }

}  // namespace rasterbench
