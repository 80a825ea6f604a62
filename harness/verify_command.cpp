#include <fmt/format.h>

#include <charconv>
#include <memory>

#include "base/error.h"
#include "harness/commands.h"
#include "harness/explain.h"
#include "harness/progress.h"
#include "harness/verdict_json.h"
#include "harness/verify.h"
#include "kernels/kernel.h"
#include "reference/ray_cast_frame.h"
#include "scene/image.h"

namespace rasterbench {
namespace {

struct VerifyOptions {
  std::string model, scene_file;
  std::vector<std::string> kernels, numerics;
  std::string size, fill = "closed", near_rule = "clip", techniques = "all";
  int threads = 0;
  bool oversubscribe = false;
  std::string difference, explain, ids, depth;
  bool json = false;
};

/// What is verified where no MODEL is given: one scene of each kind of load, small enough to take seconds.
constexpr const char* kBuiltInScenes[] = {"teapot:triangles=43000", "terrain:triangles=20000",
                                          "confetti:triangles=20000,size=16,distribution=heavy",
                                          "layers:triangles=2000,depth=4"};

std::pair<int, int> parse_pixel(const std::string& text, int width, int height) {
  int x = -1, y = -1;
  const std::size_t comma = text.find(',');
  const auto number = [](std::string_view part, int& value) {
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    return error == std::errc() && end == part.data() + part.size();
  };
  if (comma == std::string::npos || !number(std::string_view(text).substr(0, comma), x) ||
      !number(std::string_view(text).substr(comma + 1), y))
    throw InputError({.field = "--explain"}, fmt::format("'{}' is not X,Y", text));
  if (x < 0 || x >= width || y < 0 || y >= height)
    throw InputError({.field = "--explain"},
                     fmt::format("pixel {},{} is not in an image of {}x{}", x, y, width, height));
  return {x, y};
}

std::string count_or_dash(const Json& value) { return value.is_null() ? "-" : value.dump(); }

std::string number_or_dash(const Json& value) {
  return value.is_null() ? "-" : fmt::format("{:.3g}", value.get<double>());
}

constexpr const char* kRow =
    "{:<23} {:<17} {:<8} {:>8} {:>7} {:>7} {:>6} {:>8} {:>9} {:>10} {:>10} {:>9} {:>7} {:>9} {:>7}  {}\n";

void print_head() {
  fmt::print(fmt::runtime(kRow), "", "", "", "exact", "", "", "", "beyond", "can be", "worst", "depth",
             "of truth", "", "of rays", "", "");
  fmt::print(fmt::runtime(kRow), "numeric", "kernel", "conforms", "wrong", "edge", "depth", "tie", "bound",
             "wrong", "px", "steps", "wrong", "errors", "ties", "errors", "verdict");
}

void print_row(const Json& row) {
  const Json& verify = row.at("verify");
  const Json none;
  const auto of = [&](const char* judge, const char* key) -> Json {
    const Json& verdict = verify.at(judge);
    return verdict.is_null() || !verdict.contains(key) ? none : verdict.at(key);
  };
  const Json predicted = of("oracle", "predicted");
  const Json ray_ties = of("embree", "edge_ties").is_null()
                            ? none
                            : Json(of("embree", "edge_ties").get<std::int64_t>() +
                                   of("embree", "depth_ties").get<std::int64_t>());
  const bool bounded = verify.at("bound").at("bounded").get<bool>();
  fmt::print(
      fmt::runtime(kRow), row.at("numeric").get<std::string>(),
      row.at("kernel").is_null() ? std::string("(given picture)") : row.at("kernel").get<std::string>(),
      verify.at("conforms").get<bool>() ? "yes" : "NO", count_or_dash(of("oracle", "wrong")),
      count_or_dash(of("oracle", "edge")), count_or_dash(of("oracle", "depth")),
      count_or_dash(of("oracle", "exact_ties")), count_or_dash(of("oracle", "unexplained")),
      predicted == Json(-1) ? "any" : count_or_dash(predicted),
      number_or_dash(of("oracle", "worst_distance_px")),
      number_or_dash(of("oracle", "max_depth_error_steps")), count_or_dash(of("end_to_end", "wrong")),
      count_or_dash(of("end_to_end", "errors")), count_or_dash(ray_ties),
      count_or_dash(of("embree", "errors")),
      !row.at("failure").is_null()       ? "FAILED"
      : !bounded                         ? "unbounded"
      : of("oracle", "wrong") == Json(0) ? "exact"
                                         : "within bound");
}

/// One kernel in one mode: draws, compares with the specification, adds the verdicts on the mode.
Json verify_row(const std::string& kernel, const Picture& specification, const Json& verdicts,
                const RendererSetup& setup, const ModeInfo& mode) {
  const std::int64_t differing =
      check_conformance(kernel, std::string(mode.name), setup, specification).differing;
  Json row{{"numeric", mode.name}, {"kernel", kernel}};
  Json& verify = row["verify"];
  verify["conforms"] = differing == 0;
  verify["differing_pixels"] = differing;
  for (const char* verdict : kVerdicts) verify[verdict] = verdicts.at(verdict);
  row["failure"] =
      differing == 0
          ? verdicts.at("failure")
          : Json(fmt::format("{} pixels differ from the specification of {}", differing, mode.name));
  return row;
}

/// The picture that `render --ids --depth` of some build wrote; its colours are those of its ids.
Picture read_picture(const VerifyOptions& options, const Scene& scene) {
  Array<std::int32_t> ids = read_npy_ids(options.ids);
  Array<float> depths = read_npy_depths(options.depth);
  if (ids.width != depths.width || ids.height != depths.height)
    throw InputError({.file = options.depth, .field = "shape"},
                     fmt::format("({}, {}) is not that of the ids, ({}, {})", depths.height, depths.width,
                                 ids.height, ids.width));
  const auto triangles = static_cast<std::int64_t>(scene.model.triangles.size());
  for (std::size_t i = 0; i < ids.values.size(); ++i)
    if (ids.values[i] < -1 || ids.values[i] >= triangles)
      throw InputError({.file = options.ids, .field = fmt::format("element {}", i)},
                       fmt::format("{} is no triangle of the model, which has {}", ids.values[i], triangles));
  Picture picture{.width = ids.width, .height = ids.height};
  picture.ids = std::move(ids.values);
  picture.depths = std::move(depths.values);
  picture.colours = shade_owners(picture.ids, scene);
  picture.values.assign(picture.depths.begin(), picture.depths.end());
  return picture;
}

/// A given picture against the specification of a mode, and the verdicts on that picture itself.
Json picture_row(Judge& judge, const Picture& picture, const Picture& specification, const ModeInfo& mode) {
  if (!std::equal(specification.values.begin(), specification.values.end(), specification.depths.begin()))
    throw InputError({.field = "--numeric"},
                     fmt::format("{} keeps depths in another format than --depth has", mode.name));
  const std::int64_t differing = differing_pixels(picture, specification);
  const Json verdicts = judge_picture(judge, picture, mode);
  Json row{{"numeric", mode.name}, {"kernel", nullptr}};
  Json& verify = row["verify"];
  verify["conforms"] = differing == 0;
  verify["differing_pixels"] = differing;
  for (const char* verdict : kVerdicts) verify[verdict] = verdicts.at(verdict);
  row["failure"] = verdicts.at("failure");
  if (differing != 0)
    row["failure"] = fmt::format("{} pixels differ from the specification of {}", differing, mode.name);
  return row;
}

/// Verifies one scene; returns the number of rows that failed.
int verify_scene(const VerifyOptions& options, const std::string& model, Json& rows) {
  const Scene scene = open_scene(model, options.scene_file);
  FrameSettings settings;
  settings.width = scene.parameters.width;
  settings.height = scene.parameters.height;
  if (!options.size.empty()) std::tie(settings.width, settings.height) = parse_size(options.size, "--size");
  Picture given;
  if (!options.ids.empty()) {
    given = read_picture(options, scene);
    if (!options.size.empty() && (given.width != settings.width || given.height != settings.height))
      throw InputError({.file = options.ids, .field = "shape"},
                       fmt::format("({}, {}) is not --size {}", given.height, given.width, options.size));
    settings.width = given.width;
    settings.height = given.height;
  }
  settings.fill = parse_fill(options.fill, "--fill");
  settings.geometry.near_rule = parse_near(options.near_rule, "--near");
  settings.geometry.isa = best_isa();
  settings.techniques = parse_techniques(options.techniques, "--techniques");
  std::pair<int, int> pixel{-1, -1};
  if (!options.explain.empty()) pixel = parse_pixel(options.explain, settings.width, settings.height);

  DrawOptions draw;
  draw.threads = options.threads;
  draw.oversubscribe = options.oversubscribe;
  const ExecutionConfig execution = execution_of(draw);
  Judge judge(scene, settings, execution.threads);
  if (!options.explain.empty()) {
    fmt::print("{}", explain_pixel(judge, options.numerics, pixel.first, pixel.second));
    return 0;
  }

  Progress progress;
  std::vector<std::pair<std::string, std::string>> failures;
  std::vector<std::string> notes;
  bool head_printed = false;  // not before there is a row: what is refused prints nothing
  std::size_t done = 0;
  for (const std::string& name : options.numerics) {
    const ModeInfo& mode = available_mode(name, "--numeric");
    std::vector<std::string> kernels;
    for (const std::string& kernel : options.kernels)
      if (find_kernel(kernel).variant(name).make) kernels.push_back(kernel);
    ++done;
    if (kernels.empty()) continue;  // ray_cast beside other kernels, and the other way round
    if (!mode.has_screen_triangles) {
      try {
        check_ray_cast_settings(settings);
      } catch (const InputError& error) {
        notes.push_back(fmt::format("{} left out: {}", name, error.what()));
        continue;
      }
    }
    const bool is_given = !options.ids.empty();
    if (!is_given)  // one picture: nothing to count, and it may be refused
      progress.show("verifying", static_cast<double>(done), static_cast<double>(options.numerics.size()),
                    name);
    const Picture specification = render_specification(scene, name, settings);
    const Json verdicts = is_given ? Json() : judge_picture(judge, specification, mode);
    if (is_given) kernels = {"(given picture)"};
    for (const std::string& kernel : kernels) {
      Json row = is_given ? picture_row(judge, given, specification, mode)
                          : verify_row(kernel, specification, verdicts, {&scene, settings, execution}, mode);
      row["model"] = model;
      row["size"] = {settings.width, settings.height};
      if (!options.json) {
        progress.clear();
        if (!head_printed) {
          fmt::print("{}{} at {}x{}, {}\n", rows.empty() ? "" : "\n", model, settings.width, settings.height,
                     options.fill);
          print_head();
          head_printed = true;
        }
        print_row(row);
      }
      if (!row.at("failure").is_null()) failures.emplace_back(kernel + " " + name, row.at("failure"));
      rows.push_back(std::move(row));
    }
    if (!options.difference.empty()) {
      const Accuracy accuracy = judge.against_oracle(specification, mode);
      const DifferenceImage image =
          difference_image(accuracy, specification.colours, settings.width, settings.height);
      write_image(options.difference, image.pixels, image.width, image.height);
    }
  }
  progress.clear();
  if (rows.empty())
    throw InputError({.field = "--kernel"},
                     notes.empty() ? "none of these kernels can carry one of these modes" : notes.front());
  if (!options.json) {
    const EndToEndTruth& truth = judge.truth();
    fmt::print("end-to-end truth: {} pixels by multiprecision, {} ambiguous, {:.1f} s; Embree {}\n",
               truth.by_multiprecision, truth.ambiguous, truth.seconds,
               has_embree()
                   ? fmt::format("{}: build {:.1f} ms, trace {:.1f} ms", embree_version(),
                                 judge.rays(false).build_seconds * 1e3, judge.rays(false).trace_seconds * 1e3)
                   : "skipped: " + embree_version());
    for (const std::string& note : notes) fmt::print("{}\n", note);
    for (const auto& [point, reason] : failures) fmt::print("FAILED {}: {}\n", point, reason);
    if (!options.difference.empty()) fmt::print("wrote {}\n", options.difference);
  }
  return static_cast<int>(failures.size());
}

void check_options(VerifyOptions& options) {
  if (options.ids.empty() != options.depth.empty())
    throw InputError({.field = options.ids.empty() ? "--ids" : "--depth"},
                     "is missing: a picture is judged by its ids and its depths");
  if (!options.ids.empty()) {
    if (options.model.empty() || options.numerics.size() != 1 || !options.kernels.empty())
      throw InputError({.field = "--ids"}, "is a picture of one MODEL in one --numeric, and of no --kernel");
    if (!options.difference.empty() || !options.explain.empty())
      throw InputError({.field = "--ids"}, "goes without --difference and --explain");
    if (!available_mode(options.numerics.front(), "--numeric").has_screen_triangles)
      throw InputError({.field = "--ids"}, "needs a mode that the exact oracle can judge");
  }
  if (options.kernels.empty()) options.kernels = {"tile_parallel", "ray_cast"};
  for (const std::string& kernel : options.kernels) find_kernel(kernel);
  parse_techniques(options.techniques, "--techniques");
  for (const std::string& name : options.numerics) available_mode(name, "--numeric");
  if (options.numerics.empty())
    for (const ModeInfo& mode : mode_infos())
      if (mode.unavailable.empty()) options.numerics.emplace_back(mode.name);
  if (!options.difference.empty()) {
    if (options.numerics.size() != 1 || options.model.empty())
      throw InputError({.field = "--difference"}, "is of one MODEL and one --numeric");
    check_image_path(options.difference);
    check_output_path(options.difference);
    if (!available_mode(options.numerics.front(), "--numeric").has_screen_triangles)
      throw InputError({.field = "--difference"}, "needs a mode that the exact oracle can judge");
  }
  if (options.explain.empty()) return;
  if (options.model.empty()) throw InputError({.field = "--explain"}, "needs a MODEL");
  if (options.json || !options.difference.empty())
    throw InputError({.field = "--explain"}, "tells a story: it goes without --json and --difference");
  if (options.numerics == std::vector<std::string>{std::string(kRayCastInfo.name)})
    throw InputError({.field = "--explain"},
                     "needs a mode of screen triangles; Embree's owner is always told");
}

}  // namespace

void add_verify_command(CLI::App& app, Outcome& outcome) {
  CLI::App* command = app.add_subcommand(
      "verify", "judge kernels and numeric modes: specification, exact oracle, end-to-end truth, Embree");
  const auto o = std::make_shared<VerifyOptions>();
  command->add_option("MODEL", o->model, "a .dat file or a generator (default: four built-in scenes)");
  command->add_option("SCENE", o->scene_file,
                      "scene parameter file (default: a camera that shows the model)");
  command->add_option("--kernel", o->kernels, "strategies (default: tile_parallel and ray_cast)");
  command->add_option("--numeric", o->numerics, "numeric modes (default: all that this CPU can run)");
  command->add_option("--size", o->size, "WxH in pixels, each 1 to 65536 (default: the scene's)");
  command->add_option("--fill", o->fill, "closed or top-left")->capture_default_str();
  command->add_option("--near", o->near_rule, "clip at the near plane, or off")->capture_default_str();
  command
      ->add_option("--techniques", o->techniques,
                   "techniques of the kernels: all, none, names joined by '+', or all-NAME")
      ->capture_default_str();
  command->add_option("--threads", o->threads, "threads of kernels and judges (default: all CPUs)")
      ->check(CLI::Range(1, 65536));
  command->add_flag("--oversubscribe", o->oversubscribe, "allow more threads than CPUs");
  command->add_option("--difference", o->difference,
                      "IMAGE.png: where one mode's picture differs from the oracle's, by class");
  command->add_option("--explain", o->explain,
                      "X,Y: which triangles claim this pixel, their edges and depths in each arithmetic");
  command->add_option(
      "--ids", o->ids,
      "IDS.npy: judge this picture, as render --ids of any build wrote it, in place of kernels");
  command->add_option("--depth", o->depth, "DEPTH.npy: the depths of that picture (render --depth)");
  command->add_flag("--json", o->json, "an array of rows in place of the table");
  command->callback([o, &outcome] {
    check_options(*o);
    Json rows = Json::array();
    int failed = 0;
    if (!o->model.empty()) {
      failed = verify_scene(*o, o->model, rows);
    } else {
      if (o->size.empty()) o->size = "640x360";
      for (const char* model : kBuiltInScenes) failed += verify_scene(*o, model, rows);
    }
    if (o->json && o->explain.empty()) fmt::print("{}\n", dump(rows, 2));
    if (failed > 0) outcome.exit_code = 1;
  });
}

}  // namespace rasterbench
