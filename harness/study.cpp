#include "harness/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>

#include "base/error.h"
#include "base/suggest.h"
#include "harness/hypothesis.h"
#include "harness/study_reader.h"
#include "kernels/kernel.h"
#include "reference/ray_cast_frame.h"

namespace rasterbench {
namespace {

/// Seconds that a kernel which tests every pixel for every triangle needs per test: 0.66e-9 on one core in
/// the published run (results/published, all_pixels serial), rounded up.
constexpr double kSecondsPerTest = 1.0e-9;

/// Why a point will not run, or empty.
std::string reason_to_skip(const Point& point, const Scene& scene, const SamplingPlan& sampling, int cpus,
                           bool oversubscribe) {
  const bool too_many_threads = point.execution.threads > cpus && !oversubscribe;
  const std::string too_many =
      fmt::format("{} threads on {} CPUs needs --oversubscribe", point.execution.threads, cpus);
  if (is_peer(point)) return !has_llvmpipe() ? llvmpipe_missing() : too_many_threads ? too_many : "";
  const Kernel& kernel = find_kernel(point.kernel);
  const Kernel::Variant& variant = kernel.variant(point.numeric);
  if (!variant.make)
    return fmt::format("{} cannot run in mode {}: {}", point.kernel, point.numeric, variant.reason);
  if (is_left_out(point.execution.backend))
    return fmt::format("this build has no backend {}", point.execution.backend);
  if (too_many_threads) return too_many;
  if (point.execution.backend == "tbb" &&
      (point.environment.wait_policy != "default" || point.environment.runtime != "default"))
    return "wait policy and runtime are OpenMP's: oneTBB has neither";
  if (!is_supported(point.isa)) return fmt::format("this CPU has no {}", to_string(point.isa));
  if (!find_mode(point.numeric)->has_screen_triangles) {
    try {
      check_ray_cast_settings(point.settings());
    } catch (const InputError& error) {
      return error.what();
    }
  }
  if (kernel.info().tests_every_pixel) {
    const double frame = static_cast<double>(scene.model.triangles.size()) * point.width * point.height *
                         kSecondsPerTest / point.execution.threads;
    const double cost = frame * 2 * sampling.min_samples;  // each sample is preceded by an untimed frame
    if (cost > sampling.point_seconds)
      return fmt::format(
          "predicted cost of {:.3g} s ({:.3g} s a frame) exceeds the point's time limit of {:g} s", cost,
          frame, sampling.point_seconds);
  }
  return {};
}

/// The axes that a peer shares with kernels.
std::string picture_of(const Point& point) {
  return fmt::format("{}/{}x{}", point.scene.name, point.width, point.height);
}

/// `point` with the same instruction set as any other: a report compares those of one picture, too.
Point without_isa(const Point& point) {
  Point common = point;
  common.isa = Point().isa;
  return common;
}

/// The place of `name` in `seen`, where it is put if it is new.
std::size_t index_of(const std::string& name, std::vector<std::string>& seen) {
  const auto found = std::find(seen.begin(), seen.end(), name);
  const auto index = static_cast<std::size_t>(found - seen.begin());
  if (found == seen.end()) seen.push_back(name);
  return index;
}

/// Opens the scene of `reference` unless its name is known already.
void open_once(const SceneReference& reference, std::map<std::string, SceneReference>& references,
               Study& study) {
  const auto [known, is_new] = references.emplace(reference.name, reference);
  const bool from_file = reference.line > 0;
  const Place place{.file = from_file ? study.file : "",
                    .line = from_file ? std::optional(reference.line) : std::nullopt,
                    .field = from_file ? "scene" : "--scene"};
  if (known->second.model != reference.model || known->second.parameters != reference.parameters)
    throw InputError(place, fmt::format("two scenes are named '{}': {} and {}", reference.name,
                                        known->second.model, reference.model));
  if (!is_new) return;
  try {
    Scene scene = open_scene(reference.model, reference.parameters);
    study.hashes[reference.name] = scene_hash(scene);
    study.scenes.emplace(reference.name, std::move(scene));
  } catch (const InputError& error) {
    throw InputError(place, error.what());
  }
}

/// Adds the pictures of a weak sweep, which is one of a number of threads, to the series that they belong to.
void add_weak_step(const Sweep& sweep, const std::map<std::string, Scene>& scenes,
                   std::vector<WeakSeries>& all) {
  for (std::size_t i = 0; i < sweep.weak_scenes.size(); ++i) {
    const std::string& name = sweep.scenes[i].name;
    const SceneParameters& own = scenes.at(name).parameters;
    std::vector<std::pair<int, int>> sizes = sweep.sizes;
    std::vector<std::string> words = sweep.weak_sizes;
    if (sizes.empty()) {
      sizes.emplace_back(own.width, own.height);
      words.push_back(fmt::format("{}x{}", own.width, own.height));
    }
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      auto series = std::find_if(all.begin(), all.end(), [&](const WeakSeries& known) {
        return known.kind == sweep.weak && known.scene == sweep.weak_scenes[i] && known.size == words[k];
      });
      if (series == all.end())
        series = all.insert(all.end(), WeakSeries{sweep.weak, sweep.weak_scenes[i], words[k], {}});
      series->steps[sweep.threads.front()] = {name, sizes[k].first, sizes[k].second};
    }
  }
}

/// Tells each point which others its blocks must hold: pairs need both.
void add_partners(const Study& study, const std::map<std::string, SceneReference>& references,
                  std::vector<PlannedPoint>& points) {
  std::map<std::string, PlannedPoint*> by_name;
  for (PlannedPoint& planned : points) by_name[planned.name] = &planned;
  for (const WeakSeries& series : study.weak)
    for (PlannedPoint& planned : points) {
      if (planned.point.execution.threads == 1 || !series.has(planned.point)) continue;
      const WeakStep& first = series.steps.at(1);
      Point base = planned.point;
      base.scene = references.at(first.scene);
      base.width = first.width;
      base.height = first.height;
      base.execution.threads = 1;
      if (is_peer(base)) base = peer_point(base.kernel, base.scene, base.width, base.height, 1);
      planned.partners.push_back(point_name(base));
    }
  for (const Hypothesis& hypothesis : study.hypotheses) {
    if (!hypothesis.untested.empty()) continue;
    std::vector<std::string> sides = hypothesis.faster;
    sides.insert(sides.end(), hypothesis.slower.begin(), hypothesis.slower.end());
    for (const std::string& name : sides)
      for (const std::string& other : sides)
        if (other != name) by_name.at(name)->partners.push_back(other);
  }
}

/// Each family's name, by what `family_name` gives its points; those that hypotheses and weak scaling compare
/// have one.
std::map<std::string, std::string> joined_families(
    const Study& study, const std::vector<PlannedPoint>& points,
    const std::function<std::string(const Point&)>& family_name) {
  std::map<std::string, std::string> joined, of_point;
  for (const PlannedPoint& planned : points) {
    const std::string name = family_name(planned.point);
    joined.emplace(name, name);
    of_point.emplace(planned.name, name);
  }
  const auto join = [&](const std::string& a, const std::string& b) {
    const auto first = of_point.find(a), second = of_point.find(b);
    if (first == of_point.end() || second == of_point.end()) return;  // left out by the filter
    const std::string kept = joined.at(first->second), replaced = joined.at(second->second);
    for (auto& [name, family] : joined)
      if (family == replaced) family = kept;
  };
  for (const PlannedPoint& planned : points)
    for (const std::string& partner : planned.partners) join(partner, planned.name);
  for (const WeakSeries& series : study.weak) {
    const PlannedPoint* first = nullptr;
    for (const PlannedPoint& planned : points) {
      if (!series.has(planned.point)) continue;
      if (first) join(first->name, planned.name);
      if (!first) first = &planned;
    }
  }
  return joined;
}

}  // namespace

