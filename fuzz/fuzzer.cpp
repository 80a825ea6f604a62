#include "fuzz/fuzzer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <limits>

#include "fuzz/generate.h"
#include "fuzz/shrink.h"

namespace rasterbench::fuzz {
namespace {

/// A case in the world is dear: it comes once in so many, and a few of the modes are asked.
constexpr std::int64_t kWorldEvery = 16;
constexpr std::size_t kModesOfAWorldCase = 4;

Space space_of(std::int64_t number) {
  return number % kWorldEvery == kWorldEvery - 1 ? Space::kWorld : Space::kScreen;
}

/// What shrinking one finding may cost, in questions to its relation.
constexpr int kQuestionsOnTheScreen = 4000, kQuestionsInTheWorld = 600;

class Fuzzer {
 public:
  Fuzzer(const FuzzOptions& options, const FuzzListener& listener)
      : options_(options), listener_(listener), begin_(std::chrono::steady_clock::now()) {}

  FuzzReport run() {
    for (number_ = options_.first; !is_stopped() && !is_at_limit(); ++number_) {
      if (!has_relation(space_of(number_))) continue;
      try_case(make_case(options_.seed, number_, space_of(number_)));
      ++report_.cases;
      report_.seconds = seconds();
      if (listener_.progress) listener_.progress(report_);
    }
    report_.seconds = seconds();
    return std::move(report_);
  }

 private:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

  bool is_at_limit() const {
    return (options_.cases >= 0 && report_.cases >= options_.cases) || seconds() >= options_.seconds ||
           number_ == std::numeric_limits<std::int64_t>::max();
  }

  bool has_relation(Space space) const {
    return std::any_of(options_.relations.begin(), options_.relations.end(),
                       [&](const Relation* relation) { return relation->space == space; });
  }

  bool is_stopped() {
    report_.stopped = report_.stopped || (listener_.stop && listener_.stop());
    return report_.stopped;
  }

  /// All of them on the screen, some in the world.
  std::vector<const Subject*> modes_for(const FuzzCase& fuzz_case) const {
    std::vector<const Subject*> modes;
    for (const Subject& mode : options_.modes) modes.push_back(&mode);
    if (fuzz_case.space == Space::kScreen || modes.size() <= kModesOfAWorldCase) return modes;
    Random random(options_.seed ^ static_cast<std::uint64_t>(number_));
    for (std::size_t i = 0; i < kModesOfAWorldCase; ++i)
      std::swap(modes[i], modes[i + random.bits() % (modes.size() - i)]);
    modes.resize(kModesOfAWorldCase);
    return modes;
  }

  void try_case(const FuzzCase& fuzz_case) {
    for (const Subject* mode : modes_for(fuzz_case))
      for (const Relation* relation : options_.relations) {
        if (relation->space != fuzz_case.space) continue;
        if (is_stopped()) return;
        ask(*relation, *mode, fuzz_case);
      }
  }

  void ask(const Relation& relation, const Subject& mode, const FuzzCase& fuzz_case) {
    if (listener_.asking) listener_.asking(number_, relation, mode);
    Tally& tally = report_.tallies[relation.name];
    const Verdict verdict = check(relation, mode, fuzz_case, options_.kernels);
    ++tally.asked;
    tally.not_applicable += verdict.kind == Verdict::Kind::kNotApplicable;
    if (verdict.kind == Verdict::Kind::kObserved) ++tally.observed[std::string(mode.info.name)];
    if (!verdict.violated()) return;
    ++tally.violated;
    const auto known =
        std::find_if(report_.findings.begin(), report_.findings.end(), [&](const Finding& finding) {
          return finding.relation == &relation && finding.mode == mode.info.name;
        });
    if (known != report_.findings.end()) {
      ++known->again;
      return;
    }
    const bool on_screen = fuzz_case.space == Space::kScreen;
    const FuzzCase minimal = shrink(
        fuzz_case,
        [&](const FuzzCase& smaller) {
          return !is_stopped() && check(relation, mode, smaller, options_.kernels).violated();
        },
        on_screen ? kQuestionsOnTheScreen : kQuestionsInTheWorld);
    report_.findings.push_back({&relation, std::string(mode.info.name), number_, fuzz_case, minimal,
                                check(relation, mode, minimal, options_.kernels).what});
    if (listener_.found) listener_.found(report_.findings.back());
  }

  const FuzzOptions& options_;
  const FuzzListener& listener_;
  std::chrono::steady_clock::time_point begin_;
  std::int64_t number_ = 0;  // of the case
  FuzzReport report_;
};

/// "turn_world", "f32-fma" -> "TurnWorldF32Fma".
std::string camel_case(std::string_view words) {
  std::string text;
  bool begin = true;
  for (const char c : words) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalnum(u)) text += begin ? static_cast<char>(std::toupper(u)) : c;
    begin = !std::isalnum(u);
  }
  return text;
}

}  // namespace

FuzzReport run_fuzz(const FuzzOptions& options, const FuzzListener& listener) {
  return Fuzzer(options, listener).run();
}

std::string test_name(const Finding& finding, std::uint64_t seed) {
  return fmt::format("{}{}Seed{}Case{}", camel_case(finding.relation->name), camel_case(finding.mode), seed,
                     finding.case_number);
}

std::string as_test(const Finding& finding, const FuzzOptions& options) {
  const bool all_kernels = options.kernels == listed_kernels();
  return fmt::format("// {}: {}\n", finding.relation->meaning, finding.what) +
         as_test(finding.minimal, test_name(finding, options.seed), finding.relation->name, finding.mode,
                 all_kernels ? std::vector<std::string>{} : options.kernels);
}

}  // namespace rasterbench::fuzz
