#include "harness/study_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "base/error.h"
#include "base/suggest.h"
#include "base/table_reader.h"
#include "harness/weak.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

void read_sampling(const toml::table& table, const std::string& file, SamplingPlan& sampling) {
  TableReader reader(table, file);
  reader.number("target", 1e-4, 1, sampling.target);
  reader.integer("min_samples", 6, 100000, sampling.min_samples);
  reader.integer("max_samples", 6, 100000, sampling.max_samples);
  reader.number("point_seconds", 0.01, 1e6, sampling.point_seconds);
  reader.number("frame_seconds", 0, 1e6, sampling.frame_seconds);
  reader.number("time_limit", 0, 1e7, sampling.time_limit);
  reader.integer("launches", 1, 100, sampling.launches);
  reader.reject_unknown_keys("[sampling]");
  if (sampling.max_samples < sampling.launches)
    reader.fail(*table.get("launches"), "launches",
                fmt::format("{} launches need at least as many samples: max_samples is {}", sampling.launches,
                            sampling.max_samples));
  if (sampling.max_samples < sampling.min_samples) {
    const bool given = table.contains("max_samples");
    reader.fail(*table.get(given ? "max_samples" : "min_samples"), given ? "max_samples" : "min_samples",
                fmt::format("max_samples ({}) is below min_samples ({})", sampling.max_samples,
                            sampling.min_samples));
  }
}

SceneReference relative_to(SceneReference scene, const std::filesystem::path& folder) {
  const auto resolve = [&](std::string& path) {
    if (path.empty() || !std::filesystem::path(path).has_extension()) return;
    const auto beside = folder / path;
    if (std::filesystem::exists(beside)) path = beside.string();
  };
  if (scene.model.find(':') == std::string::npos) resolve(scene.model);
  resolve(scene.parameters);
  return scene;
}

/// "max", "1..max": every count up to eight CPUs, then powers of two and the largest.
std::vector<int> parse_threads(const std::string& text, int max) {
  if (text == "max") return {max};
  if (text != "1..max")
    throw InputError(unknown_name("value", text, std::vector<std::string>{"max", "1..max"}));
  std::vector<int> counts;
  for (int n = 1; n < max; n = n < 8 ? n + 1 : n * 2) counts.push_back(n);
  counts.push_back(max);
  return counts;
}

/// Whether `kernel` can carry `mode`, on a CPU that has what the mode needs.
bool carries(const std::string& kernel, const std::string& mode) {
  const Kernel::Variant& variant = find_kernel(kernel).variant(mode);
  return variant.make || variant.reason == find_mode(mode)->unavailable;
}

/// The names of a list in which "all" stands for `everything` that `suits`.
std::vector<std::string> expanded(const std::vector<std::string>& words,
                                  const std::vector<std::string>& everything,
                                  const std::function<bool(const std::string&)>& suits) {
  std::vector<std::string> names;
  for (const std::string& word : words)
    if (word == "all")
      std::copy_if(everything.begin(), everything.end(), std::back_inserter(names), suits);
    else
      names.push_back(word);
  return names;
}

/// Replaces "all": among the kernels by those that can carry a mode of the sweep, among the modes by those
/// that a kernel of the sweep can carry.
void expand_all(Sweep& sweep) {
  std::vector<std::string> kernel_names, mode_names;
  for (const Kernel& kernel : kernels())
    if (!kernel.info().hidden) kernel_names.emplace_back(kernel.info().name);
  for (const ModeInfo& mode : mode_infos()) mode_names.emplace_back(mode.name);
  const auto everything = [](const std::string&) { return true; };
  const auto all_modes = expanded(sweep.numerics, mode_names, everything);
  sweep.kernels = expanded(sweep.kernels, kernel_names, [&](const std::string& kernel) {
    return std::any_of(all_modes.begin(), all_modes.end(),
                       [&](const std::string& mode) { return carries(kernel, mode); });
  });
  sweep.numerics = expanded(sweep.numerics, mode_names, [&](const std::string& mode) {
    return std::any_of(sweep.kernels.begin(), sweep.kernels.end(),
                       [&](const std::string& kernel) { return carries(kernel, mode); });
  });
}

/// An execution of the list, with chunks multiplied in where the schedule takes one and none is written.
std::vector<ExecutionConfig> with_chunks(const ExecutionConfig& execution, const std::vector<int>& chunks) {
  if (execution.chunk || chunks.empty() || is_left_out(execution.backend)) return {execution};
  if (find_schedule(execution).chunk.empty()) return {execution};
  std::vector<ExecutionConfig> all;
  for (const int chunk : chunks) {
    all.push_back(execution);
    if (chunk > 0) all.back().chunk = chunk;
  }
  return all;
}

