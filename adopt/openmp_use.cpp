#include "adopt/openmp_use.h"

#include <elf.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string_view>

namespace rasterbench {
namespace {

/// A value of the file at an offset that the file itself gave; none where it lies outside.
template <class Value>
std::optional<Value> at(const std::string& bytes, std::uint64_t offset) {
  if (offset > bytes.size() || bytes.size() - offset < sizeof(Value)) return std::nullopt;
  Value value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

std::string name_at(const std::string& bytes, const Elf64_Shdr& strings, std::uint32_t offset) {
  const std::uint64_t begin = strings.sh_offset + offset;
  if (offset >= strings.sh_size || begin >= bytes.size()) return "";
  const std::size_t end = bytes.find('\0', begin);
  return end == std::string::npos ? "" : bytes.substr(begin, end - begin);
}

/// The undefined names of .dynsym (System V ABI, chapter 4); nothing for a file without one.
std::optional<std::vector<std::string>> dynamic_imports(const std::string& bytes) {
  const auto header = at<Elf64_Ehdr>(bytes, 0);
  if (!header) return std::nullopt;
  const auto section = [&](std::uint64_t i) {
    return i < header->e_shnum ? at<Elf64_Shdr>(bytes, header->e_shoff + i * sizeof(Elf64_Shdr))
                               : std::nullopt;
  };
  for (std::uint64_t i = 0; i < header->e_shnum; ++i) {
    const auto symbols = section(i);
    if (!symbols || symbols->sh_type != SHT_DYNSYM) continue;
    const auto strings = section(symbols->sh_link);
    if (!strings) return std::nullopt;
    std::vector<std::string> names;
    for (std::uint64_t k = 0; k < symbols->sh_size / sizeof(Elf64_Sym); ++k) {
      const auto symbol = at<Elf64_Sym>(bytes, symbols->sh_offset + k * sizeof(Elf64_Sym));
      if (!symbol) return std::nullopt;
      if (symbol->st_shndx == SHN_UNDEF && symbol->st_name != 0)
        names.push_back(name_at(bytes, *strings, symbol->st_name));
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  return std::nullopt;
}

bool contains(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

std::int64_t count_of(const ProbeCounts& probe, const std::string& key) {
  const auto found = probe.find(key);
  return found == probe.end() ? 0 : found->second;
}

OpenMpUse decide_by_calls(const ProbeCounts& probe) {
  const std::int64_t runtime = count_of(probe, "loops_runtime"), regions = count_of(probe, "regions");
  std::string fixed;
  std::int64_t fixed_loops = 0;
  for (const char* kind : {"static", "dynamic", "guided", "auto"}) {
    const std::int64_t loops = count_of(probe, std::string("loops_") + kind);
    fixed_loops += loops;
    if (loops > 0) fixed += fmt::format("{}{}", fixed.empty() ? "" : ", ", kind);
  }
  if (runtime > 0)
    return {
        ScheduleUse::kRuntime, "calls",
        fmt::format("schedule(runtime): while the program ran, {} thread{} asked for a loop whose schedule "
                    "OMP_SCHEDULE decides{}",
                    runtime, runtime == 1 ? "" : "s",
                    fixed.empty() ? "" : "; other loops have a fixed schedule (" + fixed + ")")};
  if (fixed_loops > 0)
    return {ScheduleUse::kFixed, "calls",
            fmt::format("a fixed schedule ({}): the program never asked for OMP_SCHEDULE while it ran; write "
                        "schedule(runtime) to choose the schedule without compiling again",
                        fixed)};
  if (regions > 0)
    return {ScheduleUse::kFixed, "calls",
            "no schedule(runtime): parallel regions ran, but none asked for OMP_SCHEDULE; their loops, if "
            "they have "
            "any, are static ones that the compiler divided itself (the default without a schedule clause)"};
  return {ScheduleUse::kUndecided, "none", ""};
}

}  // namespace

const char* to_string(ScheduleUse use) {
  switch (use) {
    case ScheduleUse::kRuntime:
      return "runtime";
    case ScheduleUse::kFixed:
      return "fixed";
    case ScheduleUse::kNoOpenMp:
      return "no_openmp";
    case ScheduleUse::kUndecided:
      return "undecided";
  }
  return "";
}

ProgramFile inspect_program(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (bytes.starts_with("#!")) return {"script", {}};
  if (!bytes.starts_with(ELFMAG)) return {"other", {}};
  if (bytes.size() <= EI_DATA || bytes[EI_CLASS] != ELFCLASS64 || bytes[EI_DATA] != ELFDATA2LSB)
    return {"other", {}};
  const auto imports = dynamic_imports(bytes);
  if (!imports) return {"static ELF", {}};
  return {"dynamic ELF", *imports};
}

ProbeCounts read_probe(const std::filesystem::path& path) {
  ProbeCounts counts;
  std::ifstream file(path);
  std::string key;
  std::int64_t value = 0;
  while (file >> key >> value) counts[key] += value;
  return counts;
}

OpenMpUse decide_schedule_use(const ProgramFile& file, const ProbeCounts& probe) {
  if (OpenMpUse use = decide_by_calls(probe); use.use != ScheduleUse::kUndecided) return use;
  if (file.kind != "dynamic ELF")
    return {ScheduleUse::kUndecided, "none",
            fmt::format(
                "undecided: no call of an OpenMP runtime was seen, and the program's file ({}) names none; "
                "only the times under each OMP_SCHEDULE can tell",
                file.kind)};
  bool has_runtime = false, asks_schedule = false, has_clang_dispatch = false, has_threads = false;
  for (const std::string& name : file.imports) {
    has_runtime =
        has_runtime || name.starts_with("GOMP_") || name.starts_with("__kmpc_") || name.starts_with("omp_");
    asks_schedule = asks_schedule || (name.starts_with("GOMP_") && contains(name, "_runtime"));
    has_clang_dispatch = has_clang_dispatch || name.starts_with("__kmpc_dispatch_init");
    has_threads = has_threads || name.starts_with("pthread_create") || contains(name, "_M_start_thread");
  }
  if (asks_schedule)
    return {ScheduleUse::kRuntime, "imports",
            "schedule(runtime): the program's file imports a loop whose schedule OMP_SCHEDULE decides; "
            "whether that "
            "loop was run is not known"};
  if (has_clang_dispatch)
    return {ScheduleUse::kUndecided, "imports",
            "undecided: the program's file imports a loop of LLVM's runtime that may be schedule(runtime), "
            "dynamic or "
            "guided; only the times under each OMP_SCHEDULE can tell"};
  if (has_runtime)
    return {ScheduleUse::kFixed, "imports",
            "no schedule(runtime): the program's file imports no loop whose schedule OMP_SCHEDULE decides"};
  return {
      ScheduleUse::kNoOpenMp, "imports",
      has_threads
          ? "no OpenMP: the program makes its threads itself, OMP_NUM_THREADS and OMP_SCHEDULE say nothing "
            "to it"
          : "no OpenMP: the program's file imports nothing of it, and no threads"};
}

}  // namespace rasterbench
