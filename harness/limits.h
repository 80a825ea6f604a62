// The limits of a study's points: measured bandwidth, and the floors that follow from it (records.md:
// limits).
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "harness/run.h"
#include "machine/bandwidth.h"

namespace rasterbench {

/// Times as {NAME: median, "interval": its 95 % interval [low, high], or null below 6 samples, "best": the
/// smallest}.
Json time_json(const char* name, std::span<const double> times);

/// Rates in bytes per second, the same with "gb_per_s" (10^9 bytes per second) and "best" the largest.
Json rate_json(std::span<const double> rates);

/// What a floor depends on.
struct LimitKey {
  int threads = 0;
  WorkingSet set;
  auto operator<=>(const LimitKey&) const = default;
};

/// The key of a point. Threads beyond the CPUs of this process add no bandwidth and are not counted.
LimitKey limit_of(const PointState& state, const Study& study);

/// One entry of `limits.rates`, measured now, in this process, for `seconds` or a few repetitions; what
/// cannot be measured says why.
Json measure_limit(const LimitKey& key, double seconds);

/// The rates of a study, by key; entries are those of the journal.
class Limits {
 public:
  /// Takes an entry of `limits.rates`. Throws Json::exception if it is none.
  void add(const Json& entry);

  bool has(const LimitKey& key) const { return entries_.contains(key); }

  /// Milliseconds, or empty where nothing was measured.
  std::optional<double> floor_of(const LimitKey& key) const;

  /// The object of records.md.
  Json to_json() const;

 private:
  std::map<LimitKey, Json> entries_;
};

/// The keys of the points that may still be timed, each once, without those that `limits` has.
std::vector<LimitKey> missing_limits(const std::vector<PointState>& states, const Study& study,
                                     const Limits& limits);

/// The "limit" events among those of a journal. Throws InputError naming `file` and the line of one that is
/// not whole.
Limits replay_limits(const std::vector<Json>& events, const std::filesystem::path& file);

}  // namespace rasterbench
