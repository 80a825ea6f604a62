// Tile -> picture. To be included as fixed_lanes-inl.h is.
#if defined(RASTERBENCH_KERNELS_TILE_RESOLVE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef RASTERBENCH_KERNELS_TILE_RESOLVE_INL_H_
#undef RASTERBENCH_KERNELS_TILE_RESOLVE_INL_H_
#else
#define RASTERBENCH_KERNELS_TILE_RESOLVE_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstdint>

#include "kernels/fixed_lanes-inl.h"
#include "kernels/tile_pixels.h"
#include "kernels/tile_vectors-inl.h"
#include "pipeline/resolve.h"
#include "pipeline/stream_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

/// Tile -> picture.
void resolve(const TilePixels& tile, const TileSettings& settings, TileScratch& scratch,
             const TileOutput& output) {
  const auto& triangles = output.scene.model.triangles;
  const std::uint32_t background = pack_rgba(output.scene.parameters.background);
  const std::int32_t width = tile.width();
  const auto count = settings.triangle_count;
  // First the ids of all runs of pixels that show one triangle, to be fetched and shaded together.
  std::uint32_t *const heads = scratch.heads.data(), *const ids = scratch.ids.data(),
                       *const colours = scratch.colours.data();
  std::size_t head_count = 0, id_count = 0;
  for (std::int32_t y = 0; y < tile.height(); ++y) {
    const std::int32_t* ranks = tile.ranks + y * tile.pitch;
    for (std::int32_t x = 0; x < width; x += kWidth) {
      std::uint32_t bits =
          bits_of(hn::Ne(hn::LoadU(kIntegers, ranks + x), hn::LoadU(kIntegers, ranks + x - 1)));
      if (x == 0) bits |= 1;
      if (width - x < kWidth) bits &= (1u << (width - x)) - 1;
      for (; bits != 0; bits &= bits - 1) {
        const std::int32_t head = x + std::countr_zero(bits);
        heads[head_count++] = static_cast<std::uint32_t>(head);
        const std::int32_t rank = ranks[head];
        if (rank == kNoRank) continue;
        const std::uint32_t id = swap_rank(settings.tie, count, static_cast<std::uint32_t>(rank));
        __builtin_prefetch(&triangles[id]);
        __builtin_prefetch(&triangles[id].c.z);  // may lie in the next line
        ids[id_count++] = id;
      }
    }
    heads[head_count++] = static_cast<std::uint32_t>(width);
  }
  shade_in_lanes(triangles, {ids, id_count}, output.scene.parameters.object, colours, scratch.isa);

  constexpr std::int32_t kWidest = 128;
  alignas(64) std::uint32_t row_colours[kWidest + kLanes];
  alignas(64) float row_depths[kWidest + kLanes];
  const bool is_aligned = settings.grid.width % kWidth == 0 && width % kWidth == 0 &&
                          tile.box.x0 % kWidth == 0 &&
                          reinterpret_cast<std::uintptr_t>(output.colours) % 64 == 0 &&
                          reinterpret_cast<std::uintptr_t>(output.depths) % 64 == 0;
  const std::uint32_t* head = heads;
  const std::uint32_t* colour = colours;
  for (std::int32_t y = 0; y < tile.height(); ++y) {
    const std::int32_t* ranks = tile.ranks + y * tile.pitch;
    const float* depths = tile.depths + y * tile.pitch;
    for (; static_cast<std::int32_t>(*head) < width; ++head) {
      const auto v = hn::Set(kCodes, ranks[*head] == kNoRank ? background : *colour++);
      for (std::uint32_t x = *head; x < head[1]; x += kLanes) hn::StoreU(v, kCodes, row_colours + x);
    }
    ++head;
    const std::int64_t at = std::int64_t{tile.box.y0 + y} * settings.grid.width + tile.box.x0;
    const auto depth_at_column = [&](std::int32_t x) HWY_ATTR {
      const auto empty = hn::RebindMask(kFloats, hn::Eq(hn::LoadU(kIntegers, ranks + x), integer(kNoRank)));
      // Zero added, -0 becomes +0, as in the keys of the mode.
      const Float depth = hn::Add(hn::LoadU(kFloats, depths + x), hn::Zero(kFloats));
      return hn::IfThenElse(empty, hn::Set(kFloats, 1.0f), depth);
    };
    if (settings.techniques.streaming && is_aligned) {
      for (std::int32_t x = 0; x < width; x += kWidth)
        hn::Stream(hn::Load(kCodes, row_colours + x), kCodes, output.colours + at + x);
      for (std::int32_t x = 0; x < width; x += kWidth)
        hn::Stream(depth_at_column(x), kFloats, output.depths + at + x);
    } else {
      for (std::int32_t x = 0; x < width; x += kWidth) hn::Store(depth_at_column(x), kFloats, row_depths + x);
      if (settings.techniques.streaming) {
        stream_row(row_colours, static_cast<std::size_t>(width), output.colours + at);
        stream_row(row_depths, static_cast<std::size_t>(width), output.depths + at);
      } else {
        std::copy_n(row_colours, width, output.colours + at);
        std::copy_n(row_depths, width, output.depths + at);
      }
    }
    if (output.ids != nullptr)
      for (std::int32_t x = 0; x < width; ++x)
        output.ids[at + x] = ranks[x] == kNoRank
                                 ? -1
                                 : static_cast<std::int32_t>(
                                       swap_rank(settings.tie, count, static_cast<std::uint32_t>(ranks[x])));
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
