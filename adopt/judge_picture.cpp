#include "adopt/judge_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <unordered_map>

#include "base/error.h"
#include "pipeline/resolve.h"
#include "reference/end_to_end.h"
#include "reference/footprint.h"
#include "reference/judge.h"
#include "reference/specification.h"

namespace rasterbench {
namespace {

using reference::Footprint;

/// What programs of the course compute in.
constexpr const char* kLikelyModes[] = {"f32",    "f64", "two_product", "f32_plane", "f32_incremental",
                                        "fixed_8"};
constexpr const char* kLiteralMode = "two_product";

/// A program in one format throughout, transform included. Footprint counts the roundings of our own geometry
/// and of edge functions (b-a)x(p-a); another program may take some more steps (its own view matrix,
/// normalised device coordinates, barycentrics), for which each unit is that of two bits less.
PictureBound bound_of(double unit) {
  const double u = 4 * unit;
  PictureBound bound(ModeBound{.vertex_unit = u, .edge_unit = u, .gradient_unit = u, .depth_unit = u});
  bound.geometry_unit = u;
  return bound;
}

int channel(std::uint32_t colour, int shift) { return static_cast<int>(colour >> shift & 0xff); }

/// Equal but for 1 a channel, which the contract tolerates (accuracy.md, section 1).
bool alike(std::uint32_t a, std::uint32_t b) {
  return std::abs(channel(a, 0) - channel(b, 0)) <= 1 && std::abs(channel(a, 8) - channel(b, 8)) <= 1 &&
         std::abs(channel(a, 16) - channel(b, 16)) <= 1;
}

double row_at(const AffineRow& row, const Vec3& p) {
  return row.x * double{p.x} + row.y * double{p.y} + row.z * double{p.z} + row.w;
}

/// Pixels whose samples a triangle can reach, with room for roundings; the whole image where it comes near
/// the camera's plane.
PixelBox reach_of(const Triangle& t, const Camera& camera) {
  constexpr double kRoom = 3;  // pixels: beyond every float32 rounding where w is not tiny
  const double width = camera.viewport.width, height = camera.viewport.height;
  double x0 = INFINITY, y0 = INFINITY, x1 = -INFINITY, y1 = -INFINITY;
  for (const Vec3& p : {t.a, t.b, t.c}) {
    const double w = row_at(camera.w, p);
    if (!std::isfinite(w)) return {};
    if (w < 0.5 * camera.near_plane) return {0, 0, camera.viewport.width, camera.viewport.height};
    const double x = (row_at(camera.x, p) / w + 1) * 0.5 * width,
                 y = (1 - row_at(camera.y, p) / w) * 0.5 * height;
    x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
  const auto pixel = [](double v, double most) {
    return static_cast<std::int32_t>(std::clamp(v, 0.0, most));
  };
  return {pixel(std::floor(x0 - kRoom), width), pixel(std::floor(y0 - kRoom), height),
          pixel(std::ceil(x1 + kRoom), width), pixel(std::ceil(y1 + kRoom), height)};
}

}  // namespace

FindingWords words_of(PixelFinding finding) {
  switch (finding) {
    case PixelFinding::kSame:
      return {"same", "the true colour"};
    case PixelFinding::kShade:
      return {"shade_off_by_one", "a difference of 1 in a channel, which is tolerated"};
    case PixelFinding::kAmbiguous:
      return {"ambiguous", "the true owner is undecided: not counted"};
    case PixelFinding::kFillRule:
      return {"fill_rule", "exactly on an edge, and drawn by another fill rule"};
    case PixelFinding::kEdge64:
      return {"edge_float64", "at an edge, within the rounding of float64"};
    case PixelFinding::kDepth64:
      return {"depth_float64", "at equal depths, within the rounding of float64"};
    case PixelFinding::kEdge32:
      return {"edge_float32", "at an edge, within the rounding of float32"};
    case PixelFinding::kDepth32:
      return {"depth_float32", "at nearly equal depths, within the rounding of float32"};
    case PixelFinding::kLiteral:
      return {"literal_formula", "as the literal formula of the course text shows it in float32"};
    case PixelFinding::kHidden:
      return {"hidden", "WRONG: shows a triangle that lies behind the nearest one"};
    case PixelFinding::kMissing:
      return {"missing", "WRONG: background where a triangle must be"};
    case PixelFinding::kOutside:
      return {"outside", "WRONG: a triangle drawn beyond its edges"};
    case PixelFinding::kUnwritten:
      return {"unwritten", "WRONG: black that nothing here has, as if never written"};
    case PixelFinding::kColour:
      return {"colour", "WRONG: a colour that nothing near this pixel has"};
    case PixelFinding::kUnexamined:
      return {"unexamined", "WRONG: not looked at one by one, so many pixels differ"};
  }
  return {"", ""};
}

std::int64_t PictureFindings::wrong() const {
  std::int64_t sum = 0;
  for (int i = static_cast<int>(PixelFinding::kHidden); i < kFindings; ++i)
    sum += counts[static_cast<std::size_t>(i)];
  return sum;
}

std::int64_t PictureFindings::differ() const {
  return static_cast<std::int64_t>(pixels.size()) - of(PixelFinding::kSame) - of(PixelFinding::kAmbiguous);
}

/// The triangles that can have to do with some of the pixels: those whose reach holds one of them.
class PictureJudge::Candidates {
 public:
  /// `pixels`: indices, ascending.
  Candidates(const PictureJudge& judge, std::span<const std::size_t> pixels) : judge_(judge) {
    const auto width = static_cast<std::size_t>(judge.settings_.width);
    columns_ = (judge.settings_.width + kCell - 1) / kCell;
    const int rows = (judge.settings_.height + kCell - 1) / kCell;
    // How many of the pixels lie in the cells above and to the left: a box is asked in four steps.
    std::vector<std::int64_t> sums(static_cast<std::size_t>(columns_ + 1) *
                                   static_cast<std::size_t>(rows + 1));
    const auto sum = [&](int column, int row) -> std::int64_t& {
      return sums[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_ + 1) +
                  static_cast<std::size_t>(column)];
    };
    for (const std::size_t pixel : pixels)
      ++sum(static_cast<int>(pixel % width) / kCell + 1, static_cast<int>(pixel / width) / kCell + 1);
    for (int row = 1; row <= rows; ++row)
      for (int column = 1; column <= columns_; ++column)
        sum(column, row) += sum(column - 1, row) + sum(column, row - 1) - sum(column - 1, row - 1);

