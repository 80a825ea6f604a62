#include "harness/selftest.h"

#include <algorithm>

#include "harness/run.h"
#include "harness/statistics.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

/// Ratios of the samples that were taken in one block: drift meets both alike.
std::vector<double> paired_ratios(const LabelSamples& a, const LabelSamples& b) {
  std::vector<double> ratios;
  std::size_t j = 0;
  for (std::size_t i = 0; i < a.blocks.size(); ++i) {
    while (j < b.blocks.size() && b.blocks[j] < a.blocks[i]) ++j;
    if (j < b.blocks.size() && b.blocks[j] == a.blocks[i]) ratios.push_back(a.times_ms[i] / b.times_ms[j]);
  }
  return ratios;
}

}  // namespace

std::optional<int> least_found(int comparisons, double stated_rate) {
  for (int differences = 1; differences <= comparisons; ++differences)
    if (proportion_interval(differences, comparisons).first > stated_rate) return differences;
  return std::nullopt;
}

SelfComparison compare_with_itself(const SamplingPlan& plan, std::uint64_t seed, int frames,
                                   FunctionRef<double(int label, int block)> sample) {
  SelfComparison comparison;
  std::array<double, 2> spent_ms{};
  Random random(seed);
  const auto is_open = [&](std::size_t label) { return comparison.labels[label].stop.empty(); };
  for (int block = 0; is_open(0) || is_open(1); ++block) {
    const std::size_t first = random.bits() % 2;
    for (const std::size_t label : {first, 1 - first}) {
      if (!is_open(label)) continue;
      LabelSamples& samples = comparison.labels[label];
      samples.times_ms.push_back(sample(static_cast<int>(label), block));
      samples.blocks.push_back(block);
      spent_ms[label] += samples.times_ms.back() * frames;
    }
    for (std::size_t label = 0; label < 2; ++label)
      if (is_open(label))
        comparison.labels[label].stop = stop_reason(plan, comparison.labels[label].times_ms, spent_ms[label]);
  }
  const std::vector<double> ratios = paired_ratios(comparison.labels[0], comparison.labels[1]);
  comparison.ratio = median(ratios);
  comparison.interval = median_interval(ratios);
  return comparison;
}

}  // namespace rasterbench
