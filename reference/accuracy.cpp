#include "reference/accuracy.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <tuple>

#include "base/buffer.h"
#include "base/error.h"
#include "pipeline/geometry.h"
#include "reference/bands.h"
#include "reference/bounded_triangle.h"
#include "reference/silhouette.h"
#include "reference/similarity.h"

namespace rasterbench {
namespace {

using namespace reference;

/// Distances along the view axis from depth values.
class ViewAxis {
 public:
  ViewAxis(const Camera& camera, DepthFunction function)
      : function_(function),
        near_(camera.near_plane),
        far_(camera.far_plane),
        perspective_(camera.perspective) {}

  /// How far apart two depth values are, in world units.
  double between(double a, double b) const {
    const double difference = std::abs(a - b), range = far_ - near_;
    if (!perspective_) return difference * (function_ == DepthFunction::kNdc ? range / 2 : range);
    // Each value is an affine function of 1 / distance, so that the difference of two distances needs no
    // subtraction of nearly equal numbers.
    const double slope = function_ == DepthFunction::kNdc        ? 2 * near_ * far_ / range
                         : function_ == DepthFunction::kReversed ? near_ * far_ / range
                                                                 : far_;
    return difference * (distance(a) * distance(b) / slope);
  }

 private:
  double distance(double value) const {
    if (function_ == DepthFunction::kInverseW) return -far_ / value;
    if (function_ == DepthFunction::kReversed) return near_ * far_ / (near_ - value * (far_ - near_));
    return 2 * near_ * far_ / ((far_ + near_) - value * (far_ - near_));
  }

  DepthFunction function_;
  double near_, far_;
  bool perspective_;
};

/// What is known of a pixel whose id is not the oracle's.
struct Verdict {
  PixelClass kind = PixelClass::kUnexplained;
  double distance = 0;  ///< to the outline of the triangle wrongly drawn or left out; 0 of a wrong order
  double gap = 0;       ///< between the exact depths of the drawn triangle and the owner
};

/// Counts of a band, and of the picture.
struct Tally {
  Accuracy sums;
  double worst_distance = 0, worst_gap = -1;

  void add_wrong(const Verdict& verdict, std::size_t pixel) {
    ++(verdict.kind == PixelClass::kExactTie      ? sums.exact_ties
       : verdict.kind == PixelClass::kEdge        ? sums.edge
       : verdict.kind == PixelClass::kDepth       ? sums.depth
       : verdict.kind == PixelClass::kUnexplained ? sums.unexplained
                                                  : sums.unbounded);
    worst_of(verdict.distance, verdict.gap, static_cast<std::int64_t>(pixel));
  }

  /// Of equally bad pixels the first in the picture, whichever band came first.
  void worst_of(double distance, double gap, std::int64_t pixel) {
    const auto before = std::make_tuple(worst_distance, worst_gap, -sums.worst_pixel);
    if (std::make_tuple(distance, gap, -pixel) <= before) return;
    worst_distance = distance, worst_gap = gap, sums.worst_pixel = pixel;
  }

  void add(const Tally& band) {
    const Accuracy& b = band.sums;
    sums.wrong += b.wrong;
    sums.false_positives += b.false_positives;
    sums.false_negatives += b.false_negatives;
    sums.exact_ties += b.exact_ties;
    sums.edge += b.edge;
    sums.depth += b.depth;
    sums.unexplained += b.unexplained;
    sums.unbounded += b.unbounded;
    sums.depth_out_of_bound += b.depth_out_of_bound;
    sums.max_depth_error_steps = std::max(sums.max_depth_error_steps, b.max_depth_error_steps);
    sums.max_depth_error_world = std::max(sums.max_depth_error_world, b.max_depth_error_world);
    if (b.worst_pixel >= 0) worst_of(band.worst_distance, band.worst_gap, b.worst_pixel);
  }
};

template <class Real>
class PictureJudge {
 public:
  PictureJudge(const JudgedPicture& picture, const OracleInput<Real>& input, const OracleImage& oracle,
               const Camera& camera, const ModeBound& bound)
      : picture_(picture),
        input_(input),
        oracle_(oracle),
        bound_(bound),
        far_(far_value(input.depth_function)),
        steps_(0x1p24 * std::abs(depth_map(camera, input.depth_function).scale)),
        axis_(camera, input.depth_function),
        bands_(input.triangles, input.height, bound.snap + 1),
        by_id_(input.triangles.size()) {
    for (std::size_t i = 0; i < by_id_.size(); ++i) by_id_[i] = static_cast<std::int32_t>(i);
    std::stable_sort(by_id_.begin(), by_id_.end(),
                     [&](std::int32_t a, std::int32_t b) { return id_of(a) < id_of(b); });
  }