    cells_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows));
    const auto& triangles = judge.scene_.model.triangles;
    for (std::size_t id = 0; id < triangles.size(); ++id) {
      const PixelBox reach = reach_of(triangles[id], judge.camera_);
      if (reach.empty()) continue;
      const int c0 = reach.x0 / kCell, c1 = (reach.x1 - 1) / kCell + 1;
      const int r0 = reach.y0 / kCell, r1 = (reach.y1 - 1) / kCell + 1;
      if (sum(c1, r1) - sum(c0, r1) - sum(c1, r0) + sum(c0, r0) == 0) continue;
      for (int row = r0; row < r1; ++row)
        for (int column = c0; column < c1; ++column)
          if (sum(column + 1, row + 1) - sum(column, row + 1) - sum(column + 1, row) + sum(column, row) > 0)
            cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                   static_cast<std::size_t>(column)]
                .push_back({static_cast<std::int32_t>(id), reach});
    }
  }

  /// What explains that pixel (x, y) has this colour, and not the true one.
  PixelFinding explain(int x, int y, std::uint32_t colour, std::int32_t owner) {
    const Near here = near(x, y);
    for (const bool wide : {false, true}) {
      const PixelFinding found = within(here, x + 0.5, y + 0.5, colour, owner, wide);
      if (found != PixelFinding::kColour) return found;
    }
    const std::uint32_t background = judge_.background();
    bool is_drawn_near = false;
    for (const std::int32_t id : here) {
      if (!alike(colour, colour_of(id))) continue;
      if (footprint(id, true).may_cover(x + 0.5, y + 0.5)) return PixelFinding::kHidden;
      is_drawn_near = true;
    }
    if (alike(colour, background)) return PixelFinding::kMissing;
    if (is_drawn_near) return PixelFinding::kOutside;
    return (colour & 0xffffffu) == 0 ? PixelFinding::kUnwritten : PixelFinding::kColour;
  }

 private:
  static constexpr int kCell = 32;  // pixels
  using Near = std::vector<std::int32_t>;
  struct Entry {
    std::int32_t id;
    PixelBox reach;
  };

  Near near(int x, int y) const {
    Near ids;
    for (const Entry& entry :
         cells_[static_cast<std::size_t>(y / kCell) * static_cast<std::size_t>(columns_) +
                static_cast<std::size_t>(x / kCell)])
      if (entry.reach.contains(x, y)) ids.push_back(entry.id);
    return ids;
  }

  std::uint32_t colour_of(std::int32_t id) const {
    return shade_flat(judge_.scene_.model.triangles[static_cast<std::size_t>(id)],
                      judge_.scene_.parameters.object);
  }

  const Footprint& footprint(std::int32_t id, bool wide) {
    auto& cache = footprints_[wide ? 1 : 0];
    const auto found = cache.find(id);
    if (found != cache.end()) return found->second;
    return cache
        .emplace(id,
                 Footprint(judge_.scene_.model.triangles[static_cast<std::size_t>(id)], id, judge_.camera_,
                           judge_.settings_.geometry.near_rule, wide ? float32_ : float64_))
        .first->second;
  }

  /// kColour where no triangle that the roundings of the format let win has the colour.
  PixelFinding within(const Near& ids, double x, double y, std::uint32_t colour, std::int32_t owner,
                      bool wide) {
    double nearest = 1;  // no program may show what is certainly behind this
    bool is_covered = false;
    for (const std::int32_t id : ids)
      if (footprint(id, wide).must_cover(x, y)) {
        const double high = footprint(id, wide).depths(x, y).high;
        nearest = std::min(nearest, high);
        is_covered = is_covered || high < 1;
      }
    const PixelFinding edge = wide ? PixelFinding::kEdge32 : PixelFinding::kEdge64;
    const PixelFinding depth = wide ? PixelFinding::kDepth32 : PixelFinding::kDepth64;
    const bool owner_is_certain = owner >= 0 && footprint(owner, wide).must_cover(x, y);
    if (!is_covered && alike(colour, judge_.background())) return owner_is_certain ? depth : edge;
    for (const std::int32_t id : ids) {
      if (!alike(colour, colour_of(id))) continue;
      const Footprint& drawn = footprint(id, wide);
      if (!drawn.may_cover(x, y) || !(drawn.depths(x, y).low <= nearest)) continue;
      return owner_is_certain && drawn.must_cover(x, y) ? depth : edge;
    }
    return PixelFinding::kColour;
  }

  const PictureJudge& judge_;
  const PictureBound float64_ = bound_of(0x1p-53), float32_ = bound_of(0x1p-24);
  int columns_ = 0;
  std::vector<std::vector<Entry>> cells_;
  std::unordered_map<std::int32_t, Footprint> footprints_[2];
};

