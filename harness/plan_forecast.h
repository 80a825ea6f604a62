// What a planned study can show, and what it will cost: the end of `study --dry-run`.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/study.h"

namespace rasterbench {

/// Noise that is assumed where nothing was measured: the standard deviation of the logarithms of a point's
/// samples, rounded; the median over the points of the published run (results/published) is 0.084.
inline constexpr double kAssumedNoise = 0.08;

/// The probability with which a hypothesis that is true by the detectable effect is called supported.
inline constexpr double kPower = 0.8;

/// The samples that an earlier run took of a point.
struct EarlierPoint {
  std::vector<double> ms;
  std::vector<int> launches, blocks;
  int frames = 1;  ///< per sample
};

struct EarlierRun {
  std::filesystem::path folder;
  std::map<std::string, EarlierPoint> points;  ///< by name
  /// Seconds of the run in which no frame was sampled (verification above all); empty where that is not
  /// known, since the run was resumed.
  std::optional<double> other_seconds;
};

/// Reads DIR/records.jsonl, context.json and journal.jsonl of a finished run; empty if there is none. Throws
/// InputError where they are not what a study writes.
std::optional<EarlierRun> read_earlier_run(const std::filesystem::path& folder);

/// The spread of the logarithm of a paired ratio, on the log scale.
struct RatioNoise {
  double between = 0;     ///< standard deviation of the launches' true means
  double within = 0;      ///< standard deviation of the blocks of one launch
  bool measured = false;  ///< whether it is that of these two points in an earlier run
};

/// The noise of the ratio of two points, of their samples that share launch and block, by a one-way analysis
/// of variance with launches as the random effect. Empty below two pairs.
std::optional<RatioNoise> measured_noise(const EarlierPoint& slower, const EarlierPoint& faster);

/// The least true effect that a hypothesis finds supported with probability kPower, as a factor beyond its
/// claim: exp((t(1 - level / 2) + t(kPower)) SE), t the quantiles of Student's distribution with launches - 1
/// degrees of freedom (Cohen, Statistical Power Analysis, 1988, 2.4; Hoefler & Belli, SC'15, rule 6), and
/// SE^2 = between^2 / launches + (pi / 2) within^2 / samples, since the median of n values has pi / 2 times
/// the variance of their mean. With one launch the degrees of freedom are samples - 1, and what launches add
/// is unknown. Precondition: samples > 1.
double detectable_factor(const RatioNoise& noise, int samples, int launches, double level);

/// Samples after which a point of this noise is within the target: the half interval of a median of n values
/// is about 1.96 sqrt(pi / 2) noise / sqrt(n). At least min_samples, at most max_samples.
int expected_samples(const SamplingPlan& plan, double noise);

/// For each hypothesis its points and the effect that it can detect, then the cost of the study in minutes,
/// as text. `noise` is that of a sample, given by the user in place of kAssumedNoise; an earlier run goes
/// before both.
std::string forecast(const Study& study, const std::optional<EarlierRun>& earlier,
                     std::optional<double> noise);

}  // namespace rasterbench