  Tally judge(std::vector<PixelClass>& classes, int threads) const {
    Tally total;
    std::mutex mutex;
    for_each_band(bands_.count(), threads, [&](int band) {
      const Tally tally = judge_band(band, classes);
      const std::lock_guard lock(mutex);
      total.add(tally);
    });
    return total;
  }

 private:
  std::int32_t id_of(std::int32_t piece) const {
    return input_.triangles[static_cast<std::size_t>(piece)].id;
  }

  OracleTriangle triangle(std::int32_t piece) const {
    return {input_.triangles[static_cast<std::size_t>(piece)], input_.fill};
  }

  BoundedTriangle bounded(const OracleTriangle& exact) const {
    return {exact, bound_, input_.depth_function};
  }

  /// The screen triangles of an id.
  std::span<const std::int32_t> pieces_of(std::int32_t id) const {
    const auto less = [&](std::int32_t piece, std::int32_t value) { return id_of(piece) < value; };
    const auto first = std::lower_bound(by_id_.begin(), by_id_.end(), id, less);
    auto end = first;
    while (end != by_id_.end() && id_of(*end) == id) ++end;
    return {first, end};
  }

  /// The owner of the last pixel: neighbours often have the same.
  struct Owner {
    std::int32_t piece = -1;
    std::optional<OracleTriangle> exact;
    std::optional<BoundedTriangle> bounded;
  };

  Tally judge_band(int band, std::vector<PixelClass>& classes) const {
    const auto width = static_cast<std::size_t>(input_.width);
    const std::size_t first = width * static_cast<std::size_t>(bands_.first_row(band));
    const std::size_t end = width * static_cast<std::size_t>(bands_.end_row(band));
    Tally tally;
    Accuracy& sums = tally.sums;
    const bool all_right = std::equal(picture_.ids.begin() + static_cast<std::ptrdiff_t>(first),
                                      picture_.ids.begin() + static_cast<std::ptrdiff_t>(end),
                                      oracle_.ids.begin() + static_cast<std::ptrdiff_t>(first));
    Owner owner_here;
    const std::vector<double> must = all_right ? std::vector<double>{} : nearest_that_must(band);
    for (std::size_t i = first; i < end; ++i) {
      const std::int32_t drawn = picture_.ids[i], owner = oracle_.ids[i];
      const ScreenPoint sample = sample_of(static_cast<int>(i % width), static_cast<int>(i / width));
      if (drawn == owner) {
        if (owner >= 0) judge_depth(i, sample, owner_here, sums);
        continue;
      }
      ++sums.wrong;
      sums.false_positives += owner < 0;
      sums.false_negatives += drawn < 0;
      const Verdict verdict =
          drawn < 0 ? judge_missing(i, sample, must[i - first]) : judge_drawn(i, sample, must[i - first]);
      classes[i] = verdict.kind;
      tally.add_wrong(verdict, i);
    }
    return tally;
  }

  /// Per pixel of a band with wrong pixels: no mode draws anything behind this depth there.
  std::vector<double> nearest_that_must(int band) const {
    const auto width = static_cast<std::size_t>(input_.width);
    const std::size_t first = width * static_cast<std::size_t>(bands_.first_row(band));
    std::vector<double> nearest(
        width * static_cast<std::size_t>(bands_.end_row(band) - bands_.first_row(band)), INFINITY);
    if (!bound_.bounded) return nearest;
    OracleEffort ignored;
    for (const std::int32_t index : bands_.triangles(band)) {
      const OracleTriangle exact = triangle(index);
      const BoundedTriangle t = bounded(exact);
      for (int y = bands_.first_row(band); y < bands_.end_row(band); ++y) {
        const Span span = t.span(y + 0.5, input_.width);
        for (int x = span.first; x < span.last; ++x) {
          const std::size_t i = width * static_cast<std::size_t>(y) + static_cast<std::size_t>(x);
          const ScreenPoint sample = sample_of(x, y);
          if (picture_.ids[i] == oracle_.ids[i] || !t.coverage(sample, ignored).must) continue;
          nearest[i - first] = std::min(nearest[i - first], t.depths(sample).high);
        }
      }
    }
    return nearest;
  }