std::string comparison_of(const Point& point) {
  Point common = point;
  common.kernel = "null";
  common.execution = {};
  common.environment = {};
  common.tile = Point().tile;
  common.generality = Point().generality;
  common.techniques = Point().techniques;
  return point_name(common);
}

std::string trade_of(const Point& point) {
  Point common = point;
  common.numeric = "any";
  return comparison_of(common);
}

bool is_literal_program(const Point& point) {
  return point.numeric == "two_product" && point.execution.backend == "serial" &&
         (point.kernel == "bounding_box" || point.kernel == "all_pixels");
}

std::string curve_of(const Point& point) {
  Point curve = point;
  curve.execution.threads = 0;
  return point_name(curve);
}

Study read_study(const std::filesystem::path& file, const StudyOptions& options) {
  Study study = read_study_file(file);
  if (options.time_limit) study.sampling.time_limit = *options.time_limit;
  const PlanTarget target{options.cpus.value_or(available_cpus()), options.isa.value_or(best_isa())};
  const std::vector<Sweep> sweeps = read_sweeps(file, study.text, target, options.scenes, options.sizes);

  Selectable whole;
  whole.replaced = !options.scenes.empty() || !options.sizes.empty();
  std::set<std::string> names;
  std::map<std::string, SceneReference> references;
  for (const Sweep& sweep : sweeps) {
    for (const SceneReference& reference : sweep.scenes) open_once(reference, references, study);
    span_points(sweep, study.scenes, [&](const Point& point) {
      PlannedPoint planned{point, point_name(point), {}};
      if (names.insert(planned.name).second) whole.points.push_back(std::move(planned));
    });
    add_weak_step(sweep, study.scenes, whole.weak);
  }
  study.weak = whole.weak;
  study.hypotheses = read_hypotheses(file, study.text, target, whole);
  add_partners(study, references, whole.points);

  std::set<std::string> trades, pictures;  // trades with a literal program, pictures with a peer
  std::vector<PlannedPoint> all;
  for (PlannedPoint& planned : whole.points) {
    if (options.filter && std::regex_search(planned.name, *options.filter) == options.filter_excludes)
      continue;
    if (is_peer(planned.point)) pictures.insert(picture_of(planned.point));
    if (is_literal_program(planned.point)) trades.insert(trade_of(without_isa(planned.point)));
    all.push_back(std::move(planned));
  }
  const auto family_name = [&](const Point& point) {
    const std::string trade = trade_of(without_isa(point)), picture = picture_of(point);
    return pictures.contains(picture) ? picture
           : trades.contains(trade)   ? trade
                                      : comparison_of(without_isa(point));
  };
  const std::map<std::string, std::string> joined = joined_families(study, all, family_name);
  std::vector<std::string> families;
  for (PlannedPoint& planned : all) {
    const Point& point = planned.point;
    planned.family = index_of(joined.at(family_name(point)), families);
    if (planned.family % static_cast<std::size_t>(options.shards) !=
        static_cast<std::size_t>(options.shard - 1))
      continue;
    planned.skip = reason_to_skip(point, study.scenes.at(point.scene.name), study.sampling, target.cpus,
                                  options.oversubscribe);
    study.points.push_back(std::move(planned));
  }
  study.families = families.size();
  if (static_cast<std::size_t>(options.shards) > families.size() && !families.empty())
    throw InputError(
        {.field = "--shard"},
        fmt::format("this study has {} comparison{} that must stay whole: use at most as many shards",
                    families.size(), families.size() == 1 ? "" : "s"));
  return study;
}

std::vector<std::filesystem::path> known_studies() {
  std::vector<std::filesystem::path> files;
  std::error_code missing;
  // build/PRESET/bin/rasterbench -> the checkout's studies/
  const auto program = std::filesystem::read_symlink("/proc/self/exe", missing);
  const auto folder = program.parent_path().parent_path().parent_path().parent_path() / "studies";
  for (const auto& entry : std::filesystem::directory_iterator(folder, missing))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace rasterbench
