// What is fuzzed: a numeric mode behind one function, so that relations need not know its types and a test
// can hand in a mode that is broken on purpose.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "fuzz/case.h"
#include "numeric/mode.h"

namespace rasterbench::fuzz {

/// What a mode makes of screen triangles, pixel by pixel, row 0 on top.
struct ScreenPicture {
  int width = 0, height = 0;
  std::vector<std::int32_t> ids;     ///< -1 = background
  std::vector<double> values;        ///< depth values as the mode stores them
  std::vector<std::int32_t> counts;  ///< how many triangles cover the sample
  std::vector<bool> tied;            ///< several triangles have the nearest depth, as the mode orders depths
};

struct Subject {
  ModeInfo info;
  std::function<ScreenPicture(const ScreenInput&)> draw;
};

/// Draws by the scalar specification of `Mode`: covers, depth, key.
template <NumericMode Mode>
ScreenPicture draw_screen(const ScreenInput& input) {
  const auto triangles = triangles_for<typename Mode::Real>(input, Mode::kDepthFunction);
  const auto width = static_cast<std::size_t>(input.width);
  const std::size_t pixels = width * static_cast<std::size_t>(input.height);
  ScreenPicture picture{.width = input.width,
                        .height = input.height,
                        .ids = std::vector<std::int32_t>(pixels, -1),
                        .values = {},
                        .counts = std::vector<std::int32_t>(pixels),
                        .tied = std::vector<bool>(pixels)};
  const SampleGrid grid(input.fill, input.width, input.height);
  std::vector<typename Mode::Key> keys(pixels, Mode::kClear);
  std::vector<decltype(Mode::depth({}, 0, 0))> nearest(pixels);
  for (const auto& triangle : triangles) {
    const auto prepared = Mode::prepare(
        triangle, grid, swap_rank(input.tie, input.ids, static_cast<std::uint32_t>(triangle.id)));
    const PixelBox box = intersect(prepared.box, {0, 0, input.width, input.height});
    for (std::int32_t y = box.y0; y < box.y1; ++y)
      for (std::int32_t x = box.x0; x < box.x1; ++x) {
        if (!covers<Mode>(prepared, x, y)) continue;
        const std::size_t i = static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x);
        ++picture.counts[i];
        const auto depth = Mode::depth(prepared, x, y);
        const auto key = Mode::key(depth, prepared.rank);
        if (!(key < Mode::kClear)) continue;  // on the far plane or beyond
        // Of equal depths either wins with the smaller rank.
        const bool first = picture.ids[i] < 0;
        const bool can_win = first || Mode::key(depth, 0) < Mode::key(nearest[i], 1);
        const bool can_lose = !first && Mode::key(nearest[i], 0) < Mode::key(depth, 1);
        if (can_win && can_lose && picture.ids[i] != triangle.id) picture.tied[i] = true;
        if (can_win && !can_lose) {
          nearest[i] = depth;
          picture.tied[i] = false;
        }
        if (!(key < keys[i])) continue;
        keys[i] = key;
        picture.ids[i] = triangle.id;
      }
  }
  for (const auto& key : keys) picture.values.push_back(Mode::value(key));
  return picture;
}

template <NumericMode Mode>
Subject make_subject() {
  return {Mode::kInfo, draw_screen<Mode>};
}

/// Every mode of screen triangles that this CPU can run, in the order of the list of modes.
std::span<const Subject> subjects();

/// Throws InputError, with a did-you-mean, for a mode that is not among subjects().
const Subject& find_subject(std::string_view mode);

}  // namespace rasterbench::fuzz
