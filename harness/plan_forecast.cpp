#include "harness/plan_forecast.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <numbers>

#include "base/error.h"
#include "harness/journal.h"
#include "harness/statistics.h"

namespace rasterbench {
namespace {

constexpr double kLevel = 0.05;  // of the hypotheses of a study together
constexpr double kNormal975 = 1.959964;

double mean_of(const std::vector<double>& x) {
  double sum = 0;
  for (const double value : x) sum += value;
  return sum / static_cast<double>(x.size());
}

double squares_around_mean(const std::vector<double>& x) {
  const double mean = mean_of(x);
  double sum = 0;
  for (const double value : x) sum += (value - mean) * (value - mean);
  return sum;
}

/// Standard deviation of the logarithms; 0 below two values.
double log_deviation(const std::vector<double>& x) {
  if (x.size() < 2) return 0;
  std::vector<double> logs;
  for (const double value : x) logs.push_back(std::log(value));
  return std::sqrt(squares_around_mean(logs) / static_cast<double>(x.size() - 1));
}

/// Seconds since 1970 of "2024-05-01T10:00:00Z".
double seconds_of(const std::string& time, const std::filesystem::path& file, const std::string& field) {
  std::tm parts{};
  const char* end = strptime(time.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  if (!end || *end)
    throw InputError({.file = file.string(), .field = field}, fmt::format("'{}' is not a time", time));
  return static_cast<double>(timegm(&parts));
}

/// Milliseconds in which a point was sampled: each sample follows an untimed frame.
double sampling_ms(const EarlierPoint& point) {
  double sum = 0;
  for (const double ms : point.ms) sum += ms * (point.frames + 1);
  return sum;
}

/// Seconds beside sampling of a run that was not resumed.
std::optional<double> other_seconds(const EarlierRun& run) {
  const auto journal = run.folder / "journal.jsonl";
  if (!std::filesystem::exists(journal)) return std::nullopt;
  for (const Json& event : read_journal(journal))
    if (event.value("event", "") == "resume") return std::nullopt;
  const auto path = run.folder / "context.json";
  std::ifstream file(path);
  try {
    const Json context = Json::parse(file);
    double seconds = seconds_of(context.at("finished"), path, "finished") -
                     seconds_of(context.at("started"), path, "started");
    for (const auto& [name, point] : run.points) seconds -= sampling_ms(point) / 1e3;
    return std::max(0.0, seconds);
  } catch (const Json::exception&) {
    throw InputError({.file = path.string()}, "is not what a study writes");
  }
}

std::string side(const std::vector<std::string>& names) {
  if (names.size() == 1) return names.front();
  return fmt::format("the fastest of {}: {} ...", names.size(), names.front());
}

std::string percent(double share) { return fmt::format("{:.3g} %", 100 * share); }

class Forecast {
 public:
  Forecast(const Study& study, const std::optional<EarlierRun>& earlier, std::optional<double> noise)
      : study_(study),
        earlier_(earlier),
        noise_(noise.value_or(kAssumedNoise)),
        is_given_(noise.has_value()) {
    for (const PlannedPoint& planned : study.points) by_name_[planned.name] = &planned;
    for (const Hypothesis& hypothesis : study.hypotheses) tested_ += why_untested(hypothesis).empty();
  }

  std::string text() const {
    std::string lines;
    for (std::size_t i = 0; i < study_.hypotheses.size(); ++i) {
      const Hypothesis& h = study_.hypotheses[i];
      lines += fmt::format("\nhypothesis {}: {}\n", i + 1, h.claim);
      if (const std::string reason = why_untested(h); !reason.empty()) {
        lines += fmt::format("  not tested: {}\n", reason);
        continue;
      }
      lines +=
          fmt::format("  faster: {}\n  slower: {}\n  time of slower / time of faster is at least {:.4g}\n",
                      side(h.faster), side(h.slower), 1 + h.by);
      lines += detectable(h);
    }
    return lines + cost();
  }

 private:
  std::string why_untested(const Hypothesis& hypothesis) const {
    if (!hypothesis.untested.empty()) return hypothesis.untested;
    for (const auto* names : {&hypothesis.faster, &hypothesis.slower})
      for (const std::string& name : *names) {
        const auto found = by_name_.find(name);
        if (found == by_name_.end()) return fmt::format("{} is not in this part of the study", name);
        if (!found->second->skip.empty()) return fmt::format("{} is skipped: {}", name, found->second->skip);
      }
    return {};
  }

  const EarlierPoint* earlier(const std::string& name) const {
    if (!earlier_) return nullptr;
    const auto found = earlier_->points.find(name);
    return found == earlier_->points.end() ? nullptr : &found->second;
  }

  /// Samples that the plan will take of a point.
  int samples(const std::string& name) const {
    const EarlierPoint* point = earlier(name);
    const SamplingPlan& plan = study_.sampling;
    int n = expected_samples(plan, point ? log_deviation(point->ms) : noise_);
    if (point) {
      const double each = median(point->ms) * point->frames / 1e3;
      n = std::min(n, std::max(1, static_cast<int>(std::ceil(plan.point_seconds / each))));
    }
    return n;
  }

  RatioNoise noise_of(const std::string& slower, const std::string& faster) const {
    const EarlierPoint *a = earlier(slower), *b = earlier(faster);
    if (a && b)
      if (const auto measured = measured_noise(*a, *b)) return *measured;
    // Samples of different points count as independent, which is cautious: blocks drift together.
    return {.within = std::numbers::sqrt2 * noise_};
  }

  std::string detectable(const Hypothesis& h) const {
    const auto pairs = static_cast<double>(h.faster.size() * h.slower.size());
    const double level = kLevel / (tested_ * pairs);
    double factor = 1;
    int n = 2;
    bool measured = true;
    for (const auto* names : {&h.faster, &h.slower})
      for (const std::string& name : *names) n = std::max(n, samples(name));  // partners are sampled together
    for (const std::string& slower : h.slower)
      for (const std::string& faster : h.faster) {
        const RatioNoise noise = noise_of(slower, faster);
        measured = measured && noise.measured;
        factor = std::max(factor, detectable_factor(noise, n, study_.sampling.launches, level));
      }
    const std::string source = measured    ? fmt::format("noise as measured in {}", earlier_->folder.string())
                               : is_given_ ? fmt::format("noise of {} a sample (--noise)", percent(noise_))
                                           : fmt::format(
                                                 "an assumed noise of {} a sample (--noise gives "
                                                 "another)",
                                                 percent(noise_));
    return fmt::format(
        "  detectable: a true ratio of {:.4g} ({} beyond the claim) with power {:g}, by {} samples in {} "
        "launch{}, {}, level "
        "{:g} / {:g}\n",
        (1 + h.by) * factor, percent(factor - 1), kPower, n, study_.sampling.launches,
        study_.sampling.launches == 1 ? " (whose effect is unknown)" : "es", source, kLevel, tested_ * pairs);
  }

  std::string cost() const {
    const SamplingPlan& plan = study_.sampling;
    double least = 0, most = 0;
    std::size_t run = 0, known = 0;
    for (const PlannedPoint& planned : study_.points) {
      if (!planned.skip.empty()) continue;
      ++run;
      const EarlierPoint* point = earlier(planned.name);
      if (!point) {
        most += 2 * plan.point_seconds;  // an untimed frame precedes each sample
        continue;
      }
      ++known;
      const double each = median(point->ms) * (point->frames + 1) / 1e3;
      least += each * samples(planned.name);
      most += std::min(each * plan.max_samples, each + 2 * plan.point_seconds);
    }
    std::string words;
    if (known == 0) {
      words = fmt::format("at most {:.3g} min of frames: {} points x 2 x point_seconds of {:g} s", most / 60,
                          run, plan.point_seconds);
      if (plan.time_limit > 0 && plan.time_limit < most)
        words += fmt::format("; the time limit ends it after {:.3g} min", plan.time_limit / 60);
      return fmt::format(
          "\ncost: {}; verification comes on top. A finished run in the --out folder tells more.\n", words);
    }
    words = fmt::format("{:.3g} to {:.3g} min of frames, by the times of {} of {} points in {}", least / 60,
                        most / 60, known, run, earlier_->folder.string());
    if (known < run)
      words += fmt::format(" (the others: at most 2 x point_seconds of {:g} s)", plan.point_seconds);
    words += earlier_->other_seconds ? fmt::format("; {:.3g} min of verification and the like, as then",
                                                   *earlier_->other_seconds * static_cast<double>(run) /
                                                       static_cast<double>(earlier_->points.size()) / 60)
                                     : "; that run was resumed, so what verification takes is not known";
    if (plan.time_limit > 0) words += fmt::format("; the time limit is {:.3g} min", plan.time_limit / 60);
    return fmt::format("\ncost: {}\n", words);
  }

  const Study& study_;
  const std::optional<EarlierRun>& earlier_;
  const double noise_;
  const bool is_given_;
  std::map<std::string, const PlannedPoint*> by_name_;
  double tested_ = 0;
};

}  // namespace

std::optional<EarlierRun> read_earlier_run(const std::filesystem::path& folder) {
  const auto path = folder / "records.jsonl";
  std::ifstream file(path);
  if (!file) return std::nullopt;
  EarlierRun run;
  run.folder = folder;
  std::int64_t number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    try {
      const Json record = Json::parse(line);
      if (record.at("status") != "ok") continue;
      EarlierPoint& point = run.points[record.at("name")];
      record.at("samples_ms").get_to(point.ms);
      record.at("launches").get_to(point.launches);
      record.at("blocks").get_to(point.blocks);
      record.at("frames_per_sample").get_to(point.frames);
      const auto positive = [](double ms) { return ms > 0; };
      if (point.ms.empty() || point.launches.size() != point.ms.size() ||
          point.blocks.size() != point.ms.size() || !std::all_of(point.ms.begin(), point.ms.end(), positive))
        throw InputError({.file = path.string(), .line = number, .field = "samples_ms"},
                         "are not times with a launch and a block each");
    } catch (const Json::exception&) {
      throw InputError({.file = path.string(), .line = number}, "is not what a study writes");
    }
  }
  if (run.points.empty()) return std::nullopt;
  run.other_seconds = other_seconds(run);
  return run;
}

std::optional<RatioNoise> measured_noise(const EarlierPoint& slower, const EarlierPoint& faster) {
  std::map<std::pair<int, int>, double> base;
  for (std::size_t i = 0; i < faster.ms.size(); ++i)
    base[{faster.launches[i], faster.blocks[i]}] = std::log(faster.ms[i]);
  std::map<int, std::vector<double>> launches;
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < slower.ms.size(); ++i)
    if (const auto found = base.find({slower.launches[i], slower.blocks[i]}); found != base.end()) {
      launches[slower.launches[i]].push_back(std::log(slower.ms[i]) - found->second);
      ++pairs;
    }
  if (pairs < 2) return std::nullopt;
  std::vector<double> means;
  double within = 0, of_a_mean = 0;  // squares; mean of 1 / n over the launches
  for (const auto& [launch, ratios] : launches) {
    means.push_back(mean_of(ratios));
    within += squares_around_mean(ratios);
    of_a_mean += 1 / static_cast<double>(ratios.size() * launches.size());
  }
  const std::size_t freedom = pairs - launches.size();
  within = freedom > 0 ? within / static_cast<double>(freedom) : 0;
  const double of_means =
      means.size() > 1 ? squares_around_mean(means) / static_cast<double>(means.size() - 1) : 0;
  return RatioNoise{.between = std::sqrt(std::max(0.0, of_means - within * of_a_mean)),
                    .within = std::sqrt(within),
                    .measured = true};
}

double detectable_factor(const RatioNoise& noise, int samples, int launches, double level) {
  const int freedom = (launches > 1 ? launches : samples) - 1;
  const double error = std::sqrt(noise.between * noise.between / launches +
                                 std::numbers::pi / 2 * noise.within * noise.within / samples);
  return std::exp((student_t_quantile(1 - level / 2, freedom) + student_t_quantile(kPower, freedom)) * error);
}

int expected_samples(const SamplingPlan& plan, double noise) {
  const double root = plan.target > 0 ? kNormal975 * std::sqrt(std::numbers::pi / 2) * noise / plan.target
                                      : std::sqrt(static_cast<double>(plan.max_samples));
  return static_cast<int>(std::clamp(std::ceil(root * root), static_cast<double>(plan.min_samples),
                                     static_cast<double>(plan.max_samples)));
}

std::string forecast(const Study& study, const std::optional<EarlierRun>& earlier,
                     std::optional<double> noise) {
  return Forecast(study, earlier, noise).text();
}

}  // namespace rasterbench
