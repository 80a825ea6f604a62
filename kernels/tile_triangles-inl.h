// Triangles that are set up for a tile -> pixels of the tile: one triangle at a time, its samples in vectors.
// To be included as fixed_lanes-inl.h is.
#if defined(RASTERBENCH_KERNELS_TILE_TRIANGLES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef RASTERBENCH_KERNELS_TILE_TRIANGLES_INL_H_
#undef RASTERBENCH_KERNELS_TILE_TRIANGLES_INL_H_
#else
#define RASTERBENCH_KERNELS_TILE_TRIANGLES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

#include "kernels/rough_order.h"
#include "kernels/tile_filtered-inl.h"
#include "kernels/tile_fixed-inl.h"
#include "kernels/tile_pixels-inl.h"
#include "numeric/depth.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

HWY_INLINE PixelBox box_of(const TileTriangles& t, std::size_t i) {
  return {t.x0[i], t.y0[i], t.x1[i], t.y1[i]};
}

/// Draws the samples of triangle i that floats leave uncertain, in the columns of `box` from x on. Out of
/// line: it is rare.
template <class Arithmetic, int kEdges>
HWY_NOINLINE void draw_uncertain(const TileTriangles& t, std::size_t i, const int (&cutting)[3],
                                 const PixelBox& box, FillRule fill, std::int32_t x, const TilePixels& tile) {
  const Integer columns = counting_from(kIntegers, x);
  const IntegerMask in_box = hn::And(hn::Gt(columns, integer(box.x0 - 1)), hn::Lt(columns, integer(box.x1)));
  const ExactTriangle triangle(t, i, fill);
  const DepthPlane<float> plane{t.d0[i], t.gx[i], t.gy[i], t.low[i], t.high[i]};
  typename Arithmetic::template Cut<kEdges> edges(t, i, cutting, box, tile.box);
  edges.start(columns, box.y0);
  for (std::int32_t y = box.y0; y < box.y1; ++y) {
    edges.next_row(in_box);
    for (std::uint32_t left = bits_of(edges.take_uncertain(in_box)); left != 0; left &= left - 1) {
      const std::int32_t column = x + std::countr_zero(left);
      const std::int32_t image_x = tile.box.x0 + column, image_y = tile.box.y0 + y;
      if (!triangle.covers(image_x, image_y)) continue;
      const float depth = plane.at((static_cast<float>(image_x) + 0.5f) - t.px[i],
                                   (static_cast<float>(image_y) + 0.5f) - t.py[i]);
      tile.keep(y * tile.pitch + column, depth, t.ranks[i]);
    }
  }
}

/// Draws the samples of triangle i in `box`, which the edges `cutting` cut; the others need no look. Begins
/// at `column`, at or before the box.
template <class Arithmetic, int kEdges>
HWY_INLINE void draw_box(const TileTriangles& t, std::size_t i, const int (&cutting)[3], const PixelBox& box,
                         std::int32_t column, FillRule fill, const TilePixels& tile) {
  const float d0 = t.d0[i], gy = t.gy[i], py = t.py[i];
  const Float gx = hn::Set(kFloats, t.gx[i]), px = hn::Set(kFloats, t.px[i]);
  const Float low = hn::Set(kFloats, t.low[i]), high = hn::Set(kFloats, t.high[i]);
  const Integer rank = integer(t.ranks[i]);
  const float first_y = static_cast<float>(tile.box.y0 + box.y0) + 0.5f;
  const std::int64_t pitch = tile.pitch;
  typename Arithmetic::template Cut<kEdges> edges(t, i, cutting, box, tile.box);
  for (std::int32_t x = column; x < box.x1; x += kWidth) {
    const Integer columns = counting_from(kIntegers, x);
    const IntegerMask in_box =
        hn::And(hn::Gt(columns, integer(box.x0 - 1)), hn::Lt(columns, integer(box.x1)));
    edges.start(columns, box.y0);
    const Float of_columns = hn::Mul(gx, hn::Sub(sample_of(hn::Add(columns, integer(tile.box.x0))), px));
    float* depths = tile.depths + box.y0 * pitch + x;
    std::int32_t* ranks = tile.ranks + box.y0 * pitch + x;
    float sample_y = first_y;  // small multiples of one half: exact
    for (std::int32_t rows = box.y1 - box.y0; rows > 0;
         --rows, depths += pitch, ranks += pitch, sample_y += 1.0f) {
      const IntegerMask inside = edges.next_row(in_box);
      const float of_row = d0 + gy * (sample_y - py);
      keep(inside, clamped(hn::Add(hn::Set(kFloats, of_row), of_columns), low, high), rank, depths, ranks);
    }
    if constexpr (!Arithmetic::kIsExact && kEdges > 0)
      if (HWY_UNLIKELY(!hn::AllFalse(kIntegers, edges.take_uncertain(in_box))))
        draw_uncertain<Arithmetic, kEdges>(t, i, cutting, box, fill, x, tile);
  }
}

