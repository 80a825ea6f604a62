// The inner loops that strategies share.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "numeric/mode.h"

namespace rasterbench {

/// As for_each_fragment, in runs between columns that are multiples of 64.
template <RunMode Mode, class Visit>
void for_each_run_fragment(const typename Mode::Prepared& prepared, const PixelBox& box, Visit visit) {
  constexpr std::int32_t kRun = 64;
  std::array<float, kRun> depths;
  for (std::int32_t y = box.y0; y < box.y1; ++y)
    for (std::int32_t x = box.x0, end; x < box.x1; x = end) {
      end = std::min(box.x1, (x / kRun + 1) * kRun);
      const std::uint64_t inside = Mode::inside_run(prepared, x, y, end - x);
      if (inside == 0) continue;
      const int first = std::countr_zero(inside), last = 63 - std::countl_zero(inside);
      Mode::depth_run(prepared, x + first, y, last - first + 1, depths.data());
      for (int i = first; i <= last; ++i)
        if (inside >> i & 1)
          visit(x + i, y, Mode::key(depths[static_cast<std::size_t>(i - first)], prepared.rank));
    }
}

/// Calls visit(x, y, key) for every sample of `box` that the triangle covers, row by row. `box` lies within
/// prepared.box.
template <NumericMode Mode, class Visit>
void for_each_fragment(const typename Mode::Prepared& prepared, const PixelBox& box, Visit visit) {
  if constexpr (RunMode<Mode>) return for_each_run_fragment<Mode>(prepared, box, visit);
  for (std::int32_t y = box.y0; y < box.y1; ++y)
    for (std::int32_t x = box.x0; x < box.x1; ++x)
      if (Mode::inside(prepared, x, y)) visit(x, y, Mode::key(Mode::depth(prepared, x, y), prepared.rank));
}

/// Keeps the smaller key. For pixels that one thread owns.
template <class Key>
void keep_nearest(Key& pixel, const Key& key) {
  if (key < pixel) pixel = key;
}

}  // namespace rasterbench
