#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <map>

#include "base/error.h"
#include "harness/commands.h"
#include "harness/explain_point.h"
#include "harness/option_checks.h"
#include "harness/process.h"
#include "harness/runner.h"
#include "harness/study.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

constexpr int kFewestSamples = 6;  // below, no interval exists
constexpr double kTimeout = 3600;  // seconds for a point of a study; a hang, not a slow point, takes longer

struct ExplainOptions {
  std::string model, scene_file, point;
  int samples = 11;
  bool json = false;
};

bool is_study(const std::string& model) { return std::filesystem::path(model).extension() == ".toml"; }

/// The point of `render`'s options, explained in this process and in the environment that it has.
Json explain_model(const ExplainOptions& options, const DrawOptions& draw_options) {
  Point point = point_of(draw_options, options.model, options.scene_file);
  find_schedule(point.execution);
  const Scene scene = open_point_scene(point);
  return explain_point(point, scene, options.samples);
}

const PlannedPoint& only_point(const Study& study, const std::string& pattern) {
  if (study.points.size() == 1) return study.points.front();
  constexpr std::size_t kShown = 3;
  std::string names;
  for (std::size_t i = 0; i < std::min(kShown, study.points.size()); ++i)
    names += (i == 0 ? ": " : ", ") + study.points[i].name;
  if (study.points.size() > kShown) names += ", ...";
  throw InputError({.file = study.file, .field = "--point"},
                   fmt::format("'{}' matches {} points, not one{}", pattern, study.points.size(), names));
}

/// A point of a study, explained in a process of the environment that the study gives it.
Json explain_study(const ExplainOptions& options) {
  StudyOptions chosen;
  try {
    chosen.filter = std::regex(options.point);
  } catch (const std::regex_error& error) {
    throw InputError({.field = "--point"},
                     fmt::format("'{}' is not a regular expression: {}", options.point, error.what()));
  }
  const Study study = read_study(options.model, chosen);
  const PlannedPoint& planned = only_point(study, options.point);
  if (!planned.skip.empty())
    throw InputError({.file = study.file, .field = planned.name}, "is skipped: " + planned.skip);
  if (is_peer(planned.point))
    throw InputError({.file = study.file, .field = planned.name}, "is a peer: its frame has no stages");
  if (planned.point.cache != "warm")
    throw InputError({.file = study.file, .field = planned.name},
                     "has cold caches: the frames that are explained are warm");
  Process runner({"runner"}, environment_variables(planned.point.environment));
  return runner.ask(
      {{"op", "explain"}, {"point", point_to_json(planned.point)}, {"samples", options.samples}}, kTimeout);
}

/// "12.345", or a dash where there is none.
std::string number(const Json& value, int digits = 3) {
  return value.is_null() ? "-" : fmt::format("{:.{}f}", value.get<double>(), digits);
}

std::string whole(const Json& value) {
  return value.is_null() ? "-" : fmt::format("{}", value.get<std::int64_t>());
}

std::string interval(const Json& timed) {
  const Json& ends = timed.at("interval_ms");
  return ends.is_null() ? "-" : fmt::format("[{}, {}]", number(ends.at(0)), number(ends.at(1)));
}

std::string megabytes(const Json& bytes) { return fmt::format("{:.2f}", bytes.get<double>() / 1e6); }

