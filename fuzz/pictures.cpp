#include "fuzz/pictures.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>

#include "reference/oracle.h"

namespace rasterbench::fuzz {

Verdict judged(const std::string& difference, bool promised) {
  if (difference.empty()) return kHolds;
  return {promised ? Verdict::Kind::kViolated : Verdict::Kind::kObserved, difference};
}

bool has_exact_edges(const ModeInfo& mode) {
  return mode.numbers.bounded && mode.numbers.edge_form == EdgeForm::kExact && mode.numbers.snap == 0;
}

bool snaps(const ModeInfo& mode) { return mode.numbers.snap > 0; }

ScreenInput snapped(ScreenInput input, const ModeInfo& mode) {
  const double grid = 2 * mode.numbers.snap;
  const auto on_grid = [&](float v) { return static_cast<float>(std::nearbyint(double{v} / grid) * grid); };
  for (auto& t : input.triangles)
    for (int i = 0; i < 3; ++i) {
      t.x[i] = on_grid(t.x[i]);
      t.y[i] = on_grid(t.y[i]);
    }
  return input;
}

bool is_on_grid(const ScreenInput& input, const ModeInfo& mode) {
  const ScreenInput on_grid = snapped(input, mode);
  for (std::size_t k = 0; k < input.triangles.size(); ++k) {
    const auto &t = input.triangles[k], &s = on_grid.triangles[k];
    if (!std::equal(t.x, t.x + 3, s.x) || !std::equal(t.y, t.y + 3, s.y)) return false;
  }
  return true;
}

PixelMap same_place(const ScreenPicture& a) {
  return [width = a.width, height = a.height](int x, int y) -> std::optional<std::pair<int, int>> {
    if (x >= width || y >= height) return std::nullopt;
    return std::pair{x, y};
  };
}

std::string first_difference(const ScreenPicture& a, const ScreenPicture& b, const PixelMap& map,
                             const Compared& compared,
                             const std::function<bool(std::size_t, std::size_t)>& excuse) {
  const auto index = [](const ScreenPicture& picture, int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
           static_cast<std::size_t>(x);
  };
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      const auto there = map(x, y);
      if (!there) continue;
      const std::size_t i = index(a, x, y), k = index(b, there->first, there->second);
      std::string what;
      if (compared.counts && a.counts[i] != b.counts[k])
        what = fmt::format("covered by {} and by {} triangles", a.counts[i], b.counts[k]);
      else if (compared.ids && a.ids[i] != b.ids[k])
        what = fmt::format("owned by {} and by {}", a.ids[i], b.ids[k]);
      else if (compared.values &&
               std::bit_cast<std::uint64_t>(a.values[i]) != std::bit_cast<std::uint64_t>(b.values[k]))
        what = fmt::format("of depth {:a} and {:a}", a.values[i], b.values[k]);
      if (!what.empty() && !(excuse && excuse(i, k))) return fmt::format("pixel ({}, {}) is {}", x, y, what);
    }
  return {};
}

namespace {

template <class Real>
std::vector<bool> uncertain(const ScreenInput& input, const ModeInfo& mode) {
  const auto triangles = triangles_for<Real>(input, mode.depth_function);
  const OracleInput<Real> exact{triangles,  input.width, input.height,
                                input.fill, input.tie,   mode.depth_function};
  const Prediction prediction = predict_wrong(exact, exact_owners(exact, 1), mode.numbers, 1);
  std::vector<bool> pixels;
  for (const std::uint8_t reasons : prediction.reasons) pixels.push_back(reasons != 0);
  return pixels;
}

}  // namespace

std::vector<bool> uncertain_pixels(const ScreenInput& input, const ModeInfo& mode) {
  return mode.numbers.vertex_unit == 0x1p-53 ? uncertain<double>(input, mode) : uncertain<float>(input, mode);
}

std::vector<bool> pixels_on_edges(const ScreenInput& input, const Subject& subject) {
  ScreenInput closed = input, top_left = input;
  closed.fill = FillRule::kClosed;
  top_left.fill = FillRule::kTopLeft;
  const auto of_closed = subject.draw(closed).counts, of_top_left = subject.draw(top_left).counts;
  std::vector<bool> on_edges;
  for (std::size_t i = 0; i < of_closed.size(); ++i) on_edges.push_back(of_closed[i] != of_top_left[i]);
  return on_edges;
}

}  // namespace rasterbench::fuzz
