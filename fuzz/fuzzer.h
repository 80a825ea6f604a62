// The fuzzer's loop: makes cases, asks every relation of every mode, shrinks what is violated.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "fuzz/relation.h"

namespace rasterbench::fuzz {

struct FuzzOptions {
  std::uint64_t seed = 1;
  std::int64_t first = 0;   ///< number of the first case
  double seconds = 10;      ///< after which no new case is begun
  std::int64_t cases = -1;  ///< after which it ends as well; negative: no such limit
  std::vector<Subject> modes = {};
  std::vector<const Relation*> relations = {};
  std::vector<std::string> kernels = {};
};

/// A violated relation: the first of its relation and mode, and how often it was found again.
struct Finding {
  const Relation* relation;
  std::string mode;
  std::int64_t case_number;
  FuzzCase original, minimal;
  std::string what;  ///< of the minimal case
  std::int64_t again = 0;
};

/// How often a relation was asked, and what came of it.
struct Tally {
  std::int64_t asked = 0, not_applicable = 0, violated = 0;
  std::map<std::string, std::int64_t> observed;  ///< per mode: does not hold, and was not promised
};

struct FuzzReport {
  std::int64_t cases = 0;
  double seconds = 0;
  bool stopped = false;  ///< by `stop`
  std::vector<Finding> findings;
  std::map<std::string_view, Tally> tallies;  ///< by relation
};

/// What is told while it runs; each may be empty. `stop` is asked between two questions to a relation, and
/// `asking` is told before each: who listens can say what a crash was about.
struct FuzzListener {
  std::function<void(std::int64_t case_number, const Relation&, const Subject&)> asking = {};
  std::function<void(const FuzzReport&)> progress = {};
  std::function<void(const Finding&)> found = {};
  std::function<bool()> stop = {};
};

/// Case number i of a seed is the same whatever was asked before; cases in a space that no relation is about
/// are left out.
FuzzReport run_fuzz(const FuzzOptions& options, const FuzzListener& listener = {});

/// A name that says what was found and where: "TurnF32FmaSeed1Case42".
std::string test_name(const Finding& finding, std::uint64_t seed);

/// The finding as a GoogleTest to paste, with what was found as a comment.
std::string as_test(const Finding& finding, const FuzzOptions& options);

}  // namespace rasterbench::fuzz
