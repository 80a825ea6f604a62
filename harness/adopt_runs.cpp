#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <set>

#include "adopt/read_ppm.h"
#include "base/error.h"
#include "base/hash.h"
#include "harness/adopt.h"
#include "harness/process.h"
#include "scene/dat.h"
#include "scene/image.h"

namespace rasterbench {

namespace fs = std::filesystem;

namespace {

constexpr const char* kImage = "picture.ppm";

fs::path program_file(const std::string& program) {
  std::error_code error;
  const fs::file_status status = fs::status(program, error);
  if (!fs::exists(status)) throw InputError({.file = program}, "no such program");
  if (!fs::is_regular_file(status)) throw InputError({.file = program}, "is not a file that can be run");
  if (access(program.c_str(), X_OK) != 0)
    throw InputError({.file = program}, fmt::format("cannot be run: {} (chmod +x?)", std::strerror(errno)));
  return fs::absolute(program).lexically_normal();
}

/// The picture of a run: the file that was asked for, or another PPM that the program wrote into its folder.
fs::path find_picture(const fs::path& folder, std::string& note) {
  if (fs::exists(folder / kImage)) return folder / kImage;
  for (const fs::path& place : {folder, folder.parent_path()})
    for (const auto& entry : fs::directory_iterator(place))
      if (entry.path().extension() == ".ppm") {
        note = fmt::format("wrote {} and not the file that its third argument names",
                           entry.path().filename().string());
        return entry.path();
      }
  return {};
}

std::string last_words(const std::string& output) {
  constexpr std::size_t kMost = 300;
  std::string text = output.size() > kMost ? "..." + output.substr(output.size() - kMost) : output;
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

AdoptWorkplace::Folder::~Folder() {
  std::error_code error;  // what cannot be removed stays: there is nobody left to tell
  if (!path.empty()) fs::remove_all(path, error);
}

AdoptWorkplace::AdoptWorkplace(const AdoptOptions& options, const Scene& scene, int width, int height,
                               const std::string& name)
    : options_(options),
      drawn_(scene),
      program_(program_file(options.program)),
      width_(width),
      height_(height) {
  const fs::path out = fs::absolute(options.out);
  std::error_code error;
  fs::create_directories(out, error);
  if (!error && !fs::is_directory(out)) error = std::make_error_code(std::errc::not_a_directory);
  const fs::path folder = out / fmt::format(".{}.{}", name, getpid());
  if (!error) fs::create_directories(folder, error);
  if (error) throw InputError({.file = options.out, .field = "--out"}, error.message());
  folder_.path = folder;
  // The name matters: a program may call its picture after its model.
  model_ =
      folder_.path / (fs::is_regular_file(options.model, error) ? fs::path(options.model).stem() : "model");
  model_ += ".dat";
  scene_ = folder_.path / "scene.txt";
  lay_files();
}

/// The user's own files, byte for byte, where these say all; else what they were read as. Never the files
/// themselves: a program that mistakes its arguments would overwrite them.
void AdoptWorkplace::lay_files() const {
  std::error_code error;
  const auto anew = fs::copy_options::overwrite_existing;
  if (fs::is_regular_file(options_.model, error))
    fs::copy_file(options_.model, model_, anew);
  else
    write_dat(drawn_.model, model_);
  if (!options_.scene_file.empty() && options_.size.empty()) {
    fs::copy_file(options_.scene_file, scene_, anew);
  } else {
    SceneParameters parameters = drawn_.parameters;
    parameters.width = width_;
    parameters.height = height_;
    write_scene_parameters(parameters, scene_);
  }
  // A time long ago marks files that nobody wrote since.
  for (const fs::path& file : {model_, scene_}) fs::last_write_time(file, fs::file_time_type{});
}

bool AdoptWorkplace::files_are_touched() const {
  std::error_code error;
  return fs::last_write_time(model_, error) != fs::file_time_type{} ||
         fs::last_write_time(scene_, error) != fs::file_time_type{};
}

ProgramRun AdoptWorkplace::prepared(const RunSetting& setting) const {
  const fs::path folder = folder_.path / "run";
  fs::remove_all(folder);
  for (const auto& entry : fs::directory_iterator(folder_.path))
    if (entry.path() != model_ && entry.path() != scene_) fs::remove_all(entry.path());
  fs::create_directory(folder);
  ProgramRun run{.words = {program_.string(), model_.string(), scene_.string(), (folder / kImage).string()},
                 .folder = folder};
  run.variables = {{"OMP_NUM_THREADS", std::to_string(setting.threads)}, {"OMP_DYNAMIC", "false"}};
  if (!setting.schedule.empty()) run.variables["OMP_SCHEDULE"] = setting.schedule;
  if (options_.binding != "none") {
    run.variables["OMP_PROC_BIND"] = options_.binding;
    run.variables["OMP_PLACES"] = "cores";
  }
  run.limit_seconds = options_.limit;
  // Room for pictures in ASCII and for logs; a program that writes without end is stopped.
  run.max_file_bytes =
      64 * 1024 * 1024 + 32 * static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(height_);
  run.stop = [] { return interrupted.load(); };
  return run;
}

JudgedRun AdoptWorkplace::run(const RunSetting& setting, bool watch,
                              std::vector<std::uint32_t>& pixels) const {
  ProgramRun run = prepared(setting);
  run.watch = watch;
  JudgedRun judged;
  judged.setting = setting;
  judged.result = run_program(run);
  if (judged.result.end == RunEnd::kStopped || interrupted) throw Interrupted("interrupted");
  if (judged.result.end == RunEnd::kNotStarted)
    throw InputError({.file = options_.program}, describe_end(run, judged.result));
  pixels.clear();
  if (files_are_touched()) {
    lay_files();
    judged.outcome = "failed";
    judged.problem = "it wrote to the model or the scene file that it was given";
    return judged;
  }
  if (judged.result.end != RunEnd::kExited || judged.result.code != 0) {
    judged.outcome = judged.result.end == RunEnd::kTimeLimit   ? "hung"
                     : judged.result.end == RunEnd::kSignalled ? "crashed"
                                                               : "failed";
    judged.problem = describe_end(run, judged.result);
    if (const std::string words = last_words(judged.result.output); !words.empty())
      judged.problem += "; it said: " + words;
    return judged;
  }
  const fs::path file = find_picture(run.folder, judged.note);
  if (file.empty()) {
    judged.outcome = "no_picture";
    judged.problem = "ended with exit code 0 and wrote no picture";
    return judged;
  }
  PpmFile picture = read_ppm(file, width_, height_);
  if (!picture.problem.empty()) {
    judged.outcome = "bad_picture";
    judged.problem = "its picture " + picture.problem;
    return judged;
  }
  if (judged.note.empty()) judged.note = picture.note;
  judged.outcome = "ok";
  pixels = std::move(picture.pixels);
  judged.picture =
      hash_bytes({reinterpret_cast<const char*>(pixels.data()), pixels.size() * sizeof(pixels[0])});
  return judged;
}

ProbeCounts AdoptWorkplace::probe(int threads, int& most_threads) const {
  ProgramRun run = prepared({threads, "static"});
  const fs::path report = folder_.path / "openmp.txt";
  const fs::path library = fs::read_symlink("/proc/self/exe").parent_path() / kProbeLibrary;
  if (fs::exists(library)) {
    run.variables["LD_PRELOAD"] = library.string();
    run.variables[kProbeVariable] = report.string();
  }
  run.watch = true;
  const ProgramResult result = run_program(run);
  if (result.end == RunEnd::kStopped || interrupted) throw Interrupted("interrupted");
  if (result.end == RunEnd::kNotStarted)
    throw InputError({.file = options_.program}, describe_end(run, result));
  most_threads = result.most_threads;
  ProbeCounts counts = read_probe(report);
  return counts;
}

void run_judged(const AdoptOptions& options, const AdoptWorkplace& workplace, AdoptVerdict& verdict,
                Progress& progress) {
  // More threads than CPUs, too: nothing is timed here, and a thread that is interrupted between reading a
  // depth and writing it is what shows a race.
  std::set<int> counts{1, 2, 4, 8};
  counts.insert(options.threads.begin(), options.threads.end());
  const auto begin = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  std::vector<std::uint32_t> pixels;
  constexpr int kEnough = 5;  // repetitions, to say how often something goes wrong
  for (int repetition = 0; repetition < options.repetitions; ++repetition) {
    if (repetition >= kEnough && !verdict.is_correct()) return;
    for (const int threads : counts) {
      if (repetition > 0 && elapsed() > options.judge_seconds) return;
      const std::string schedule = repetition % 2 == 0 ? "dynamic,1" : "static";
      progress.show("judging", static_cast<double>(repetition), static_cast<double>(options.repetitions),
                    fmt::format("{} thread{}, OMP_SCHEDULE={}", threads, threads == 1 ? "" : "s", schedule));
      const JudgedRun run = workplace.run({threads, schedule}, true, pixels);
      verdict.add(run, pixels);
      if (run.outcome == "hung") return;  // each would take the whole limit
    }
  }
}

}  // namespace rasterbench
