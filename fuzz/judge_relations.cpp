// Relations of whole frames to the independent references: the exact oracle, the end-to-end truth, and ray
// casting.
#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "fuzz/pictures.h"
#include "reference/judge.h"

namespace rasterbench::fuzz {
namespace {

/// A case drawn in a mode, and its judge.
struct Bench {
  Scene scene;
  FrameSettings settings;
  Judge judge;
  Picture picture;

  Bench(const FuzzCase& fuzz_case, const Subject& subject)
      : scene(scene_of(fuzz_case)),
        settings(settings_of(fuzz_case)),
        judge(scene, settings, 1),
        picture(render_specification(scene, subject.info.name, settings)) {}

  std::string at(std::int64_t pixel) const {
    return fmt::format("pixel ({}, {})", pixel % settings.width, pixel / settings.width);
  }
};

/// Index of the first pixel of one of the classes, or -1.
std::int64_t first_of(const Accuracy& accuracy, std::initializer_list<PixelClass> classes) {
  const auto found =
      std::find_first_of(accuracy.classes.begin(), accuracy.classes.end(), classes.begin(), classes.end());
  return found == accuracy.classes.end() ? -1 : found - accuracy.classes.begin();
}

Verdict oracle(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  const ModeBound& bound = subject.info.numbers;
  if (!bound.bounded) return kNotApplicable;
  Bench bench(fuzz_case, subject);
  const Accuracy accuracy = bench.judge.against_oracle(bench.picture, subject.info);
  if (const auto pixel = first_of(accuracy, {PixelClass::kUnexplained}); pixel >= 0)
    return judged(bench.at(pixel) + " is wrong, and the mode's bound does not explain it", true);
  if (bound.exact_winner && accuracy.wrong > 0)
    return judged(fmt::format("{} is wrong in an exact mode", bench.at(accuracy.worst_pixel)), true);
  if (has_exact_edges(subject.info) && accuracy.edge > 0)
    return judged(bench.at(first_of(accuracy, {PixelClass::kEdge})) + " is wrong at an edge, edges are exact",
                  true);
  const Prediction prediction = bench.judge.prediction(subject.info);
  const OracleImage& exact = bench.judge.oracle(subject.info);
  for (std::size_t i = 0; i < exact.ids.size(); ++i)
    if (bench.picture.ids[i] != exact.ids[i] && prediction.reasons[i] == 0)
      return judged(bench.at(static_cast<std::int64_t>(i)) + " is wrong, which was not predicted", true);
  return kHolds;
}

Verdict snapped_oracle(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  if (!snaps(subject.info)) return kNotApplicable;
  Bench bench(fuzz_case, subject);
  const Accuracy accuracy = bench.judge.against_snapped_oracle(bench.picture, subject.info);
  const auto pixel = first_of(accuracy, {PixelClass::kUnexplained, PixelClass::kEdge});
  return pixel < 0 ? kHolds : judged(bench.at(pixel) + " is wrong on the snapped corners", true);
}

Verdict truth(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  Bench bench(fuzz_case, subject);
  const Accuracy accuracy = bench.judge.against_oracle(bench.picture, subject.info);
  const EndToEndVerdict verdict = bench.judge.against_truth(bench.picture, subject.info, &accuracy);
  if (verdict.errors == 0) return kHolds;
  const auto i = static_cast<std::size_t>(verdict.worst_pixel);
  return judged(
      fmt::format("{} is owned by {}, in truth by {}, and nothing explains it", bench.at(verdict.worst_pixel),
                  bench.picture.ids[i], bench.judge.truth().truth.ids[i]),
      subject.info.numbers.bounded);
}

/// Rays see what the clipping rule leaves, so that the literal step list has nothing to be compared with.
Verdict rays(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  if (!has_embree() || fuzz_case.near_rule != NearRule::kClip) return kNotApplicable;
  Bench bench(fuzz_case, subject);
  for (const bool robust : {false, true}) {
    const RayComparison comparison = bench.judge.against_rays(bench.picture, subject.info, robust);
    if (comparison.errors == 0) continue;
    const auto i = static_cast<std::size_t>(comparison.worst_pixel);
    return judged(fmt::format("{} is owned by {}, a {} ray sees {}, and nothing explains it",
                              bench.at(comparison.worst_pixel), bench.picture.ids[i],
                              robust ? "robust" : "fast", bench.judge.rays(robust).picture.ids[i]),
                  subject.info.numbers.bounded);
  }
  return kHolds;
}

constexpr Relation kRelations[] = {
    {"accuracy", "a frame is the exact oracle's, but for pixels that the mode's bound explains and predicts",
     Space::kWorld, oracle},
    {"accuracy_snapped", "the same, of snapped corners, where no edge explains anything", Space::kWorld,
     snapped_oracle},
    {"truth", "a frame is the end-to-end truth's, but for pixels that bounds explain", Space::kWorld, truth},
    {"rays", "a frame is what Embree's rays see, but for pixels that bounds explain", Space::kWorld, rays},
};

}  // namespace

std::span<const Relation> judge_relations() { return kRelations; }

}  // namespace rasterbench::fuzz
