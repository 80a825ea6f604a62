// rasterbench: the command line.
#include <fmt/format.h>

#include <string>
#include <vector>

#include "base/error.h"
#include "base/suggest.h"
#include "build_info.h"
#include "harness/commands.h"

namespace {

int run(int argc, char** argv) {
  using namespace rasterbench;
  CLI::App app("rasterbench: parallel strategies for triangle rasterization on CPUs, compared",
               "rasterbench");
  const std::string version = fmt::format("rasterbench {} ({})", build_info::kVersion, build_info::kCommit);
  app.set_version_flag("--version", version);
  app.require_subcommand(1);
  app.set_help_all_flag("--help-all", "the options of all subcommands");

  // Google Benchmark's options have their own syntax and their own parser.
  std::vector<std::string> arguments, benchmark_flags;
  for (int i = argc - 1; i > 0; --i) {  // CLI11 takes them in reverse
    const std::string argument(argv[i]);
    if (argument.starts_with("--benchmark_"))
      benchmark_flags.insert(benchmark_flags.begin(), argument);
    else
      arguments.push_back(argument);
  }

  Outcome outcome;
  add_render_command(app);
  add_study_command(app, outcome, benchmark_flags);
  add_verify_command(app, outcome);
  add_explain_command(app);
  add_list_command(app);
  add_scene_command(app);
  add_advise_command(app, outcome);
  add_adopt_command(app, outcome);
  add_extremes_command(app, outcome);
  add_fuzz_command(app, outcome);
  add_stability_command(app);
  add_machine_command(app);
  add_selftest_command(app, outcome);
  add_trace_command(app);
  add_replay_command(app, outcome);
  add_runner_command(app, outcome, benchmark_flags);
  for (CLI::App* command : app.get_subcommands({})) command->set_version_flag("--version", version);
  if (!benchmark_flags.empty() && argc > 1 && argv[1] != std::string_view("study") &&
      argv[1] != std::string_view("runner"))
    throw InputError({.field = benchmark_flags.front()}, "goes with the command study");
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::vector<std::string> known;
    for (const CLI::App* command :
         app.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); }))
      known.push_back(command->get_name());
    if (app.get_subcommands().empty() && argc > 1 && argv[1][0] != '-')
      throw InputError(unknown_name("command", argv[1], known));
    throw InputError(std::string(error.what()) + "; see --help");
  }
  return outcome.exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  return rasterbench::guarded_main("rasterbench", [&] { return run(argc, argv); });
}
