// Reads a picture that somebody else's program wrote: a binary PPM of a known size, from a file that may hold
// anything.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace rasterbench {

/// A picture, or what is wrong with the file, in words.
struct PpmFile {
  std::vector<std::uint32_t> pixels =
      {};                    ///< RGBA8 with red in the lowest byte and alpha 255, row 0 on top; or empty
  std::string problem = {};  ///< empty where there is a picture
  std::string note = {};     ///< what is odd and harmless: bytes after the last pixel
};

/// Reads a P6 PPM of width x height pixels and 8 bits a channel. Never allocates more than the picture needs,
/// whatever the header claims.
PpmFile read_ppm(const std::filesystem::path& path, int width, int height);

}  // namespace rasterbench
