// Relations about order: of a triangle's corners, of the triangles, of their ids, of the two fill rules, and
// of depths.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "fuzz/pictures.h"
#include "scene/generator.h"

namespace rasterbench::fuzz {
namespace {

/// Fisher & Yates.
template <class T>
void shuffle(std::vector<T>& items, Random& random) {
  for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[random.bits() % i]);
}

ScreenTriangle<float> reordered(const ScreenTriangle<float>& t, const std::array<int, 3>& order) {
  ScreenTriangle<float> result{{}, {}, {}, t.id};
  for (std::size_t i = 0; i < 3; ++i) {
    result.x[i] = t.x[order[i]];
    result.y[i] = t.y[order[i]];
    result.d[i] = t.d[order[i]];
  }
  return result;
}

/// The corners of every triangle in one of their six orders, half of which reverse its winding.
Verdict turn(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  constexpr std::array<std::array<int, 3>, 5> kOrders{
      {{1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  const ScreenInput input = screen_input(fuzz_case);
  ScreenInput turned = input;
  Random random(fuzz_case.seed);
  for (auto& t : turned.triangles) t = reordered(t, kOrders[random.bits() % kOrders.size()]);
  const ScreenPicture before = subject.draw(input);
  return judged(first_difference(before, subject.draw(turned), same_place(before), {}),
                subject.info.numbers.bounded);
}

/// Each triangle keeps its id: Invariant 0, which binds unbounded modes as well.
Verdict order(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  const ScreenInput input = screen_input(fuzz_case);
  ScreenInput shuffled = input;
  Random random(fuzz_case.seed);
  shuffle(shuffled.triangles, random);
  const ScreenPicture before = subject.draw(input);
  return judged(first_difference(before, subject.draw(shuffled), same_place(before), {}), true);
}

/// Only pixels where several triangles are nearest may change hands. The exact mode compares such depths
/// exactly, and stores the winner's with the rounding of its plane: at a tie its values may change as well.
Verdict rename(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  const ScreenInput input = screen_input(fuzz_case);
  std::vector<std::int32_t> new_id(static_cast<std::size_t>(input.ids));
  std::iota(new_id.begin(), new_id.end(), 0);
  Random random(fuzz_case.seed);
  shuffle(new_id, random);
  ScreenInput renamed = input;
  for (auto& t : renamed.triangles) t.id = new_id[static_cast<std::size_t>(t.id)];

  ScreenPicture before = subject.draw(input);
  const ScreenPicture after = subject.draw(renamed);
  for (std::int32_t& id : before.ids)
    if (id >= 0) id = new_id[static_cast<std::size_t>(id)];
  const auto tied = [&](std::size_t i, std::size_t) { return before.tied[i] && after.tied[i]; };
  std::string difference = first_difference(before, after, same_place(before), {.values = false}, tied);
  if (difference.empty()) {
    const bool exact = subject.info.numbers.exact_winner;
    difference = first_difference(before, after, same_place(before), {.ids = false},
                                  [&](std::size_t i, std::size_t k) { return exact && tied(i, k); });
  }
  return judged(difference, true);
}

/// A flipped copy of every triangle behind the others in the order of ids: it loses every tie (accuracy.md,
/// case 41).
Verdict duplicate(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  const ScreenInput input = screen_input(fuzz_case);
  ScreenInput twice = input;
  twice.ids = 2 * input.ids;
  for (const auto& t : input.triangles) {
    ScreenTriangle<float> copy = reordered(t, {0, 2, 1});
    copy.id += input.ids;
    // Between the others, so that the order of drawing would show.
    twice.triangles.insert(twice.triangles.begin(), copy);
  }
  ScreenPicture before = subject.draw(input);
  for (std::int32_t& count : before.counts) count *= 2;
  return judged(first_difference(before, subject.draw(twice), same_place(before), {}),
                subject.info.numbers.bounded);
}

/// What top-left covers, closed covers.
Verdict fill(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  ScreenInput input = screen_input(fuzz_case);
  input.fill = FillRule::kClosed;
  const ScreenPicture closed = subject.draw(input);
  input.fill = FillRule::kTopLeft;
  const ScreenPicture top_left = subject.draw(input);
  return judged(
      first_difference(closed, top_left, same_place(closed), {.ids = false, .values = false},
                       [&](std::size_t i, std::size_t k) { return top_left.counts[k] <= closed.counts[i]; }),
      true);
}

/// Rounding leaves the depths of a triangle's corners unless it is kept from it (accuracy.md, section 1);
/// tiles could not be rejected by depth. A format of fixed point may round by half a step.
Verdict range(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  ScreenInput input = screen_input(fuzz_case);
  input.fill = FillRule::kClosed;
  for (const auto& t : input.triangles) {
    ScreenInput alone = input;
    alone.triangles = {t};
    const ScreenPicture picture = subject.draw(alone);
    std::array<float, 3> d;
    std::transform(t.d, t.d + 3, d.begin(),
                   [&](float v) { return depth_value(v, subject.info.depth_function); });
    const auto [low, high] = std::minmax_element(d.begin(), d.end());
    const double room = subject.info.numbers.depth_step / 2 * (1 + 0x1p-20);  // and its own rounding
    for (std::size_t i = 0; i < picture.ids.size(); ++i)
      if (picture.ids[i] >= 0 && !(picture.values[i] >= *low - room && picture.values[i] <= *high + room))
        return judged(
            fmt::format("pixel ({}, {}) is of depth {:a}, corners are from {:a} to {:a}",
                        i % static_cast<std::size_t>(picture.width),
                        i / static_cast<std::size_t>(picture.width), picture.values[i], *low, *high),
            subject.info.numbers.bounded);
  }
  return kHolds;
}

constexpr Relation kRelations[] = {
    {"turn", "the order and winding of a triangle's corners change nothing", Space::kScreen, turn},
    {"order", "the order in which triangles are drawn changes nothing", Space::kScreen, order},
    {"rename", "other ids change the owners' names only, but for ties in depth", Space::kScreen, rename},
    {"duplicate", "flipped copies of all triangles, with larger ids, change nothing", Space::kScreen,
     duplicate},
    {"fill", "what the rule top-left covers, the rule closed covers", Space::kScreen, fill},
    {"range", "depths of a triangle stay within those of its corners", Space::kScreen, range},
};

}  // namespace

std::span<const Relation> order_relations() { return kRelations; }

}  // namespace rasterbench::fuzz