ExecutionConfig checked_execution(const std::string& text) {
  const ExecutionConfig execution = parse_execution(text, "execution");
  if (!is_left_out(execution.backend)) find_schedule(execution);
  return execution;
}

/// "MODEL[@SCENE.txt]" or {name = "...", model = "...", parameters = "..."}.
SceneReference read_scene(const TableReader& sweep, const toml::node& node, const std::string& file) {
  if (node.is_string()) return parse_scene_reference(*node.value<std::string>());
  if (!node.is_table())
    sweep.fail(node, "scene",
               "must be a string such as \"teapot\" or \"a.dat@a.txt\", or a table with name and model");
  TableReader reader(*node.as_table(), file);
  std::string name, model, parameters;
  reader.text("name", name);
  reader.text("model", model);
  reader.text("parameters", parameters);
  reader.reject_unknown_keys("a scene");
  if (model.empty()) reader.fail(node, "model", "is missing from this scene");
  SceneReference scene = parse_scene_reference(parameters.empty() ? model : model + "@" + parameters);
  if (!name.empty()) scene.name = name;
  if (scene.name.find('/') != std::string::npos)
    reader.fail(node, "name", "must not hold a '/': points are named by paths");
  return scene;
}

/// A size; of weak = "pixels" that of one thread, which "*threads" stands behind.
std::pair<int, int> parse_sweep_size(const std::string& text, const std::string& weak,
                                     const std::string& field) {
  const bool grows = text.ends_with(kTimesThreads);
  if (grows != (weak == "pixels"))
    throw InputError({.field = field},
                     grows ? fmt::format("'{}' grows with the threads: needs weak = \"pixels\"", text)
                           : fmt::format("'{}' does not grow: weak = \"pixels\" needs sizes such as "
                                         "\"960x540{}\"",
                                         text, kTimesThreads));
  return parse_size(text.substr(0, grows ? text.size() - kTimesThreads.size() : text.size()), field);
}

/// A weak sweep as one for each number of threads; any other as it is.
std::vector<Sweep> with_weak_steps(const Sweep& sweep) {
  if (sweep.weak.empty()) return {sweep};
  std::vector<Sweep> steps;
  for (const int threads : sweep.threads) {
    Sweep& step = steps.emplace_back(sweep);
    step.threads = {threads};
    for (SceneReference& scene : step.scenes) {
      step.weak_scenes.push_back(scene.name);
      if (sweep.weak == "triangles") scene = scene_for_threads(scene, threads);
    }
    for (auto& size : step.sizes) {
      const std::string one = fmt::format("{}x{}", size.first, size.second);
      step.weak_sizes.push_back(sweep.weak == "pixels" ? one + kTimesThreads : one);
      if (sweep.weak == "pixels") size = size_for_threads(size, threads);
    }
  }
  return steps;
}

