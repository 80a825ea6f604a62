#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <regex>

#include "adopt/race_scene.h"
#include "base/error.h"
#include "base/hash.h"
#include "build_info.h"
#include "harness/adopt.h"
#include "harness/commands.h"
#include "harness/context.h"
#include "harness/option_checks.h"
#include "harness/process.h"
#include "scene/image.h"

namespace rasterbench {
namespace {

void check_options(AdoptOptions& o) {
  parse_fill(o.fill, "--fill");
  parse_near(o.near_rule, "--near");
  check_word(o.binding, kBindings, "--binding");
  if (!o.size.empty()) parse_size(o.size, "--size");
  const int cpus = available_cpus();
  if (o.threads.empty()) {
    for (int count = 1; count < cpus; count *= 2) o.threads.push_back(count);
    o.threads.push_back(cpus);
  }
  std::sort(o.threads.begin(), o.threads.end());
  o.threads.erase(std::unique(o.threads.begin(), o.threads.end()), o.threads.end());
  if (o.threads.back() > cpus && !o.oversubscribe)
    throw InputError({.field = "--threads"},
                     fmt::format("{} threads on {} CPUs needs --oversubscribe", o.threads.back(), cpus));
  if (o.threads.front() != 1) o.threads.insert(o.threads.begin(), 1);  // the base
  for (const std::string& schedule : o.schedules) {
    ExecutionConfig execution;
    execution.backend = "openmp";
    parse_schedule(schedule, "--schedule", execution);
    find_schedule(execution);
  }
  if (o.schedules.empty()) o.schedules = kAdoptSchedules;
  if (o.min_samples > o.max_samples)
    throw InputError({.field = "--min-samples"}, fmt::format("{} is more than --max-samples", o.min_samples));
  if (o.own_time.empty()) return;
  try {
    if (std::regex(o.own_time).mark_count() != 1)
      throw InputError({.field = "--own-time"}, "needs one group: the parentheses around the number");
  } catch (const std::regex_error& error) {
    throw InputError({.field = "--own-time"}, fmt::format("is no regular expression: {}", error.what()));
  }
}

Json openmp_json(const OpenMpUse& use, const ProgramFile& file, const ProbeCounts& probe, int most_threads) {
  Json calls = probe.empty() ? Json() : Json(probe);
  return {{"schedule", to_string(use.use)},
          {"evidence", use.evidence},
          {"text", use.text},
          {"file", file.kind},
          {"calls", std::move(calls)},
          {"most_threads", most_threads}};
}

/// Below this a process's start and its files are a large part of its time.
constexpr double kShortRunMs = 100;

/// From here on others take so much of the machine, in CPUs, that speedups say more of them than of the
/// program.
constexpr double kOtherLoad = 0.25;

/// Why more threads do not help, as far as it can be seen from outside.
std::string why_no_gain(double busy, int threads, const ProbeCounts& probe, double other_load) {
  std::string text = fmt::format("{:.2g} CPUs were busy in the mean", busy);
  const auto count = [&](const char* name) {
    const auto found = probe.find(name);
    return found == probe.end() ? std::int64_t{0} : found->second;
  };
  const std::int64_t turns = count("criticals") + count("locks");
  if (turns > 0)
    return text +
           fmt::format(
               ". It entered critical sections or took locks {} times: threads take turns there, and one "
               "waits while another works.",
               turns);
  if (other_load > kOtherLoad)
    return text + ", and others had the rest of the machine: measure again where nothing else runs.";
  if (busy < 0.75 * threads)
    return text +
           ": most of the time one thread works alone (reading, transforming or writing in a serial part, or "
           "the "
           "whole picture), while the others have nothing to do.";
  return text +
         ": all of them work, so they wait actively, do work twice, or fight for the same cache lines.";
}

/// What the times say, for whoever wrote the program.
std::vector<std::string> timing_sentences(const Json& timing, const ProbeCounts& probe) {
  std::vector<std::string> sentences;
  const Json* best = nullptr;
  int most = 1;
  for (const Json& point : timing.at("points")) {
    if (best == nullptr || point.at("median_ms") < best->at("median_ms")) best = &point;
    most = std::max(most, point.at("threads").get<int>());
  }
  const auto setting = [](const Json& point) {
    const int threads = point.at("threads").get<int>();
    return fmt::format("{} thread{}{}", threads, threads == 1 ? "" : "s",
                       point.at("schedule").is_null() ? "" : ", " + point.at("schedule").get<std::string>());
  };
  const double lowest = best->at("median_ms").get<double>();
  sentences.push_back(fmt::format("Lowest median: {:.4g} ms with {}.", lowest, setting(*best)));
  if (lowest < kShortRunMs)
    sentences.push_back(
        "That is short: starting a process, reading the model and writing the picture are a large part of "
        "it. For a "
        "report take a larger scene.");
  const Json& other = timing.at("other_load_cpus");
  const double other_load = other.is_number() ? other.get<double>() : 0;
  if (other_load > kOtherLoad)
    sentences.push_back(fmt::format(
        "NOISY: other programs kept {:.2g} of {} CPUs busy while this was timed; do not publish these times.",
        other_load, available_cpus()));
  for (const Json& point : timing.at("points")) {
    if (most == 1 || point.at("threads") != most || point.at("speedup").is_null()) continue;
    std::string text = fmt::format("{}: {:.3g} times as fast as one thread", setting(point),
                                   point.at("speedup").get<double>());
    const Json& interval = point.at("speedup_interval");
    if (interval.is_null()) {
      text += " (too few samples for an interval).";
    } else {
      const double high = interval.at(1).get<double>();
      text += fmt::format(" [{:.3g}, {:.3g}]", interval.at(0).get<double>(), high);
      // Not even a quarter of what each further thread could add.
      text += high < 1 + 0.25 * (most - 1)
                  ? ": it does not scale. " +
                        why_no_gain(point.at("cpus_busy").get<double>(), most, probe, other_load)
                  : ".";
    }
    sentences.push_back(std::move(text));
  }
  return sentences;
}

/// The modes that the picture is nearest to: several where it equals them all.
std::string nearest_text(const Json& nearest) {
  const Json& differing = nearest.front().at("differing");
  std::vector<std::string> names;
  for (const Json& mode : nearest)
    if (mode.at("differing") == differing && mode.at("fill") == nearest.front().at("fill"))
      names.push_back(mode.at("numeric").get<std::string>());
  return fmt::format("nearest mode{}: {} ({}), from which {} pixels differ", names.size() == 1 ? "" : "s",
                     fmt::join(names, ", "), nearest.front().at("fill").get<std::string>(),
                     differing.get<std::int64_t>());
}

/// The same program on race_scene(): a race that the user's own scene seldom shows is the same error.
Json provoke_races(const AdoptOptions& options, Progress& progress) {
  AdoptOptions stress = options;
  stress.model = stress.scene_file = stress.size = "";
  stress.threads = {16};
  stress.repetitions = std::numeric_limits<int>::max();  // until the time is up
  stress.judge_seconds = options.race_seconds;
  const Scene scene = race_scene();
  FrameSettings settings;
  settings.width = scene.parameters.width;
  settings.height = scene.parameters.height;
  settings.fill = parse_fill(options.fill, "--fill");
  const AdoptWorkplace workplace(stress, scene, settings.width, settings.height, "races");
  PictureJudge judge(scene, settings, available_cpus());
  AdoptVerdict verdict(stress, judge, settings.width, settings.height);
  run_judged(stress, workplace, verdict, progress);
  return verdict.conclude(options.out, "races_");
}

int adopt(AdoptOptions& options) {
  check_options(options);
  const Scene scene = open_scene(options.model, options.scene_file);
  FrameSettings settings;
  settings.width = scene.parameters.width;
  settings.height = scene.parameters.height;
  if (!options.size.empty()) std::tie(settings.width, settings.height) = parse_size(options.size, "--size");
  settings.fill = parse_fill(options.fill, "--fill");
  settings.geometry.near_rule = parse_near(options.near_rule, "--near");
  const AdoptWorkplace workplace(options, scene, settings.width, settings.height, "work");
  catch_interrupts();
  const std::string started = utc_now();

  Progress progress;
  int most_threads = 0;
  progress.show("looking", 0, 1, "what it asks of OpenMP");
  const ProgramFile file = inspect_program(workplace.program());
  const ProbeCounts probe = workplace.probe(std::max(2, options.threads.back()), most_threads);
  OpenMpUse use = decide_schedule_use(file, probe);
  progress.show("judging", 0, 1, "the true picture");
  PictureJudge judge(scene, settings, available_cpus());
  AdoptVerdict verdict(options, judge, settings.width, settings.height);
  run_judged(options, workplace, verdict, progress);

  for (const char* name : {"races_difference.png", "races_picture.png"})
    std::filesystem::remove(std::filesystem::path(options.out) / name);
  // What is wrong already needs no provocation.
  const Json races =
      verdict.is_correct() && options.race_seconds > 0 ? provoke_races(options, progress) : Json();
  const bool is_safe = races.is_null() || races.at("correct").get<bool>();

  std::optional<Json> timing;
  if (verdict.is_correct() && is_safe) {
    // A program that never asks for OMP_SCHEDULE is timed as it was compiled.
    const bool one = use.use == ScheduleUse::kFixed || use.use == ScheduleUse::kNoOpenMp;
    timing = time_program(options, options.threads, one ? std::vector<std::string>{""} : options.schedules,
                          workplace, verdict, progress);
  }
  progress.clear();

  const std::filesystem::path out(options.out);
  Json result;
  result["schema"] = 1;
  result["started"] = started;
  result["finished"] = utc_now();
  result["rasterbench"] = {{"version", build_info::kVersion}, {"commit", build_info::kCommit}};
  result["program"] = {{"path", workplace.program().string()}, {"hash", hash_file(workplace.program())}};
  result["scene"] = {{"model", options.model},
                     {"parameters", options.scene_file.empty() ? Json() : Json(options.scene_file)},
                     {"hash", scene_hash(scene)},
                     {"triangles", scene.model.triangles.size()},
                     {"size", {settings.width, settings.height}},
                     {"fill", options.fill},
                     {"near", options.near_rule}};
  result["machine"] = describe_machine();
  result["environment"] = {{"binding", options.binding},
                           {"cleared", {"OMP_*", "GOMP_*", "KMP_*", "LD_PRELOAD"}}};
  // What an earlier run found here must not stand beside what this one finds.
  for (const char* name : {"adopt.json", "adopt.sbatch", "difference.png", "picture.png"})
    std::filesystem::remove(out / name);
  result["judgement"] = verdict.conclude(out, "");
  result["races"] = races;
  result["openmp"] = openmp_json(use, file, probe, most_threads);
  result["timing"] = timing ? *timing : Json();
  result["slurm"] = Json();
  const Json& judgement = result["judgement"];
  const bool is_correct = judgement.at("correct").get<bool>() && is_safe;
  result["correct"] = is_correct;

  fmt::print("{} on {} at {}x{}: {}\n", options.program, options.model, settings.width, settings.height,
             is_correct ? "CORRECT" : "WRONG");
  for (const Json& problem : judgement.at("problems"))
    fmt::print("  {}\n", problem.at("text").get<std::string>());
  if (!is_safe)
    for (const Json& problem : races.at("problems"))
      fmt::print("  On a scene made to provoke races: {}\n", problem.at("text").get<std::string>());
  if (!judgement.at("nearest").empty()) {
    const Json& usual = judgement.at("pictures").front();
    fmt::print("  {} runs, {} picture{}; {}; {} differ from exact arithmetic, {} of them wrong\n",
               judgement.at("runs").size(), judgement.at("pictures").size(),
               judgement.at("pictures").size() == 1 ? "" : "s", nearest_text(judgement.at("nearest")),
               usual.at("differ").get<std::int64_t>(), usual.at("wrong").get<std::int64_t>());
  }
  if (is_correct && judgement.at("pictures").size() == 1)
    fmt::print(
        "  no race was seen in {} runs on this scene and {} on one made to provoke them; that proves none "
        "away\n",
        judgement.at("runs").size(), races.is_null() ? 0 : races.at("runs").size());
  for (const Json& note : judgement.at("notes")) fmt::print("  note: {}\n", note.get<std::string>());
  fmt::print("  OpenMP: {}\n", use.text);
  std::vector<std::string> written{"adopt.json"};
  if (timing) {
    std::vector<std::string> sentences = timing_sentences(*timing, probe);
    result["timing"]["text"] = sentences;
    for (const std::string& sentence : sentences) fmt::print("  {}\n", sentence);
    write_file(out / "adopt.sbatch", adopt_slurm_script(options, workplace.program(), *timing,
                                                        judgement.at("max_rss_bytes").get<std::int64_t>()));
    result["slurm"] = "adopt.sbatch";
    written.push_back("adopt.sbatch");
  } else {
    fmt::print("  not timed: a program that is judged wrong shows no speed\n");
  }
  for (const Json* judged : {&judgement, &races}) {
    if (judged->is_null() || judged->at("difference").is_null()) continue;
    written.push_back(judged->at("difference"));
    written.push_back(judged->at("picture"));
  }
  write_file(out / "adopt.json", dump(result, 1) + "\n");
  fmt::print("wrote {} in {}", fmt::join(written, ", "), options.out);
  fmt::print("{}\n", timing ? "; figures and tables: scripts/python -m analysis adopt " + options.out : "");
  return is_correct ? 0 : 1;
}

}  // namespace

void add_adopt_command(CLI::App& app, Outcome& outcome) {
  CLI::App* command = app.add_subcommand(
      "adopt", "judge and time your own program, which is run as PROGRAM MODEL.dat SCENE.txt IMAGE.ppm");
  const auto o = std::make_shared<AdoptOptions>();
  command->add_option("PROGRAM", o->program, "a program or script that can be run")->required();
  command->add_option("MODEL", o->model, "a .dat file or a generator, which the program gets as a file")
      ->required();
  command->add_option("SCENE", o->scene_file,
                      "scene parameter file (default: a camera that shows the model)");
  command->add_option("--out", o->out, "folder for adopt.json, pictures and the SLURM script")->required();
  command->add_option("--size", o->size, "WxH in pixels, each 1 to 65536 (default: the scene's)");
  command->add_option("--fill", o->fill, "the fill rule to judge by: closed (the contract's) or top-left")
      ->capture_default_str();
  command->add_option("--near", o->near_rule, "what is true near the camera: clip at the near plane, or off")
      ->capture_default_str();
  command
      ->add_option("--threads", o->threads,
                   "OMP_NUM_THREADS of the timed points; 1 is always among them (default: 1, "
                   "2, 4, ... and all CPUs)")
      ->check(CLI::Range(1, 65536));
  command
      ->add_option(
          "--schedule", o->schedules,
          "OMP_SCHEDULE: KIND[,CHUNK]; may be repeated (default: static, dynamic,1, dynamic,16, guided)")
      ->allow_extra_args(false);
  command->add_option("--binding", o->binding, "OMP_PROC_BIND: none, close or spread")->capture_default_str();
  command->add_flag("--oversubscribe", o->oversubscribe, "allow timed points with more threads than CPUs");
  command->add_option("--limit", o->limit, "seconds after which a run is killed")
      ->capture_default_str()
      ->check(number_check(0.01, kLongestSeconds));
  command->add_option("--repetitions", o->repetitions, "judged runs of each number of threads, to find races")
      ->capture_default_str()
      ->check(CLI::Range(2, 10000));
  command->add_option("--judge-seconds", o->judge_seconds, "begin no further repetition after this long")
      ->capture_default_str()
      ->check(number_check(0, kLongestSeconds));
  command
      ->add_option("--race-seconds", o->race_seconds,
                   "seconds of runs on a scene that is made to provoke races; 0: none")
      ->capture_default_str()
      ->check(number_check(0, kLongestSeconds));
  command
      ->add_option("--max-wrong", o->max_wrong,
                   "wrong pixels (beyond what rounding explains) that are let pass")
      ->capture_default_str()
      ->check(whole_number_check(0));
  command
      ->add_option("--target", o->target,
                   "stop when half the 95 % interval is within this share of the median")
      ->capture_default_str()
      ->check(number_check(1e-6, 1));
  command->add_option("--min-samples", o->min_samples, "timed runs of each point, at least")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  command->add_option("--max-samples", o->max_samples, "timed runs of each point, at most")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  command->add_option("--seconds", o->seconds, "begin no further block of timed runs after this long")
      ->capture_default_str()
      ->check(number_check(0, kLongestSeconds));
  command->add_option(
      "--own-time", o->own_time,
      "regular expression with one group: a number that the program prints, kept beside its wall time");
  command->add_option("--slurm-cores", o->slurm_cores, "cores of the SLURM script")
      ->capture_default_str()
      ->check(CLI::Range(1, 65536));
  command->footer("Exit codes: 0 correct, 1 wrong (or it crashes, hangs, writes no picture), 2 bad usage.");
  command->callback([o, &outcome] { outcome.exit_code = adopt(*o); });
}

}  // namespace rasterbench
