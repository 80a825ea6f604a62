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
#include <cstddef>
#include <cstdint>
#include <span>

#include "kernels/fixed_lanes-inl.h"
#include "kernels/tile_pixels.h"
#include "kernels/tile_vectors-inl.h"
#include "pipeline/resolve.h"
#include "pipeline/stream_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

/// Finds the runs of pixels that show one triangle, row by row, and fetches the triangles: heads, of each row
/// the first pixels of its runs and then the width; ids, of each run but those of no triangle. The number of
/// ids.
HWY_INLINE std::size_t find_runs(const TilePixels& tile, const TileSettings& settings,
                                 std::span<const Triangle> triangles, TileScratch& scratch) {
  std::uint32_t *const heads = scratch.heads.data(), *const ids = scratch.ids.data();
  const std::int32_t width = tile.width();
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
        const std::uint32_t id =
            swap_rank(settings.tie, settings.triangle_count, static_cast<std::uint32_t>(rank));
        __builtin_prefetch(&triangles[id]);
        __builtin_prefetch(&triangles[id].c.z);  // may lie in the next line
        ids[id_count++] = id;
      }
    }
    heads[head_count++] = static_cast<std::uint32_t>(width);
  }
  return id_count;
}

/// A row of a tile as it goes into the picture; vectors may write beyond its end.
struct PictureRow {
  static constexpr std::size_t kSize = 128 + kLanes;  // of the largest tile
  alignas(64) std::uint32_t colours[kSize];
  alignas(64) float depths[kSize];

  HWY_INLINE void set_depths(const float* from, const std::int32_t* ranks, std::int32_t width) {
    for (std::int32_t x = 0; x < width; x += kWidth) hn::Store(shown(from, ranks, x), kFloats, depths + x);
  }
  /// From column x on: 1 where there is no triangle. Zero added, -0 becomes +0, as in the keys of the mode.
  static HWY_INLINE Float shown(const float* from, const std::int32_t* ranks, std::int32_t x) {
    const auto empty = hn::RebindMask(kFloats, hn::Eq(hn::LoadU(kIntegers, ranks + x), integer(kNoRank)));
    return hn::IfThenElse(empty, hn::Set(kFloats, 1.0f),
                          hn::Add(hn::LoadU(kFloats, from + x), hn::Zero(kFloats)));
  }
};

/// Tile -> picture: the triangles that it shows are shaded together, then its rows are written.
HWY_INLINE void resolve(const TilePixels& tile, const TileSettings& settings, TileScratch& scratch,
                        const TileOutput& output) {
  const auto& triangles = output.scene.model.triangles;
  const std::uint32_t background = pack_rgba(output.scene.parameters.background);
  const std::size_t id_count = find_runs(tile, settings, triangles, scratch);
  shade_in_lanes(triangles, {scratch.ids.data(), id_count}, output.scene.parameters.object,
                 scratch.colours.data(), scratch.isa);

  const std::int32_t width = tile.width();
  const auto is_vectors = [](std::int64_t n) { return n % kWidth == 0; };
  const auto is_at_vector = [](const void* p) {
    return reinterpret_cast<std::uintptr_t>(p) % (4 * kLanes) == 0;
  };
  // Where every row of the picture begins at a vector, depths need not be stored before they are.
  const bool is_aligned = is_vectors(settings.grid.width) && is_vectors(tile.box.x0) && is_vectors(width) &&
                          is_at_vector(output.colours) && is_at_vector(output.depths);
  const auto n = static_cast<std::size_t>(width);
  PictureRow row;
  const std::uint32_t *head = scratch.heads.data(), *colour = scratch.colours.data();
  for (std::int32_t y = 0; y < tile.height(); ++y) {
    const std::int32_t* ranks = tile.ranks + y * tile.pitch;
    const float* depths = tile.depths + y * tile.pitch;
    for (; *head < n; ++head) {
      const auto v = hn::Set(kCodes, ranks[*head] == kNoRank ? background : *colour++);
      for (std::uint32_t x = *head; x < head[1]; x += kLanes) hn::StoreU(v, kCodes, row.colours + x);
    }
    ++head;
    const std::int64_t at = std::int64_t{tile.box.y0 + y} * settings.grid.width + tile.box.x0;
    if (settings.techniques.streaming && is_aligned) {
      for (std::int32_t x = 0; x < width; x += kWidth)
        hn::Stream(hn::Load(kCodes, row.colours + x), kCodes, output.colours + at + x);
      for (std::int32_t x = 0; x < width; x += kWidth)
        hn::Stream(PictureRow::shown(depths, ranks, x), kFloats, output.depths + at + x);
    } else if (settings.techniques.streaming) {
      row.set_depths(depths, ranks, width);
      stream_row(row.colours, n, output.colours + at);
      stream_row(row.depths, n, output.depths + at);
    } else {
      row.set_depths(depths, ranks, width);
      std::copy_n(row.colours, n, output.colours + at);
      std::copy_n(row.depths, n, output.depths + at);
    }
    if (output.ids == nullptr) continue;
    for (std::int32_t x = 0; x < width; ++x) {
      const auto rank = static_cast<std::uint32_t>(ranks[x]);
      output.ids[at + x] =
          ranks[x] == kNoRank
              ? -1
              : static_cast<std::int32_t>(swap_rank(settings.tie, settings.triangle_count, rank));
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
