// A program of somebody else's that keeps to the course contract, PROGRAM MODEL SCENE.txt IMAGE.ppm: run,
// judged, timed. The steps of `rasterbench adopt`; what they find is adopt.json (records.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "adopt/judge_picture.h"
#include "adopt/openmp_use.h"
#include "adopt/run_program.h"
#include "harness/point.h"
#include "harness/progress.h"

namespace rasterbench {

struct AdoptOptions {
  std::string program, model, scene_file, out;
  std::string size;  ///< WxH; empty: the scene's
  std::string fill = "closed", near_rule = "clip";
  std::vector<int> threads;            ///< of the timed points; empty: 1, 2, 4, ... and all CPUs
  std::vector<std::string> schedules;  ///< values of OMP_SCHEDULE; empty: kAdoptSchedules
  std::string binding = "none";        ///< OMP_PROC_BIND
  bool oversubscribe = false;
  double limit = 60;           ///< seconds for one run
  int repetitions = 20;        ///< judged runs of each number of threads
  double judge_seconds = 60;   ///< begin no further repetition after this long
  double race_seconds = 10;    ///< of runs on race_scene(); 0: none
  std::int64_t max_wrong = 0;  ///< pixels beyond every bound that are let pass
  double target = 0.02;        ///< half the interval, as a share of the median
  int min_samples = 6, max_samples = 30;
  double seconds = 120;  ///< begin no further block of samples after this long
  std::string own_time;  ///< regular expression with one group: a time that the program prints
  int slurm_cores = 16;  ///< of the SLURM script
};

inline const std::vector<std::string> kAdoptSchedules{"static", "dynamic,1", "dynamic,16", "guided"};

/// One configuration of a run. An empty schedule: OMP_SCHEDULE is not set.
struct RunSetting {
  int threads = 1;
  std::string schedule;
};

/// What came of one run.
struct JudgedRun {
  RunSetting setting;
  std::string outcome;  ///< "ok", "crashed", "failed", "hung", "no_picture" or "bad_picture"
  std::string problem;  ///< in words, unless ok
  std::string picture;  ///< hash of the pixels; empty without any
  std::string note;     ///< what is odd and harmless
  ProgramResult result;
};

/// The files that a program is given, copies all, and a fresh folder for each run. Removes them in the end.
/// The scene must outlive it.
class AdoptWorkplace {
 public:
  /// Throws InputError where PROGRAM is no file that can be run, or OUT cannot be written.
  /// `name` tells it from other workplaces of this process.
  AdoptWorkplace(const AdoptOptions& options, const Scene& scene, int width, int height,
                 const std::string& name);

  /// Runs the program and reads its picture into `pixels`. Throws InputError where it cannot be started, and
  /// Interrupted.
  JudgedRun run(const RunSetting& setting, bool watch, std::vector<std::uint32_t>& pixels) const;

  /// One run that is neither judged nor timed: what the program asks of its OpenMP runtime.
  ProbeCounts probe(int threads, int& most_threads) const;

  const std::filesystem::path& program() const { return program_; }

 private:
  struct Folder {
    std::filesystem::path path;
    ~Folder();
  };
  ProgramRun prepared(const RunSetting& setting) const;
  void lay_files() const;
  bool files_are_touched() const;

  const AdoptOptions& options_;
  const Scene& drawn_;
  std::filesystem::path program_;
  Folder folder_;
  std::filesystem::path model_, scene_;
  int width_, height_;
};

/// The distinct pictures that a program drew and what each is found to be.
class AdoptVerdict {
 public:
  AdoptVerdict(const AdoptOptions& options, PictureJudge& judge, int width, int height)
      : options_(options), judge_(judge), width_(width), height_(height) {}

  /// Adds a judged run. A picture that was drawn before costs nothing.
  void add(const JudgedRun& run, const std::vector<std::uint32_t>& pixels);

  /// Whether nothing speaks against the program so far.
  bool is_correct() const;

  /// The `judgement` of adopt.json. Where pixels differ, writes difference.png and picture.png into `folder`,
  /// their names after `prefix`.
  Json conclude(const std::filesystem::path& folder, const std::string& prefix);

 private:
  struct Drawn {
    std::vector<std::uint32_t> pixels;  ///< empty where there are too many distinct pictures to keep
    PictureFindings findings;
    int runs = 0;
    std::size_t number = 0;  ///< in the order in which they were drawn
  };
  const Drawn& worst() const;
  bool is_wrong(const Drawn& drawn) const { return drawn.findings.wrong() > options_.max_wrong; }
  void add_run_problems(Json& problems) const;
  void add_picture_problems(Json& problems, Json& notes, Json& judgement) const;
  std::int64_t unstable_pixels() const;

  const AdoptOptions& options_;
  PictureJudge& judge_;
  int width_, height_;
  std::vector<JudgedRun> runs_;
  std::map<std::string, Drawn> pictures_;
};

/// Judged runs over thread counts and repetitions, until the time is up; stops early at a run that hangs, and
/// after a few repetitions where something is wrong.
void run_judged(const AdoptOptions& options, const AdoptWorkplace& workplace, AdoptVerdict& verdict,
                Progress& progress);

/// The `timing` of adopt.json: whole-process wall times in randomised blocks. Each run's picture is judged,
/// too; none where one is wrong.
std::optional<Json> time_program(const AdoptOptions& options, const std::vector<int>& threads,
                                 const std::vector<std::string>& schedules, const AdoptWorkplace& workplace,
                                 AdoptVerdict& verdict, Progress& progress);

/// A SLURM batch script that repeats the whole adoption on one node with options.slurm_cores cores.
std::string adopt_slurm_script(const AdoptOptions& options, const std::filesystem::path& program,
                               const Json& timing, std::int64_t max_rss_bytes);

}  // namespace rasterbench
