#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "base/error.h"
#include "harness/commands.h"
#include "harness/cost_image.h"
#include "harness/loop_costs.h"
#include "harness/option_checks.h"
#include "kernels/kernel.h"
#include "scene/image.h"

namespace rasterbench {
namespace {

struct TraceOptions {
  std::string model, scene_file, output = "trace.json", costs, image;
  int chunk = 0;  // 0: the schedule's
  int frames = 11;
};

/// What trace.json says of the image: its place from there, and its scale.
Json image_json(const TraceOptions& options, const CostImage& image) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::absolute(options.output).parent_path();
  return {{"file", fs::absolute(options.image).lexically_proximate(folder).string()},
          {"unit", image.unit},
          {"low", 0},
          {"high", image.high},
          {"map", "viridis"},
          {"opacity", kCostOpacity},
          {"shown", image.shown}};
}

/// Two names of one file, which may not exist yet.
bool is_same_file(const std::string& a, const std::string& b) {
  namespace fs = std::filesystem;
  std::error_code none;  // a generator's name is no file: then the names decide
  if (fs::equivalent(a, b, none)) return true;
  return fs::weakly_canonical(fs::absolute(a)) == fs::weakly_canonical(fs::absolute(b));
}

/// Outputs that would be written over each other, or over what is read, are refused before anything is.
void check_distinct_files(const TraceOptions& options) {
  struct File {
    const char* option;
    const std::string& path;
  };
  const std::array<File, 5> files{{{"MODEL", options.model},
                                   {"SCENE", options.scene_file},
                                   {"--output", options.output},
                                   {"--costs", options.costs},
                                   {"--image", options.image}}};
  constexpr std::size_t kInputs = 2;
  for (std::size_t later = kInputs; later < files.size(); ++later)
    for (std::size_t earlier = 0; earlier < later; ++earlier)
      if (!files[later].path.empty() && !files[earlier].path.empty() &&
          is_same_file(files[earlier].path, files[later].path))
        throw InputError({.field = files[later].option},
                         fmt::format("{} is the file of {}, too", files[later].path, files[earlier].option));
}

void print_threads(const TracedFrame& frame) {
  double loops = 0;
  for (const TracedLoop& loop : frame.loops) loops += loop.end - loop.begin;
  for (std::size_t worker = 0; worker < frame.chunks.size(); ++worker) {
    double busy = 0, longest = 0;
    std::int64_t iterations = 0;
    for (const TracedChunk& chunk : frame.chunks[worker]) {
      busy += chunk.end - chunk.begin;
      longest = std::max(longest, chunk.end - chunk.begin);
      iterations += chunk.last - chunk.first + 1;
    }
    fmt::print("thread {}: {} iterations in {} chunks, {:.3f} ms in them ({:.1f} %), the longest {:.3f} ms\n",
               worker, iterations, frame.chunks[worker].size(), 1e3 * busy,
               loops > 0 ? 100 * busy / loops : 0.0, 1e3 * longest);
  }
  fmt::print("loop {:.3f} ms, frame {:.3f} ms traced and {:.3f} ms without stamps\n", 1e3 * loops,
             1e3 * frame.seconds, 1e3 * frame.untraced_seconds);
}

void trace(const TraceOptions& options, const DrawOptions& draw_options) {
  for (const std::string& file : {options.output, options.costs, options.image})
    if (!file.empty()) check_output_path(file);
  if (!options.image.empty()) check_image_path(options.image);
  check_distinct_files(options);
  Point point = point_of(draw_options, options.model, options.scene_file);
  if (options.chunk > 0) {
    if (point.execution.chunk)
      throw InputError({.field = "--chunk"},
                       fmt::format("--schedule {} has a chunk already", draw_options.schedule));
    point.execution.chunk = options.chunk;
  }
  find_schedule(point.execution);
  const Scene scene = open_point_scene(point);
  const LoopShape shape = loop_shape(point);

  // Costs first: what has none is refused before anything is written.
  std::optional<LoopCosts> costs;
  if (!options.costs.empty() || !options.image.empty())
    costs = measure_loop_costs(point, scene, options.frames);
  std::optional<CostImage> image;
  if (!options.image.empty()) image = cost_image(point, scene, shape, *costs);
  const TracedFrame frame = trace_frames(point, scene, options.frames);

  if (image) write_image(options.image, image->colours, point.width, point.height);
  if (!options.costs.empty())
    write_file(options.costs, costs_text(point, scene_hash(scene), shape, *costs,
                                         measure_schedules(point.execution.threads)));
  write_file(options.output, trace_text(point, shape, frame, image ? image_json(options, *image) : Json()));

  fmt::print("{}\n", point_name(point));
  print_threads(frame);
  if (costs)
    fmt::print(
        "one thread: loop {:.3f} ms; stamps add {:.0f} ns to an iteration, which the costs are without\n",
        1e3 * costs->serial_loop_seconds, 1e9 * costs->stamp_seconds);
  if (image)
    fmt::print("heat map: 0 to {:.4g} {}, {:.1f} % of the cost lies on the picture\n", image->high,
               image->unit, 100 * image->shown);
  for (const std::string& file : {options.output, options.costs, options.image})
    if (!file.empty()) fmt::print("wrote {}\n", file);
}

}  // namespace

void add_trace_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "trace", "every chunk of the loop under study, and where on the screen its time goes");
  const auto options = std::make_shared<TraceOptions>();
  const auto draw_options = std::make_shared<DrawOptions>();
  command->add_option("MODEL", options->model, "a .dat file, or a generator such as teapot:triangles=43000")
      ->required();
  command->add_option("SCENE", options->scene_file,
                      "scene parameter file (default: a camera that shows the model)");
  command
      ->add_option("-o,--output", options->output,
                   "TRACE.json, in the format of Chrome's tracing, which ui.perfetto.dev opens")
      ->capture_default_str();
  command->add_option("--costs", options->costs,
                      "COSTS.json: microseconds of each iteration on one thread, and of handing out a chunk");
  command->add_option("--image", options->image,
                      "IMAGE.png or .ppm: the costs as a heat map over the picture");
  command
      ->add_option("--chunk", options->chunk,
                   "chunk of the schedule, in iterations (default: the schedule's)")
      ->check(CLI::Range(1, 1 << 30));
  command->add_option("--frames", options->frames, "traced frames: the one of median time is written")
      ->capture_default_str()
      ->check(whole_number_check(1, 10000));
  add_point_options(*command, *draw_options);
  command->callback([=] { trace(*options, *draw_options); });
}

}  // namespace rasterbench
