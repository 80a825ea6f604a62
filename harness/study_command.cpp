#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "base/error.h"
#include "base/hash.h"
#include "base/suggest.h"
#include "harness/commands.h"
#include "harness/context.h"
#include "harness/coordinator.h"
#include "harness/option_checks.h"
#include "harness/plan_forecast.h"
#include "harness/run.h"
#include "harness/runner.h"
#include "scene/image.h"

namespace rasterbench {
namespace {

struct StudyArguments {
  std::string file, out, filter, shard, family, isa;
  std::vector<std::string> scenes, sizes;
  bool resume = false, replace = false, dry_run = false, list = false, json = false, oversubscribe = false;
  double time_limit = -1, noise = -1;
  int cpus = 0;
};

std::regex parse_regex(const std::string& text, const std::string& field) {
  try {
    return std::regex(text);
  } catch (const std::regex_error& error) {
    throw InputError({.field = field},
                     fmt::format("'{}' is not a regular expression: {}", text, error.what()));
  }
}

int positive_integer(std::string_view text, const std::string& field) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 1)
    throw InputError({.field = field}, fmt::format("'{}' is not a whole number from 1", text));
  return value;
}

void parse_shard(const std::string& text, StudyOptions& options) {
  const auto slash = text.find('/');
  if (slash == std::string::npos)
    throw InputError({.field = "--shard"}, fmt::format("'{}' is not I/N", text));
  options.shard = positive_integer(std::string_view(text).substr(0, slash), "--shard");
  options.shards = positive_integer(std::string_view(text).substr(slash + 1), "--shard");
  if (options.shard > options.shards)
    throw InputError({.field = "--shard"}, fmt::format("{} is beyond {}", options.shard, options.shards));
}

std::map<std::string, std::string> parse_context(const std::string& text) {
  std::map<std::string, std::string> custom;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string pair = text.substr(begin, end - begin);
    const auto equals = pair.find('=');
    if (equals == std::string::npos)
      throw InputError({.field = "--benchmark_context"}, fmt::format("'{}' is not KEY=VALUE", pair));
    try {
      (void)Json(pair).dump();
    } catch (const Json::exception&) {
      throw InputError({.field = "--benchmark_context"}, "is not UTF-8");
    }
    custom[pair.substr(0, equals)] = pair.substr(equals + 1);
    begin = end + 1;
  }
  return custom;
}

/// Sorts Google Benchmark's options: what steers order, stopping and output is the harness's here and is
/// translated; the rest goes to the library in the runner processes.
void apply_benchmark_flags(const std::vector<std::string>& flags, StudyArguments& arguments, Study* study,
                           CoordinatorOptions& coordinator) {
  static const std::vector<std::string> kTranslated{
      "benchmark_filter",      "benchmark_list_tests",
      "benchmark_repetitions", "benchmark_out",
      "benchmark_out_format",  "benchmark_context",
      "benchmark_format",      "benchmark_enable_random_interleaving"};
  static const std::vector<std::string> kPassed{"benchmark_perf_counters",
                                                "benchmark_min_time",
                                                "benchmark_min_warmup_time",
                                                "benchmark_time_unit",
                                                "benchmark_color",
                                                "benchmark_counters_tabular",
                                                "benchmark_report_aggregates_only",
                                                "benchmark_display_aggregates_only"};
  for (const std::string& flag : flags) {
    const auto equals = flag.find('=');
    const std::string name = flag.substr(2, equals == std::string::npos ? equals : equals - 2);
    const std::string value = equals == std::string::npos ? "true" : flag.substr(equals + 1);
    const std::string field = "--" + name;
    const auto one_of = [&](std::vector<std::string> known) {
      check_word(value, known, field);
      return value;
    };
    if (name == "benchmark_filter") {
      arguments.filter = value;
    } else if (name == "benchmark_list_tests") {
      arguments.list = one_of({"true", "false"}) == "true";
    } else if (name == "benchmark_repetitions") {
      const int n = positive_integer(value, field);
      if (study) {
        study->sampling.min_samples = study->sampling.max_samples = n;
        study->sampling.target = 0;
      }
    } else if (name == "benchmark_out") {
      check_output_path(value);
      coordinator.benchmark_out = value;
    } else if (name == "benchmark_out_format") {
      coordinator.benchmark_out_format = one_of({"json", "csv", "console"});
    } else if (name == "benchmark_format") {
      coordinator.benchmark_format = one_of({"json", "csv", "console"});
    } else if (name == "benchmark_context") {
      coordinator.custom_context = parse_context(value);
    } else if (name == "benchmark_enable_random_interleaving") {
      if (one_of({"true", "false"}) == "false")
        throw InputError({.field = field},
                         "a study always interleaves at random: drift must hit all points alike");
    } else if (std::find(kPassed.begin(), kPassed.end(), name) != kPassed.end()) {
      if (!study) coordinator.benchmark_flags.push_back(flag);
    } else {
      std::vector<std::string> known = kTranslated;
      known.insert(known.end(), kPassed.begin(), kPassed.end());
      throw InputError({.field = field}, unknown_name("option", name, known));
    }
  }
}

