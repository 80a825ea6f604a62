// Relations to the exact oracle on the very triangles that a mode is given.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fuzz/pictures.h"
#include "reference/oracle.h"

namespace rasterbench::fuzz {
namespace {

std::string at(const ScreenInput& input, std::size_t i) {
  const auto width = static_cast<std::size_t>(input.width);
  return fmt::format("pixel ({}, {})", i % width, i / width);
}

/// The first pixel where the picture is not the oracle's and `bound` does not explain it.
template <class Real>
std::string beyond_bound(const ScreenInput& input, const ScreenPicture& picture, const ModeInfo& mode,
                         const ModeBound& bound) {
  const auto triangles = triangles_for<Real>(input, mode.depth_function);
  const OracleInput<Real> exact{triangles,  input.width, input.height,
                                input.fill, input.tie,   mode.depth_function};
  const OracleImage oracle = exact_owners(exact, 1);
  const Prediction prediction = predict_wrong(exact, oracle, bound, 1);
  for (std::size_t i = 0; i < picture.ids.size(); ++i) {
    const std::uint8_t reasons = prediction.reasons[i];
    if (bound.edge_form == EdgeForm::kExact && bound.snap == 0 && (reasons & kEdgeCanFlip))
      return at(input, i) + " has an uncertain edge by the prediction, though edges are exact";
    if (picture.ids[i] != oracle.ids[i] && (reasons == 0 || bound.exact_winner))
      return fmt::format("{} is owned by {} and by {} in exact arithmetic", at(input, i), picture.ids[i],
                         oracle.ids[i]);
    if (reasons != 0 || picture.ids[i] < 0) continue;
    const double error = std::abs(picture.values[i] - oracle.values[i]);
    if (!(error <= prediction.max_depth_error))
      return fmt::format("{} is of depth {:a}, {:a} off, the bound is {:a}", at(input, i), picture.values[i],
                         error, prediction.max_depth_error);
  }
  return {};
}

std::string beyond_bound(const ScreenInput& input, const ScreenPicture& picture, const ModeInfo& mode,
                         const ModeBound& bound) {
  return bound.vertex_unit == 0x1p-53 ? beyond_bound<double>(input, picture, mode, bound)
                                      : beyond_bound<float>(input, picture, mode, bound);
}

Verdict oracle(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  if (!subject.info.numbers.bounded) return kNotApplicable;
  const ScreenInput input = screen_input(fuzz_case);
  return judged(beyond_bound(input, subject.draw(input), subject.info, subject.info.numbers), true);
}

/// A mode that snaps is exact on what it has snapped.
Verdict snap(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  if (!snaps(subject.info)) return kNotApplicable;
  const ScreenInput input = screen_input(fuzz_case);
  ModeBound bound = subject.info.numbers;
  bound.snap = 0;
  return judged(beyond_bound(snapped(input, subject.info), subject.draw(input), subject.info, bound), true);
}

constexpr Relation kRelations[] = {
    {"oracle", "owners and depths are the exact oracle's, but for what the mode's bound explains",
     Space::kScreen, oracle},
    {"snap", "the same, of snapped corners, where nothing is left for edges to explain", Space::kScreen,
     snap},
};

}  // namespace

std::span<const Relation> oracle_relations() { return kRelations; }

}  // namespace rasterbench::fuzz
