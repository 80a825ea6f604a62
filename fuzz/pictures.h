// Pictures compared, for relations.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fuzz/relation.h"
#include "fuzz/subject.h"

namespace rasterbench::fuzz {

inline const Verdict kHolds{};
inline const Verdict kNotApplicable{.kind = Verdict::Kind::kNotApplicable};

/// kHolds where `difference` is empty; else a violation, or an observation where it was not promised.
Verdict judged(const std::string& difference, bool promised);

/// Whether coverage is that of exact arithmetic on the corners as they are given.
bool has_exact_edges(const ModeInfo& mode);
/// Whether it is that of exact arithmetic on snapped corners.
bool snaps(const ModeInfo& mode);
/// Whether snapping leaves every corner where it is.
bool is_on_grid(const ScreenInput& input, const ModeInfo& mode);
/// The corners as the mode snaps them: to the nearest of the grid, ties to even.
ScreenInput snapped(ScreenInput input, const ModeInfo& mode);

/// Which pixel of `b` shows what pixel (x, y) of `a` shows, if any does.
using PixelMap = std::function<std::optional<std::pair<int, int>>(int x, int y)>;
PixelMap same_place(const ScreenPicture& a);

/// What is compared of a pixel.
struct Compared {
  bool counts = true, ids = true, values = true;
};

/// The first pixel where the pictures differ in what is compared (values: in their bits) and which `excuse`
/// (of indices into a and b) does not let pass, in words; empty where there is none.
std::string first_difference(const ScreenPicture& a, const ScreenPicture& b, const PixelMap& map,
                             const Compared& compared,
                             const std::function<bool(std::size_t, std::size_t)>& excuse = {});

/// Per pixel, whether the mode can get its owner wrong by its bound (predict_wrong).
std::vector<bool> uncertain_pixels(const ScreenInput& input, const ModeInfo& mode);

/// Per pixel, whether the fill rule matters to the mode's coverage there: a sample lies on an edge.
std::vector<bool> pixels_on_edges(const ScreenInput& input, const Subject& subject);

}  // namespace rasterbench::fuzz
