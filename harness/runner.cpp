#include "harness/runner.h"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "base/error.h"
#include "execution/binding.h"
#include "harness/explain_point.h"
#include "harness/limits.h"
#include "harness/verdict_json.h"
#include "harness/verify.h"
#include "kernels/kernel.h"
#include "scene/image.h"

extern char** environ;

namespace rasterbench {
namespace {

/// Takes what Google Benchmark reports of a run instead of printing it.
class CollectingReporter final : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs)
      if (run.run_type == Run::RT_Iteration) last = run;
  }
  Run last;
};

/// Every worker reads and writes its share of a buffer that is larger than the caches, so that little of the
/// point is left in a last-level cache of up to kSweepBytes or in the workers' own.
void sweep_caches(Execution& execution) {
  constexpr std::size_t kSweepBytes = std::size_t{256} << 20, kShareBytes = std::size_t{16} << 20;
  static std::vector<std::uint64_t> sink(kSweepBytes / sizeof(std::uint64_t), 1);
  const std::int64_t shares = kSweepBytes / kShareBytes;
  execution.uniform_loop(shares, [&](std::int64_t share, int) {
    const std::size_t size = kShareBytes / sizeof(std::uint64_t),
                      first = static_cast<std::size_t>(share) * size;
    for (std::size_t i = first; i < first + size; i += 8) sink[i] += 1;  // one word a cache line
  });
  benchmark::DoNotOptimize(sink.data());
}

class Runner {
 public:
  Json answer(const Json& request) {
    const std::string op = request.at("op");
    if (op == "limit")
      return measure_limit({request.at("threads"), {request.at("read_bytes"), request.at("write_bytes")}},
                           request.at("seconds"));
    if (op == "peer") return unless_missing([] { return peer_json(llvmpipe_version()); });
    const Point point = point_from_json(request.at("point"));
    if (op == "verify" && is_peer(point))
      return unless_missing([&] { return verifier_.judge(point, scene(point.scene)); });
    if (op == "verify") return verifier_.judge(point, scene(point.scene));
    if (op == "sample") return sample(point, request.at("name"), request.at("frames"));
    if (op == "explain") return explain_point(point, scene(point.scene), request.at("samples"));
    if (op == "image") return image(point, request.at("path").get<std::string>());
    throw Error("unknown request " + op);
  }

 private:
  /// Not to have what a peer needs is no error of the point.
  template <class Answer>
  static Json unless_missing(Answer answer) {
    try {
      return answer();
    } catch (const InputError& error) {
      return {{"skip", error.what()}};
    }
  }

  const Scene& scene(const SceneReference& reference) {
    auto found = scenes_.find(reference.name);
    if (found == scenes_.end())
      found = scenes_.emplace(reference.name, open_scene(reference.model, reference.parameters)).first;
    return found->second;
  }

  std::unique_ptr<Renderer> new_renderer(const Point& point) {
    const Scene& drawn = scene(point.scene);
    if (is_peer(point)) return make_llvmpipe_renderer(drawn, point.settings());
    return make_renderer(point.kernel, point.numeric,
                         {&drawn, point.settings(), point.execution, 0, /*keeps_ids=*/false});
  }