void print_plan(const Study& study, bool names_only) {
  if (names_only) {
    for (const PlannedPoint& planned : study.points) fmt::print("{}\n", planned.name);
    return;
  }
  std::size_t skipped = 0;
  std::set<Environment> environments;
  for (const PlannedPoint& planned : study.points) {
    fmt::print("{}{}\n", planned.name, planned.skip.empty() ? "" : "  skipped: " + planned.skip);
    skipped += !planned.skip.empty();
    environments.insert(planned.point.environment);
  }
  const SamplingPlan& s = study.sampling;
  fmt::print("\n{}: {} points, {} to run, {} skipped; {} runner process{} in {} environment{}\n", study.name,
             study.points.size(), study.points.size() - skipped, skipped,
             environments.size() * static_cast<std::size_t>(s.launches),
             environments.size() * static_cast<std::size_t>(s.launches) == 1 ? "" : "es", environments.size(),
             environments.size() == 1 ? "" : "s");
  fmt::print(
      "samples a point: {} to {}, until half the 95 % interval is within {:g} % of the median; {}\n",
      s.min_samples, s.max_samples, s.target * 100,
      s.time_limit > 0 ? fmt::format("at most {:g} s in all", s.time_limit) : std::string("no time limit"));
}

/// The threads of the largest point that will run.
int most_threads(const std::vector<PlannedPoint>& points) {
  int most = 1;
  for (const PlannedPoint& planned : points)
    if (planned.skip.empty()) most = std::max(most, planned.point.execution.threads);
  return most;
}

/// The plan as one object, by family: what a job array is made of (records.md).
void print_plan_as_json(const Study& study, const StudyOptions& options) {
  std::map<std::size_t, Study> families;
  for (const PlannedPoint& planned : study.points) {
    Study& family = families[planned.family];
    family.name = study.name;
    family.seed = study.seed;
    family.sampling = study.sampling;
    family.hashes = study.hashes;
    family.families = study.families;
    family.points.push_back(planned);
  }
  Json plan;
  plan["schema"] = 1;
  plan["study"] = study.name;
  plan["file"] = study.file;
  plan["hash"] = hash_bytes(study.text);
  plan["build_id"] = build_id();
  plan["cpus"] = options.cpus.value_or(available_cpus());
  plan["isa"] = to_string(options.isa.value_or(best_isa()));
  plan["families"] = Json::array();
  for (const auto& [number, family] : families) {
    const std::vector<PointState> states = initial_states(family, plan["build_id"]);
    Json points = Json::array();
    for (const PointState& state : states)
      points.push_back({{"id", state.id},
                        {"name", state.planned->name},
                        {"threads", state.planned->point.execution.threads},
                        {"skip", state.skip.empty() ? Json() : Json(state.skip)}});
    plan["families"].push_back({{"id", family_id(family, states)},
                                {"shard", fmt::format("{}/{}", number + 1, study.families)},
                                {"threads", most_threads(family.points)},
                                {"points", points}});
  }
  fmt::print("{}\n", dump(plan, 1));
}

/// What was planned for another machine must be what this one can run: a job that was given too few CPUs, or
/// a lesser CPU, would skip its points and call them done.
void check_target(const Study& study, const StudyOptions& options, const std::string& family) {
  if (options.isa && !is_supported(*options.isa))
    throw InputError({.field = "--isa"}, fmt::format("this CPU has no {}", to_string(*options.isa)));
  if (const int needed = most_threads(study.points);
      options.cpus && needed > available_cpus() && !options.oversubscribe)
    throw InputError(
        {.field = "--cpus"},
        fmt::format("{} threads are planned and this process may use {} CPU{}: needs --oversubscribe", needed,
                    available_cpus(), available_cpus() == 1 ? "" : "s"));
  if (family.empty() || study.points.empty()) return;
  if (const std::string id = family_id(study, initial_states(study, build_id())); id != family)
    throw InputError({.field = "--family"},
                     fmt::format("this is {}: the study, a scene, the program or its options are not those "
                                 "that {} was planned with",
                                 id, family));
}

}  // namespace

