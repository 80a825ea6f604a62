#include "harness/context.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <hwloc.h>
#include <sched.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <memory>
#include <sstream>

#include "base/hash.h"
#include "build_info.h"
#include "harness/hypothesis.h"
#include "machine/topology.h"
#include "reference/judge.h"

extern char** environ;

namespace rasterbench {
namespace {

/// The first line of a file of the kernel's, or why there is none.
Json first_line(const char* path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) return fmt::format("unavailable: no {}", path);
  return line;
}

Json allowed_cpus() {
  cpu_set_t mask;
  CPU_ZERO(&mask);
  if (sched_getaffinity(0, sizeof mask, &mask) != 0) return "unavailable: sched_getaffinity failed";
  Json cpus = Json::array();
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
    if (CPU_ISSET(cpu, &mask)) cpus.push_back(cpu);
  return cpus;
}

Json caches(hwloc_topology_t topology) {
  Json list = Json::array();
  for (const hwloc_obj_type_t type :
       {HWLOC_OBJ_L1CACHE, HWLOC_OBJ_L2CACHE, HWLOC_OBJ_L3CACHE, HWLOC_OBJ_L4CACHE}) {
    const hwloc_obj_t cache = hwloc_get_obj_by_type(topology, type, 0);
    if (!cache) continue;
    list.push_back({{"level", cache->attr->cache.depth},
                    {"size_bytes", cache->attr->cache.size},
                    {"shared_by", hwloc_bitmap_weight(cache->cpuset)}});
  }
  return list;
}

}  // namespace

Json describe_machine() {
  Json machine;
  utsname name{};
  uname(&name);
  machine["hostname"] = name.nodename;
  machine["cpu"] = cpu_model();
  machine["cpus_online"] = sysconf(_SC_NPROCESSORS_ONLN);
  machine["cpus_allowed"] = allowed_cpus();
  hwloc_topology_t topology = nullptr;
  if (hwloc_topology_init(&topology) == 0 && hwloc_topology_load(topology) == 0) {
    const int cores = hwloc_get_nbobjs_by_type(topology, HWLOC_OBJ_CORE);
    machine["cores"] = cores;
    machine["packages"] = hwloc_get_nbobjs_by_type(topology, HWLOC_OBJ_PACKAGE);
    machine["numa_nodes"] = hwloc_get_nbobjs_by_type(topology, HWLOC_OBJ_NUMANODE);
    machine["smt"] = hwloc_get_nbobjs_by_type(topology, HWLOC_OBJ_PU) > cores;
    machine["caches"] = caches(topology);
  } else {
    machine["cores"] = "unavailable: hwloc cannot read the topology";
  }
  if (topology) hwloc_topology_destroy(topology);
  machine["topology"] = Json::array();
  for (const CpuPlace& place : cpu_places())
    machine["topology"].push_back({{"cpu", place.cpu},
                                   {"core", place.core},
                                   {"package", place.package},
                                   {"numa_node", place.numa_node}});
  if (machine["topology"].empty()) machine["topology"] = "unavailable: hwloc cannot read the topology";
  machine["memory_bytes"] = std::int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGE_SIZE);
  machine["governor"] = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  machine["load_average"] = first_line("/proc/loadavg");
  machine["kernel"] = fmt::format("{} {}", name.sysname, name.release);
  machine["virtualisation"] = first_line("/sys/class/dmi/id/sys_vendor");
  return machine;
}

Json relevant_environment() {
  Json variables = Json::object();
  for (char** variable = environ; *variable; ++variable) {
    const std::string text(*variable);
    for (const char* prefix : {"OMP_", "GOMP_", "KMP_", "TBB_", "LD_PRELOAD", "LP_NUM_THREADS", "SLURM_JOB_",
                               "MALLOC_", "RASTERBENCH_"})
      if (text.starts_with(prefix))
        variables[text.substr(0, text.find('='))] = text.substr(text.find('=') + 1);
  }
  return variables;
}

std::string cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unavailable: /proc/cpuinfo names no model";
}

std::string build_id() { return hash_file("/proc/self/exe"); }

std::string utc_now() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}",
                     fmt::gmtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())));
}

Json describe_context(const Study& study, const StudyOptions& options,
                      const std::map<std::string, std::string>& custom) {
  namespace info = build_info;
  Json context;
  context["schema"] = 1;
  context["program"] = {{"version", info::kVersion}, {"commit", info::kCommit},
                        {"dirty", info::kDirty},     {"compiler", info::kCompiler},
                        {"flags", info::kFlags},     {"build_type", info::kBuildType},
                        {"build_id", build_id()},    {"fast_math", !can_judge()}};
  context["libraries"] = {{"google_benchmark", info::kBenchmarkVersion},
                          {"tbb", *info::kTbbVersion ? info::kTbbVersion : "unavailable: not built in"},
                          {"openmp", openmp_runtime()},
                          {"hwloc", HWLOC_VERSION}};
  context["machine"] = describe_machine();
  context["environment"] = relevant_environment();
  const SamplingPlan& sampling = study.sampling;
  context["study"] = {{"name", study.name},
                      {"question", study.question},
                      {"file", study.file},
                      {"text", study.text},
                      {"hash", hash_bytes(study.text)},
                      {"seed", study.seed},
                      {"shard", fmt::format("{}/{}", options.shard, options.shards)},
                      {"sampling",
                       {{"target", sampling.target},
                        {"min_samples", sampling.min_samples},
                        {"max_samples", sampling.max_samples},
                        {"point_seconds", sampling.point_seconds},
                        {"launches", sampling.launches},
                        {"time_limit_s", sampling.time_limit}}}};
  if (sampling.frame_seconds > 0) context["study"]["sampling"]["frame_seconds"] = sampling.frame_seconds;
  if (!study.hypotheses.empty()) context["study"]["hypotheses"] = hypotheses_to_json(study.hypotheses);
  for (const WeakSeries& series : study.weak) {
    Json steps = Json::array();
    for (const auto& [threads, step] : series.steps)
      steps.push_back({{"threads", threads}, {"scene", step.scene}, {"size", {step.width, step.height}}});
    context["study"]["weak"].push_back(
        {{"kind", series.kind}, {"scene", series.scene}, {"size", series.size}, {"steps", steps}});
  }
  context["overrides"] = {
      {"scenes", options.scenes}, {"sizes", options.sizes}, {"oversubscribe", options.oversubscribe}};
  if (options.cpus) context["overrides"]["cpus"] = *options.cpus;
  if (options.isa) context["overrides"]["isa"] = to_string(*options.isa);
  for (const PlannedPoint& planned : study.points) {
    const SceneReference& scene = planned.point.scene;
    context["scenes"][scene.name] = {{"model", scene.model},
                                     {"parameters", scene.parameters},
                                     {"hash", study.hashes.at(scene.name)},
                                     {"triangles", study.scenes.at(scene.name).model.triangles.size()}};
  }
  context["region"] =
      "one frame: world triangles in memory -> RGBA8 + float32 depth in memory; stages clear, geometry, "
      "raster, resolve; "
      "allocation, files and verification are outside; a peer's frame: triangles and their colours in a "
      "vertex "
      "buffer -> the same, in its framebuffer: clear, draw, finish";
  context["custom"] = custom.empty() ? Json::object() : Json(custom);
  return context;
}

}  // namespace rasterbench
