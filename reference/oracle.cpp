#include "reference/oracle.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>

#include "base/buffer.h"
#include "base/error.h"
#include "reference/bands.h"
#include "reference/oracle_triangle.h"

namespace rasterbench {
namespace {

using namespace reference;

/// Edges farther than this from a sample, in pixels, are no margin of it.
constexpr double kEdgeReach = 1.5;

/// The nearest triangle so far at a sample.
struct Nearest {
  std::int32_t piece = -1;
  std::uint8_t on_edges = 0;
  bool tied = false;                 // with a triangle of another id
  OracleTriangle::Depth depth = {};  // of `piece`
  double next = INFINITY;            // the nearest depth of the others that are not tied
};

template <class Real>
class Oracle {
 public:
  Oracle(const OracleInput<Real>& input, OracleImage& image)
      : input_(input),
        image_(image),
        far_(far_value(input.depth_function)),
        bands_(input.triangles, input.height, kEdgeReach) {}

  void draw(int threads) {
    for_each_band(bands_.count(), threads, [&](int band) {
      OracleEffort effort;
      draw_band(band, effort);
      measure_edges(band);
      const std::lock_guard lock(mutex_);
      image_.effort.coverage_tests += effort.coverage_tests;
      image_.effort.coverage_fallbacks += effort.coverage_fallbacks;
      image_.effort.depth_tests += effort.depth_tests;
      image_.effort.depth_fallbacks += effort.depth_fallbacks;
    });
  }

 private:
  OracleTriangle triangle(std::int32_t index) const {
    return {input_.triangles[static_cast<std::size_t>(index)], input_.fill};
  }

  std::size_t pixel(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(input_.width) + static_cast<std::size_t>(x);
  }

  void draw_band(int band, OracleEffort& effort) {
    const int first_row = bands_.first_row(band), end_row = bands_.end_row(band);
    const std::size_t first_pixel = pixel(0, first_row);
    std::vector<Nearest> nearest(pixel(0, end_row) - first_pixel);
    for (const std::int32_t index : bands_.triangles(band)) {
      const OracleTriangle t = triangle(index);
      if (!t.has_area()) continue;
      for (int y = first_row; y < end_row; ++y) {
        const Span span = t.covered_span(y + 0.5, input_.width);
        for (int x = span.first; x < span.last; ++x) {
          const ScreenPoint sample = sample_of(x, y);
          const OracleTriangle::Cover cover = t.covers(sample, effort);
          if (cover.inside) add(nearest[pixel(x, y) - first_pixel], index, t, cover.on_edges, sample, effort);
        }
      }
    }
    for (std::size_t i = 0; i < nearest.size(); ++i) store(nearest[i], first_pixel + i);
  }

  void add(Nearest& nearest, std::int32_t index, const OracleTriangle& t, std::uint8_t on_edges,
           const ScreenPoint& sample, OracleEffort& effort) const {
    const OracleTriangle::Depth depth = t.depth(sample, on_edges);
    if (!t.nearer_than(far_, depth, sample, on_edges, effort)) {
      nearest.next = std::min(nearest.next, std::max(depth.value, far_));
      return;
    }
    if (nearest.piece < 0) {
      nearest = {index, on_edges, false, depth, nearest.next};
      return;
    }
    ++effort.depth_tests;
    const int order =
        depth.decides_against(nearest.depth)
            ? (depth.value > nearest.depth.value) - (depth.value < nearest.depth.value)
            : compare_depths_exactly(t, on_edges, triangle(nearest.piece), nearest.on_edges, sample, effort);
    if (order != 0) {
      const double next = std::min(nearest.next, std::max(depth.value, nearest.depth.value));
      if (order < 0) nearest = {index, on_edges, false, depth, next};
      nearest.next = next;
      return;
    }
    const std::int32_t id = input_.triangles[static_cast<std::size_t>(nearest.piece)].id;
    if (t.id() == id) return;  // pieces of a clipped triangle, whose owner is the same
    const bool wins = input_.tie == TieRule::kFirst ? t.id() < id : t.id() > id;
    if (wins) nearest = {index, on_edges, true, depth, nearest.next};
    nearest.tied = true;
  }

  void store(const Nearest& nearest, std::size_t i) {
    const bool drawn = nearest.piece >= 0;
    image_.pieces[i] = nearest.piece;
    image_.ids[i] = drawn ? input_.triangles[static_cast<std::size_t>(nearest.piece)].id : -1;
    image_.values[i] = drawn ? nearest.depth.value : far_;
    const double gap = drawn ? std::min(nearest.next, far_) - nearest.depth.value : nearest.next - far_;
    // What is no tie has a gap, even where the difference of the rounded depths has vanished.
    const float least = drawn ? std::numeric_limits<float>::denorm_min() : 0.0f;
    image_.depth_gap[i] = nearest.tied ? 0.0f : std::max(least, static_cast<float>(gap));
  }

  void measure_edges(int band) {
    const int first_row = bands_.first_row(band), end_row = bands_.end_row(band);
    for (const std::int32_t index : bands_.triangles(band)) {
      const OracleTriangle t = triangle(index);
      std::array<double, 3> slack;
      for (std::size_t i = 0; i < 3; ++i) slack[i] = kEdgeReach * t.edges()[i].length;
      for (int y = first_row; y < end_row; ++y) {
        const Span span = t.span(y + 0.5, slack, kEdgeReach, input_.width);
        for (int x = span.first; x < span.last; ++x) measure_edge(index, t, sample_of(x, y), pixel(x, y));
      }
    }
  }

  void measure_edge(std::int32_t index, const OracleTriangle& t, const ScreenPoint& sample, std::size_t i) {
    bool is_far_inside = true;
    for (const OracleEdge& edge : t.edges())
      is_far_inside = is_far_inside && edge.at(sample).value > kEdgeReach * edge.length;
    if (is_far_inside) return;
    if (index != image_.pieces[i] && t.clamped_depth(sample) > image_.values[i] + OracleImage::kDepthReach)
      return;
    const double distance = t.distance_to_outline(sample);
    if (distance <= kEdgeReach)
      image_.edge_margin[i] = std::min(image_.edge_margin[i], static_cast<float>(distance));
  }

  const OracleInput<Real>& input_;
  OracleImage& image_;
  double far_;
  Bands bands_;
  std::mutex mutex_;  // of image_.effort
};

}  // namespace

template <class Real>
OracleImage exact_owners(const OracleInput<Real>& input, int threads) {
  const auto begin = std::chrono::steady_clock::now();
  const std::size_t pixels = static_cast<std::size_t>(input.width) * static_cast<std::size_t>(input.height);
  constexpr std::size_t kPixelBytes = 2 * sizeof(std::int32_t) + sizeof(double) + 2 * sizeof(float);
  checked_bytes(
      pixels, kPixelBytes,
      "the oracle's picture of " + std::to_string(input.width) + "x" + std::to_string(input.height));
  OracleImage image{.width = input.width,
                    .height = input.height,
                    .ids = std::vector<std::int32_t>(pixels),
                    .pieces = std::vector<std::int32_t>(pixels),
                    .values = std::vector<double>(pixels),
                    .edge_margin = std::vector<float>(pixels, INFINITY),
                    .depth_gap = std::vector<float>(pixels),
                    .effort = {}};
  Oracle<Real>(input, image).draw(threads);
  image.effort.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return image;
}

template OracleImage exact_owners(const OracleInput<float>&, int);
template OracleImage exact_owners(const OracleInput<double>&, int);

}  // namespace rasterbench
