// The order statistics that stopping and records need; everything further is analysis/.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace rasterbench {

/// The median; of an even number of values the mean of the middle two. Precondition: not empty.
double median(std::span<const double> values);

/// The narrowest symmetric order-statistic interval that covers the median with at least 95 %: [x(k),
/// x(n+1-k)] for the largest k with P(Binomial(n, 1/2) <= k - 1) <= 2.5 % (David & Nagaraja, Order
/// Statistics, 7.1). Empty below 6 values.
std::optional<std::pair<double, double>> median_interval(std::span<const double> values);

/// The 95th percentile (nearest rank), or empty below 59 values, where no order statistic bounds it with 95
/// %.
std::optional<double> percentile_95(std::span<const double> values);

/// The exact 95 % interval of a probability from `successes` of `trials` (Clopper & Pearson 1934).
/// Precondition: 0 <= successes <= trials, trials > 0.
std::pair<double, double> proportion_interval(int successes, int trials);

/// The quantile of Student's distribution: P(T <= result) = p (Abramowitz & Stegun, 26.7.3 and 26.7.4).
/// Preconditions: 0.5 <= p < 1, freedom > 0.
double student_t_quantile(double p, int freedom);

}  // namespace rasterbench