Sweep read_sweep(const toml::table& table, const std::string& file, const std::filesystem::path& folder,
                 const PlanTarget& target) {
  Sweep sweep;
  TableReader reader(table, file);
  reader.each("scene", [&](const toml::node& node) {
    sweep.scenes.push_back(relative_to(read_scene(reader, node, file), folder));
    sweep.scenes.back().line = static_cast<std::int64_t>(node.source().begin.line);
  });
  std::vector<std::string> weak;
  reader.words("weak", kWeakKinds, "", weak);
  if (weak.size() > 1) reader.fail(*table.get("weak"), "weak", "must be one word: a sweep grows in one way");
  sweep.weak = weak.front();
  reader.strings("size", sweep.sizes,
                 [&](const std::string& s) { return parse_sweep_size(s, sweep.weak, "size"); });
  if (sweep.weak.empty())
    for (const SceneReference& scene : sweep.scenes)
      if (scene.model.find(kTimesThreads) != std::string::npos)
        reader.fail(*table.get("scene"), "scene",
                    fmt::format("'{}' grows with the threads: this [[sweep]] needs weak = \"triangles\"",
                                scene.model));
  reader.strings("kernel", sweep.kernels, [](const std::string& word) {
    if (word != "all") find_kernel(word);
    return word;
  });
  reader.strings("peer", sweep.peers, [](const std::string& word) {
    if (std::find(kPeers.begin(), kPeers.end(), word) == kPeers.end())
      throw InputError(unknown_name("peer", word, kPeers));
    return word;
  });
  std::vector<std::string> modes{"all"};
  for (const ModeInfo& info : mode_infos()) modes.emplace_back(info.name);
  reader.words("numeric", modes, "f32", sweep.numerics);
  expand_all(sweep);
  reader.strings("fill", sweep.fills, [](const std::string& s) { return parse_fill(s, "fill"); });
  reader.strings("near", sweep.nears, [](const std::string& s) { return parse_near(s, "near"); });
  std::vector<ExecutionConfig> executions;
  reader.strings("execution", executions, checked_execution);
  std::vector<int> chunks;
  reader.each("chunk", [&](const toml::node& node) {
    const auto value = node.value<std::int64_t>();
    if (node.is_string() && *node.value<std::string>() == "default") return chunks.push_back(0);
    if (!node.is_integer() || *value < 1 || *value > (1 << 30))
      reader.fail(node, "chunk", "must be \"default\" or whole numbers from 1");
    chunks.push_back(static_cast<int>(*value));
  });
  for (const ExecutionConfig& execution : executions)
    for (const ExecutionConfig& one : with_chunks(execution, chunks)) sweep.executions.push_back(one);
  reader.each("threads", [&](const toml::node& node) {
    if (const auto value = node.value<std::int64_t>(); node.is_integer() && *value >= 1 && *value <= 65536)
      return sweep.threads.push_back(static_cast<int>(*value));
    if (!node.is_string())
      reader.fail(node, "threads", "must be whole numbers from 1, \"max\" or \"1..max\"");
    const auto counts = reader.located(
        node, "threads", [&] { return parse_threads(*node.value<std::string>(), target.cpus); });
    sweep.threads.insert(sweep.threads.end(), counts.begin(), counts.end());
  });
  std::vector<std::string> bindings, waits, runtimes;
  reader.words("binding", kBindings, "none", bindings);
  reader.words("wait_policy", kWaitPolicies, "default", waits);
  reader.words("runtime", kRuntimes, "default", runtimes);
  for (const auto& binding : bindings)
    for (const auto& wait : waits)
      for (const auto& runtime : runtimes) sweep.environments.push_back({binding, wait, runtime});
  reader.each("tile", [&](const toml::node& node) {
    const auto value = node.value<std::int64_t>();
    if (!node.is_integer() || *value < 1 || *value > kMaxImageSide)
      reader.fail(node, "tile", fmt::format("must be whole numbers of pixels from 1 to {}", kMaxImageSide));
    sweep.tiles.push_back(static_cast<int>(*value));
  });
  reader.words("cache", kCaches, "warm", sweep.caches);
  reader.strings("generality", sweep.generalities,
                 [](const std::string& s) { return parse_generality(s, "generality"); });
  reader.strings("isa", sweep.isas,
                 [&](const std::string& s) { return s == "best" ? target.best : parse_isa(s, "isa"); });
  reader.strings("techniques", sweep.techniques,
                 [](const std::string& s) { return parse_techniques(s, "techniques"); });
  reader.reject_unknown_keys("[[sweep]]");

  if (sweep.kernels.empty() && sweep.peers.empty())
    reader.fail(table, "kernel", "is missing from this [[sweep]], which has no peer either");
  if (sweep.kernels.empty())
    for (const char* axis : {"numeric", "fill", "near", "execution", "chunk", "binding", "wait_policy",
                             "runtime", "tile", "cache", "generality", "techniques"})
      if (const toml::node* node = table.get(axis))
        reader.fail(*node, axis, "is an axis of kernels, of which this [[sweep]] has none");
  if (sweep.executions.empty() && !sweep.kernels.empty())
    reader.fail(table, "execution", "is missing from this [[sweep]]");
  if (sweep.fills.empty()) sweep.fills.push_back(FillRule::kClosed);
  if (sweep.nears.empty()) sweep.nears.push_back(NearRule::kClip);
  if (sweep.threads.empty()) sweep.threads = {target.cpus};
  if (!sweep.weak.empty() && std::find(sweep.threads.begin(), sweep.threads.end(), 1) == sweep.threads.end())
    reader.fail(table.contains("threads") ? *table.get("threads") : table, "threads",
                "weak scaling is measured against one thread: 1 is missing");
  if (sweep.weak == "pixels" && sweep.sizes.empty())
    reader.fail(table, "size", "is missing: weak = \"pixels\" needs the size for one thread");
  if (sweep.tiles.empty()) sweep.tiles.push_back(64);
  if (sweep.generalities.empty()) sweep.generalities.push_back(Generality::kMinimal);
  if (sweep.isas.empty()) sweep.isas.push_back(target.best);
  if (sweep.techniques.empty()) sweep.techniques.push_back({});
  return sweep;
}

}  // namespace

