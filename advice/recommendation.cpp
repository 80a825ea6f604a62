#include "advice/recommendation.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "harness/point.h"
#include "harness/statistics.h"

namespace rasterbench {
namespace {

std::string quoted(const std::string& word) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=:,./@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

std::optional<Recommendation> recommend(std::span<const Measurement> measurements) {
  Recommendation r;
  for (const Measurement& m : measurements)
    if (m.conforms && !m.rounds_ms.empty())
      r.finalists.push_back({&m, median(m.rounds_ms), median_interval(m.rounds_ms), {}, false});
  if (r.finalists.empty()) return std::nullopt;
  std::stable_sort(r.finalists.begin(), r.finalists.end(),
                   [](const Ranked& a, const Ranked& b) { return a.median_ms < b.median_ms; });
  const std::vector<double>& fastest = r.finalists.front().measurement->rounds_ms;
  for (std::size_t i = 1; i < r.finalists.size(); ++i) {
    std::vector<double> ratios = r.finalists[i].measurement->rounds_ms;
    for (std::size_t round = 0; round < ratios.size(); ++round) ratios[round] /= fastest[round];
    r.finalists[i].slower_by = median_interval(ratios);
    r.finalists[i].is_distinguishable = r.finalists[i].slower_by && r.finalists[i].slower_by->first > 1;
  }
  const auto merit = [&](std::size_t i) {
    const ModeVerdict& verdict = *r.finalists[i].measurement->candidate.verdict;
    return std::tuple(verdict.predicted, verdict.found, i);
  };
  for (std::size_t i = 1; i < r.finalists.size(); ++i)
    if (!r.finalists[i].is_distinguishable && merit(i) < merit(r.chosen)) r.chosen = i;
  return r;
}

std::string command_line(const Candidate& candidate, const std::string& model, const std::string& scene_file,
                         const FrameSettings& settings) {
  const ExecutionConfig& e = candidate.execution;
  std::string command = "rasterbench render " + quoted(model);
  if (!scene_file.empty()) command += " " + quoted(scene_file);
  command += fmt::format(" --size {}x{} --kernel {} --numeric {} --backend {}", settings.width,
                         settings.height, candidate.kernel, candidate.verdict->mode->name, e.backend);
  if (!e.schedule.empty()) command += " --schedule " + e.schedule;
  return command + fmt::format(" --threads {} --fill {} --near {}", e.threads,
                               kFillRules[settings.fill == FillRule::kTopLeft],
                               kNearRules[settings.geometry.near_rule == NearRule::kOff]);
}

}  // namespace rasterbench
