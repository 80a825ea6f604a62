#include "advice/scene_facts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "numeric/modes.h"
#include "reference/bands.h"

namespace rasterbench {
namespace {

/// How many screen triangles cover each sample, by edge functions that make no error.
std::vector<std::uint32_t> count_layers(std::span<const ScreenTriangle<float>> triangles,
                                        const FrameSettings& settings, int threads) {
  std::vector<Filtered::Prepared> prepared;
  prepared.reserve(triangles.size());
  for (const ScreenTriangle<float>& t : triangles)
    if (t.id >= 0) prepared.push_back(Filtered::prepare(t, settings.grid(), 0));
  std::vector<std::uint32_t> layers(settings.pixels());
  constexpr int kRows = 32;  // of a band: few enough bands that each may look at every triangle
  reference::for_each_band((settings.height + kRows - 1) / kRows, threads, [&](int band) {
    const PixelBox rows{0, band * kRows, settings.width, std::min(settings.height, (band + 1) * kRows)};
    for (const Filtered::Prepared& p : prepared) {
      const PixelBox box = intersect(p.box, rows);
      for (std::int32_t y = box.y0; y < box.y1; ++y)
        for (std::int32_t x = box.x0; x < box.x1; ++x)
          layers[static_cast<std::size_t>(y) * static_cast<std::size_t>(settings.width) +
                 static_cast<std::size_t>(x)] += Filtered::inside(p, x, y);
    }
  });
  return layers;
}

void measure_triangles(std::span<const ScreenTriangle<float>> triangles, SceneFacts& facts) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  facts.low_x = facts.low_y = kInfinity;
  facts.high_x = facts.high_y = -kInfinity;
  std::vector<double> lengths;
  for (const ScreenTriangle<float>& t : triangles) {
    if (t.id < 0) continue;
    const auto [low_x, high_x] = std::minmax({double{t.x[0]}, double{t.x[1]}, double{t.x[2]}});
    const auto [low_y, high_y] = std::minmax({double{t.y[0]}, double{t.y[1]}, double{t.y[2]}});
    facts.low_x = std::min(facts.low_x, low_x);
    facts.high_x = std::max(facts.high_x, high_x);
    facts.low_y = std::min(facts.low_y, low_y);
    facts.high_y = std::max(facts.high_y, high_y);
    facts.subpixel += high_x - low_x < 1 && high_y - low_y < 1;
    for (int e = 0; e < 3; ++e)
      lengths.push_back(std::hypot(double{t.x[kEdgeTo[e]]} - t.x[kEdgeFrom[e]],
                                   double{t.y[kEdgeTo[e]]} - t.y[kEdgeFrom[e]]));
  }
  facts.edge_length = spread_of(lengths);
}

void measure_pixels(const OracleImage& oracle, const Camera& camera, SceneFacts& facts) {
  std::vector<double> gaps, margins;
  double nearest_d = 1, farthest_d = -1;
  for (std::size_t i = 0; i < oracle.ids.size(); ++i) {
    const double margin = double{oracle.edge_margin[i]};
    if (margin == 0) ++facts.on_edge;
    if (margin > 0 && std::isfinite(margin)) margins.push_back(margin);
    if (oracle.ids[i] < 0) continue;
    ++facts.covered_pixels;
    nearest_d = std::min(nearest_d, oracle.values[i]);
    farthest_d = std::max(farthest_d, oracle.values[i]);
    const double gap = double{oracle.depth_gap[i]};
    if (gap == 0) ++facts.depth_ties;
    if (gap > 0) gaps.push_back(gap);
  }
  facts.depth_gap = spread_of(gaps);
  facts.edge_margin = spread_of(margins);
  if (facts.covered_pixels > 0) {
    facts.nearest = view_distance(camera, nearest_d);
    facts.farthest = view_distance(camera, farthest_d);
  }
}

}  // namespace

Spread spread_of(std::vector<double>& values) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (values.empty()) return {kNone, kNone, kNone, kNone};
  std::sort(values.begin(), values.end());
  const auto rank = [&](double share) {
    return values[static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size()))) - 1];
  };
  return {values.front(), rank(0.01), rank(0.5), values.back()};
}

double view_distance(const Camera& camera, double d) {
  const double n = camera.near_plane, f = camera.far_plane;
  if (!camera.perspective) return n + (d + 1) / 2 * (f - n);
  // 2 n f / ((f + n) - d (f - n)), written so that nothing cancels where d is near 1.
  const double denominator = 2 * n + (1 - d) * (f - n);
  return denominator > 0 ? 2 * n * f / denominator : std::numeric_limits<double>::infinity();
}

SceneFacts scene_facts(Judge& judge, int threads) {
  const FrameSettings& settings = judge.settings();
  const std::vector<Triangle>& world = judge.scene().model.triangles;
  const ScreenTransform transform = make_screen_transform(judge.camera());
  SceneFacts facts;
  facts.triangles = static_cast<std::int64_t>(world.size());
  facts.needs = analyse_needs(world, transform, settings.geometry.near_rule);

  std::vector<ScreenTriangle<float>> screen(world.size()), extra;
  transform_triangles<float>(world, 0, transform, settings.geometry, screen.data(), extra, facts.counts);
  screen.insert(screen.end(), extra.begin(), extra.end());
  measure_triangles(screen, facts);

  measure_pixels(judge.oracle(F32::kInfo), judge.camera(), facts);
  std::int64_t sum = 0;
  for (const std::uint32_t layers : count_layers(screen, settings, threads)) {
    sum += layers;
    facts.most_layers = std::max(facts.most_layers, std::int64_t{layers});
  }
  if (facts.covered_pixels > 0)
    facts.mean_layers = static_cast<double>(sum) / static_cast<double>(facts.covered_pixels);
  return facts;
}

}  // namespace rasterbench
