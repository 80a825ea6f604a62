// Content hashes (XXH3, 128 bits) as 32 hex digits.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace rasterbench {

std::string hash_bytes(std::string_view bytes);

/// The hash of a file's content; throws InputError if it cannot be read.
std::string hash_file(const std::filesystem::path& path);

}  // namespace rasterbench
