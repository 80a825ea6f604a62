#include "scene/dat.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <string_view>

#include "base/buffer.h"
#include "base/error.h"
#include "scene/image.h"
#include "scene/input_file.h"

namespace rasterbench {

static_assert(std::endian::native == std::endian::little, "a .dat file is little-endian and read as it lies");

namespace {

constexpr std::uint64_t kHeaderBytes = sizeof(std::int32_t);

}  // namespace

Model read_dat(const std::filesystem::path& path, std::FILE* warnings) {
  InputFile file(path);
  const std::string name = path.string();
  if (!file.is_regular())
    throw InputError({.file = name}, "is not a plain file: T cannot be checked against its size");
  if (file.size() == 0) throw InputError({.file = name}, "the file is empty");

  std::int32_t count = 0;
  if (file.size() < kHeaderBytes || file.read(&count, kHeaderBytes) < kHeaderBytes)
    throw InputError({.file = name, .byte = 0}, fmt::format("T needs 4 bytes, the file has {}", file.size()));
  if (count < 0)
    throw InputError({.file = name, .byte = 0},
                     fmt::format("T is {}; a number of triangles cannot be negative", count));

  // Before anything is allocated: T of a file that is not a .dat file is a random number of up to 77 GB.
  const std::uint64_t held = (file.size() - kHeaderBytes) / sizeof(Triangle);
  const std::uint64_t wanted = static_cast<std::uint64_t>(count);
  const std::string counts = fmt::format("T says {} triangles, the file holds {}", wanted, held);
  if (held < wanted)
    throw InputError({.file = name, .byte = 0}, fmt::format("{} ({} bytes)", counts, file.size()));
  const std::uint64_t used = kHeaderBytes + wanted * sizeof(Triangle);
  if (used < file.size())
    fmt::print(warnings, "warning: {}: {}; the last {} bytes are ignored\n", name, counts,
               file.size() - used);

  Model model;
  model.name = name;
  const std::size_t bytes = checked_bytes(wanted, sizeof(Triangle), name);
  model.triangles.resize(wanted);
  if (const std::size_t got = file.read(model.triangles.data(), bytes); got < bytes)
    throw InputError({.file = name, .byte = static_cast<std::int64_t>(kHeaderBytes + got)},
                     "the file became shorter while it was read");
  return model;
}

void write_dat(const Model& model, const std::filesystem::path& path) {
  if (model.triangles.size() > static_cast<std::size_t>(kMaxTriangles))
    throw InputError({.file = path.string()}, fmt::format("{} triangles are more than T can say, {}",
                                                          model.triangles.size(), kMaxTriangles));
  const std::int32_t count = static_cast<std::int32_t>(model.triangles.size());
  const std::array<std::string_view, 2> pieces = {
      std::string_view(reinterpret_cast<const char*>(&count), sizeof(count)),
      std::string_view(reinterpret_cast<const char*>(model.triangles.data()),
                       model.triangles.size() * sizeof(Triangle))};
  write_file(path, pieces);
}

}  // namespace rasterbench
