#include "harness/statistics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rasterbench {
namespace {

std::vector<double> sorted(std::span<const double> values) {
  std::vector<double> copy(values.begin(), values.end());
  std::sort(copy.begin(), copy.end());
  return copy;
}

/// P(Binomial(n, p) >= k) for 0 < p < 1.
double at_least(int k, int n, double p) {
  double sum = 0;
  for (int i = k; i <= n; ++i)
    sum += std::exp(std::lgamma(n + 1.0) - std::lgamma(i + 1.0) - std::lgamma(n - i + 1.0) + i * std::log(p) +
                    (n - i) * std::log1p(-p));
  return sum;
}

/// The p at which at_least(k, n, p), which grows with p, is `tail`.
double p_of_tail(int k, int n, double tail) {
  double low = 0, high = 1;
  for (int step = 0; step < 60; ++step) {
    const double middle = (low + high) / 2;
    (at_least(k, n, middle) < tail ? low : high) = middle;
  }
  return (low + high) / 2;
}

/// P(|T| < t) for Student's T.
double student_t_within(double t, int freedom) {
  const double angle = std::atan(t / std::sqrt(static_cast<double>(freedom)));
  const double sine = std::sin(angle), square = std::cos(angle) * std::cos(angle);
  const bool odd = freedom % 2 == 1;
  // A power series in cos^2 with freedom / 2 terms; odd numbers start with cos, even ones with 1.
  double sum = 0, term = odd ? std::cos(angle) : 1;
  for (int k = odd ? 3 : 2; k <= freedom; k += 2) {
    sum += term;
    term *= square * (k - 1) / k;
  }
  return odd ? 2 / std::numbers::pi * (angle + sine * sum) : sine * sum;
}

}  // namespace

double median(std::span<const double> values) {
  const std::vector<double> x = sorted(values);
  const std::size_t n = x.size();
  return n % 2 == 1 ? x[n / 2] : (x[n / 2 - 1] + x[n / 2]) / 2;
}

std::optional<std::pair<double, double>> median_interval(std::span<const double> values) {
  const std::vector<double> x = sorted(values);
  const auto n = static_cast<double>(x.size());
  // Terms of Binomial(n, 1/2) by logarithms: 2^-n underflows for long runs.
  double below = 0;
  std::size_t k = 0;
  for (std::size_t i = 0; 2 * i < x.size(); ++i) {
    const auto j = static_cast<double>(i);
    below += std::exp(std::lgamma(n + 1) - std::lgamma(j + 1) - std::lgamma(n - j + 1) - n * std::log(2.0));
    if (below > 0.025) break;
    k = i + 1;
  }
  if (k == 0) return std::nullopt;
  return std::pair{x[k - 1], x[x.size() - k]};
}

std::optional<double> percentile_95(std::span<const double> values) {
  if (values.size() < 59) return std::nullopt;
  const std::vector<double> x = sorted(values);
  return x[static_cast<std::size_t>(std::ceil(0.95 * static_cast<double>(x.size()))) - 1];
}

std::pair<double, double> proportion_interval(int successes, int trials) {
  constexpr double kTail = 0.025;
  return {successes == 0 ? 0 : p_of_tail(successes, trials, kTail),
          successes == trials ? 1 : p_of_tail(successes + 1, trials, 1 - kTail)};
}

double student_t_quantile(double p, int freedom) {
  double low = 0, high = 1;
  while (student_t_within(high, freedom) < 2 * p - 1) high *= 2;
  for (int step = 0; step < 80; ++step) {
    const double middle = (low + high) / 2;
    (student_t_within(middle, freedom) < 2 * p - 1 ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace rasterbench