template <class Arithmetic>
HWY_INLINE void draw_box(const TileTriangles& t, std::size_t i, const int (&cutting)[3], int edges,
                         const PixelBox& box, std::int32_t column, FillRule fill, const TilePixels& tile) {
  switch (edges) {
    case 0:
      return draw_box<Arithmetic, 0>(t, i, cutting, box, column, fill, tile);
    case 1:
      return draw_box<Arithmetic, 1>(t, i, cutting, box, column, fill, tile);
    case 2:
      return draw_box<Arithmetic, 2>(t, i, cutting, box, column, fill, tile);
    default:
      return draw_box<Arithmetic, 3>(t, i, cutting, box, column, fill, tile);
  }
}

template <class Arithmetic>
void draw_triangle(const TileTriangles& t, std::size_t i, FillRule fill, const TilePixels& tile) {
  int cutting[3] = {}, edges = 0;
  for (int e = 0; e < 3; ++e)
    if (t.partial[i] >> e & 1) cutting[edges++] = e;
  draw_box<Arithmetic>(t, i, cutting, edges, box_of(t, i), t.x0[i], fill, tile);
}

/// Triangle i in an untouched box that begins where a vector does and lies inside of the triangle. The
/// largest depth.
HWY_INLINE float fill(const TileTriangles& t, std::size_t i, const PixelBox& box, const LanePlane& plane,
                      const TilePixels& tile) {
  const Integer rank = integer(t.ranks[i]), no_rank = integer(kNoRank);
  const Float clear_depth = hn::Set(kFloats, kClearDepth);
  Float most = hn::Set(kFloats, -std::numeric_limits<float>::infinity());
  for (std::int32_t x = box.x0; x < box.x1; x += kWidth) {
    const Float of_columns =
        hn::Mul(plane.gx, hn::Sub(sample_of(counting_from(kIntegers, tile.box.x0 + x)), plane.x0));
    float* depths = tile.depths + box.y0 * tile.pitch + x;
    std::int32_t* ranks = tile.ranks + box.y0 * tile.pitch + x;
    float sample_y = static_cast<float>(tile.box.y0 + box.y0) + 0.5f;
    for (std::int32_t rows = box.y1 - box.y0; rows > 0;
         --rows, depths += tile.pitch, ranks += tile.pitch, sample_y += 1.0f) {
      const float of_row = t.d0[i] + t.gy[i] * (sample_y - t.py[i]);
      const Float depth = clamped(hn::Add(hn::Set(kFloats, of_row), of_columns), plane.low, plane.high);
      const Float kept = hn::Min(depth, clear_depth);
      most = hn::Max(most, kept);
      hn::StoreU(kept, kFloats, depths);
      hn::StoreU(hn::IfThenElse(hn::RebindMask(kIntegers, hn::Le(depth, clear_depth)), rank, no_rank),
                 kIntegers, ranks);
    }
  }
  return hn::GetLane(hn::MaxOfLanes(kFloats, most));
}

