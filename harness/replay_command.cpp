#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <numeric>

#include "base/error.h"
#include "harness/commands.h"
#include "harness/option_checks.h"
#include "harness/replay.h"
#include "harness/statistics.h"

namespace rasterbench {
namespace {

constexpr int kMostThreads = 1024;
constexpr double kLongest = 600;  // seconds of one repetition

struct ReplayOptions {
  std::string costs, backend = "openmp", schedule = "dynamic";
  int chunk = 0, threads = 16, repetitions = 3;
  double scale = 0, seconds = 2;
  bool json = false;
};

ExecutionConfig execution_config(const ReplayOptions& options) {
  ExecutionConfig config;
  config.backend = options.backend;
  parse_schedule(options.schedule, "--schedule", config);
  if (options.chunk > 0 && config.chunk)
    throw InputError({.field = "--chunk"}, fmt::format("--schedule {} has one already", options.schedule));
  if (options.chunk > 0) config.chunk = options.chunk;
  config.threads = options.threads;
  find_schedule(config);
  return config;
}

/// "-3.1 %": how much longer was measured than simulated.
std::string error_text(double measured, double simulated) {
  return fmt::format("{:+.1f} %", 100 * (measured / simulated - 1));
}

Json measure(const ReplayOptions& options) {
  const ExecutionConfig config = execution_config(options);
  const CostsFile costs = read_costs(options.costs);
  const double total =
      1e-6 * std::accumulate(costs.microseconds.begin(), costs.microseconds.end(), 0.0);  // seconds
  if (!(total > 0)) throw InputError({.file = options.costs, .field = "cost_us"}, "every iteration costs 0");
  const double scale = options.scale > 0 ? options.scale : options.seconds * options.threads / total;
  const std::vector<double> sleeps = sleeps_of(costs, scale);
  const double shortest = std::accumulate(sleeps.begin(), sleeps.end(), 0.0) / options.threads;
  if (shortest > kLongest)
    throw InputError(
        {.field = "--scale"},
        fmt::format("a repetition would take {:.0f} s or more, {:.0f} s is the most", shortest, kLongest));
  const std::string runtime = config.backend == "openmp" ? openmp_runtime() : config.backend;
  const auto borders = chunk_borders(config, runtime, std::ssize(sleeps));
  const auto execution = make_execution(config);
  if (const int count = observe_threads(*execution).count; count < options.threads)
    throw Error(fmt::format("{} of {} threads ran", count, options.threads));
  // Starts the threads: their creation is no part of a schedule.
  replay(*execution, std::vector<double>(static_cast<std::size_t>(options.threads), 1e-3));

  Json result{
      {"costs", options.costs},
      {"execution", to_string(config)},
      {"threads", options.threads},
      {"runtime", runtime},
      {"unit", costs.unit},
      {"iterations", sleeps.size()},
      {"scale", scale},
      {"raised", std::count(sleeps.begin(), sleeps.end(), kShortestSleep)},
      {"chunks", borders.empty() ? Json() : Json(borders.size() - 1)},
      {"can_be_contradicted", can_be_contradicted(config, borders)},
      {"simulated_ms", borders.empty() ? Json() : Json(1e3 * simulated_seconds(config, borders, sleeps))},
      {"repetitions", Json::array()}};
  for (int r = 0; r < options.repetitions; ++r) {
    const Replay run = replay(*execution, sleeps);
    Json entry{{"measured_ms", 1e3 * run.seconds},
               {"from_slept_ms", nullptr},
               {"contradiction", nullptr},
               {"order_contradiction", nullptr}};
    if (!borders.empty()) {
      entry["from_slept_ms"] = 1e3 * simulated_seconds(config, borders, run.slept);
      if (const auto at = contradiction(config, borders, run.workers)) entry["contradiction"] = *at;
      if (const auto at = order_contradiction(config, borders, run)) entry["order_contradiction"] = *at;
    }
    entry["workers"] = run.workers;
    entry["started_ms"] = entry["slept_ms"] = Json::array();
    for (const double seconds : run.started) entry["started_ms"].push_back(1e3 * seconds);
    for (const double seconds : run.slept) entry["slept_ms"].push_back(1e3 * seconds);
    result["repetitions"].push_back(std::move(entry));
  }
  return result;
}

void print(const Json& result) {
  fmt::print(
      "{} iterations ({}s) as sleeps: {} on {} threads, {}; scale {:.4g}, {} sleeps raised to {:.0f} us\n",
      result.at("iterations").get<int>(), result.at("unit").get<std::string>(),
      result.at("execution").get<std::string>(), result.at("threads").get<int>(),
      result.at("runtime").get<std::string>(), result.at("scale").get<double>(),
      result.at("raised").get<int>(), 1e6 * kShortestSleep);
  const bool has_model = !result.at("simulated_ms").is_null();
  std::vector<double> measured, from_slept;
  for (const Json& run : result.at("repetitions")) {
    measured.push_back(run.at("measured_ms").get<double>());
    if (has_model) from_slept.push_back(run.at("from_slept_ms").get<double>() / measured.back());
  }
  const double middle = median(measured);
  fmt::print("measured    {:.2f} ms (median of {})\n", middle, measured.size());
  if (!has_model) {
    fmt::print("simulated   by `python3 -m analysis whatif --replay` alone: this program has no rule of {}\n",
               result.at("execution").get<std::string>());
    return;
  }
  const double simulated = result.at("simulated_ms").get<double>();
  fmt::print("simulated   {:.2f} ms; measured is {} of it\n", simulated, error_text(middle, simulated));
  fmt::print(
      "            from the durations that were really slept: measured is {} of it (median); what is left is "
      "the "
      "schedule's\n",
      error_text(1, median(from_slept)));
  for (const Json& run : result.at("repetitions"))
    for (const auto& [key, what] :
         {std::pair{"contradiction", "the rule"}, {"order_contradiction", "the order"}})
      if (!run.at(key).is_null())
        fmt::print("contradicts {} of {} at iteration {}\n", what, result.at("runtime").get<std::string>(),
                   run.at(key).get<std::int64_t>());
  if (!result.at("can_be_contradicted").get<bool>())
    fmt::print("who ran what cannot contradict the rule here: only the order of the starts was checked\n");
  fmt::print("chunks      {}; see analysis/schedule_model.py for the rules\n",
             result.at("chunks").get<int>());
}

}  // namespace

void add_replay_command(CLI::App& app, Outcome& outcome) {
  CLI::App* command =
      app.add_subcommand("replay", "sleep a loop's traced costs in the real runtime, beside its simulation");
  const auto options = std::make_shared<ReplayOptions>();
  command->add_option("COSTS", options->costs, "costs.json, as `trace --costs` writes it")->required();
  command->add_option("--backend", options->backend, "see `list backends`")->capture_default_str();
  command->add_option("--schedule", options->schedule, "KIND[,CHUNK]; see `list schedules`")
      ->capture_default_str();
  command->add_option("--chunk", options->chunk, "chunk or grain in iterations (default: the schedule's own)")
      ->check(whole_number_check(1, 1 << 30));
  command->add_option("--threads", options->threads, "threads; more than CPUs may be, since they sleep")
      ->capture_default_str()
      ->check(whole_number_check(1, kMostThreads));
  command->add_option("--scale", options->scale, "sleep over cost (default: what --seconds needs)")
      ->check(number_check(1e-6, 1e9));
  command->add_option("--seconds", options->seconds, "of a repetition if threads shared its sleeps evenly")
      ->capture_default_str()
      ->check(number_check(1e-3, kLongest));
  command->add_option("--repetitions", options->repetitions, "of the loop")
      ->capture_default_str()
      ->check(whole_number_check(1, 1000));
  command->add_flag("--json", options->json, "one JSON object in place of the text");
  command->footer(
      "No sleep is shorter than 200 us. Exit code 1: a run contradicts the rule of its runtime, or its "
      "order.");
  command->callback([options, &outcome] {
    const Json result = measure(*options);
    if (options->json)
      fmt::print("{}\n", dump(result));
    else
      print(result);
    for (const Json& run : result.at("repetitions"))
      if (!run.at("contradiction").is_null() || !run.at("order_contradiction").is_null())
        outcome.exit_code = 1;
  });
}

}  // namespace rasterbench