PictureJudge::PictureJudge(const Scene& scene, const FrameSettings& settings, int threads)
    : scene_(scene), settings_(settings), camera_(sized_camera(scene, settings)) {
  settings_.geometry.isa = Isa::kBaseline;  // nothing vectorised takes part in a judgement
  const auto truth = [&](FillRule fill) {
    return render_end_to_end(scene, settings_.width, settings_.height, fill, settings_.geometry.near_rule,
                             threads);
  };
  EndToEndTruth own = truth(settings_.fill);
  owners_ = std::move(own.truth.ids);
  truth_ = shade_owners(owners_, scene);
  for (const DecidedBy decided : own.decided) ambiguous_.push_back(decided == DecidedBy::kAmbiguous);
  other_fill_ = shade_owners(
      truth(settings_.fill == FillRule::kClosed ? FillRule::kTopLeft : FillRule::kClosed).truth.ids, scene);
}
PictureJudge::~PictureJudge() = default;

std::uint32_t PictureJudge::background() const { return pack_rgba(scene_.parameters.background); }

const std::vector<std::uint32_t>& PictureJudge::mode_colours(const std::string& numeric, FillRule fill) {
  const auto [slot, is_new] = modes_.try_emplace({numeric, fill});
  if (is_new) {
    FrameSettings settings = settings_;
    settings.fill = fill;
    slot->second = render_specification(scene_, numeric, settings).colours;
  }
  return slot->second;
}

