// The pixels of a tile in vectors: emptied, drawn into, looked at. To be included as fixed_lanes-inl.h is.
#if defined(RASTERBENCH_KERNELS_TILE_PIXELS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef RASTERBENCH_KERNELS_TILE_PIXELS_INL_H_
#undef RASTERBENCH_KERNELS_TILE_PIXELS_INL_H_
#else
#define RASTERBENCH_KERNELS_TILE_PIXELS_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include "kernels/fixed_lanes-inl.h"
#include "kernels/tile_pixels.h"
#include "kernels/tile_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

/// Empties the pixels of a box that begins where a vector does; those beyond the image never show anything.
HWY_INLINE void clear(const TilePixels& tile, const PixelBox& box) {
  const Float empty = hn::Set(kFloats, kClearDepth);
  const Float beyond = hn::Set(kFloats, -std::numeric_limits<float>::infinity());
  const Integer no_rank = integer(kNoRank);
  for (std::int32_t y = box.y0; y < box.y1; ++y) {
    const Integer inside = integer(y < tile.height() ? tile.width() : 0);
    float* const depths = tile.depths + y * tile.pitch;
    std::int32_t* const ranks = tile.ranks + y * tile.pitch;
    for (std::int32_t x = box.x0; x < box.x1; x += kWidth) {
      const IntegerMask in_image = hn::Lt(counting_from(kIntegers, x), inside);
      hn::StoreU(hn::IfThenElse(hn::RebindMask(kFloats, in_image), empty, beyond), kFloats, depths + x);
      hn::StoreU(no_rank, kIntegers, ranks + x);
    }
  }
}

/// Empties what no triangle has touched so far.
HWY_INLINE void clear_untouched(TilePixels& tile) {
  for (; tile.untouched != 0; tile.untouched &= tile.untouched - 1)
    clear(tile, tile.block(std::countr_zero(tile.untouched)));
}

/// Begins a tile: its blocks are cleared when a triangle comes, or all that are left by clear_untouched();
/// what lies beyond them is cleared now.
HWY_INLINE void start_tile(TilePixels& tile, int rows_in_memory) {
  const auto columns = static_cast<std::int32_t>(tile.pitch);
  clear(tile, {tile.side, 0, columns, tile.side});
  clear(tile, {0, tile.side, columns, rows_in_memory});
  tile.next_look = std::int64_t{tile.width()} * tile.height();
  const std::int32_t blocks = tile.blocks();
  tile.untouched = ~std::uint64_t{0} >> (64 - blocks);
  // Nothing is drawn into blocks beyond the image; vectors look at what is behind the last one, too.
  std::fill_n(tile.farthest, static_cast<std::size_t>(blocks) + kLanes,
              -std::numeric_limits<float>::infinity());
  for (std::int32_t block = 0; block < blocks; ++block)
    if (!tile.block_in_image(block).empty()) tile.farthest[block] = kClearDepth;
}

/// Stores the lanes of `mask`; the others hold `old`, which is what is there.
template <class V, class Mask, class D>
HWY_INLINE void store_where(V v, Mask mask, V old, D d, hn::TFromD<D>* to) {
#if HWY_TARGET == HWY_AVX3
  hn::BlendedStore(v, mask, d, to);
#else  // masked stores are slow before AVX-512
  hn::StoreU(hn::IfThenElse(mask, v, old), d, to);
#endif
}

/// Keeps the fragments of `inside` whose keys are smaller than those of the pixels.
HWY_INLINE void keep(IntegerMask inside, Float depth, Integer rank, float* depths, std::int32_t* ranks) {
  const Float old_depth = hn::LoadU(kFloats, depths);
  const Integer old_rank = hn::LoadU(kIntegers, ranks);
  const IntegerMask nearer = hn::RebindMask(kIntegers, hn::Lt(depth, old_depth));
  const IntegerMask tied =
      hn::And(hn::RebindMask(kIntegers, hn::Eq(depth, old_depth)), hn::Lt(rank, old_rank));
  const IntegerMask kept = hn::And(inside, hn::Or(nearer, tied));
  store_where(depth, hn::RebindMask(kFloats, kept), old_depth, kFloats, depths);
  store_where(rank, kept, old_rank, kIntegers, ranks);
}

/// The largest depth in a box that begins where a vector does: what is farther everywhere is hidden.
HWY_INLINE float farthest_depth(const TilePixels& tile, const PixelBox& box) {
  Float most = hn::Set(kFloats, -std::numeric_limits<float>::infinity());
  for (std::int32_t y = box.y0; y < box.y1; ++y)
    for (std::int32_t x = box.x0; x < box.x1; x += kWidth)
      most = hn::Max(most, hn::LoadU(kFloats, tile.depths + y * tile.pitch + x));
  return hn::GetLane(hn::MaxOfLanes(kFloats, most));
}

/// Looks for what is farthest in each block, once as many samples were drawn as the tile has, then twice and
/// four times as many: what a look costs is little beside them, whether it finds something or not.
HWY_INLINE void look_for_farthest(TilePixels& tile) {
  if (tile.drawn < tile.next_look) return;
  for (std::int32_t block = 0; block < tile.blocks(); ++block)
    if ((tile.untouched >> block & 1) == 0)
      tile.farthest[block] = farthest_depth(tile, tile.block_in_image(block));
  tile.next_look += std::int64_t{tile.width()} * tile.height();
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
