// The .dat format of the course contract: int32 T (little-endian), then T x 9 float32: corners A, B, C of
// each triangle.
#pragma once

#include <cstdio>
#include <filesystem>

#include "scene/model.h"

namespace rasterbench {

/// Reads a .dat file. T is checked against the file's size before anything is allocated. Throws InputError
/// that names both counts when the file is too short; warns on `warnings`, naming both, when bytes are left
/// over.
Model read_dat(const std::filesystem::path& path, std::FILE* warnings = stderr);

/// Writes `model` as .dat; write_file's guarantees.
void write_dat(const Model& model, const std::filesystem::path& path);

}  // namespace rasterbench
