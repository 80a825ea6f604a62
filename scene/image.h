// Image and array files. Every file is written beside its target and renamed into place when it is
// complete.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace rasterbench {

/// Replaces `path` by `bytes`, or leaves what was there: writes a temporary file in the same folder, then
/// renames it. A symbolic link is followed; a device or a pipe (/dev/stdout) is written to as it is. Throws
/// InputError that names the path.
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// The same for a file that lies in memory as several pieces, e.g. a header and an array.
void write_file(const std::filesystem::path& path, std::span<const std::string_view> pieces);

/// Writes RGBA8 pixels (row 0 on top, width * height of them) as P6 PPM or PNG, by the path's extension (.ppm
/// or .png, in any case); alpha is dropped. A pixel is r + (g << 8) + (b << 16) + (a << 24).
void write_image(const std::filesystem::path& path, std::span<const std::uint32_t> rgba, int width,
                 int height);

/// Throws InputError unless the extension of `path` is one that write_image knows.
void check_image_path(const std::filesystem::path& path);

/// Throws InputError if `path` can be seen not to be writable: a folder, or in none. Called before long work,
/// so that it is not lost and earlier outputs are not replaced for nothing.
void check_output_path(const std::filesystem::path& path);

/// Writes NumPy .npy (version 1.0) arrays of shape (height, width), little-endian, C order.
void write_npy(const std::filesystem::path& path, std::span<const std::int32_t> values, int width,
               int height);
void write_npy(const std::filesystem::path& path, std::span<const float> values, int width, int height);

/// An array of shape (height, width), row 0 on top.
template <class Value>
struct Array {
  int width = 0;
  int height = 0;
  std::vector<Value> values = {};
};

/// What write_npy() wrote. Throws InputError that names the path where the file is anything else.
Array<std::int32_t> read_npy_ids(const std::filesystem::path& path);
Array<float> read_npy_depths(const std::filesystem::path& path);

}  // namespace rasterbench
