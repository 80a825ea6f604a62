#include "extremes/run.h"

#include <fmt/format.h>

#include <algorithm>

#include "extremes/judge_case.h"
#include "kernels/kernel.h"

namespace rasterbench::extremes {
namespace {

/// Whether a case asks for more than the counts of gaps and overlaps.
bool asks_for_pictures(const Must& must) {
  return must.match_oracle || must.match_truth || must.match_rays || must.pixels || !must.owners.empty() ||
         !must.counts.empty() || must.nothing_tested || must.same_as || must.every_execution ||
         must.no_background_inside || !must.refusal_or_room.empty();
}

/// Gaps and overlaps as a finding: wrong where there must be none.
Finding judge_watertightness(const WatertightCount& count, const Scene& scene, const Must& must) {
  Finding finding;
  finding.pixels = std::int64_t{scene.parameters.width} * scene.parameters.height;
  finding.drawn = finding.pixels - count.gaps;
  if (count.gaps + count.overlaps > 0)
    finding.worsen(must_be_watertight(must, count.mode) ? Verdict::kWrong : Verdict::kReported,
                   fmt::format("{} gaps and {} overlaps", count.gaps, count.overlaps));
  return finding;
}

void add_watertightness(const Case& one, std::span<const std::string_view> modes, int threads,
                        CaseResult& result) {
  std::vector<std::string_view> counted;
  std::copy_if(modes.begin(), modes.end(), std::back_inserter(counted),
               [](std::string_view name) { return find_mode(name)->has_screen_triangles; });
  const Scene scene = open_case(one);
  result.watertight = count_gaps_and_overlaps(scene, counted, threads);
  for (std::size_t i = 0; i < modes.size(); ++i)
    for (const WatertightCount& count : result.watertight)
      if (count.mode == modes[i]) result.findings[i].merge(judge_watertightness(count, scene, one.must));
}

}  // namespace

bool must_be_watertight(const Must& must, std::string_view mode) {
  return must.watertight &&
         (is_watertight_by_construction(*find_mode(mode)) ||
          std::find(must.watertight->begin(), must.watertight->end(), mode) != must.watertight->end());
}

std::vector<std::string_view> runnable_modes(std::string_view kernel) {
  std::vector<std::string_view> modes;
  for (const ModeInfo& info : mode_infos())
    if (info.unavailable.empty() && find_kernel(kernel).variant(info.name).make) modes.push_back(info.name);
  return modes;
}

CaseResult run_case(const Case& one, std::span<const std::string_view> modes, std::string_view kernel,
                    Part part, int threads) {
  CaseResult result;
  if (one.must.is_about_reading()) {
    result.in_any_mode = true;
    result.findings = {judge_reading(one)};
    return result;
  }
  Finding nothing;
  nothing.verdict = Verdict::kNotCarried;
  result.findings.assign(modes.size(), nothing);
  if (part == Part::kAll && asks_for_pictures(one.must)) {
    CaseJudge judge(one, threads);
    std::transform(modes.begin(), modes.end(), result.findings.begin(),
                   [&](std::string_view name) { return judge.judge(*find_mode(name), kernel); });
  }
  if (one.must.watertight) add_watertightness(one, modes, threads, result);
  return result;
}

}  // namespace rasterbench::extremes