  void judge_depth(std::size_t i, const ScreenPoint& sample, Owner& owner, Accuracy& sums) const {
    const double value = picture_.values[i], exact = oracle_.values[i];
    sums.max_depth_error_steps = std::max(sums.max_depth_error_steps, steps_ * std::abs(value - exact));
    sums.max_depth_error_world = std::max(sums.max_depth_error_world, axis_.between(value, exact));
    if (!bound_.bounded || value == exact) return;
    if (owner.piece != oracle_.pieces[i]) {
      owner.piece = oracle_.pieces[i];
      owner.exact.emplace(triangle(owner.piece));
      owner.bounded.emplace(*owner.exact, bound_, input_.depth_function);
    }
    if (owner.bounded->depths(sample).contains(value)) return;
    // The mode may have drawn another piece of the same triangle.
    OracleEffort ignored;
    for (const std::int32_t piece : pieces_of(oracle_.ids[i])) {
      const OracleTriangle other = triangle(piece);
      const BoundedTriangle t = bounded(other);
      if (t.coverage(sample, ignored).may && t.depths(sample).contains(value)) return;
    }
    ++sums.depth_out_of_bound;
  }

  PixelClass classified(PixelClass kind, bool is_explained) const {
    if (!bound_.bounded && kind != PixelClass::kExactTie) return PixelClass::kUnbounded;
    return is_explained && !bound_.exact_winner ? kind : PixelClass::kUnexplained;
  }

  /// Background where the oracle has a triangle.
  Verdict judge_missing(std::size_t i, const ScreenPoint& sample, double must) const {
    OracleEffort ignored;
    const OracleTriangle owner = triangle(oracle_.pieces[i]);
    const BoundedTriangle t = bounded(owner);
    const bool is_depth = t.coverage(sample, ignored).must && t.depths(sample).high >= far_;
    return {.kind = classified(is_depth ? PixelClass::kDepth : PixelClass::kEdge, must >= far_),
            .distance = is_depth ? 0 : owner.distance_to_outline(sample),
            .gap = far_ - oracle_.values[i]};
  }

  /// A triangle that is not the oracle's.
  Verdict judge_drawn(std::size_t i, const ScreenPoint& sample, double must) const {
    OracleEffort ignored;
    Verdict verdict{.distance = INFINITY, .gap = INFINITY};
    bool is_explained = false, is_covered = false, may_swap = false;
    const bool is_background = oracle_.pieces[i] < 0;
    const auto pieces = pieces_of(picture_.ids[i]);
    for (const std::int32_t piece : pieces) {
      const OracleTriangle drawn = triangle(piece);
      const BoundedTriangle t = bounded(drawn);
      const DepthInterval depths = t.depths(sample);
      is_explained =
          is_explained || (t.coverage(sample, ignored).may && depths.low < far_ && depths.low <= must);
      const OracleTriangle::Cover cover = drawn.covers(sample, ignored);
      if (!cover.inside) {
        if (!is_covered) verdict.distance = std::min(verdict.distance, drawn.distance_to_outline(sample));
        continue;
      }
      is_covered = true;
      verdict.gap = std::min(verdict.gap, drawn.depth(sample, cover.on_edges).value - oracle_.values[i]);
      if (is_background) {  // so it lies beyond the far plane
        may_swap = true;
        continue;
      }
      const OracleTriangle owner = triangle(oracle_.pieces[i]);
      const OracleTriangle::Cover of_owner = owner.covers(sample, ignored);
      if (compare_depths(drawn, cover.on_edges, owner, of_owner.on_edges, sample) == 0)
        return {.kind = classified(PixelClass::kExactTie, true)};
      may_swap = may_swap || depths.low <= bounded(owner).depths(sample).high;
    }
    if (pieces.empty()) return {.kind = classified(PixelClass::kEdge, false)};
    if (!is_covered) verdict.gap = 0;
    if (is_covered) verdict.distance = may_swap ? 0 : triangle(oracle_.pieces[i]).distance_to_outline(sample);
    verdict.kind = classified(is_covered && may_swap ? PixelClass::kDepth : PixelClass::kEdge, is_explained);
    return verdict;
  }