/// The blocks of a tile, a lane each, from `first` on: what of `box` lies in them.
HWY_INLINE LaneBox parts_in_blocks(const PixelBox& box, const TilePixels& tile, std::int32_t first) {
  const int shift = tile.block_shift();
  const Integer numbers = counting_from(kIntegers, first);
  const Integer x = hn::ShiftLeft<kBlockShift>(hn::And(numbers, integer((1 << shift) - 1)));
  const Integer y = hn::ShiftLeft<kBlockShift>(hn::ShiftRightSame(numbers, shift));
  return {hn::Max(x, integer(box.x0)), hn::Max(y, integer(box.y0)),
          hn::Min(hn::Add(x, integer(kBlockSide)), integer(box.x1)),
          hn::Min(hn::Add(y, integer(kBlockSide)), integer(box.y1))};
}

/// The smallest depth of the samples of each lane's box: each operation of a depth rounds monotonically, so
/// that it is that of a corner.
HWY_INLINE Float nearest_of(const LanePlane& plane, const LaneBox& box, const PixelBox& tile) {
  const auto nearer_end = [](Float gradient, Integer low, Integer high) HWY_ATTR {
    const auto rises = hn::RebindMask(kIntegers, hn::Gt(gradient, hn::Zero(kFloats)));
    return hn::IfThenElse(rises, low, hn::Sub(high, integer(1)));
  };
  const Integer x = hn::Add(nearer_end(plane.gx, box.x0, box.x1), integer(tile.x0));
  const Integer y = hn::Add(nearer_end(plane.gy, box.y0, box.y1), integer(tile.y0));
  return depth_at(plane, depth_of_row(plane, sample_of(y)), sample_of(x));
}

/// Draws triangle i in one block. `cutting`: the edges that cut the block's part of the triangle's box.
template <class Arithmetic>
HWY_INLINE void draw_block(const TileTriangles& t, std::size_t i, const int (&cutting)[3], int edges,
                           const LanePlane& plane, std::int32_t number, const TileSettings& settings,
                           TilePixels& tile) {
  const PixelBox block = tile.block(number), box = intersect(box_of(t, i), block);
  if (const std::uint64_t bit = std::uint64_t{1} << number; (tile.untouched & bit) != 0) {
    tile.untouched &= ~bit;
    if (edges == 0 && box == block) {
      tile.farthest[number] = fill(t, i, block, plane, tile);
      return;
    }
    clear(tile, block);
  }
  draw_box<Arithmetic>(t, i, cutting, edges, box, box.x0 & ~(kWidth - 1), settings.fill, tile);
  if (settings.techniques.front_to_back)
    tile.farthest[number] = farthest_depth(tile, tile.block_in_image(number));
}

/// Draws a large triangle by the blocks of the tile: those outside of an edge or behind what is there are
/// left out, and of the others each is cut by few edges. False where none was drawn because some are hidden.
template <class Arithmetic>
bool draw_in_blocks(const TileTriangles& t, std::size_t i, const TileSettings& settings, TilePixels& tile) {
  const auto set = [](float v) HWY_ATTR { return hn::Set(kFloats, v); };
  const LanePlane plane = {set(t.d0[i]),   set(t.gx[i]), set(t.gy[i]), set(t.low[i]),
                           set(t.high[i]), set(t.px[i]), set(t.py[i])};
  bool drawn = false, hidden = false;
  const std::int32_t blocks = tile.blocks();
  for (std::int32_t first = 0; first < blocks; first += kWidth) {
    const LaneBox parts = parts_in_blocks(box_of(t, i), tile, first);
    IntegerMask draws =
        hn::And(parts.holds_a_sample(), hn::Lt(counting_from(kIntegers, first), integer(blocks)));
    if (hn::AllFalse(kIntegers, draws)) continue;
    std::uint32_t cut[3] = {};
    for (int e = 0; e < 3; ++e) {
      if ((t.partial[i] >> e & 1) == 0) continue;
      const EdgeCut edge = Arithmetic::cut_by(t, i, e, parts, tile.box);
      draws = hn::AndNot(edge.misses, draws);
      cut[e] = bits_of(edge.cuts);
    }
    if (settings.techniques.front_to_back) {
      const auto is_behind = hn::RebindMask(
          kIntegers, hn::Gt(nearest_of(plane, parts, tile.box), hn::LoadU(kFloats, tile.farthest + first)));
      hidden = hidden || !hn::AllFalse(kIntegers, hn::And(draws, is_behind));
      draws = hn::AndNot(is_behind, draws);
    }
    for (std::uint32_t left = bits_of(draws); left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      int cutting[3] = {}, edges = 0;
      for (int e = 0; e < 3; ++e) {
        cutting[edges] = e;
        edges += cut[e] >> lane & 1;
      }
      draw_block<Arithmetic>(t, i, cutting, edges, plane, first + lane, settings, tile);
      drawn = true;
    }
  }
  return drawn || !hidden;
}