void print_times(const Json& e) {
  fmt::print("{}\nmedian {} ms, 95 % interval {}, of {} frames; {} times the floor of {} ms\n\n",
             e.at("point").get<std::string>(), number(e.at("median_ms")), interval(e),
             e.at("samples").get<int>(), number(e.at("times_floor"), 2), number(e.at("floor_ms")));
  fmt::print("{:<10}{:>11}{:>22}{:>8}{:>11}{:>11}{:>11}{:>8}\n", "stage", "median ms", "95 % interval", "%",
             "MB read", "MB written", "floor ms", "GB/s");
  for (const auto& [name, stage] : e.at("stages").items()) {
    if (stage.is_null()) {
      fmt::print("{:<10}{:>11}\n", name, "none");
      continue;
    }
    const Json& bytes = stage.at("bytes");
    fmt::print("{:<10}{:>11}{:>22}{:>8.1f}{:>11}{:>11}{:>11}{:>8}\n", name, number(stage.at("median_ms")),
               interval(stage), 100 * stage.at("share").get<double>(),
               bytes.is_null() ? "-" : megabytes(bytes.at("read")),
               bytes.is_null() ? "-" : megabytes(bytes.at("written")), number(stage.at("floor_ms")),
               number(stage.at("gb_per_s"), 1));
  }
  const Json& rates = e.at("rates");
  if (rates.at("read").is_string())
    fmt::print("no floors: {}\n", rates.at("read").get<std::string>());
  else
    fmt::print(
        "bytes: each element of an array that a stage reads or writes, once; floors at the best measured "
        "rates of {} and {} GB/s (read, streaming write)\n",
        number(rates.at("read").at("best"), 1), number(rates.at("streaming_write").at("best"), 1));
  const Json& loop = e.at("raster_loop");
  std::string busy;
  for (const Json& ms : loop.at("busy_ms")) busy += (busy.empty() ? "" : ", ") + number(ms);
  fmt::print(
      "raster stage: busy {} ms a thread, longest over mean {}; waiting for the longest {} ms; serial "
      "parts, barriers and starts {} ms\n",
      busy, number(loop.at("longest_over_mean"), 2), number(loop.at("imbalance_ms")),
      number(loop.at("serial_ms")));
  if (loop.at("contended_locks") != 0.0)
    fmt::print("locks: {} a frame were held by another thread, {} ms of thread time until they were free\n",
               number(loop.at("contended_locks"), 0), number(loop.at("lock_wait_ms")));
  if (loop.at("failed_exchanges") != 0.0)
    fmt::print("atomics: {} compare-exchanges a frame found the key of another thread\n",
               number(loop.at("failed_exchanges"), 0));
}

void print_counters(const Json& e) {
  const Json& g = e.at("geometry");
  std::string rejected;
  for (const auto& [test, count] : g.at("rejected").items())
    if (count != 0) rejected += fmt::format(", {} {}", whole(count), test);
  fmt::print(
      "\ntriangles: {}, {} drawn as {} pieces, {} cut at the near plane, {} at the guard band; rejected: "
      "{}\n",
      whole(g.at("triangles")), whole(g.at("drawn")), whole(g.at("pieces")), whole(g.at("near_clipped")),
      whole(g.at("guard_clipped")), rejected.empty() ? "none" : rejected.substr(2));
  const Json& c = e.at("counted");
  if (const Json& sizes = c.at("sizes"); !sizes.is_null()) {
    fmt::print("pieces by the longer side of their box in pixels:");
    const char* separator = " ";
    for (const auto& [size, count] : sizes.items()) {
      const std::string label = size.starts_with("side_") ? "<= " + size.substr(5)
                                : size == "larger"        ? "larger"
                                                          : "no sample";
      fmt::print("{}{} {}", std::exchange(separator, ", "), label, whole(count));
    }
    fmt::print("\n");
  }
  const Json& specification = e.at("specification");
  fmt::print("samples of any kernel of this mode: {} in the boxes, {} inside\n",
             whole(specification.at("samples_in_boxes")), whole(specification.at("samples_inside")));
  if (!c.at("fragments_tested").is_null())
    fmt::print("samples of this one: {} tested, {} tests of single edges, {} depths and keys\n",
               whole(c.at("fragments_tested")), whole(c.at("edge_tests")), whole(c.at("fragments_passed")));
  if (!c.at("covered_pixels").is_null())
    fmt::print("pixels covered: {}, triangles visible: {}\n", whole(c.at("covered_pixels")),
               whole(c.at("visible_triangles")));
  if (!c.at("bin_entries").is_null())
    fmt::print("bins: {} cells, {} touched, {} entries\n", whole(c.at("tiles")), whole(c.at("tiles_touched")),
               whole(c.at("bin_entries")));
  if (!c.at("hidden_entries").is_null())
    fmt::print(
        "of these entries {} hidden and left out; {} fragments of tiny triangles in place of triangles\n",
        whole(c.at("hidden_entries")), whole(c.at("binned_fragments")));
  if (!c.at("merges").is_null()) fmt::print("keys merged from private buffers: {}\n", whole(c.at("merges")));
}

