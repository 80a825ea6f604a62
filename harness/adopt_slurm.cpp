#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "build_info.h"
#include "harness/adopt.h"

namespace rasterbench {
namespace {

namespace fs = std::filesystem;

/// In single quotes, as bash takes any text literally.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

/// For a comment and a job's name, which end at the line or at a space.
std::string plain_name(std::string name) {
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_' && c != '.') c = '_';
  return name;
}

std::string absolute_file(const std::string& name) {
  std::error_code error;
  return fs::is_regular_file(name, error) ? fs::absolute(name).lexically_normal().string() : name;
}

}  // namespace

std::string adopt_slurm_script(const AdoptOptions& options, const fs::path& program, const Json& timing,
                               std::int64_t max_rss_bytes) {
  std::string threads;
  for (int count = 1; count < options.slurm_cores; count *= 2) threads += fmt::format("{} ", count);
  threads += std::to_string(options.slurm_cores);
  std::string words;
  std::vector<std::string> schedules;
  for (const Json& point : timing.at("points"))
    if (!point.at("schedule").is_null() &&
        std::find(schedules.begin(), schedules.end(), point.at("schedule").get<std::string>()) ==
            schedules.end())
      schedules.push_back(point.at("schedule").get<std::string>());
  for (const std::string& schedule : schedules) words += " --schedule " + quoted(schedule);
  if (!options.size.empty()) words += " --size " + quoted(options.size);
  if (options.fill != "closed") words += " --fill " + quoted(options.fill);
  if (options.near_rule != "clip") words += " --near " + quoted(options.near_rule);
  if (!options.own_time.empty()) words += " --own-time " + quoted(options.own_time);
  if (options.max_wrong > 0) words += fmt::format(" --max-wrong {}", options.max_wrong);
  words += fmt::format(
      " --limit {:g} --judge-seconds {:g} --race-seconds {:g} --seconds {:g} --max-samples {} --target {:g}",
      options.limit, options.judge_seconds, options.race_seconds, options.seconds, options.max_samples,
      options.target);

  // The three budgets, one run beyond each, the judge's own work, and half as much again.
  const int minutes =
      static_cast<int>(std::ceil(
          1.5 * (options.judge_seconds + options.race_seconds + options.seconds + 3 * options.limit) / 60)) +
      5;
  // The program's memory and the judge's.
  const std::int64_t megabytes = std::max<std::int64_t>(2048, 2 * (max_rss_bytes >> 20) + 1024);
  const fs::path self = fs::read_symlink("/proc/self/exe");
  return fmt::format(
      R"(#!/bin/bash
# Repeats the adoption of {name} on one node of a cluster: sbatch adopt.sbatch
# Written by rasterbench {version}; the lines below are meant to be edited (partition, account, modules).
#SBATCH --job-name=adopt-{name}
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={cores}
#SBATCH --hint=nomultithread
#SBATCH --mem={memory}M
#SBATCH --time={minutes}
#SBATCH --output=adopt-%j.log
set -euo pipefail

rasterbench={self}
program={program}
model={model}
scene={scene}
out={out}

# What the submitting shell says of OpenMP is inherited by jobs.
for variable in $(compgen -e); do
  case $variable in OMP_* | GOMP_* | KMP_*) unset "$variable" ;; esac
done

# Without -c, srun puts every thread on one core.
srun --cpu-bind=cores -c "$SLURM_CPUS_PER_TASK" \
  "$rasterbench" adopt "$program" "$model" ${{scene:+"$scene"}} --out "$out-$SLURM_JOB_ID" \
  --threads {threads} --binding close{words}
)",
      fmt::arg("name", plain_name(program.stem().string())), fmt::arg("version", build_info::kVersion),
      fmt::arg("cores", options.slurm_cores), fmt::arg("memory", megabytes), fmt::arg("minutes", minutes),
      fmt::arg("self", quoted(self.string())), fmt::arg("program", quoted(program.string())),
      fmt::arg("model", quoted(absolute_file(options.model))),
      fmt::arg("scene", quoted(options.scene_file.empty() ? "" : absolute_file(options.scene_file))),
      fmt::arg("out", quoted(fs::absolute(options.out).lexically_normal().string())),
      fmt::arg("threads", threads), fmt::arg("words", words));
}

}  // namespace rasterbench
