#include "fuzz/relation.h"

#include "base/error.h"
#include "base/suggest.h"
#include "kernels/kernel.h"

namespace rasterbench::fuzz {

std::span<const Relation> relations() {
  static const std::vector<Relation> all = [] {
    std::vector<Relation> list;
    for (const auto part : {order_relations(), motion_relations(), tessellation_relations(),
                            oracle_relations(), frame_relations(), judge_relations()})
      list.insert(list.end(), part.begin(), part.end());
    return list;
  }();
  return all;
}

const Relation& find_relation(std::string_view name) {
  std::vector<std::string> known;
  for (const Relation& relation : relations()) {
    if (relation.name == name) return relation;
    known.emplace_back(relation.name);
  }
  throw InputError({.field = "--relation"}, unknown_name("relation", name, known));
}

std::vector<std::string> listed_kernels() {
  std::vector<std::string> names;
  for (const Kernel& kernel : kernels())
    if (!kernel.info().hidden) names.emplace_back(kernel.info().name);
  return names;
}

Verdict check(const Relation& relation, const Subject& subject, const FuzzCase& fuzz_case,
              std::span<const std::string> kernels) {
  try {
    return relation.check(fuzz_case, subject, kernels);
  } catch (const InputError&) {
    return {.kind = Verdict::Kind::kNotApplicable};
  } catch (const std::exception& error) {
    return {Verdict::Kind::kViolated, std::string("an exception: ") + error.what()};
  }
}

std::string violation(std::string_view relation, std::string_view mode, const FuzzCase& fuzz_case,
                      const std::vector<std::string>& kernels) {
  const Verdict verdict = check(find_relation(relation), find_subject(mode), fuzz_case,
                                kernels.empty() ? listed_kernels() : kernels);
  return verdict.violated() ? verdict.what : "";
}

}  // namespace rasterbench::fuzz
