#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>

#include "base/error.h"
#include "base/suggest.h"
#include "extremes/run.h"
#include "harness/commands.h"
#include "harness/progress.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

using extremes::Case;
using extremes::CaseResult;
using extremes::Finding;
using extremes::Verdict;

struct ExtremesOptions {
  std::vector<std::string> numerics, kernels, cases;
  std::string catalogue;
  int threads = 0;
  bool watertight = false, json = false;
};

/// A verdict in a cell of the table, in JSON, and in the legend.
struct VerdictName {
  Verdict verdict;
  char symbol;
  const char* name;
  const char* meaning;
};
constexpr VerdictName kVerdictNames[] = {
    {Verdict::kEqual, '=', "exact", "what exact arithmetic says, pixel for pixel"},
    {Verdict::kWithinBound, '~', "within bound", "pixels differ, each within the mode's stated bound"},
    {Verdict::kReported, 'o', "reported",
     "wrong, and said so: nothing is promised, or more than 1 in 1000 pixels are lost to rounded corners"},
    {Verdict::kRefused, '!', "refused", "refused, or warned of, as it must be"},
    {Verdict::kWrong, 'X', "WRONG", "what must not happen"},
    {Verdict::kNotCarried, '-', "not carried", "the kernel cannot carry the mode"},
};
const VerdictName& name_of(Verdict verdict) {
  return *std::find_if(std::begin(kVerdictNames), std::end(kVerdictNames),
                       [&](const VerdictName& n) { return n.verdict == verdict; });
}

/// The cases that are asked for by number or name, in the order of the catalogue.
std::vector<Case> chosen_cases(const ExtremesOptions& options) {
  const std::vector<Case> all =
      options.catalogue.empty() ? extremes::read_catalogue(extremes::built_in_catalogue(), "catalogue.toml")
                                : extremes::read_catalogue_file(options.catalogue);
  std::set<std::string> wanted;
  for (const std::string& word : options.cases) {
    int number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    const bool is_number = error == std::errc() && end == word.data() + word.size();
    const std::size_t before = wanted.size();
    std::vector<std::string> names;
    bool found = false;
    for (const Case& one : all) {
      names.push_back(one.name);
      if (!(is_number ? one.number == number : one.name == word)) continue;
      wanted.insert(one.name);
      found = true;
    }
    if (!found && before == wanted.size())
      throw InputError({.field = "--case"}, is_number ? fmt::format("there is no case {}", word)
                                                      : unknown_name("case", word, names));
  }
  std::vector<Case> chosen;
  for (const Case& one : all) {
    const bool counted = !options.watertight || one.must.watertight;
    if (counted && (options.cases.empty() || wanted.contains(one.name))) chosen.push_back(one);
  }
  if (chosen.empty())
    throw InputError({.field = "--watertight"}, "none of these cases is a mesh to count on");
  return chosen;
}

/// The results of all cases with one kernel.
struct Results {
  std::string kernel;
  std::vector<std::string_view> modes;
  std::vector<Case> cases;
  std::vector<CaseResult> of_cases;
};

constexpr int kNameWidth = 34;  // of a case with its number

/// The names of the modes, each running down over its column.
void print_heads(const std::vector<std::string_view>& modes) {
  std::size_t lines = 0;
  for (const std::string_view mode : modes) lines = std::max(lines, mode.size());
  for (std::size_t line = 0; line < lines; ++line) {
    std::string row(kNameWidth, ' ');
    for (const std::string_view mode : modes) {
      const std::size_t above = lines - mode.size();
      row += ' ';
      row += line < above ? ' ' : mode[line - above];
      row += ' ';
    }
    fmt::print("{}\n", row.substr(0, row.find_last_not_of(' ') + 1));
  }
}

