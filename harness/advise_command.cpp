#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "advice/report.h"
#include "base/error.h"
#include "harness/commands.h"
#include "harness/option_checks.h"
#include "harness/progress.h"

namespace rasterbench {
namespace {

struct AdviseOptions {
  std::string model, scene_file;
  std::int64_t max_wrong = 0;
  std::optional<double> max_depth_error;
  std::string size, fill = "closed", near_rule = "clip";
  int threads = 0;
  double seconds = 20;
  bool explain = false, json = false;
};

Tolerance checked_tolerance(const AdviseOptions& o) {
  if (o.max_depth_error && !(*o.max_depth_error > 0 && std::isfinite(*o.max_depth_error)))
    throw InputError({.field = "--max-depth-error"},
                     fmt::format("{} is not a distance above 0", *o.max_depth_error));
  return {o.max_wrong, o.max_depth_error};
}

/// The picture of a configuration against the end-to-end truth.
EndToEndVerdict judge_end_to_end(Judge& judge, const Candidate& candidate) {
  const ModeInfo& mode = *candidate.verdict->mode;
  const Picture picture = render_specification(judge.scene(), mode.name, judge.settings());
  const Accuracy accuracy = judge.against_oracle(picture, mode);
  return judge.against_truth(picture, mode, &accuracy);
}

Advice advise(const AdviseOptions& o, const Scene& scene, const FrameSettings& settings, int threads) {
  Advice advice;
  advice.model = o.model;
  advice.scene_file = o.scene_file;
  advice.settings = settings;
  advice.camera = sized_camera(scene, settings);
  advice.tolerance = checked_tolerance(o);
  Judge judge(scene, settings, threads);
  Progress progress;
  progress.show("scene", 0, 1, "exact owners and margins");
  advice.facts = scene_facts(judge, threads);
  advice.verdicts = judge_modes(judge, advice.tolerance, threads, [&](double share, std::string_view mode) {
    progress.show("modes", share, 1, std::string(mode));
  });
  advice.measurements =
      measure(scene, settings, advice.verdicts, {.threads = threads, .seconds = o.seconds},
              [&](double share, const std::string& name) { progress.show("measuring", share, 1, name); });
  advice.recommendation = recommend(advice.measurements.all);
  if (advice.recommendation) {
    progress.show("end to end", 0, 1, "the picture of the file's own numbers");
    advice.end_to_end = judge_end_to_end(judge, advice.chosen().measurement->candidate);
  }
  progress.clear();
  return advice;
}

}  // namespace

void add_advise_command(CLI::App& app, Outcome& outcome) {
  CLI::App* command = app.add_subcommand(
      "advise", "the fastest configuration that keeps a tolerance on a scene, by error bounds: a proof");
  const auto o = std::make_shared<AdviseOptions>();
  command->add_option("MODEL", o->model, "a .dat file, or a generator such as teapot:triangles=43000")
      ->required();
  command->add_option("SCENE", o->scene_file,
                      "scene parameter file (default: a camera that shows the model)");
  command
      ->add_option("--max-wrong", o->max_wrong,
                   "pixels that may show another triangle than exact arithmetic on the same screen triangles")
      ->required()
      ->check(whole_number_check(0));
  command->add_option("--max-depth-error", o->max_depth_error,
                      "largest error of the depth, in world units along the view axis (default: any)");
  command->add_option("--size", o->size, "WxH in pixels, each 1 to 65536 (default: the scene's)");
  command->add_option("--threads", o->threads, "threads to draw and judge with (default: all CPUs)")
      ->check(CLI::Range(1, 65536));
  command->add_option("--fill", o->fill, "closed or top-left")->capture_default_str();
  command->add_option("--near", o->near_rule, "clip at the near plane, or off")->capture_default_str();
  command->add_option("--seconds", o->seconds, "time for measuring, after the scene and the modes are judged")
      ->capture_default_str()
      ->check(number_check(0.1, 3600));
  command->add_flag(
      "--explain", o->explain,
      "also what the frame leaves out and why, where each mode can go wrong, all that was tried");
  command->add_flag("--json", o->json, "one JSON object in place of the text");
  command->footer(
      "Exit code 1: no mode keeps the tolerance by its bound, or a kernel draws a wrong picture.");
  command->callback([o, &outcome] {
    checked_tolerance(*o);
    FrameSettings settings;
    if (!o->size.empty()) std::tie(settings.width, settings.height) = parse_size(o->size, "--size");
    settings.fill = parse_fill(o->fill, "--fill");
    settings.geometry.near_rule = parse_near(o->near_rule, "--near");
    settings.geometry.isa = best_isa();
    DrawOptions draw;
    draw.threads = o->threads;
    const int threads = execution_of(draw).threads;
    const Scene scene = open_scene(o->model, o->scene_file);
    if (o->size.empty()) {
      settings.width = scene.parameters.width;
      settings.height = scene.parameters.height;
    }
    const Advice advice = advise(*o, scene, settings, threads);
    fmt::print("{}", o->json ? dump(advice_json(advice), 2) + "\n" : advice_text(advice, o->explain));
    bool failed = !advice.recommendation;
    for (const Measurement& m : advice.measurements.all) failed = failed || !m.conforms;
    for (const ModeVerdict& v : advice.verdicts) failed = failed || v.beyond_bound > 0;
    if (failed) outcome.exit_code = 1;
  });
}

}  // namespace rasterbench
