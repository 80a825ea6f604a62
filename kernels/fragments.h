// The inner loops that strategies share.
#pragma once

#include <cstdint>

#include "numeric/mode.h"

namespace rasterbench {

/// Calls visit(x, y, key) for every sample of `box` that the triangle covers, row by row. `box` lies within
/// prepared.box.
template <NumericMode Mode, class Visit>
void for_each_fragment(const typename Mode::Prepared& prepared, const PixelBox& box, Visit visit) {
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