  static int compare_depths(const OracleTriangle& a, std::uint8_t on_edges_a, const OracleTriangle& b,
                            std::uint8_t on_edges_b, const ScreenPoint& sample) {
    const OracleTriangle::Depth depth_a = a.depth(sample, on_edges_a), depth_b = b.depth(sample, on_edges_b);
    OracleEffort ignored;
    if (!depth_a.decides_against(depth_b))
      return compare_depths_exactly(a, on_edges_a, b, on_edges_b, sample, ignored);
    return (depth_a.value > depth_b.value) - (depth_a.value < depth_b.value);
  }

  const JudgedPicture& picture_;
  const OracleInput<Real>& input_;
  const OracleImage& oracle_;
  const ModeBound& bound_;
  double far_;
  double steps_;  // of 2^-24 in d, per unit of the depth function
  ViewAxis axis_;
  Bands bands_;
  std::vector<std::int32_t> by_id_;  // indices of the screen triangles
};

void compare_colours(std::span<const std::uint32_t> colours, std::span<const std::uint32_t> truth,
                     Accuracy& accuracy) {
  double squares = 0;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    int largest = 0;
    for (int shift = 0; shift < 24; shift += 8) {
      const int difference =
          static_cast<int>(colours[i] >> shift & 0xff) - static_cast<int>(truth[i] >> shift & 0xff);
      largest = std::max(largest, std::abs(difference));
      squares += difference * difference;
    }
    accuracy.colours_changed += largest > 0;
    accuracy.colours_changed_8 += largest > 8;
  }
  const double mean = squares / (3.0 * static_cast<double>(colours.size()));
  accuracy.psnr = squares == 0 ? INFINITY : 10 * std::log10(255.0 * 255.0 / mean);
}

}  // namespace

template <class Real>
Accuracy measure_accuracy(const JudgedPicture& picture, const OracleInput<Real>& input,
                          const OracleImage& oracle, std::span<const std::uint32_t> oracle_colours,
                          const Camera& camera, const ModeBound& bound, int threads) {
  const std::size_t pixels = static_cast<std::size_t>(input.width) * static_cast<std::size_t>(input.height);
  const auto fits = [&](const auto& list) { return list.size() == pixels; };
  if (!fits(picture.ids) || !fits(picture.values) || !fits(picture.colours) || !fits(oracle.ids) ||
      !fits(oracle_colours))
    throw Error("the picture to judge and the oracle's have different sizes");
  checked_bytes(pixels, sizeof(PixelClass), "the classes of the pixels");

  std::vector<PixelClass> classes(pixels, PixelClass::kSame);
  const Tally tally = PictureJudge<Real>(picture, input, oracle, camera, bound).judge(classes, threads);
  Accuracy accuracy = tally.sums;
  accuracy.pixels = static_cast<std::int64_t>(pixels);
  accuracy.worst_distance = tally.worst_distance;
  accuracy.classes = std::move(classes);
  accuracy.predicted = bound.bounded ? predict_wrong(input, oracle, bound, threads).pixels : -1;
  accuracy.silhouette_hausdorff = silhouette_distance(picture.ids, oracle.ids, input.width, input.height);
  compare_colours(picture.colours, oracle_colours, accuracy);
  accuracy.ssim = structural_similarity(picture.colours, oracle_colours, input.width, input.height);
  return accuracy;
}

template Accuracy measure_accuracy(const JudgedPicture&, const OracleInput<float>&, const OracleImage&,
                                   std::span<const std::uint32_t>, const Camera&, const ModeBound&, int);
template Accuracy measure_accuracy(const JudgedPicture&, const OracleInput<double>&, const OracleImage&,
                                   std::span<const std::uint32_t>, const Camera&, const ModeBound&, int);

}  // namespace rasterbench