void add_study_command(CLI::App& app, Outcome& outcome, const std::vector<std::string>& benchmark_flags) {
  CLI::App* command = app.add_subcommand("study", "run a study: verify and time every point, write records");
  const auto a = std::make_shared<StudyArguments>();
  command->add_option("FILE", a->file, "study file (TOML)")->required();
  command->add_option("--out", a->out, "folder of the results (default: results/NAME)");
  command
      ->add_option("--scene", a->scenes, "MODEL[@SCENE.txt] in place of the study's scenes; may be repeated")

      ->allow_extra_args(false);
  command
      ->add_option("--size", a->sizes, "WxH in place of the study's sizes; may be repeated")

      ->allow_extra_args(false);
  command->add_option("--shard", a->shard, "I/N: only the I-th of N parts; what is compared stays together");
  command->add_option("--family", a->family,
                      "refuse to run unless the shard is this family of --list --json, and nothing else");
  command
      ->add_option("--cpus", a->cpus, "plan for N CPUs: what \"max\" means (default: those of this process)")
      ->check(number_check(1, 65536));
  command->add_option("--isa", a->isa,
                      "plan for this instruction set: what \"best\" means (default: this CPU's)");
  command->add_flag("--resume", a->resume, "continue an interrupted study from its journal");
  command
      ->add_flag("--replace", a->replace,
                 "start afresh; the old folder is kept as DIR.previous, DIR.previous-2, ...")
      ->excludes("--resume");
  const auto dry_run = command->add_flag(
      "--dry-run", a->dry_run,
      "print the points, what would be skipped, what each hypothesis can detect and the cost in minutes; run "
      "nothing");
  command
      ->add_option(
          "--noise", a->noise,
          fmt::format("with --dry-run: standard deviation of a sample, as a share of its time, where no "
                      "finished run in the --out folder tells (default: {:g})",
                      kAssumedNoise))
      ->check(number_check(1e-6, 10))
      ->needs(dry_run);
  command->add_flag("--list", a->list, "print the names of the points only");
  command->add_flag("--json", a->json, "with --list: the families of the study and the ids of their points")
      ->needs("--list");
  command->add_option("--filter", a->filter,
                      "only points whose name this regular expression matches; -REGEX: does not match");
  command
      ->add_option("--time-limit", a->time_limit,
                   "seconds for the whole study; 0: none (default: the study's)")
      ->check(number_check(0, kLongestSeconds));
  command->add_flag("--oversubscribe", a->oversubscribe, "allow more threads than CPUs");
  command->footer(
      "Google Benchmark's options (--benchmark_filter, _list_tests, _repetitions, _out, _out_format, "
      "_format, _context,\n"
      "_perf_counters, ...) are understood as well.");
  command->callback([a, &outcome, &benchmark_flags] {
    CoordinatorOptions coordinator;
    apply_benchmark_flags(benchmark_flags, *a, nullptr, coordinator);
    StudyOptions options;
    options.scenes = a->scenes;
    options.sizes = a->sizes;
    options.oversubscribe = a->oversubscribe;
    if (a->time_limit >= 0) options.time_limit = a->time_limit;
    if (a->cpus > 0) options.cpus = a->cpus;
    if (!a->isa.empty()) options.isa = parse_isa(a->isa, "--isa");
    if (!a->shard.empty()) parse_shard(a->shard, options);
    if (!a->filter.empty()) {
      options.filter_excludes = a->filter.front() == '-';  // as in Google Benchmark
      options.filter = parse_regex(a->filter.substr(options.filter_excludes), "--filter");
    }
    Study study = read_study(a->file, options);
    apply_benchmark_flags(benchmark_flags, *a, &study, coordinator);
    if (a->json) return print_plan_as_json(study, options);
    coordinator.out = a->out.empty() ? "results/" + study.name : a->out;
    if (a->list || a->dry_run) {
      print_plan(study, a->list);
      if (!a->list)
        fmt::print("{}", forecast(study, read_earlier_run(coordinator.out),
                                  a->noise > 0 ? std::optional(a->noise) : std::nullopt));
      return;
    }
    check_target(study, options, a->family);
    if (!coordinator.out.has_filename()) coordinator.out = coordinator.out.parent_path();  // DIR/ means DIR
    if (std::filesystem::exists(coordinator.out) && a->replace)
      coordinator.out =
          std::filesystem::canonical(coordinator.out);  // what a link points to is what is replaced
    coordinator.resume = a->resume;
    coordinator.replace = a->replace;
    outcome.exit_code = run_study(study, options, coordinator);
  });
}

void add_runner_command(CLI::App& app, Outcome& outcome, const std::vector<std::string>& benchmark_flags) {
  CLI::App* command = app.add_subcommand("runner", "serve a study's coordinator on stdin and stdout");
  command->group("");  // hidden: started by `study` only
  command->callback([&] { outcome.exit_code = run_runner(benchmark_flags); });
}

}  // namespace rasterbench