/// The largest of n floats, with as many behind them as a vector has.
HWY_INLINE float largest(const float* values, std::int32_t n) {
  Float most = hn::Set(kFloats, -std::numeric_limits<float>::infinity());
  for (std::int32_t i = 0; i < n; i += kWidth) most = hn::Max(most, hn::LoadU(kFloats, values + i));
  return hn::GetLane(hn::MaxOfLanes(kFloats, most));
}

/// The triangles that are set up, in the order in which a tile draws them: the large ones first, with the
/// techniques from front to back and by blocks.
template <class Arithmetic>
class TriangleDrawing {
 public:
  TriangleDrawing(TileScratch& scratch, const TileSettings& settings, TilePixels& tile)
      : scratch_(scratch),
        triangles_(scratch.triangles),
        settings_(settings),
        tile_(tile),
        rejects_(settings.techniques.front_to_back) {}

  void draw_large() {
    std::vector<std::uint32_t>& order = scratch_.order;
    order.clear();
    for (std::size_t i = 0; i < triangles_.size; ++i)
      if (is_large(i)) order.push_back(static_cast<std::uint32_t>(i));
    if (rejects_) sort_roughly(triangles_.nearest, order, scratch_.unsorted);
    if (!settings_.techniques.blocks) clear_untouched(tile_);
    float farthest = rejects_ ? largest(tile_.farthest, tile_.blocks()) : 0;
    for (const std::uint32_t i : order) {
      if (rejects_ && triangles_.nearest[i] > farthest) {
        ++scratch_.hidden_entries;
        continue;
      }
      if (settings_.techniques.blocks)
        scratch_.hidden_entries += !draw_in_blocks<Arithmetic>(triangles_, i, settings_, tile_);
      else
        draw_whole(i);
      if (rejects_) farthest = largest(tile_.farthest, tile_.blocks());
    }
  }

  void draw_others() {
    clear_untouched(tile_);
    for (std::size_t i = 0; i < triangles_.size; ++i) {
      if (is_large(i)) continue;
      if (rejects_ && tile_.hides(box_of(triangles_, i), triangles_.nearest[i]))
        ++scratch_.hidden_entries;
      else
        draw_whole(i);
    }
  }

 private:
  std::int32_t area_of_box(std::size_t i) const {
    return (triangles_.x1[i] - triangles_.x0[i]) * (triangles_.y1[i] - triangles_.y0[i]);
  }
  /// Triangles of few pixels hide nothing and cost less than to be ordered and taken apart.
  bool is_large(std::size_t i) const { return area_of_box(i) >= kBlockSide * kBlockSide; }

  void draw_whole(std::size_t i) {
    draw_triangle<Arithmetic>(triangles_, i, settings_.fill, tile_);
    tile_.drawn += area_of_box(i);
    if (rejects_) look_for_farthest(tile_);
  }

  TileScratch& scratch_;
  const TileTriangles& triangles_;
  const TileSettings& settings_;
  TilePixels& tile_;
  bool rejects_;
};

/// Draws the triangles that are set up and empties their list.
template <class Arithmetic>
void draw_triangles(TileScratch& scratch, const TileSettings& settings, TilePixels& tile) {
  TriangleDrawing<Arithmetic> drawing(scratch, settings, tile);
  drawing.draw_large();
  drawing.draw_others();
  scratch.triangles.size = 0;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
