#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "base/error.h"
#include "fuzz/fuzzer.h"
#include "harness/commands.h"
#include "harness/option_checks.h"
#include "harness/process.h"
#include "harness/progress.h"
#include "kernels/kernel.h"
#include "numeric/modes.h"
#include "scene/image.h"

namespace rasterbench {
namespace {

/// As a shell says of a command that Ctrl-C has ended: 128 + SIGINT.
constexpr int kInterruptedExitCode = 130;

/// What is being asked: of use to whoever reads of a crash in it.
std::array<char, 256> asked_last{};

/// A crash ends the process as it would have, after one line that says how to see it again.
void catch_crashes() {
  const auto handler = [](int signal) {
    // Only what a handler may call.
    [[maybe_unused]] const auto written =
        write(STDERR_FILENO, asked_last.data(), std::strlen(asked_last.data()));
    std::signal(signal, SIG_DFL);
    raise(signal);
  };
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) std::signal(signal, handler);
}

void remember(std::uint64_t seed, std::int64_t number, const fuzz::Relation& relation,
              const fuzz::Subject& mode) {
  const auto end = fmt::format_to_n(
      asked_last.data(), asked_last.size() - 1,
      "\nrasterbench: crashed in: fuzz --seed {} --first {} --cases 1 --relation {} --numeric {}\n", seed,
      number, relation.name, mode.info.name);
  *end.out = '\0';
}

struct FuzzArguments {
  fuzz::FuzzOptions options;
  std::vector<std::string> modes, kernels, relations;
  std::string out;
};

void complete(FuzzArguments& a) {
  for (const std::string& mode : a.modes) a.options.modes.push_back(fuzz::find_subject(mode));
  if (a.modes.empty()) a.options.modes.assign(fuzz::subjects().begin(), fuzz::subjects().end());
  for (const std::string& relation : a.relations)
    a.options.relations.push_back(&fuzz::find_relation(relation));
  if (a.relations.empty())
    for (const fuzz::Relation& relation : fuzz::relations()) a.options.relations.push_back(&relation);
  for (const std::string& kernel : a.kernels) find_kernel(kernel);
  a.options.kernels = a.kernels.empty() ? fuzz::listed_kernels() : a.kernels;
}

void make_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder))
    throw InputError({.file = folder, .field = "--out"}, error ? error.message() : "is not a folder");
}

/// Writes NAME.cpp, NAME.dat and NAME.txt.
void write_finding(const fuzz::Finding& finding, const FuzzArguments& a) {
  const auto stem = std::filesystem::path(a.out) / fuzz::test_name(finding, a.options.seed);
  write_file(std::filesystem::path(stem).concat(".cpp"), fuzz::as_test(finding, a.options));
  const bool exact = fuzz::write_pair(finding.minimal, stem);
  fmt::print("wrote {}.cpp, .dat and .txt{}\n", stem.string(),
             exact ? "" : "; the scene is the nearest that float32 world coordinates can say");
}

void print_report(const fuzz::FuzzReport& report) {
  fmt::print("\n{:<18}{:>10}{:>16}{:>10}  observed, not promised\n", "relation", "asked", "not applicable",
             "violated");
  for (const fuzz::Relation& relation : fuzz::relations()) {
    const auto found = report.tallies.find(relation.name);
    if (found == report.tallies.end()) continue;
    const fuzz::Tally& tally = found->second;
    std::string observed;
    for (const auto& [mode, count] : tally.observed)
      observed += fmt::format("{}{} {}", observed.empty() ? "" : ", ", mode, count);
    fmt::print("{:<18}{:>10}{:>16}{:>10}  {}\n", relation.name, tally.asked, tally.not_applicable,
               tally.violated, observed);
  }
  for (const fuzz::Finding& finding : report.findings)
    fmt::print("\n{} in {}, case {}, again in {}: {}", finding.relation->name, finding.mode,
               finding.case_number, finding.again, finding.what);
  fmt::print("\n{} cases in {:.1f} s, {} violated{}\n", report.cases, report.seconds, report.findings.size(),
             report.stopped ? "; interrupted" : "");
}

int fuzz_and_report(FuzzArguments& a) {
  complete(a);
  if (!a.out.empty()) make_folder(a.out);
  catch_interrupts();
  catch_crashes();
  Progress progress;
  fuzz::FuzzListener listener;
  listener.asking = [&](std::int64_t number, const fuzz::Relation& relation, const fuzz::Subject& mode) {
    remember(a.options.seed, number, relation, mode);
  };
  listener.stop = [] { return interrupted.load(); };
  listener.progress = [&](const fuzz::FuzzReport& report) {
    const double share = std::max(
        report.seconds / a.options.seconds,
        a.options.cases > 0 ? static_cast<double>(report.cases) / static_cast<double>(a.options.cases) : 0.0);
    progress.show("fuzz", share, 1,
                  fmt::format("{} cases, {:.0f} cases/s, {} violated", report.cases,
                              static_cast<double>(report.cases) / report.seconds, report.findings.size()));
  };
  listener.found = [&](const fuzz::Finding& finding) {
    progress.note(fmt::format("case {}: {} is violated in {}", finding.case_number, finding.relation->name,
                              finding.mode));
    fmt::print("{}\n", fuzz::as_test(finding, a.options));
    if (!a.out.empty()) write_finding(finding, a);
    std::fflush(stdout);
  };
  const fuzz::FuzzReport report = fuzz::run_fuzz(a.options, listener);
  print_report(report);
  return report.stopped ? kInterruptedExitCode : report.findings.empty() ? 0 : 1;
}

}  // namespace

void add_fuzz_command(CLI::App& app, Outcome& outcome) {
  CLI::App* command = app.add_subcommand(
      "fuzz", "look for cases in which numeric modes, kernels and references contradict each other");
  const auto a = std::make_shared<FuzzArguments>();
  command->add_option("--seconds", a->options.seconds, "begin no new case after this long")
      ->capture_default_str()
      ->check(number_check(0, kLongestSeconds));
  command->add_option("--cases", a->options.cases, "end after so many cases as well (default: no such limit)")
      ->check(whole_number_check(1));
  command->add_option("--first", a->options.first, "number of the first case")
      ->capture_default_str()
      ->check(whole_number_check(0));
  command->add_option("--seed", a->options.seed, "of the sequence of cases; the same seed, the same cases")
      ->capture_default_str()
      ->check(whole_number_check(0));
  command->add_option("--numeric", a->modes, "numeric mode; may be repeated (default: all)")
      ->allow_extra_args(false);
  command->add_option("--kernel", a->kernels, "kernel; may be repeated (default: all)")
      ->allow_extra_args(false);
  command
      ->add_option("--relation", a->relations, "relation of the list below; may be repeated (default: all)")
      ->allow_extra_args(false);
  command->add_option("--out", a->out, "folder for NAME.cpp, NAME.dat and NAME.txt of each violation");
  std::string list = "Relations:\n";
  for (const fuzz::Relation& relation : fuzz::relations())
    list += fmt::format("  {:<18}{}\n", relation.name, relation.meaning);
  command->footer(list + "Exit codes: 0 nothing violated, 1 something was, 2 bad usage, 130 interrupted.");
  command->callback([a, &outcome] { outcome.exit_code = fuzz_and_report(*a); });
}

}  // namespace rasterbench
