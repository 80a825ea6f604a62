// Relations about tessellation: the pieces of a triangle cover what the triangle covers, each sample once
// under the rule top-left.
//
// Each triangle is drawn alone and flat, so that nothing hides a wrong pixel. Exact edges promise it to the
// pixel. In other modes pieces and whole see their outer edges with different roundings, and three or more
// uncertain edges may contradict each other next to a common corner: gaps and overlaps are promised to lie
// within the bound only.
#include <algorithm>
#include <optional>
#include <vector>

#include "fuzz/exact_arithmetic.h"
#include "fuzz/pictures.h"
#include "numeric/exact_sign.h"
#include "scene/generator.h"

namespace rasterbench::fuzz {
namespace {

struct Corner {
  float x, y, d;
};

Corner corner(const ScreenTriangle<float>& t, std::size_t i) { return {t.x[i], t.y[i], t.d[i]}; }

ScreenTriangle<float> triangle(const Corner& a, const Corner& b, const Corner& c, std::int32_t id) {
  return {{a.x, b.x, c.x}, {a.y, b.y, c.y}, {a.d, b.d, c.d}, id};
}

std::optional<Corner> midpoint(const Corner& a, const Corner& b) {
  const auto x = exact_midpoint(a.x, b.x), y = exact_midpoint(a.y, b.y), d = exact_midpoint(a.d, b.d);
  if (!x || !y || !d) return std::nullopt;
  return Corner{*x, *y, *d};
}

using Pieces = std::vector<ScreenTriangle<float>>;

/// Two pieces, from the middle of one side, or four, from the middles of all three; none where a middle is no
/// float32 number.
Pieces cut_at_midpoints(const ScreenTriangle<float>& t, Random& random) {
  const auto first = static_cast<std::size_t>(random.bits() % 3);
  const Corner a = corner(t, first), b = corner(t, (first + 1) % 3), c = corner(t, (first + 2) % 3);
  const auto ab = midpoint(a, b);
  if (!ab) return {};
  if (random.bits() % 2 == 0) return {triangle(a, *ab, c, t.id), triangle(*ab, b, c, t.id)};
  const auto bc = midpoint(b, c), ca = midpoint(c, a);
  if (!bc || !ca) return {};
  return {triangle(a, *ab, *ca, t.id), triangle(*ab, b, *bc, t.id), triangle(*ca, *bc, c, t.id),
          triangle(*ab, *bc, *ca, t.id)};
}

/// Three pieces round a point inside, which need not be the exact one that was aimed at.
Pieces cut_at_inner_point(const ScreenTriangle<float>& t, Random& random) {
  const double u = random.uniform(), v = random.uniform(), of_a = 1 - (u > v ? u : v), of_b = u > v ? v : u,
               of_c = 1 - of_a - of_b;
  const auto mix = [&](const float* of) {
    return static_cast<float>(of_a * double{of[0]} + of_b * double{of[1]} + of_c * double{of[2]});
  };
  const Corner a = corner(t, 0), b = corner(t, 1), c = corner(t, 2), inner{mix(t.x), mix(t.y), mix(t.d)};
  return {triangle(a, b, inner, t.id), triangle(b, c, inner, t.id), triangle(c, a, inner, t.id)};
}

/// Sign of the area of exact corners.
int orientation(const ScreenTriangle<float>& t) {
  return exact_orientation(t.x[0], t.y[0], t.x[1], t.y[1], t.x[2], t.y[2]);
}

/// Whether the pieces are wound as the whole is: else they overlap or stick out.
bool all_wound_alike(const Pieces& pieces, int winding) {
  return std::all_of(pieces.begin(), pieces.end(),
                     [&](const auto& piece) { return orientation(piece) == winding; });
}

/// The pixel where the whole and its pieces differ, for a mode of exact edges; in closed several pieces may
/// own a sample on their common edge.
std::string difference_of_exact(const ScreenPicture& whole, ScreenPicture pieces, FillRule fill) {
  if (fill == FillRule::kClosed)
    for (std::int32_t& count : pieces.counts) count = std::min(count, 1);
  return first_difference(whole, pieces, same_place(whole), {.ids = false, .values = false});
}

/// The same within the bound.
std::string difference_within_bound(const ScreenInput& whole, const ScreenPicture& of_whole,
                                    const ScreenInput& pieces, const ScreenPicture& of_pieces,
                                    const ModeInfo& mode) {
  const auto uncertain = uncertain_pixels(whole, mode), uncertain_pieces = uncertain_pixels(pieces, mode);
  return first_difference(
      of_whole, of_pieces, same_place(of_whole), {.ids = false, .values = false},
      [&](std::size_t i, std::size_t k) {
        return uncertain[i] || uncertain_pieces[k] ||
               (whole.fill == FillRule::kClosed && of_pieces.counts[k] > 1 && of_whole.counts[i] == 1);
      });
}

template <class Cut>
Verdict tessellate(const FuzzCase& fuzz_case, const Subject& subject, Cut cut) {
  const ScreenInput input = screen_input(fuzz_case);
  Random random(fuzz_case.seed);
  Verdict verdict = kNotApplicable;
  for (ScreenTriangle<float> t : input.triangles) {
    std::fill_n(t.d, 3, 0.0f);
    ScreenInput whole = input, pieces = input;
    whole.triangles = {t};
    pieces.triangles = cut(t, random);
    const int winding = orientation(t);
    if (pieces.triangles.empty() || winding == 0 || !all_wound_alike(pieces.triangles, winding)) continue;
    // A snap moves pieces and whole apart.
    if (snaps(subject.info) && !(is_on_grid(whole, subject.info) && is_on_grid(pieces, subject.info)))
      continue;
    if (verdict.kind == Verdict::Kind::kNotApplicable) verdict = kHolds;
    const ScreenPicture of_whole = subject.draw(whole), of_pieces = subject.draw(pieces);
    const std::string difference = difference_of_exact(of_whole, of_pieces, input.fill);
    if (difference.empty()) continue;
    const ModeBound& bound = subject.info.numbers;
    if (bound.bounded && bound.edge_form == EdgeForm::kExact) return judged(difference, true);
    verdict = judged(difference, false);
    if (!bound.bounded) continue;
    const std::string beyond = difference_within_bound(whole, of_whole, pieces, of_pieces, subject.info);
    if (!beyond.empty()) return judged(beyond, true);
  }
  return verdict;
}

Verdict halve(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  return tessellate(fuzz_case, subject, cut_at_midpoints);
}

Verdict split(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  return tessellate(fuzz_case, subject, cut_at_inner_point);
}

/// All triangles together, each cut at exact midpoints: the pieces lie in its plane and bear its id, so that
/// a mode of exact winners sees the same owners.
Verdict owners(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  if (!subject.info.numbers.exact_winner) return kNotApplicable;
  const ScreenInput input = screen_input(fuzz_case);
  ScreenInput cut = input;
  cut.triangles.clear();
  Random random(fuzz_case.seed);
  for (const ScreenTriangle<float>& t : input.triangles) {
    const Pieces pieces = cut_at_midpoints(t, random);
    if (pieces.empty()) cut.triangles.push_back(t);
    cut.triangles.insert(cut.triangles.end(), pieces.begin(), pieces.end());
  }
  if (cut.triangles.size() == input.triangles.size()) return kNotApplicable;
  const ScreenPicture whole = subject.draw(input);
  return judged(
      first_difference(whole, subject.draw(cut), same_place(whole), {.counts = false, .values = false}),
      true);
}

constexpr Relation kRelations[] = {
    {"midpoints", "pieces from the exact middles of a triangle's sides cover what it covers", Space::kScreen,
     halve},
    {"split", "three pieces round an inner point cover what the triangle covers", Space::kScreen, split},
    {"owners", "exact winners stay when triangles are cut at exact midpoints", Space::kScreen, owners},
};

}  // namespace

std::span<const Relation> tessellation_relations() { return kRelations; }

}  // namespace rasterbench::fuzz
