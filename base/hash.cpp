#include "base/hash.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <fstream>
#include <iterator>

#include "base/error.h"

namespace rasterbench {

std::string hash_bytes(std::string_view bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

std::string hash_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError({.file = path.string()}, "cannot be read");
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return hash_bytes(bytes);
}

}  // namespace rasterbench
