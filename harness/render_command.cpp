#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "base/error.h"
#include "harness/commands.h"
#include "harness/statistics.h"
#include "kernels/kernel.h"
#include "scene/image.h"

namespace rasterbench {

ExecutionConfig execution_of(const DrawOptions& options) {
  ExecutionConfig execution;
  execution.backend = options.backend;
  if (!options.schedule.empty())
    parse_schedule(options.schedule, "--schedule", execution);
  else
    execution.schedule = options.backend == "openmp" ? "dynamic" : options.backend == "tbb" ? "auto" : "";
  const int cpus = available_cpus();
  execution.threads = options.threads > 0           ? options.threads
                      : options.backend == "serial" ? 1
                                                    : default_threads();
  if (execution.threads > cpus && !options.oversubscribe)
    throw InputError({.field = "--threads"},
                     fmt::format("{} threads on {} CPUs needs --oversubscribe", execution.threads, cpus));
  return execution;
}

FrameSettings frame_settings_of(const DrawOptions& options) {
  FrameSettings settings;
  settings.fill = parse_fill(options.fill, "--fill");
  settings.geometry.near_rule = parse_near(options.near_rule, "--near");
  check_word(options.tie, {"first", "last"}, "--tie");
  settings.tie = options.tie == "first" ? TieRule::kFirst : TieRule::kLast;
  check_word(options.cull, {"none", "back"}, "--cull");
  settings.geometry.cull_back_faces = options.cull == "back";
  settings.tile = options.tile;
  settings.generality = parse_generality(options.generality, "--generality");
  settings.geometry.isa = parse_isa(options.isa, "--isa");
  if (!is_supported(settings.geometry.isa))
    throw InputError({.field = "--isa"}, fmt::format("this CPU has no {}", options.isa));
  settings.techniques = parse_techniques(options.techniques, "--techniques");
  if (!options.size.empty()) std::tie(settings.width, settings.height) = parse_size(options.size, "--size");
  return settings;
}

Point point_of(const DrawOptions& options, const std::string& model, const std::string& scene_file) {
  const FrameSettings settings = frame_settings_of(options);
  const Kernel::Variant& variant = find_kernel(options.kernel).variant(options.numeric);
  if (!variant.make)
    throw InputError({.field = "--kernel"}, fmt::format("{} cannot run in mode {}: {}", options.kernel,
                                                        options.numeric, variant.reason));
  Point point;
  point.scene = parse_scene_reference(model + "@" + scene_file);
  point.scene.model = model;  // also where it has an @
  point.scene.parameters = scene_file;
  point.width = settings.width;
  point.height = settings.height;
  point.kernel = options.kernel;
  point.numeric = options.numeric;
  point.fill = settings.fill;
  point.near_rule = settings.geometry.near_rule;
  point.execution = execution_of(options);
  point.tile = settings.tile;
  point.generality = settings.generality;
  point.isa = settings.geometry.isa;
  point.techniques = settings.techniques;
  return point;
}

Scene open_point_scene(Point& point) {
  Scene scene = open_scene(point.scene.model, point.scene.parameters);
  if (point.width == 0) {
    point.width = scene.parameters.width;
    point.height = scene.parameters.height;
  }
  return scene;
}

namespace {

void print_needs(const Scene& scene, const FrameSettings& settings, const ModeInfo& mode) {
  if (!mode.has_screen_triangles) return fmt::print("geometry stage: none, {} casts rays\n", mode.name);
  if (settings.generality == Generality::kFull)
    return fmt::print("geometry stage: every test is kept (generality = full)\n");
  const Camera camera = sized_camera(scene, settings);
  const NeedsAnalysis analysis = analyse_needs(
      scene.model.triangles, make_screen_transform(camera, mode.depth_function), settings.geometry.near_rule);
  fmt::print("geometry stage:\n{}", to_string(explain_needs(analysis, camera)));
}

}  // namespace

void draw(const Drawing& drawing, const DrawOptions& options) {
  // Everything that can be wrong with the arguments is found before the model is read.
  if (!drawing.image.empty()) check_image_path(drawing.image);
  for (const std::string& file : {drawing.image, drawing.ids, drawing.depth})
    if (!file.empty()) check_output_path(file);
  FrameSettings settings = frame_settings_of(options);
  find_kernel(options.kernel).variant(options.numeric);
  const ExecutionConfig execution = execution_of(options);
  find_schedule(execution);

  const Scene scene = open_scene(drawing.model, drawing.scene_file);
  if (options.size.empty()) {
    settings.width = scene.parameters.width;
    settings.height = scene.parameters.height;
  }
  const auto renderer = make_renderer(options.kernel, options.numeric,
                                      {&scene, settings, execution, 0, /*keeps_ids=*/!drawing.ids.empty()});
  const FrameReport* report = &renderer->draw();
  std::vector<double> times;
  for (int frame = 0; frame < drawing.frames; ++frame) {
    report = &renderer->draw();
    times.push_back(report->seconds.total() * 1e3);
  }

  if (!drawing.image.empty())
    write_image(drawing.image, renderer->colours(), settings.width, settings.height);
  if (!drawing.ids.empty()) write_npy(drawing.ids, renderer->ids(), settings.width, settings.height);
  if (!drawing.depth.empty()) write_npy(drawing.depth, renderer->depths(), settings.width, settings.height);
  if (drawing.quiet) return;

  const GeometryCounts& c = report->counts;
  std::string stages;
  const StageSeconds& s = report->seconds;
  for (const auto& [name, seconds] : {std::pair{"clear", s.clear}, std::pair{"geometry", s.geometry},
                                      std::pair{"raster", s.raster}, std::pair{"resolve", s.resolve}})
    if (seconds) stages += fmt::format("{}{} {:.3f}", stages.empty() ? "" : ", ", name, *seconds * 1e3);
  fmt::print("{} at {}x{}: {} triangles, {} drawn", drawing.model, settings.width, settings.height,
             c.triangles, c.drawn);
  if (c.near_clipped) fmt::print(", {} cut at the near plane", c.near_clipped);
  if (c.non_finite) fmt::print(", {} with a coordinate that is not finite left out", c.non_finite);
  if (c.zero_area) fmt::print(", {} without area left out", c.zero_area);
  fmt::print("\n{} {} {} on {} thread{}: {:.3f} ms (median of {}; last: {})\n", options.kernel,
             options.numeric, to_string(execution), execution.threads, execution.threads == 1 ? "" : "s",
             median(times), times.size(), stages);
  if (drawing.explain) print_needs(scene, settings, *find_mode(options.numeric));
  for (const std::string& file : {drawing.image, drawing.ids, drawing.depth})
    if (!file.empty()) fmt::print("wrote {}\n", file);
}

namespace {

/// MODEL's file name or generator without its folder, keys and extension.
std::string default_image(const std::string& model) {
  const std::string name = std::filesystem::path(model.substr(0, model.find(':'))).stem().string();
  return name + ".png";
}

}  // namespace

void add_point_options(CLI::App& command, DrawOptions& o) {
  command.add_option("--kernel", o.kernel, "strategy; see `rasterbench list kernels`")->capture_default_str();
  command.add_option("--numeric", o.numeric, "numeric mode; see `rasterbench list numerics`")
      ->capture_default_str();
  command.add_option("--backend", o.backend, "serial, openmp or tbb")->capture_default_str();
  command.add_option(
      "--schedule", o.schedule,
      "KIND[,CHUNK]; see `rasterbench list schedules` (default: dynamic for openmp, auto for tbb)");
  command
      .add_option("--threads", o.threads,
                  "number of threads (default: all CPUs of this process, or OMP_NUM_THREADS; serial: 1)")
      ->check(CLI::Range(1, 65536));
  command.add_flag("--oversubscribe", o.oversubscribe, "allow more threads than CPUs");
  command.add_option("--size", o.size, "WxH in pixels, each 1 to 65536 (default: the scene's)");
  command.add_option("--fill", o.fill, "closed (edges belong to both sides) or top-left (to one)")
      ->capture_default_str();
  command.add_option("--near", o.near_rule, "clip at the near plane, or off")->capture_default_str();
  command.add_option("--tile", o.tile, "side of a tile in pixels, for kernels that have tiles")
      ->capture_default_str()
      ->check(CLI::Range(1, 65536));
  command
      .add_option("--generality", o.generality,
                  "tests of the geometry stage: minimal (those that this scene needs) or full (all)")
      ->capture_default_str();
  command
      .add_option("--isa", o.isa,
                  "instruction set of the vectorised loops: baseline, sse4, avx2, avx512, or best")
      ->capture_default_str();
  command
      .add_option(
          "--techniques", o.techniques,
          "all, none, names joined by '+', or all-NAME; those that the kernel lacks change nothing; see "
          "`rasterbench list techniques`")
      ->capture_default_str();
}

void add_render_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("render", "draw one picture and say how long it took");
  const auto drawing = std::make_shared<Drawing>();
  const auto options = std::make_shared<DrawOptions>();
  command->add_option("MODEL", drawing->model, "a .dat file, or a generator such as teapot:triangles=43000")
      ->required();
  command->add_option("SCENE", drawing->scene_file,
                      "scene parameter file (default: a camera that shows the model)");
  command->add_option("-o,--output", drawing->image,
                      "IMAGE.ppm or .png (default: the model's name, .png, in this folder)");
  command->add_option("--ids", drawing->ids, "IDS.npy: int32 (H, W), -1 = background");
  command->add_option("--depth", drawing->depth, "DEPTH.npy: float32 (H, W), 1 = background");
  command->add_option("--frames", drawing->frames, "timed frames, after one untimed")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  command->add_flag("--explain", drawing->explain,
                    "say which tests the geometry stage leaves out for this scene, and why");
  add_point_options(*command, *options);
  command->add_option("--tie", options->tie, "who wins an equal depth: first or last triangle")
      ->capture_default_str();
  command->add_option("--cull", options->cull, "none, or back: leave back faces out")->capture_default_str();
  command->callback([drawing, options] {
    if (drawing->image.empty() && drawing->ids.empty() && drawing->depth.empty())
      drawing->image = default_image(drawing->model);
    draw(*drawing, *options);
  });
}

}  // namespace rasterbench
