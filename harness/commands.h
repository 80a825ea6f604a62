// The subcommands of rasterbench. Each function adds one to the program and runs it from its callback.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "harness/point.h"

namespace rasterbench {

/// What main returns; set by the subcommand that ran.
struct Outcome {
  int exit_code = 0;
};

void add_render_command(CLI::App& app);
void add_study_command(CLI::App& app, Outcome& outcome, const std::vector<std::string>& benchmark_flags);
void add_list_command(CLI::App& app);
void add_scene_command(CLI::App& app);
void add_explain_command(CLI::App& app);
void add_advise_command(CLI::App& app, Outcome& outcome);
void add_adopt_command(CLI::App& app, Outcome& outcome);
void add_extremes_command(CLI::App& app, Outcome& outcome);
void add_fuzz_command(CLI::App& app, Outcome& outcome);
void add_stability_command(CLI::App& app);
void add_machine_command(CLI::App& app);
void add_selftest_command(CLI::App& app, Outcome& outcome);
void add_trace_command(CLI::App& app);
void add_replay_command(CLI::App& app, Outcome& outcome);
void add_verify_command(CLI::App& app, Outcome& outcome);
void add_runner_command(CLI::App& app, Outcome& outcome, const std::vector<std::string>& benchmark_flags);

/// How one picture is drawn, as options of a command.
struct DrawOptions {
  std::string kernel = "tile_parallel";
  std::string numeric = "f32";
  std::string backend = "openmp";
  std::string schedule;  ///< KIND[,CHUNK]; empty: dynamic for openmp, auto for tbb
  int threads = 0;       ///< 0: all CPUs
  bool oversubscribe = false;
  std::string size;  ///< WxH; empty: the scene's
  std::string fill = "closed";
  std::string near_rule = "clip";
  std::string tie = "first";
  std::string cull = "none";
  int tile = 64;
  std::string generality = "minimal";
  std::string isa = "best";
  std::string techniques = "all";
};

/// The execution that the options ask for; throws InputError.
ExecutionConfig execution_of(const DrawOptions& options);

/// What the options say of the frame; width and height are 0 where they leave the size to the scene. Throws
/// InputError.
FrameSettings frame_settings_of(const DrawOptions& options);

/// The point that the options ask for, of a MODEL and, where it is not empty, a SCENE file; width and height
/// are 0 where they leave the size to the scene. Throws InputError.
Point point_of(const DrawOptions& options, const std::string& model, const std::string& scene_file);

/// Opens the scene of `point` and gives it the scene's size where it has none.
Scene open_point_scene(Point& point);

/// Adds the options of DrawOptions that a point of a study has, too: all but tie and cull.
void add_point_options(CLI::App& command, DrawOptions& options);

/// Draws one picture and writes what is asked for; shared by `render` and `graphics`.
struct Drawing {
  std::string model, scene_file, image, ids, depth;
  int frames = 1;  ///< timed ones, after an untimed one
  bool quiet = false;
  bool explain = false;  ///< say which tests the geometry stage leaves out, and why
};
void draw(const Drawing& drawing, const DrawOptions& options);

/// Runs `body`; prints what it throws as one line on stderr and returns the exit code.
int guarded_main(const char* program, const std::function<int()>& body);

}  // namespace rasterbench