void print_hardware(const Json& e) {
  const Json& hardware = e.at("hardware");
  fmt::print("\nhardware counters of one frame, user space:");
  std::map<std::string, std::string> missing;  // events by reason
  for (const auto& [event, reason] : hardware.at("unavailable").items()) {
    std::string& events = missing[reason.get<std::string>()];
    events += (events.empty() ? "" : ", ") + event;
  }
  if (hardware.at("per_thread").empty()) fmt::print(" none\n");
  int thread = 0;
  for (const Json& counts : hardware.at("per_thread")) {
    fmt::print("{}  thread {}:", thread == 0 ? "\n" : "", thread);
    ++thread;
    for (const auto& [event, count] : counts.items())
      if (!count.is_null()) fmt::print(" {} {}", event, whole(count));
    fmt::print("\n");
  }
  for (const auto& [event, share] : hardware.at("least_share").items())
    if (share.get<double>() < 1)
      fmt::print("  {} was counted in {:.0f} % of the time and is scaled\n", event,
                 100 * share.get<double>());
  for (const auto& [reason, events] : missing) fmt::print("  unavailable: {}: {}\n", events, reason);
  const Json& rates = e.at("hardware_rates");
  if (!rates.at("instructions_per_cycle").is_null())
    fmt::print("  {} instructions per cycle\n", number(rates.at("instructions_per_cycle"), 2));
  for (const char* unit : {"per_triangle", "per_fragment"}) {
    std::string line;
    for (const auto& [event, rate] : rates.at(unit).items())
      if (!rate.is_null()) line += fmt::format("{} {} {}", line.empty() ? "" : ",", number(rate), event);
    if (!line.empty())
      fmt::print("  {}:{}\n", unit == std::string("per_triangle") ? "a triangle" : "a fragment", line);
  }
}

void print_ladder(const Json& e) {
  const Json& ladder = e.at("cost_ladder");
  if (ladder.is_string()) {
    fmt::print("\ncost ladder: {}\n", ladder.get<std::string>());
    return;
  }
  fmt::print(
      "\ncost ladder: the front part of a frame up to each step, threads: {}, {}, medians of {}; set-up, "
      "coverage and "
      "keys one at a time, not in vectors\n"
      "{:<11}{:>11}{:>22}{:>11}{:>9}{:>12}  {}\n",
      ladder.at("threads").get<int>(), ladder.at("numeric").get<std::string>(),
      ladder.at("repetitions").get<int>(), "up to", "median ms", "95 % interval", "step ms", "x floor",
      "results", "the step");
  for (const Json& rung : ladder.at("rungs"))
    fmt::print("{:<11}{:>11}{:>22}{:>11}{:>9}{:>12}  {}\n",
               (rung.at("rung") == "read" ? "" : "+ ") + rung.at("rung").get<std::string>(),
               number(rung.at("median_ms")), interval(rung), number(rung.at("step_ms")),
               number(rung.at("times_floor"), 2), whole(rung.at("results")),
               rung.at("unit").get<std::string>() + ": " + rung.at("meaning").get<std::string>());
}

void print_explanation(const Json& e) {
  print_times(e);
  print_counters(e);
  print_hardware(e);
  print_ladder(e);
  const Json& bound = e.at("bound");
  fmt::print("\nbound: {}: {}. Compared: {}.", bound.at("name").get<std::string>(),
             bound.at("text").get<std::string>(), bound.at("measures").get<std::string>());
  if (const Json& step = bound.at("largest_step"); !step.is_null())
    fmt::print(" The largest step of the cost ladder is {}.", step.get<std::string>());
  if (const Json& caution = bound.at("caution"); !caution.is_null())
    fmt::print(" Caution: {}.", caution.get<std::string>());
  fmt::print("\n");
}

}  // namespace

void add_explain_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("explain", "where the time of a point goes, and which bound holds");
  const auto options = std::make_shared<ExplainOptions>();
  const auto draw_options = std::make_shared<DrawOptions>();
  command
      ->add_option("MODEL", options->model,
                   "a .dat file, a generator such as teapot:triangles=43000, or a study file (.toml)")
      ->required();
  command->add_option("SCENE", options->scene_file,
                      "scene parameter file (default: a camera that shows the model)");
  add_point_options(*command, *draw_options);
  const std::vector<CLI::Option*> of_point = command->get_options([](const CLI::Option* option) {
    return option->get_name() != "--help" && option->get_name() != "MODEL";
  });
  command->add_option("--point", options->point,
                      "regular expression that the name of one point of the study matches");
  command->add_option("--samples", options->samples, "timed frames, and repetitions of the cost ladder")
      ->capture_default_str()
      ->check(whole_number_check(kFewestSamples, 10000));
  command->add_flag("--json", options->json, "one JSON object in place of the tables");
  command->callback([=] {
    const bool study = is_study(options->model);
    if (!study && !options->point.empty())
      throw InputError({.field = "--point"},
                       fmt::format("goes with a study file (.toml), not with {}", options->model));
    if (study)
      for (const CLI::Option* option : of_point)
        if (option->count() > 0)
          throw InputError({.field = option->get_name()}, "goes with a MODEL: a study has points of its own");
    const Json explained = study ? explain_study(*options) : explain_model(*options, *draw_options);
    if (options->json)
      fmt::print("{}\n", dump(explained, 2));
    else
      print_explanation(explained);
  });
}

}  // namespace rasterbench
