#include "extremes/watertight.h"

#include <algorithm>
#include <bit>

#include "base/buffer.h"
#include "execution/execution.h"
#include "pipeline/geometry.h"

namespace rasterbench::extremes {
namespace {

/// How many triangles cover each pixel; more than kMany count as kMany.
using Coverage = std::vector<std::uint8_t>;
constexpr std::uint8_t kMany = 255;

template <class Real>
std::vector<ScreenTriangle<Real>> screen_triangles(const Scene& scene) {
  std::vector<ScreenTriangle<Real>> triangles(scene.model.triangles.size()), extra;
  GeometryCounts counts;
  transform_triangles<Real>(scene.model.triangles, 0, make_screen_transform(make_camera(scene.parameters)),
                            {}, triangles.data(), extra, counts);
  triangles.insert(triangles.end(), extra.begin(), extra.end());
  std::erase_if(triangles, [](const ScreenTriangle<Real>& t) { return t.id < 0; });
  return triangles;
}

template <NumericMode Mode>
void add_triangle(const typename Mode::Prepared& prepared, const PixelBox& image, Coverage& coverage) {
  const PixelBox box = intersect(prepared.box, image);
  const auto add = [&](std::int32_t x, std::int32_t y) {
    auto& count = coverage[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.x1) +
                           static_cast<std::size_t>(x)];
    count = std::min<std::uint8_t>(count, kMany - 1) + std::uint8_t{1};
  };
  for (std::int32_t y = box.y0; y < box.y1; ++y) {
    if constexpr (RunMode<Mode>) {
      constexpr std::int32_t kRun = 64;  // runs end at columns that are multiples of it
      for (std::int32_t x = box.x0, end; x < box.x1; x = end) {
        end = std::min(box.x1, (x / kRun + 1) * kRun);
        for (std::uint64_t inside = Mode::inside_run(prepared, x, y, end - x); inside != 0;
             inside &= inside - 1)
          add(x + std::countr_zero(inside), y);
      }
    } else {
      for (std::int32_t x = box.x0; x < box.x1; ++x)
        if (Mode::inside(prepared, x, y)) add(x, y);
    }
  }
}

template <NumericMode Mode>
WatertightCount count(std::span<const ScreenTriangle<typename Mode::Real>> triangles, const SampleGrid& grid,
                      Coverage& coverage) {
  std::fill(coverage.begin(), coverage.end(), std::uint8_t{0});
  const PixelBox image{0, 0, grid.width, grid.height};
  for (const auto& triangle : triangles)
    add_triangle<Mode>(Mode::prepare(triangle, grid, static_cast<std::uint32_t>(triangle.id)), image,
                       coverage);
  return {.mode = Mode::kInfo.name,
          .gaps = std::count(coverage.begin(), coverage.end(), std::uint8_t{0}),
          .overlaps = std::count_if(coverage.begin(), coverage.end(), [](std::uint8_t n) { return n > 1; })};
}

}  // namespace

bool is_watertight_by_construction(const ModeInfo& mode) {
  return mode.numbers.bounded && mode.numbers.edge_form == EdgeForm::kExact;
}

std::vector<WatertightCount> count_gaps_and_overlaps(const Scene& scene,
                                                     std::span<const std::string_view> modes, int threads) {
  const SceneParameters& p = scene.parameters;
  const SampleGrid grid(FillRule::kTopLeft, p.width, p.height);
  const std::size_t pixels = static_cast<std::size_t>(p.width) * static_cast<std::size_t>(p.height);
  checked_bytes(pixels, static_cast<std::size_t>(threads), "counters of gaps and overlaps");
  checked_bytes(scene.model.triangles.size(), sizeof(ScreenTriangle<float>) + sizeof(ScreenTriangle<double>),
                "screen triangles");
  // The depth has no part in coverage, so that one depth function serves all modes.
  const auto in_float = screen_triangles<float>(scene);
  const auto in_double = screen_triangles<double>(scene);
  std::vector<Coverage> coverages(static_cast<std::size_t>(threads), Coverage(pixels));
  std::vector<WatertightCount> counts(modes.size());
  make_execution({.backend = "openmp", .schedule = "dynamic", .chunk = {}, .threads = threads})
      ->loop(static_cast<std::int64_t>(modes.size()), [&](std::int64_t i, int worker) {
        const auto index = static_cast<std::size_t>(i);
        Coverage& coverage = coverages[static_cast<std::size_t>(worker)];
        for_each_mode([&]<NumericMode Mode>() {
          if (Mode::kInfo.name != modes[index]) return;
          if constexpr (std::is_same_v<typename Mode::Real, double>)
            counts[index] = count<Mode>(in_double, grid, coverage);
          else
            counts[index] = count<Mode>(in_float, grid, coverage);
        });
      });
  return counts;
}

}  // namespace rasterbench::extremes