  /// One sample: a fresh renderer, one untimed frame, then `frames` timed ones as one iteration of a Google
  /// Benchmark run.
  Json sample(const Point& point, const std::string& name, int frames) {
    Json answer;
    const auto probe = is_peer(point) ? nullptr : make_execution(point.execution);
    if (point.execution.backend == "openmp") answer["runtime_observed"] = openmp_runtime();
    if (probe) answer["threads_observed"] = observe_threads(*probe).count;
    const auto renderer = new_renderer(point);
    renderer->draw();
    if (!probe) answer["threads_observed"] = observed_llvmpipe_threads();  // its first frame starts them
    if (probe && point.cache == "cold") sweep_caches(*probe);

    if (Execution* execution = renderer->execution()) execution->reset_sightings();
    StageSeconds stages;
    std::optional<double> loop_seconds;
    const FrameReport* report = nullptr;  // of the last frame; read after the clock has stopped
    benchmark::ClearRegisteredBenchmarks();
    benchmark::RegisterBenchmark(
        name.c_str(),
        [&](benchmark::State& state) {
          loop_seconds = 0.0;
          stages = {};  // Google Benchmark may be told to call this more than once: the last call counts
          for ([[maybe_unused]] const auto iteration : state) {
            const auto begin = std::chrono::steady_clock::now();
            for (int frame = 0; frame < frames; ++frame) {
              report = &renderer->draw();
              stages += report->seconds;
              loop_seconds = sum_of_known(loop_seconds, report->loop_seconds);
            }
            state.SetIterationTime(
                std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
          }
        })
        ->Iterations(1)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
    CollectingReporter reporter;
    benchmark::RunSpecifiedBenchmarks(&reporter, nullptr, ".");
    if (reporter.last.error_occurred) throw Error(reporter.last.error_message);

    const double per_frame_ms = 1e3 / frames;
    answer["ms"] = reporter.last.real_accumulated_time * per_frame_ms;
    const auto stage_ms = [&](const std::optional<double>& seconds) {
      return seconds ? Json(*seconds * per_frame_ms) : Json();
    };
    answer["stages"] = {{"clear", stage_ms(stages.clear)},
                        {"geometry", stage_ms(stages.geometry)},
                        {"raster", stage_ms(stages.raster)},
                        {"resolve", stage_ms(stages.resolve)}};
    answer["loop_ms"] = renderer->execution() ? stage_ms(loop_seconds) : Json();
    Json& threads = answer["per_thread"] = Json::array();
    for (std::size_t i = 0; i < report->raster_tally.size(); ++i) {
      const WorkerTally& worker = report->raster_tally[i];
      const Sightings& seen = renderer->execution()->sightings()[i];
      threads.push_back(
          {{"busy_ms", worker.busy_seconds * 1e3},
           {"idle_ms", std::max(0.0, 1e3 * (report->seconds.raster.value_or(0) - worker.busy_seconds))},
           {"iterations", worker.iterations},
           {"chunks", worker.chunks},
           {"failed_exchanges", worker.contention.failed_exchanges},
           {"contended_locks", worker.contention.contended_locks},
           {"lock_wait_ms", worker.contention.lock_wait_seconds * 1e3},
           {"cpu", worker.cpu},
           {"first_cpu", seen.first},
           {"last_cpu", seen.last},
           {"cpus", seen.cpus},
           {"moves", seen.moves}});
    }
    // A serial loop runs on the initial thread, which a runtime may leave unbound until its first team.
    if (point.environment.binding != "none" && probe && point.execution.backend != "serial") {
      const std::string broken = broken_binding(renderer->execution()->sightings(), binding_);
      answer["binding"] = broken.empty() ? "kept" : broken;
    }
    answer["picture"] = picture_hash(*renderer);
    for (const auto& [counter, value] : reporter.last.counters) answer["counters"][counter] = value.value;
    return answer;
  }

  Json image(const Point& point, const std::string& path) {
    const auto renderer = new_renderer(point);
    renderer->draw();
    write_image(path, renderer->colours(), point.width, point.height);
    return Json::object();
  }

  Verifier verifier_;
  const Binding binding_ = process_binding();
  std::map<std::string, Scene> scenes_;
};

/// Where RASTERBENCH_LIBOMP says that LLVM's OpenMP runtime is, or where a distribution puts it.
std::string find_libomp() {
  if (const char* named = std::getenv("RASTERBENCH_LIBOMP")) return named;
  for (const char* path : {"/usr/lib/x86_64-linux-gnu/libomp.so.5", "/usr/lib/aarch64-linux-gnu/libomp.so.5",
                           "/usr/lib64/libomp.so", "/usr/lib/libomp.so"})
    if (std::filesystem::exists(path)) return path;
  return {};
}

}  // namespace

std::map<std::string, std::string> environment_variables(const Environment& environment) {
  std::map<std::string, std::string> variables;
  variables["OMP_PROC_BIND"] = environment.binding == "none" ? "false" : environment.binding;
  variables["OMP_PLACES"] = environment.binding == "none" ? "" : "cores";
  variables["OMP_WAIT_POLICY"] = environment.wait_policy == "default" ? "" : environment.wait_policy;
  variables["OMP_DYNAMIC"] = "false";
  // What would change a schedule or a thread count behind the study's back.
  for (const char* name : {"OMP_SCHEDULE", "OMP_NUM_THREADS", "GOMP_CPU_AFFINITY", "KMP_AFFINITY"})
    variables[name] = "";
  // Google Benchmark takes its options from these too; the study's are given as arguments.
  for (char** variable = environ; *variable; ++variable)
    if (const std::string text(*variable); text.starts_with("BENCHMARK_"))
      variables[text.substr(0, text.find('='))] = "";
  if (environment.llvmpipe_threads > 0) variables.merge(llvmpipe_variables(environment.llvmpipe_threads));
  const std::string own = openmp_runtime();
  if (environment.runtime == "libgomp" && own != "libgomp")
    throw InputError(fmt::format("this program runs under {}: libgomp serves programs of gcc only", own));
  if (environment.runtime == "libomp" && own != "libomp") {  // which has libgomp's interface, too
    const std::string path = find_libomp();
    if (path.empty()) throw InputError("LLVM's OpenMP runtime (libomp) is not installed on this machine");
    const char* others = std::getenv("LD_PRELOAD");
    variables["LD_PRELOAD"] = others && *others ? path + ":" + others : path;
  }
  return variables;
}

int run_runner(const std::vector<std::string>& benchmark_flags) {
  std::vector<std::string> words{"rasterbench"};
  words.insert(words.end(), benchmark_flags.begin(), benchmark_flags.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  int argc = static_cast<int>(argv.size());
  benchmark::Initialize(&argc, argv.data());

  Runner runner;
  for (std::string line; std::getline(std::cin, line);) {
    Json answer;
    try {
      answer = runner.answer(Json::parse(line));
    } catch (const std::exception& error) {
      answer = Json::object();
      answer["error"] = error.what();
    }
    std::cout << dump(answer) << std::endl;  // flushed: the coordinator waits for it
  }
  return 0;
}

}  // namespace rasterbench
