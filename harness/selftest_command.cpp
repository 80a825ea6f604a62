#include <fmt/format.h>

#include <fstream>
#include <map>
#include <memory>
#include <optional>

#include "base/error.h"
#include "execution/execution.h"
#include "harness/commands.h"
#include "harness/option_checks.h"
#include "harness/process.h"
#include "harness/progress.h"
#include "harness/run.h"
#include "harness/runner.h"
#include "harness/selftest.h"
#include "harness/statistics.h"
#include "scene/image.h"

namespace rasterbench {
namespace {

constexpr double kTimeout =
    3600;  // seconds for an answer of a runner; a hang, not a slow point, takes longer
constexpr double kStatedRate = 0.05;  // what intervals of 95 % promise

struct SelftestOptions {
  std::string model = "teapot:triangles=3000", scene_file, output;
  int comparisons = 100;
  std::uint64_t seed = 1;
  bool json = false;
  SamplingPlan sampling = {.min_samples = 10, .launches = 5};
};

/// The processes of one comparison: each is a launch, with a memory layout of its own.
class Launches {
 public:
  explicit Launches(const Point& point) : point_(point) {}

  Json ask(int launch, Json request) {
    auto& process = processes_[launch];
    if (!process)
      process = std::make_unique<Process>(std::vector<std::string>{"runner"},
                                          environment_variables(point_.environment));
    // Threads that wait actively must not disturb another launch's samples.
    if (running_ != process.get() && running_) running_->pause();
    running_ = process.get();
    running_->resume();
    request["point"] = point_to_json(point_);
    return running_->ask(request, kTimeout);
  }

