// Cases that are files: written into a folder of their own and read as a user's would be.
#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "base/error.h"
#include "extremes/constructions.h"
#include "extremes/judge_case.h"
#include "scene/dat.h"
#include "scene/image.h"

namespace rasterbench::extremes {
namespace {

namespace fs = std::filesystem;

/// An empty folder that goes away with the object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "rasterbench-extremes-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      throw InputError({.file = name}, fmt::format("cannot be made: {}", std::strerror(errno)));
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  fs::path operator/(const char* name) const { return path_ / name; }

 private:
  fs::path path_;
};

/// A .dat file that claims and holds what it is told to. The triangles face the default camera.
std::string dat_bytes(const ModelFile& file) {
  const Triangle triangle{{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
  std::string bytes(reinterpret_cast<const char*>(&file.claimed), sizeof(file.claimed));
  for (std::int64_t i = 0; i < file.triangles; ++i)
    bytes.append(reinterpret_cast<const char*>(&triangle), sizeof(triangle));
  bytes.append(static_cast<std::size_t>(file.extra_bytes), '\0');
  return bytes;
}

/// Reads the case's file; `warnings` is where warnings go.
Scene read_file(const Case& one, std::FILE* warnings) {
  const TemporaryFolder folder;
  Scene scene{.model = {}, .parameters = one.parameters};
  if (one.input.model_file) {
    write_file(folder / "case.dat", dat_bytes(*one.input.model_file));
    scene.model = read_dat(folder / "case.dat", warnings);
    scene.model.name = one.name;
  } else {
    write_file(folder / "case.txt", one.input.parameter_file);
    scene.parameters = read_scene_parameters(folder / "case.txt");
  }
  return scene;
}

/// What reading a case's file says, without the end of the line.
struct Said {
  std::string error, warning;
};

Said read_and_listen(const Case& one) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* stream = open_memstream(&text, &size);
  if (stream == nullptr) throw Error("no memory for a stream");
  Said said;
  try {
    read_file(one, stream);
  } catch (const InputError& error) {
    said.error = error.what();
  }
  std::fclose(stream);
  said.warning.assign(text, size);
  std::free(text);
  if (said.warning.ends_with('\n')) said.warning.pop_back();
  return said;
}

void require_parts(const std::vector<std::string>& parts, const std::string& line, Finding& finding) {
  for (const std::string& part : parts)
    if (line.find(part) == std::string::npos)
      finding.worsen(Verdict::kWrong, fmt::format("'{}' is not in: {}", part, line));
  if (line.find('\n') != std::string::npos) finding.worsen(Verdict::kWrong, "more than one line: " + line);
}

}  // namespace

Scene open_case(const Case& one) { return one.input.model_file ? read_file(one, stderr) : scene_of(one); }

Finding judge_reading(const Case& one) {
  Finding finding;
  finding.verdict = Verdict::kRefused;
  const auto [error, warning] = read_and_listen(one);
  const Must& must = one.must;
  if (must.error.empty() != error.empty())
    finding.worsen(Verdict::kWrong, error.empty() ? "read without an error" : "an error: " + error);
  if (must.warning.empty() != warning.empty())
    finding.worsen(Verdict::kWrong, warning.empty() ? "read without a warning" : "a warning: " + warning);
  require_parts(must.error, error, finding);
  require_parts(must.warning, warning, finding);
  return finding;
}

}  // namespace rasterbench::extremes