void print_table(const Results& results) {
  fmt::print("kernel {}\n", results.kernel);
  print_heads(results.modes);
  for (std::size_t i = 0; i < results.cases.size(); ++i) {
    const CaseResult& result = results.of_cases[i];
    std::string row =
        fmt::format("{:>2} {:<{}}", results.cases[i].number, results.cases[i].name, kNameWidth - 3);
    for (const Finding& finding : result.findings) {
      row += ' ';
      row += name_of(finding.verdict).symbol;
      row += ' ';
    }
    fmt::print("{}{}\n", row, result.in_any_mode ? "(reading: any mode)" : "");
  }
  fmt::print("\n");
}

void print_legend(const std::vector<Results>& all) {
  std::map<Verdict, int> counts;
  std::set<std::string> notes;
  for (const Results& results : all)
    for (const CaseResult& result : results.of_cases)
      for (const Finding& finding : result.findings) {
        ++counts[finding.verdict];
        if (!finding.note.empty()) notes.insert(finding.note);
      }
  for (const VerdictName& name : kVerdictNames)
    fmt::print("  {}  {:<13}{:>5}  {}\n", name.symbol, name.name, counts[name.verdict], name.meaning);
  for (const std::string& note : notes) fmt::print("note: {}\n", note);
}

/// Gaps and overlaps, meshes in columns.
void print_watertight(const Results& results) {
  fmt::print("{:<24}", "gaps/overlaps, top-left");
  for (std::size_t i = 0; i < results.cases.size(); ++i)
    if (results.cases[i].must.watertight) fmt::print("{:>27}", results.cases[i].name);
  fmt::print("\n");
  for (std::size_t m = 0; m < results.modes.size(); ++m) {
    const std::string_view mode = results.modes[m];
    if (!find_mode(mode)->has_screen_triangles) continue;
    fmt::print("{:<24}", mode);
    for (std::size_t i = 0; i < results.cases.size(); ++i)
      for (const extremes::WatertightCount& count : results.of_cases[i].watertight)
        if (count.mode == mode)
          fmt::print("{:>26}{}", fmt::format("{}/{}", count.gaps, count.overlaps),
                     extremes::must_be_watertight(results.cases[i].must, mode) ? '*' : ' ');
    fmt::print("\n");
  }
  fmt::print("* must be 0/0\n\n");
}

void print_wrong(const Results& results) {
  for (std::size_t i = 0; i < results.cases.size(); ++i) {
    const CaseResult& result = results.of_cases[i];
    for (std::size_t m = 0; m < result.findings.size(); ++m)
      if (result.findings[m].verdict == Verdict::kWrong)
        fmt::print("WRONG: case {} {}, {}: {}\n", results.cases[i].number, results.cases[i].name,
                   result.in_any_mode ? "any mode" : fmt::format("{} {}", results.kernel, results.modes[m]),
                   result.findings[m].explanation);
  }
}

Json results_json(const std::vector<Results>& all) {
  Json list = Json::array();
  for (const Results& results : all)
    for (std::size_t i = 0; i < results.cases.size(); ++i) {
      const CaseResult& result = results.of_cases[i];
      for (std::size_t m = 0; m < result.findings.size(); ++m) {
        const Finding& finding = result.findings[m];
        Json entry{{"number", results.cases[i].number}, {"name", results.cases[i].name}};
        entry["kernel"] = result.in_any_mode ? Json() : Json(results.kernel);
        entry["numeric"] = result.in_any_mode ? Json() : Json(results.modes[m]);
        entry["verdict"] = name_of(finding.verdict).name;
        entry["pixels"] = finding.pixels;
        entry["drawn"] = finding.drawn;
        entry["wrong"] = finding.wrong;
        for (const extremes::WatertightCount& count : result.watertight)
          if (!result.in_any_mode && count.mode == results.modes[m]) {
            entry["gaps"] = count.gaps;
            entry["overlaps"] = count.overlaps;
          }
        entry["explanation"] = finding.explanation;
        entry["note"] = finding.note;
        list.push_back(std::move(entry));
      }
    }
  return list;
}

bool any_wrong(const std::vector<Results>& all) {
  for (const Results& results : all)
    for (const CaseResult& result : results.of_cases)
      for (const Finding& finding : result.findings)
        if (finding.verdict == Verdict::kWrong) return true;
  return false;
}

