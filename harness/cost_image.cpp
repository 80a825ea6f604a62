#include "harness/cost_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "pipeline/frame_renderer.h"

namespace rasterbench {
namespace {

using Colour = std::array<double, 3>;

/// Viridis at 0, 1/16, .. 1, as matplotlib 3.6 has it.
constexpr std::array<Colour, 17> kViridis{{{68, 1, 84},
                                           {72, 24, 106},
                                           {71, 45, 123},
                                           {66, 64, 134},
                                           {59, 82, 139},
                                           {51, 99, 141},
                                           {44, 114, 142},
                                           {38, 130, 142},
                                           {33, 145, 140},
                                           {31, 159, 136},
                                           {39, 173, 129},
                                           {61, 188, 116},
                                           {92, 200, 99},
                                           {129, 211, 77},
                                           {170, 220, 50},
                                           {213, 226, 26},
                                           {253, 231, 37}}};

/// The colour at `share` of the scale, 0 to 1.
Colour viridis(double share) {
  const double at = std::clamp(share, 0.0, 1.0) * (kViridis.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), kViridis.size() - 2);
  const double t = at - static_cast<double>(below);
  Colour colour;
  for (std::size_t c = 0; c < 3; ++c) colour[c] = (1 - t) * kViridis[below][c] + t * kViridis[below + 1][c];
  return colour;
}

/// Relative luminance of Rec. 709, on the encoded values: 0 to 255.
double grey_of(std::uint32_t rgba) {
  return 0.2126 * (rgba & 255) + 0.7152 * (rgba >> 8 & 255) + 0.0722 * (rgba >> 16 & 255);
}

std::uint32_t blend(const Colour& heat, double grey) {
  std::uint32_t rgba = 0xff000000u;
  for (std::size_t c = 0; c < 3; ++c)
    rgba |= static_cast<std::uint32_t>(std::lround(kCostOpacity * heat[c] + (1 - kCostOpacity) * grey))
            << (8 * c);
  return rgba;
}

/// Seconds a pixel, of triangles: each cost spread over a box. Differences first and sums after, so that a
/// large box costs as little as a small one.
std::vector<double> spread_triangles(const Point& point, const Scene& scene, const LoopCosts& costs) {
  FrameSettings settings = point.settings();
  ScreenTriangles<float> screen(scene.model.triangles.size());
  const auto serial = make_execution({});
  screen.transform(scene.model.triangles, make_screen_transform(sized_camera(scene, settings)),
                   settings.geometry, *serial);
  const auto triangles = screen.span();
  if (triangles.size() != costs.seconds.size())
    throw Error(fmt::format("{} costs of {} screen triangles", costs.seconds.size(), triangles.size()));
  const std::int32_t width = settings.width, height = settings.height;
  const auto stride = static_cast<std::size_t>(width) + 1;
  std::vector<double> sums(stride * (static_cast<std::size_t>(height) + 1));
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& t = triangles[i];
    if (t.id < 0) continue;
    const auto [x0, x1] = std::minmax({t.x[0], t.x[1], t.x[2]});
    const auto [y0, y1] = std::minmax({t.y[0], t.y[1], t.y[2]});
    const auto pixel = [](float at, std::int32_t side) {
      return static_cast<std::size_t>(std::clamp(std::floor(at), 0.0f, static_cast<float>(side - 1)));
    };
    const std::size_t left = pixel(x0, width), right = pixel(x1, width) + 1, top = pixel(y0, height),
                      bottom = pixel(y1, height) + 1;
    const double share = costs.seconds[i] / static_cast<double>((right - left) * (bottom - top));
    sums[top * stride + left] += share;
    sums[top * stride + right] -= share;
    sums[bottom * stride + left] -= share;
    sums[bottom * stride + right] += share;
  }
  std::vector<double> spread;
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    double* row = sums.data() + y * stride;
    if (y > 0)
      for (std::size_t x = 0; x < stride; ++x) row[x] += row[x - stride];
    double sum = 0;
    for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x)
      spread.push_back(std::max(0.0, sum += row[x]));  // rounding leaves a trace below zero
  }
  return spread;
}

/// Seconds of the iteration that owns each pixel.
std::vector<double> of_owners(const Point& point, const LoopShape& shape, const LoopCosts& costs) {
  std::vector<double> of_pixel;
  for (int y = 0; y < point.height; ++y)
    for (int x = 0; x < point.width; ++x) {
      const auto owner =
          static_cast<std::size_t>(y / shape.height) * static_cast<std::size_t>(shape.columns) +
          static_cast<std::size_t>(x / shape.width);
      if (owner >= costs.seconds.size())
        throw Error(fmt::format("{} costs of a loop that draws pixel {}, {} in iteration {}",
                                costs.seconds.size(), x, y, owner));
      of_pixel.push_back(costs.seconds[owner]);
    }
  return of_pixel;
}

}  // namespace

CostImage cost_image(const Point& point, const Scene& scene, const LoopShape& shape, const LoopCosts& costs) {
  const bool owned = shape.width > 0;
  std::vector<double> seconds =
      owned ? of_owners(point, shape, costs) : spread_triangles(point, scene, costs);
  if (seconds.size() != costs.colours.size())
    throw Error(fmt::format("costs of {} pixels over a picture of {}", seconds.size(), costs.colours.size()));
  CostImage image;
  image.unit = owned ? "us a " + shape.unit : "ns a pixel";
  const double scale = owned ? 1e6 : 1e9;

  std::vector<double> positive;
  std::copy_if(seconds.begin(), seconds.end(), std::back_inserter(positive), [](double s) { return s > 0; });
  double high = 0;
  if (!positive.empty()) {
    const auto at = positive.begin() + static_cast<std::ptrdiff_t>((positive.size() - 1) * 999 / 1000);
    std::nth_element(positive.begin(), at, positive.end());
    high = *at;
  }
  image.high = high * scale;
  const double whole = std::accumulate(costs.seconds.begin(), costs.seconds.end(), 0.0);
  if (!owned && whole > 0) image.shown = std::accumulate(seconds.begin(), seconds.end(), 0.0) / whole;
  for (std::size_t i = 0; i < seconds.size(); ++i)
    image.colours.push_back(blend(viridis(high > 0 ? seconds[i] / high : 0), grey_of(costs.colours[i])));
  return image;
}

}  // namespace rasterbench
