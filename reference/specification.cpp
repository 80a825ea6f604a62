#include "reference/specification.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/buffer.h"
#include "base/error.h"
#include "base/suggest.h"
#include "numeric/modes.h"
#include "pipeline/geometry.h"
#include "pipeline/resolve.h"
#include "reference/ray_cast_frame.h"

namespace rasterbench {
namespace {

/// Every pixel whose sample could be inside, found without the mode: the corners' extents, a pixel wider on
/// each side.
template <class Real>
PixelBox generous_box(const ScreenTriangle<Real>& t, const PixelBox& image) {
  const auto [low_x, high_x] = std::minmax({t.x[0], t.x[1], t.x[2]});
  const auto [low_y, high_y] = std::minmax({t.y[0], t.y[1], t.y[2]});
  const auto pixel = [](Real v, int margin) { return static_cast<std::int32_t>(std::floor(v)) + margin; };
  return intersect({pixel(low_x, -1), pixel(low_y, -1), pixel(high_x, 2), pixel(high_y, 2)}, image);
}

template <NumericMode Mode>
Picture render_mode(const Scene& scene, const FrameSettings& settings) {
  using Real = typename Mode::Real;
  const auto& triangles = scene.model.triangles;
  Picture picture{.width = settings.width, .height = settings.height};
  checked_bytes(settings.pixels(), sizeof(typename Mode::Key) + 20, "the specification's picture");
  std::vector<ScreenTriangle<Real>> screen(triangles.size()), extra;
  const Camera camera = sized_camera(scene, settings);
  GeometryOptions one_by_one = settings.geometry;  // what is vectorised is held to what is not
  one_by_one.isa = Isa::kBaseline;
  transform_triangles<Real>(triangles, 0, make_screen_transform(camera, Mode::kDepthFunction), one_by_one,
                            screen.data(), extra, picture.counts);
  screen.insert(screen.end(), extra.begin(), extra.end());

  const auto width = static_cast<std::size_t>(settings.width);
  std::vector<typename Mode::Key> keys(settings.pixels(), Mode::kClear);
  const auto count = static_cast<std::int64_t>(triangles.size());
  for (const ScreenTriangle<Real>& triangle : screen) {
    if (triangle.id < 0) continue;
    const auto prepared = Mode::prepare(
        triangle, settings.grid(), swap_rank(settings.tie, count, static_cast<std::uint32_t>(triangle.id)));
    const PixelBox tested = intersect(prepared.box, settings.bounds());
    if (!tested.empty())
      picture.samples_tested += std::int64_t{tested.x1 - tested.x0} * (tested.y1 - tested.y0);
    const PixelBox box = generous_box(triangle, settings.bounds());
    for (std::int32_t y = box.y0; y < box.y1; ++y)
      for (std::int32_t x = box.x0; x < box.x1; ++x) {
        if (!covers<Mode>(prepared, x, y)) continue;
        ++picture.samples_covered;
        const auto key = Mode::key(Mode::depth(prepared, x, y), prepared.rank);
        auto& pixel = keys[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)];
        if (key < pixel) pixel = key;
      }
  }

  picture.ids.reserve(keys.size());
  picture.depths.reserve(keys.size());
  picture.colours.reserve(keys.size());
  picture.values.reserve(keys.size());
  const DepthMap map = depth_map(camera, Mode::kDepthFunction);
  const std::uint32_t background = pack_rgba(scene.parameters.background);
  for (const auto& key : keys) {
    const bool drawn = key < Mode::kClear;
    const auto id = drawn ? static_cast<std::int32_t>(swap_rank(settings.tie, count, Mode::rank(key))) : -1;
    picture.ids.push_back(id);
    picture.depths.push_back(Mode::output_depth(key, map));
    picture.values.push_back(Mode::value(key));
    picture.colours.push_back(
        drawn ? shade_flat(triangles[static_cast<std::size_t>(id)], scene.parameters.object) : background);
  }
  return picture;
}

}  // namespace

Picture render_specification(const Scene& scene, std::string_view mode, const FrameSettings& settings) {
  if (!available_mode(mode, "numeric").has_screen_triangles)
    return render_ray_cast_specification(scene, settings);
  Picture picture;
  for_each_mode([&]<NumericMode Mode>() {
    if (Mode::kInfo.name == mode) picture = render_mode<Mode>(scene, settings);
  });
  return picture;
}

std::int64_t differing_pixels(const Picture& a, const Picture& b) {
  if (a.width != b.width || a.height != b.height)
    return static_cast<std::int64_t>(std::max(a.ids.size(), b.ids.size()));
  std::int64_t differing = 0;
  for (std::size_t i = 0; i < a.ids.size(); ++i)
    differing += a.ids[i] != b.ids[i] || a.colours[i] != b.colours[i] ||
                 std::bit_cast<std::uint32_t>(a.depths[i]) != std::bit_cast<std::uint32_t>(b.depths[i]);
  return differing;
}

Picture picture_of(const Renderer& renderer, const FrameSettings& settings) {
  const auto depths = renderer.depths();
  const auto colours = renderer.colours();
  return {.width = settings.width,
          .height = settings.height,
          .ids = renderer.ids(),
          .depths = {depths.begin(), depths.end()},
          .colours = {colours.begin(), colours.end()},
          .values = renderer.values()};
}

}  // namespace rasterbench
