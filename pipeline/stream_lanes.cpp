// Whether it pays is for a study to say (studies/ladder.toml). In resolve_row(), on an AMD EPYC with AVX-512,
// it does not: the stage takes 1.05 times as long with it at 1920x1080 and 3840x2160 and 1.12 times at
// 160x90, which the caches hold (medians of interleaved rounds of tile_simd, on one thread and two). Probably
// because the stage looks for runs of pixels one at a time, so that plain stores keep up. The tiles of
// fused_tiles look for them in vectors and gain: on one thread frames of small, medium and large triangles
// are 1.1, 1.4 and 1.8 times as fast at 1920x1080, 1.2, 1.5 and 2.2 times at 3840x2160, and the same at
// 160x90.
#include "pipeline/stream_lanes.h"

#include <algorithm>

#include "base/isa_dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/stream_lanes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h:
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "pipeline/stream_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

void stream(const std::uint32_t* colours, const float* depths, std::size_t n, std::uint32_t* to_colours,
            float* to_depths) {
  stream_row(colours, n, to_colours);
  stream_row(depths, n, to_depths);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace rasterbench {
namespace {

HWY_EXPORT(stream);

}  // namespace

void stream_pixels(const std::uint32_t* colours, const float* depths, std::size_t n,
                   std::uint32_t* to_colours, float* to_depths, Isa isa) {
  if (isa == Isa::kBaseline) {
    std::copy_n(colours, n, to_colours);
    std::copy_n(depths, n, to_depths);
    return;
  }
  RASTERBENCH_DISPATCH(stream, isa)(colours, depths, n, to_colours, to_depths);
}

void flush_streams() { hwy::FlushStream(); }

}  // namespace rasterbench
#endif  // HWY_ONCE
