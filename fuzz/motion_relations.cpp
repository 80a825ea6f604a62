// Relations about place: a picture moved by whole pixels, or mirrored, is the picture of what is moved or
// mirrored. Both are applied only where every changed coordinate is a float32 number.
#include <cmath>

#include "fuzz/exact_arithmetic.h"
#include "fuzz/pictures.h"
#include "scene/generator.h"

namespace rasterbench::fuzz {
namespace {

/// Applies `x_to` and `y_to` (float -> optional<float>) to all corners; empty where one has no exact result
/// or leaves the guard band.
template <class X, class Y>
std::optional<ScreenInput> moved(ScreenInput input, X x_to, Y y_to) {
  for (auto& t : input.triangles)
    for (int i = 0; i < 3; ++i) {
      const auto x = x_to(t.x[i]), y = y_to(t.y[i]);
      if (!x || !y || std::abs(*x) > kGuardBand || std::abs(*y) > kGuardBand) return std::nullopt;
      t.x[i] = *x;
      t.y[i] = *y;
    }
  return input;
}

/// Exact edges and those of the form (b-a)x(p-a) see nothing but differences of coordinates, and the depth's
/// plane too, so that they promise the same bits. A x + B y + C sees the coordinates themselves; incremental
/// edges restart at fixed columns.
bool sees_differences_only(const ModeInfo& mode, int dx) {
  const EdgeForm form = mode.numbers.edge_form;
  constexpr int kRestart = 64;  // columns, IncrementalEdges
  return form == EdgeForm::kExact || form == EdgeForm::kCross ||
         (form == EdgeForm::kIncremental && dx % kRestart == 0);
}

Verdict shift(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  const ScreenInput input = screen_input(fuzz_case);
  Random random(fuzz_case.seed);
  const auto pixels = [&](int side) {
    return static_cast<int>(random.bits() % static_cast<std::uint64_t>(2 * side + 1)) - side;
  };
  const int dx = pixels(input.width), dy = pixels(input.height);
  const auto after = moved(
      input, [&](float x) { return exact_sum(x, static_cast<float>(dx)); },
      [&](float y) { return exact_sum(y, static_cast<float>(dy)); });
  if (!after) return kNotApplicable;
  const PixelMap map = [&](int x, int y) -> std::optional<std::pair<int, int>> {
    const int to_x = x + dx, to_y = y + dy;
    if (to_x < 0 || to_x >= input.width || to_y < 0 || to_y >= input.height) return std::nullopt;
    return std::pair{to_x, to_y};
  };
  const ScreenPicture a = subject.draw(input), b = subject.draw(*after);
  if (!subject.info.numbers.bounded) return judged(first_difference(a, b, map, {}), false);
  if (sees_differences_only(subject.info, dx)) return judged(first_difference(a, b, map, {}), true);
  const std::string difference = first_difference(a, b, map, {.counts = false, .values = false});
  if (difference.empty()) return kHolds;
  const auto of_a = uncertain_pixels(input, subject.info), of_b = uncertain_pixels(*after, subject.info);
  return judged(first_difference(a, b, map, {.counts = false, .values = false},
                                 [&](std::size_t i, std::size_t k) { return of_a[i] || of_b[k]; }),
                true);
}

/// Where a sample lies on an edge, top-left gives it to the other side in the mirror: such pixels are left
/// out. Mirrored corners come in another canonical order, so that roundings differ.
Verdict mirror(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  const ScreenInput input = screen_input(fuzz_case);
  const bool left_right = Random(fuzz_case.seed).bits() % 2 == 0;
  const auto flipped = [](bool flip, int side) {
    return [=](float v) { return flip ? exact_sum(static_cast<float>(side), -v) : std::optional(v); };
  };
  const auto after = moved(input, flipped(left_right, input.width), flipped(!left_right, input.height));
  if (!after) return kNotApplicable;
  const PixelMap map = [&](int x, int y) {
    return std::optional(left_right ? std::pair{input.width - 1 - x, y} : std::pair{x, input.height - 1 - y});
  };
  const ScreenPicture a = subject.draw(input), b = subject.draw(*after);
  const ModeBound& bound = subject.info.numbers;
  const bool exact_coverage = bound.bounded && bound.edge_form == EdgeForm::kExact;
  const Compared compared{.counts = exact_coverage, .ids = true, .values = false};
  std::string difference = first_difference(a, b, map, compared);
  if (difference.empty()) return kHolds;

  std::vector<bool> edges_a(a.ids.size()), edges_b = edges_a;
  if (input.fill == FillRule::kTopLeft) {
    edges_a = pixels_on_edges(input, subject);
    edges_b = pixels_on_edges(*after, subject);
  }
  const auto on_edge = [&](std::size_t i, std::size_t k) { return edges_a[i] || edges_b[k]; };
  if (!bound.bounded || bound.exact_winner)
    return judged(first_difference(a, b, map, compared, on_edge), bound.bounded);
  if (exact_coverage) {
    difference = first_difference(a, b, map, {.ids = false, .values = false}, on_edge);
    if (!difference.empty()) return judged(difference, true);
  }
  const auto of_a = uncertain_pixels(input, subject.info), of_b = uncertain_pixels(*after, subject.info);
  return judged(
      first_difference(a, b, map, {.counts = false, .values = false},
                       [&](std::size_t i, std::size_t k) { return on_edge(i, k) || of_a[i] || of_b[k]; }),
      true);
}

constexpr Relation kRelations[] = {
    {"shift", "moved by whole pixels: the same picture, moved", Space::kScreen, shift},
    {"mirror", "mirrored about the image's centre: the same picture, mirrored", Space::kScreen, mirror},
};

}  // namespace

std::span<const Relation> motion_relations() { return kRelations; }

}  // namespace rasterbench::fuzz
