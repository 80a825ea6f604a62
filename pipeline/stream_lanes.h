// Colours and depths on their way past the caches.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/isa.h"

namespace rasterbench {

/// Copies n colours and n depths with non-temporal stores, which neither read what they overwrite nor put it
/// into a cache. The destinations need not be aligned: what lies before the first whole vector and after the
/// last one is stored as usual, and so is everything where `isa` has no vectors. No other thread may read the
/// copies before flush_streams().
void stream_pixels(const std::uint32_t* colours, const float* depths, std::size_t n,
                   std::uint32_t* to_colours, float* to_depths, Isa isa);

/// Orders the non-temporal stores of this thread before its later stores, as those that release a lock or a
/// barrier.
void flush_streams();

}  // namespace rasterbench
