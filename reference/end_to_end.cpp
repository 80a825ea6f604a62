// Two stages for each band of rows. The first draws all of its triangles in double with bounds and keeps, per
// pixel, the fragment with the smallest lower bound of its distance and the second smallest of these bounds:
// the pixel is decided if that fragment certainly covers the sample and even its upper bound is below the
// second. The second stage draws the triangles again at the undecided samples only, lists all fragments that
// may be the nearest, and decides among them exactly.
#include "reference/end_to_end.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/buffer.h"
#include "reference/bands.h"
#include "reference/end_to_end_exact.h"
#include "reference/end_to_end_filter.h"

namespace rasterbench {
namespace {

using end_to_end::ExactScene;
using end_to_end::FilteredTriangle;
using end_to_end::Fragment;
using end_to_end::IndexRange;
using end_to_end::PixelResolver;
using end_to_end::SampleTransform;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kChunk = 4096;  // triangles that a thread sorts at a time
constexpr int kBandRows = 16;         // enough bands for some threads, and a band's pixels stay in the cache

bool is_finite(const Vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

/// What the first stage knows of a pixel.
struct Pixel {
  double nearest = kInfinity, farthest = kInfinity;  // of the fragment with the smallest `nearest`
  double distance = 0;
  double second_nearest = kInfinity;
  double visible_farthest = kInfinity;  // the smallest of the certainly visible fragments
  std::int32_t id = -1;
  bool visible = false;

  void add(std::int32_t fragment_id, const Fragment& f) {
    if (f.covers) visible_farthest = std::min(visible_farthest, f.farthest);
    if (f.nearest >= nearest) {
      second_nearest = std::min(second_nearest, f.nearest);
      return;
    }
    second_nearest = nearest;
    nearest = f.nearest;
    farthest = f.farthest;
    distance = f.distance;
    id = fragment_id;
    visible = f.covers;
  }
  bool is_decided() const { return id < 0 || (visible && farthest < second_nearest); }
};

class Renderer {
 public:
  Renderer(const Scene& scene, FillRule fill, NearRule near_rule, int max_bits, EndToEndTruth& result)
      : triangles_(scene.model.triangles),
        near_(scene.parameters.near_plane),
        far_(scene.parameters.far_plane),
        fill_(fill),
        near_rule_(near_rule),
        result_(result),
        width_(result.truth.width),
        height_(result.truth.height),
        exact_(scene, width_, height_, max_bits),
        transform_(exact_.transform()) {}

  void run(int threads) {
    sort_into_bands(threads);
    reference::for_each_band(static_cast<int>(bands_.size()), threads, [this](int band) {
      draw_band(static_cast<std::size_t>(band));
      mpfr_free_cache2(MPFR_FREE_LOCAL_CACHE);  // the thread's own, which nobody could free after its end
    });
  }

 private:
  struct Candidate {
    std::size_t pixel;
    PixelResolver::Candidate fragment;
  };

  // 0 for a triangle that draws nothing; otherwise the sign that FilteredTriangle asks for.
  int orientation(std::int32_t id, const FilteredTriangle& filtered) const {
    const Triangle& t = triangles_[static_cast<std::size_t>(id)];
    if (near_rule_ == NearRule::kOff && !filtered.is_in_front() && !exact_.is_in_front(t)) return 0;
    const int sign = filtered.orientation();
    // (e_U, e_V, e_W) is right-handed, hence (U, V, z = -w) is not.
    return sign != 0 ? sign : -exact_.triangle(id).volume.sign();
  }

  void sort_into_bands(int threads) {
    struct Placement {
      IndexRange bands;
      int orientation = 0;
    };
    std::vector<Placement> placements(triangles_.size());
    const std::size_t chunks = (triangles_.size() + kChunk - 1) / kChunk;
    reference::for_each_band(static_cast<int>(chunks), threads, [&](int chunk) {
      const std::size_t first = static_cast<std::size_t>(chunk) * kChunk;
      for (std::size_t i = first; i < std::min(triangles_.size(), first + kChunk); ++i) {
        const Triangle& t = triangles_[i];
        if (!is_finite(t.a) || !is_finite(t.b) || !is_finite(t.c)) continue;
        const FilteredTriangle filtered(t, transform_);
        const IndexRange rows = filtered.rows();
        if (filtered.is_behind() || rows.empty() || filtered.columns().empty()) continue;
        placements[i] = {{rows.first / kBandRows, rows.last / kBandRows},
                         orientation(static_cast<std::int32_t>(i), filtered)};
      }
    });
    bands_.resize(static_cast<std::size_t>((height_ + kBandRows - 1) / kBandRows));
    orientations_.resize(triangles_.size());
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      orientations_[i] = static_cast<std::int8_t>(placements[i].orientation);
      if (placements[i].orientation == 0) continue;
      for (int band = placements[i].bands.first; band <= placements[i].bands.last; ++band)
        bands_[static_cast<std::size_t>(band)].push_back(static_cast<std::int32_t>(i));
    }
  }

  // The fragment, if it is possibly between the planes.
  std::optional<Fragment> between_planes(std::optional<Fragment> f) const {
    if (!f) return f;
    if (near_rule_ == NearRule::kClip) {
      if (f->farthest < near_) return std::nullopt;
      f->covers = f->covers && f->nearest >= near_;
    }
    if (f->nearest >= far_) return std::nullopt;
    f->covers = f->covers && f->farthest < far_;
    return f;
  }

  // Calls visit(row, triangle id, filtered triangle, its view of the row, columns, orientation) for the
  // triangles of a band and the rows that each may cover.
  template <class Visit>
  void visit_rows(std::size_t band, const Visit& visit) const {
    const int first = static_cast<int>(band) * kBandRows, last = std::min(height_, first + kBandRows) - 1;
    for (const std::int32_t id : bands_[band]) {
      const FilteredTriangle triangle(triangles_[static_cast<std::size_t>(id)], transform_);
      const int orientation = orientations_[static_cast<std::size_t>(id)];
      const IndexRange rows = triangle.rows(), columns = triangle.columns();
      for (int i = std::max(first, rows.first); i <= std::min(last, rows.last); ++i) {
        const FilteredTriangle::Row row = triangle.row(i);
        if (row.misses) continue;
        visit(i - first, id, triangle, row, triangle.columns(row, orientation, columns), orientation);
      }
    }
  }

  void draw_band(std::size_t band) {
    const int first = static_cast<int>(band) * kBandRows, rows = std::min(height_ - first, kBandRows);
    const auto width = static_cast<std::size_t>(width_);
    std::vector<Pixel> pixels(static_cast<std::size_t>(rows) * width);
    visit_rows(band, [&](int i, std::int32_t id, const FilteredTriangle& triangle,
                         const FilteredTriangle::Row& row, IndexRange columns, int orientation) {
      Pixel* line = pixels.data() + static_cast<std::size_t>(i) * width;
      for (int j = columns.first; j <= columns.last; ++j)
        if (const auto f = between_planes(triangle.fragment(row, j, orientation))) line[j].add(id, *f);
    });

    std::vector<std::vector<int>> undecided(static_cast<std::size_t>(rows));  // columns of each row
    const std::size_t offset = static_cast<std::size_t>(first) * width;
    for (std::size_t p = 0; p < pixels.size(); ++p) {
      if (!pixels[p].is_decided())
        undecided[p / width].push_back(static_cast<int>(p % width));
      else if (pixels[p].id >= 0)
        write(offset + p, pixels[p].id, pixels[p].distance);
    }
    decide(first, candidates(band, pixels, undecided));
  }

  // All fragments at undecided pixels that may be the nearest, by pixel and id.
  std::vector<Candidate> candidates(std::size_t band, const std::vector<Pixel>& pixels,
                                    const std::vector<std::vector<int>>& undecided) const {
    std::vector<Candidate> found;
    if (std::all_of(undecided.begin(), undecided.end(), [](const auto& row) { return row.empty(); }))
      return found;
    visit_rows(band, [&](int i, std::int32_t id, const FilteredTriangle& triangle,
                         const FilteredTriangle::Row& row, IndexRange columns, int orientation) {
      const std::vector<int>& open = undecided[static_cast<std::size_t>(i)];
      for (auto j = std::lower_bound(open.begin(), open.end(), columns.first);
           j != open.end() && *j <= columns.last; ++j) {
        const std::size_t pixel =
            static_cast<std::size_t>(i) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(*j);
        const auto f = between_planes(triangle.fragment(row, *j, orientation));
        if (f && f->nearest <= pixels[pixel].visible_farthest)
          found.push_back({pixel, {.id = id, .visible = f->covers, .distance = f->distance}});
      }
    });
    std::stable_sort(found.begin(), found.end(),
                     [](const Candidate& a, const Candidate& b) { return a.pixel < b.pixel; });
    return found;
  }

  void decide(int first_row, const std::vector<Candidate>& candidates) {
    const std::size_t offset = static_cast<std::size_t>(first_row) * static_cast<std::size_t>(width_);
    PixelResolver resolver(exact_, fill_, near_rule_);
    std::vector<PixelResolver::Candidate> fragments;
    for (auto c = candidates.begin(); c != candidates.end();) {
      const std::size_t pixel = offset + c->pixel;
      const auto end =
          std::find_if(c, candidates.end(), [&](const Candidate& o) { return o.pixel != c->pixel; });
      fragments.clear();
      for (; c != end; ++c) fragments.push_back(c->fragment);
      const int column = static_cast<int>(pixel % static_cast<std::size_t>(width_));
      const int row = static_cast<int>(pixel / static_cast<std::size_t>(width_));
      const PixelResolver::Owner owner =
          resolver.resolve({.x = 2 * column + 1 - width_, .y = height_ - 1 - 2 * row}, fragments);
      if (owner.id >= 0) write(pixel, owner.id, owner.distance);
      result_.decided[pixel] = owner.ambiguous ? DecidedBy::kAmbiguous : DecidedBy::kMultiprecision;
    }
  }

  // d = ((n + f) t - 2 n f) / ((f - n) t) at distance t, written so that it is accurate near d = -1 and does
  // not overflow.
  void write(std::size_t pixel, std::int32_t id, double distance) {
    // The sample is not in front of the near plane, whatever the estimate says.
    const double t = near_rule_ == NearRule::kClip ? std::max(distance, near_) : distance;
    result_.truth.ids[pixel] = id;
    result_.truth.depths[pixel] = 2 * (far_ / (far_ - near_)) * ((t - near_) / t) - 1;
  }

  std::span<const Triangle> triangles_;
  double near_, far_;
  FillRule fill_;
  NearRule near_rule_;
  EndToEndTruth& result_;
  int width_, height_;
  ExactScene exact_;
  SampleTransform transform_;
  std::vector<std::int8_t> orientations_;         // of each triangle
  std::vector<std::vector<std::int32_t>> bands_;  // the ids, increasing, of what each band's rows may show
};

}  // namespace

EndToEndTruth render_end_to_end(const Scene& scene, int width, int height, FillRule fill, NearRule near_rule,
                                int threads, int max_bits) {
  const auto start = std::chrono::steady_clock::now();
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  checked_bytes(pixels, sizeof(std::int32_t) + sizeof(double) + sizeof(DecidedBy), "the end-to-end truth");
  EndToEndTruth result;
  result.truth = {.width = width,
                  .height = height,
                  .ids = std::vector<std::int32_t>(pixels, -1),
                  .depths = std::vector<double>(pixels, 1.0)};
  result.decided.assign(pixels, DecidedBy::kDouble);
  Renderer(scene, fill, near_rule, max_bits, result).run(threads);
  result.by_multiprecision =
      std::count(result.decided.begin(), result.decided.end(), DecidedBy::kMultiprecision);
  result.ambiguous = std::count(result.decided.begin(), result.decided.end(), DecidedBy::kAmbiguous);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace rasterbench