PictureFindings PictureJudge::judge(std::span<const std::uint32_t> colours) {
  if (colours.size() != truth_.size()) throw Error("the picture to judge has another size than the scene's");
  PictureFindings findings;
  findings.pixels.assign(colours.size(), PixelFinding::kSame);
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    if (colours[i] == truth_[i]) continue;
    if (ambiguous_[i])
      findings.pixels[i] = PixelFinding::kAmbiguous;
    else if (alike(colours[i], truth_[i]))
      findings.pixels[i] = PixelFinding::kShade;
    else if (other_fill_[i] != truth_[i] && alike(colours[i], other_fill_[i]))
      findings.pixels[i] = PixelFinding::kFillRule;
    else
      open.push_back(i);
  }
  // Evenly over the picture, so that what is left out is like what is looked at.
  const std::size_t step = open.size() / static_cast<std::size_t>(kMostExamined) + 1;
  std::vector<std::size_t> examined;
  for (std::size_t k = 0; k < open.size(); ++k) {
    if (k % step == 0)
      examined.push_back(open[k]);
    else
      findings.pixels[open[k]] = PixelFinding::kUnexamined;
  }
  if (!examined.empty()) {
    Candidates candidates(*this, examined);
    const auto width = static_cast<std::size_t>(settings_.width);
    for (const std::size_t i : examined) {
      PixelFinding found = candidates.explain(static_cast<int>(i % width), static_cast<int>(i / width),
                                              colours[i], owners_[i]);
      if (is_wrong(found) && alike(colours[i], mode_colours(kLiteralMode, settings_.fill)[i]))
        found = PixelFinding::kLiteral;
      findings.pixels[i] = found;
    }
  }
  for (const PixelFinding finding : findings.pixels) ++findings.counts[static_cast<std::size_t>(finding)];
  return findings;
}

std::vector<NearestMode> PictureJudge::nearest(std::span<const std::uint32_t> colours) {
  std::vector<NearestMode> found;
  const FillRule other = settings_.fill == FillRule::kClosed ? FillRule::kTopLeft : FillRule::kClosed;
  for (const FillRule fill : {settings_.fill, other})
    for (const char* numeric : kLikelyModes) {
      // The literal formula is closed by what it is.
      if (numeric == std::string_view(kLiteralMode) && fill == FillRule::kTopLeft) continue;
      const std::vector<std::uint32_t>& mode = mode_colours(numeric, fill);
      NearestMode entry{numeric, fill, 0};
      for (std::size_t i = 0; i < colours.size(); ++i) entry.differing += colours[i] != mode[i];
      found.push_back(std::move(entry));
    }
  std::stable_sort(found.begin(), found.end(),
                   [](const NearestMode& a, const NearestMode& b) { return a.differing < b.differing; });
  return found;
}

WholePicture PictureJudge::whole(std::span<const std::uint32_t> colours) const {
  const auto width = static_cast<std::size_t>(settings_.width),
             height = static_cast<std::size_t>(settings_.height);
  const auto differing = [&](auto at) {
    std::int64_t count = 0;
    for (std::size_t y = 0; y < height; ++y)
      for (std::size_t x = 0; x < width; ++x) count += !alike(at(x, y), truth_[y * width + x]);
    return count;
  };
  const auto as_it_is = [&](std::size_t x, std::size_t y) { return colours[y * width + x]; };
  const auto swapped = [&](std::size_t x, std::size_t y) {
    const std::uint32_t c = as_it_is(x, y);
    return (c & 0xff00ff00u) | (c & 0xff) << 16 | (c >> 16 & 0xff);
  };
  const std::int64_t before = differing(as_it_is);
  const WholePicture tries[] = {
      {"upside down", differing([&](auto x, auto y) { return as_it_is(x, height - 1 - y); })},
      {"mirrored", differing([&](auto x, auto y) { return as_it_is(width - 1 - x, y); })},
      {"red and blue swapped", differing(swapped)}};
  WholePicture best;
  for (const WholePicture& t : tries)
    if (10 * t.differing < before && (best.transformed.empty() || t.differing < best.differing)) best = t;
  return best;
}

}  // namespace rasterbench
