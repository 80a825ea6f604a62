// Metamorphic relations: what must hold between the pictures of a case and of the same case changed in a way
// of which the effect is known, so that no picture has to be known (Chen, Cheung & Yiu, Metamorphic testing:
// a new approach for generating next test cases, 1998); and the relations to the exact references.
//
// What a relation asks of a mode follows from the mode's ModeBound. A mode without a bound promises little:
// what it breaks beyond that is observed and counted, not a violation.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fuzz/case.h"
#include "fuzz/subject.h"

namespace rasterbench::fuzz {

struct Verdict {
  enum class Kind {
    kHolds,
    kNotApplicable,  ///< the case or the mode is not one that the relation is about
    kObserved,       ///< does not hold, in a mode that does not promise it
    kViolated,
  };
  Kind kind = Kind::kHolds;
  std::string what = {};  ///< kObserved, kViolated: where, and what was found there

  bool violated() const { return kind == Kind::kViolated; }
};

struct Relation {
  std::string_view name;
  std::string_view meaning;  ///< one line
  Space space;               ///< of the cases that it is about
  /// `kernels`: names of those that may be asked.
  Verdict (*check)(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string> kernels);
};

/// Those in screen space first.
std::span<const Relation> relations();

/// Throws InputError with a did-you-mean.
const Relation& find_relation(std::string_view name);

/// Relation::check, where an exception is a violation too; an InputError (a camera that cannot be, a picture
/// that Embree cannot hold) makes the case not applicable.
Verdict check(const Relation& relation, const Subject& subject, const FuzzCase& fuzz_case,
              std::span<const std::string> kernels);

/// Names of the kernels that are compared where nobody names any: all but the canaries.
std::vector<std::string> listed_kernels();

/// What `relation` finds wrong with `mode` in a case; empty where it holds or does not apply. For the tests
/// that as_test() prints. `kernels` empty: listed_kernels().
std::string violation(std::string_view relation, std::string_view mode, const FuzzCase& fuzz_case,
                      const std::vector<std::string>& kernels = {});

/// The relations of each file, for the list.
std::span<const Relation> order_relations();
std::span<const Relation> motion_relations();
std::span<const Relation> tessellation_relations();
std::span<const Relation> oracle_relations();
std::span<const Relation> frame_relations();
std::span<const Relation> judge_relations();

}  // namespace rasterbench::fuzz