Study read_study_file(const std::filesystem::path& path) {
  Study study;
  study.file = path.string();
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    std::vector<std::string> known;
    for (const auto& study_file : known_studies()) known.push_back(study_file.string());
    throw InputError({.file = study.file},
                     known.empty() ? "no such study file" : unknown_name("study", study.file, known));
  }
  study.text.assign(std::istreambuf_iterator<char>(file), {});
  const toml::table table = parse_toml(study.text, study.file);
  TableReader reader(table, study.file);
  study.name = path.stem().string();
  reader.text("name", study.name);
  if (study.name.empty() || study.name.starts_with('.') || study.name.find('/') != std::string::npos)
    reader.fail(*table.get("name"), "name", "must be a file name: its results go into results/NAME");
  reader.text("question", study.question);
  reader.integer("seed", 0, std::numeric_limits<std::int64_t>::max(), study.seed);
  if (const toml::node* node = reader.find("sampling")) {
    if (!node->is_table()) reader.fail(*node, "sampling", "must be a table");
    read_sampling(*node->as_table(), study.file, study.sampling);
  }
  reader.find("sweep");
  reader.find("hypothesis");
  reader.reject_unknown_keys("a study");
  return study;
}

std::vector<Sweep> read_sweeps(const std::filesystem::path& path, const std::string& text,
                               const PlanTarget& target, const std::vector<std::string>& scenes,
                               const std::vector<std::string>& sizes) {
  const std::string file = path.string();
  const toml::table table = parse_toml(text, file);
  const toml::array* sweeps = table.get_as<toml::array>("sweep");
  if (const toml::node* other = table.get("sweep"); other && !sweeps)
    throw InputError(
        {.file = file, .line = static_cast<std::int64_t>(other->source().begin.line), .field = "sweep"},
        "must be [[sweep]] tables, with two brackets");
  if (!sweeps || sweeps->empty())
    throw InputError({.file = file, .field = "sweep"}, "a study needs at least one [[sweep]]");
  std::vector<Sweep> all;
  for (const toml::node& node : *sweeps) {
    if (!node.is_table()) throw InputError({.file = file, .field = "sweep"}, "must be [[sweep]] tables");
    Sweep sweep = read_sweep(*node.as_table(), file, path.parent_path(), target);
    if (!scenes.empty()) {
      sweep.scenes.clear();
      for (const std::string& scene : scenes) sweep.scenes.push_back(parse_scene_reference(scene));
    }
    if (!sizes.empty()) {
      sweep.sizes.clear();
      for (const std::string& size : sizes)
        sweep.sizes.push_back(parse_sweep_size(size, sweep.weak, "--size"));
    }
    if (sweep.scenes.empty())
      throw InputError(
          {.file = file, .line = static_cast<std::int64_t>(node.source().begin.line), .field = "scene"},
          "is missing from this [[sweep]]");
    try {
      for (Sweep& step : with_weak_steps(sweep)) all.push_back(std::move(step));
    } catch (const InputError& error) {
      if (!scenes.empty() && sweep.weak == "triangles") throw InputError({.field = "--scene"}, error.what());
      throw InputError(
          {.file = file, .line = static_cast<std::int64_t>(node.source().begin.line), .field = "weak"},
          error.what());
    }
  }
  return all;
}

/// The axes of the geometry stage; one combination where there is no such stage.
std::vector<std::pair<Generality, Isa>> of_geometry(const Sweep& sweep, const std::string& numeric) {
  if (!find_mode(numeric)->has_screen_triangles) return {{Generality::kMinimal, Isa::kBaseline}};
  std::vector<std::pair<Generality, Isa>> all;
  for (const Generality generality : sweep.generalities)
    for (const Isa isa : sweep.isas) all.emplace_back(generality, isa);
  return all;
}

void span_points(const Sweep& sweep, const std::map<std::string, Scene>& scenes,
                 const std::function<void(const Point&)>& visit) {
  for (const SceneReference& scene : sweep.scenes) {
    std::vector<std::pair<int, int>> sizes = sweep.sizes;
    const SceneParameters& own = scenes.at(scene.name).parameters;
    if (sizes.empty()) sizes.emplace_back(own.width, own.height);
    for (const auto& [width, height] : sizes) {
      for (const std::string& numeric : sweep.numerics)
        for (const FillRule fill : sweep.fills)
          for (const NearRule near_rule : sweep.nears)
            for (const std::string& kernel : sweep.kernels)
              for (const int tile : find_kernel(kernel).info().has_tiles ? sweep.tiles : std::vector<int>{64})
                for (const ExecutionConfig& execution : sweep.executions)
                  for (const int threads :
                       execution.backend == "serial" ? std::vector<int>{1} : sweep.threads)
                    for (const Environment& environment : sweep.environments)
                      for (const std::string& cache : sweep.caches)
                        for (const auto& [generality, isa] : of_geometry(sweep, numeric))
                          for (const Techniques& techniques : sweep.techniques) {
                            Point point{scene,     width,       height, kernel, numeric,    fill, near_rule,
                                        execution, environment, tile,   cache,  generality, isa,  techniques};
                            point.execution.threads = threads;
                            visit(point);
                          }
      for (const std::string& peer : sweep.peers)
        for (const int threads : sweep.threads) visit(peer_point(peer, scene, width, height, threads));
    }
  }
}

}  // namespace rasterbench