 private:
  const Point& point_;
  std::map<int, std::unique_ptr<Process>> processes_;
  Process* running_ = nullptr;
};

/// Checks that the point conforms before it is timed; its frames per sample.
int verified_frames(const Point& point) {
  const Json judgement = Launches(point).ask(0, {{"op", "verify"}});
  if (!judgement.at("failure").is_null())
    throw Error("the point is not timed: " + judgement.at("failure").get<std::string>());
  return frames_per_sample(judgement.at("frame_ms"));
}

SelfComparison compare(const Point& point, const SelftestOptions& options, int frames, int index) {
  Launches launches(point);
  return compare_with_itself(
      options.sampling, options.seed * 1000003 + static_cast<std::uint64_t>(index), frames,
      [&](int label, int block) {
        return launches
            .ask(block % options.sampling.launches,
                 {{"op", "sample"}, {"name", label == 0 ? "a" : "b"}, {"frames", frames}})
            .at("ms")
            .get<double>();
      });
}

Json comparison_json(const SelfComparison& comparison, int index, int launches) {
  Json json = {{"comparison", index}, {"ratio", comparison.ratio}};
  json["interval"] = comparison.interval ? Json(*comparison.interval) : Json();
  json["differs"] = comparison.differs();
  for (std::size_t label = 0; label < 2; ++label) {
    const LabelSamples& samples = comparison.labels[label];
    Json of_launch = Json::array();
    for (const int block : samples.blocks) of_launch.push_back(block % launches);
    json[label == 0 ? "a" : "b"] = {{"samples_ms", samples.times_ms},
                                    {"blocks", samples.blocks},
                                    {"launches", of_launch},
                                    {"stop", samples.stop}};
  }
  return json;
}

/// What so many comparisons are able to find, in words.
std::string power(int comparisons) {
  const std::optional<int> least = least_found(comparisons, kStatedRate);
  if (!least)
    return fmt::format("{} comparisons cannot show a rate above {:g} %, whatever comes out", comparisons,
                       100 * kStatedRate);
  return fmt::format("so many comparisons show a rate above {:g} % from {} differences on, which is {:.1f} %",
                     100 * kStatedRate, *least, 100.0 * *least / comparisons);
}

int run_selftest(const SelftestOptions& options, const DrawOptions& draw_options) {
  if (!options.output.empty()) check_output_path(options.output);
  if (options.sampling.max_samples < options.sampling.launches)
    throw InputError({.field = "--max-samples"}, "is less than --launches: some would hold no sample");
  if (options.sampling.max_samples < options.sampling.min_samples)
    throw InputError({.field = "--max-samples"}, "is less than --min-samples");
  Point point = point_of(draw_options, options.model, options.scene_file);
  find_schedule(point.execution);
  open_point_scene(point);
  catch_interrupts();
  std::ofstream lines;
  const auto check_lines = [&] {
    if (!lines) throw Error(options.output + ": cannot be written");
  };
  std::vector<double> off;  // how far each ratio is from 1
  std::size_t samples = 0;
  int differences = 0, on_target = 0;
  {
    Progress progress;
    const int frames = verified_frames(point);
    if (!options.output.empty()) {
      lines.open(options.output, std::ios::binary);
      check_lines();
    }
    for (int i = 0; i < options.comparisons; ++i) {
      progress.show("comparing a point with itself", i, options.comparisons,
                    fmt::format("{} came out different", differences));
      const SelfComparison comparison = compare(point, options, frames, i);
      differences += comparison.differs();
      off.push_back(std::max(comparison.ratio, 1 / comparison.ratio) - 1);
      for (const LabelSamples& label : comparison.labels) {
        samples += label.times_ms.size();
        on_target += label.stop == "target";
      }
      // At once, so that a run that ends early keeps what it has measured.
      if (!options.output.empty()) {
        lines << dump(comparison_json(comparison, i, options.sampling.launches)) << '\n' << std::flush;
        check_lines();
      }
    }
  }
  const auto [low, high] = proportion_interval(differences, options.comparisons);
  const std::optional<int> least = least_found(options.comparisons, kStatedRate);
  const bool broken = low > kStatedRate;
  if (options.json) {
    fmt::print("{}\n", dump({{"point", point_config(point)},
                             {"comparisons", options.comparisons},
                             {"differences", differences},
                             {"rate", static_cast<double>(differences) / options.comparisons},
                             {"interval", {low, high}},
                             {"stated_rate", kStatedRate},
                             {"median_off", median(off)},
                             {"samples", samples},
                             {"stopped_by_target", on_target},
                             {"least_found", least ? Json(*least) : Json()},
                             {"kept", !broken}},
                            2));
  } else {
    fmt::print(
        "{} of {} comparisons of a point with itself came out different: {:.1f} % [{:.1f}, {:.1f}], stated "
        "{:g} %\n"
        "half of the ratios are within {:.2f} % of 1; {:.1f} samples a label, {} of {} labels stopped by "
        "target\n{}\n{}\n",
        differences, options.comparisons, 100.0 * differences / options.comparisons, 100 * low, 100 * high,
        100 * kStatedRate, 100 * median(off), static_cast<double>(samples) / (2.0 * options.comparisons),
        on_target, 2 * options.comparisons, power(options.comparisons),
        broken ? "BROKEN: more often than stated; intervals on this machine are too narrow"
               : "no more often than stated, as far as so many comparisons can tell");
    if (!options.output.empty()) fmt::print("wrote {}\n", options.output);
  }
  return broken ? 1 : 0;
}

}  // namespace

void add_selftest_command(CLI::App& app, Outcome& outcome) {
  CLI::App* command = app.add_subcommand(
      "selftest", "the A/A test: compare a point with itself, and say how often it comes out different");
  const auto options = std::make_shared<SelftestOptions>();
  const auto draw_options = std::make_shared<DrawOptions>();
  draw_options->size = "320x180";
  command->add_option("MODEL", options->model, "a .dat file, or a generator such as teapot:triangles=43000")
      ->capture_default_str();
  command->add_option("SCENE", options->scene_file,
                      "scene parameter file (default: a camera that shows the model)");
  add_point_options(*command, *draw_options);
  SamplingPlan& sampling = options->sampling;
  command->add_option("--comparisons", options->comparisons, "how many, each in processes of its own")
      ->capture_default_str()
      ->check(whole_number_check(1, 100000));
  command->add_option("--launches", sampling.launches, "processes of a comparison")
      ->capture_default_str()
      ->check(whole_number_check(1, 100));
  command
      ->add_option("--target", sampling.target,
                   "a label stops when half its 95 % interval is within this share of its median")
      ->capture_default_str()
      ->check(number_check(1e-6, 1));
  command->add_option("--min-samples", sampling.min_samples, "of a label")
      ->capture_default_str()
      ->check(whole_number_check(6, 100000));
  command->add_option("--max-samples", sampling.max_samples, "of a label")
      ->capture_default_str()
      ->check(whole_number_check(6, 100000));
  command->add_option("--seed", options->seed, "of the order within the blocks")->capture_default_str();
  command->add_flag("--json", options->json, "one JSON object in place of the words");
  command->add_option("-o,--output", options->output,
                      "every comparison with its samples, one JSON object a line");
  command->callback(
      [options, draw_options, &outcome] { outcome.exit_code = run_selftest(*options, *draw_options); });
}

}  // namespace rasterbench