/// Those that are asked for, or tile_parallel for modes of screen triangles and ray_cast for its own.
std::vector<std::string_view> chosen_kernels(const std::vector<std::string>& names,
                                             const std::vector<std::string_view>& modes) {
  std::vector<std::string_view> chosen;
  for (const std::string& name : names) chosen.push_back(find_kernel(name).info().name);
  if (!chosen.empty()) return chosen;
  for (const std::string_view kernel : {"tile_parallel", "ray_cast"})
    if (modes.empty() || std::any_of(modes.begin(), modes.end(), [&](std::string_view mode) {
          return static_cast<bool>(find_kernel(kernel).variant(mode).make);
        }))
      chosen.push_back(kernel);
  return chosen;
}

/// Cases about reading run once, with the first kernel.
Results run_kernel(const std::vector<Case>& cases, const std::vector<std::string_view>& modes,
                   std::string_view kernel, bool is_first, const ExtremesOptions& options,
                   Progress& progress) {
  Results results{.kernel = std::string(kernel), .modes = modes, .cases = {}, .of_cases = {}};
  const auto part = options.watertight ? extremes::Part::kWatertight : extremes::Part::kAll;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    if (cases[i].must.is_about_reading() && !is_first) continue;
    progress.show("extremes, " + results.kernel, static_cast<double>(i), static_cast<double>(cases.size()),
                  cases[i].name);
    results.cases.push_back(cases[i]);
    results.of_cases.push_back(extremes::run_case(cases[i], modes, kernel, part, options.threads));
  }
  return results;
}

int run_extremes(ExtremesOptions options) {
  std::vector<std::string_view> asked;
  for (const std::string& name : options.numerics) asked.push_back(available_mode(name, "--numeric").name);
  const std::vector<std::string_view> kernels = chosen_kernels(options.kernels, asked);
  if (options.threads == 0) options.threads = default_threads();
  if (options.threads > available_cpus())
    throw InputError({.field = "--threads"},
                     fmt::format("at most the {} CPUs of this process", available_cpus()));
  const std::vector<Case> cases = chosen_cases(options);

  std::vector<Results> all;
  {
    Progress progress;
    for (const std::string_view kernel : kernels)
      all.push_back(run_kernel(cases, asked.empty() ? extremes::runnable_modes(kernel) : asked, kernel,
                               all.empty(), options, progress));
  }
  if (options.json) {
    fmt::print("{}\n", dump(results_json(all), 2));
  } else {
    for (const Results& results : all)
      if (!options.watertight) print_table(results);
    if (std::any_of(cases.begin(), cases.end(), [](const Case& one) { return one.must.watertight; }))
      print_watertight(all.front());
    print_legend(all);
    for (const Results& results : all) print_wrong(results);
  }
  return any_wrong(all) ? 1 : 0;
}

}  // namespace

void add_extremes_command(CLI::App& app, Outcome& outcome) {
  CLI::App* command = app.add_subcommand(
      "extremes", "the stress cases in every numeric mode: exact, within bound, reported or WRONG");
  const auto options = std::make_shared<ExtremesOptions>();
  command->add_option("--numeric", options->numerics,
                      "numeric modes (default: all that this CPU runs and the kernel carries)");
  command->add_option("--kernel", options->kernels,
                      "strategies (default: tile_parallel, and ray_cast for its own mode)");
  command->add_option("--case", options->cases, "cases by number or name (default: all)");
  command->add_option("--catalogue", options->catalogue, "FILE.toml instead of the built-in catalogue");
  command->add_option("--threads", options->threads, "number of threads (default: all CPUs of this process)")
      ->check(CLI::Range(1, 65536));
  command->add_flag("--watertight", options->watertight, "only count gaps and overlaps of the meshes");
  command->add_flag("--json", options->json, "an array of objects, one for each case and mode");
  command->callback([options, &outcome] { outcome.exit_code = run_extremes(*options); });
}

}  // namespace rasterbench
