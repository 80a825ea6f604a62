#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "extremes/run.h"
#include "extremes/sweeps.h"
#include "harness/commands.h"
#include "harness/progress.h"
#include "scene/image.h"

namespace rasterbench {
namespace {

using extremes::Sweep;
using extremes::SweepPoint;

struct StabilityOptions {
  std::vector<std::string> numerics, sweeps;
  int steps = 0;  ///< 0: each sweep's own
  int threads = 0;
  std::string output = "stability.jsonl";
};

std::vector<Sweep> chosen_sweeps(const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const Sweep& sweep : extremes::sweeps()) known.push_back(sweep.name);
  for (const std::string& name : names) check_word(name, known, "--sweep");
  std::vector<Sweep> chosen;
  for (const Sweep& sweep : extremes::sweeps())
    if (names.empty() || std::find(names.begin(), names.end(), sweep.name) != names.end())
      chosen.push_back(sweep);
  return chosen;
}

std::vector<std::string_view> chosen_modes(const std::vector<std::string>& names) {
  std::vector<std::string_view> chosen;
  for (const std::string& name : names) {
    const ModeInfo& mode = available_mode(name, "--numeric");
    if (!mode.has_screen_triangles)
      throw InputError({.field = "--numeric"}, name + ": has no screen triangles to be judged on");
    if (std::find(chosen.begin(), chosen.end(), mode.name) == chosen.end()) chosen.push_back(mode.name);
  }
  if (chosen.empty())
    for (const ModeInfo& mode : mode_infos())
      if (mode.unavailable.empty() && mode.has_screen_triangles) chosen.push_back(mode.name);
  return chosen;
}

Json point_json(const Sweep& sweep, double value, const SweepPoint& point) {
  Json json{{"sweep", sweep.name}, {"parameter", value}, {"numeric", point.numeric}};
  json["pixels"] = point.pixels;
  json["drawn"] = point.drawn;
  json["wrong"] = point.wrong;
  json["unexplained"] = point.unexplained;
  json["worst_distance_px"] = point.worst_distance ? Json(*point.worst_distance) : Json();
  json["max_depth_error_steps"] = point.max_depth_error_steps;
  json["judge"] = sweep.by_truth ? "truth" : "oracle";
  return json;
}

/// Where each mode breaks down in each sweep.
class BreakingPoints {
 public:
  void add(const Sweep& sweep, double value, const SweepPoint& point) {
    Cell& cell = cells_[sweep.name][point.numeric];
    cell.unexplained += point.unexplained;
    if (point.is_broken() && !cell.first) cell.first = value;
  }

  void print(const std::vector<Sweep>& sweeps, const std::vector<std::string_view>& modes) const {
    fmt::print("first value with more than {:g} of the drawn pixels wrong; - = none\n{:<24}",
               extremes::kBrokenShare, "");
    for (const Sweep& sweep : sweeps) fmt::print("{:>16}", sweep.name);
    fmt::print("\n");
    for (const std::string_view mode : modes) {
      fmt::print("{:<24}", mode);
      for (const Sweep& sweep : sweeps) {
        const Cell& cell = cells_.at(sweep.name).at(mode);
        fmt::print("{:>16}", (cell.first ? fmt::format("{:.4g}", *cell.first) : "-") +
                                 (cell.unexplained > 0 ? "!" : ""));
      }
      fmt::print("\n");
    }
    for (const Sweep& sweep : sweeps)
      fmt::print("{:<16}{}, {:g} to {:g}; judged by the {}\n", sweep.name, sweep.parameter, sweep.first,
                 sweep.last, sweep.by_truth ? "end-to-end truth" : "exact oracle");
    fmt::print("! = somewhere beyond the mode's bound\n");
  }

 private:
  struct Cell {
    std::optional<double> first;
    std::int64_t unexplained = 0;
  };
  std::map<std::string, std::map<std::string_view, Cell>> cells_;
};

void run_stability(const StabilityOptions& options) {
  check_output_path(options.output);
  const std::vector<Sweep> sweeps = chosen_sweeps(options.sweeps);
  const std::vector<std::string_view> modes = chosen_modes(options.numerics);
  const int threads = options.threads > 0 ? options.threads : default_threads();
  if (threads > available_cpus())
    throw InputError({.field = "--threads"},
                     fmt::format("at most the {} CPUs of this process", available_cpus()));
  std::string lines;
  BreakingPoints breaking;
  {
    Progress progress;
    for (const Sweep& sweep : sweeps) {
      const auto values = extremes::parameter_values(sweep, options.steps > 0 ? options.steps : sweep.steps);
      for (std::size_t i = 0; i < values.size(); ++i) {
        progress.show(sweep.name, static_cast<double>(i), static_cast<double>(values.size()),
                      fmt::format("{:.4g}", values[i]));
        for (const SweepPoint& point : extremes::measure(sweep, values[i], modes, threads)) {
          lines += dump(point_json(sweep, values[i], point)) + "\n";
          breaking.add(sweep, values[i], point);
        }
      }
    }
  }
  write_file(options.output, lines);
  breaking.print(sweeps, modes);
  fmt::print("wrote {}\n", options.output);
}

}  // namespace

void add_stability_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "stability",
      "how far each numeric mode can be taken: sweeps of a scene's properties to their extremes");
  const auto options = std::make_shared<StabilityOptions>();
  command->add_option("--numeric", options->numerics, "numeric modes (default: all that this CPU runs)");
  command->add_option("--sweep", options->sweeps,
                      "near_far, translation, field_of_view, triangle_size, image_size (default: all)");
  command->add_option("--steps", options->steps, "values of each sweep (default: 8 to 18, each sweep's own)")
      ->check(CLI::Range(2, 1000));
  command->add_option("--threads", options->threads, "number of threads (default: all CPUs of this process)")
      ->check(CLI::Range(1, 65536));
  command->add_option("-o,--output", options->output, "one JSON object a line")->capture_default_str();
  command->callback([options] { run_stability(*options); });
}

}  // namespace rasterbench
