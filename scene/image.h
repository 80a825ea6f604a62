// Image and array writers. Every file is written beside its target and renamed into place when it is complete.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

namespace rasterbench {

/// Replaces `path` by `bytes`, or leaves what was there: writes a temporary file in the same folder, then renames it.
/// Throws InputError that names the path.
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Writes RGBA8 pixels (row 0 on top, width * height of them) as P6 PPM or PNG, by the path's extension; alpha is dropped.
void write_image(const std::filesystem::path& path, std::span<const std::uint32_t> rgba, int width, int height);

/// Throws InputError unless the extension of `path` is one that write_image knows.
void check_image_path(const std::filesystem::path& path);

/// Writes NumPy .npy (version 1.0) arrays of shape (height, width), little-endian, C order.
void write_npy(const std::filesystem::path& path, std::span<const std::int32_t> values, int width, int height);
void write_npy(const std::filesystem::path& path, std::span<const float> values, int width, int height);

}  // namespace rasterbench
