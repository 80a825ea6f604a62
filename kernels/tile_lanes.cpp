#include "kernels/tile_lanes.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>

#include "base/isa_dispatch.h"
#include "kernels/tile_pixels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/tile_lanes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h:
#include <hwy/highway.h>

#include "kernels/fixed_lanes-inl.h"
#include "kernels/tile_filtered-inl.h"
#include "kernels/tile_fixed-inl.h"
#include "kernels/tile_pixels-inl.h"
#include "kernels/tile_resolve-inl.h"
#include "kernels/tile_triangles-inl.h"
#include "kernels/tile_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

/// Draws the small triangles of a block, each in a lane: one place of all boxes at a time. A sample beyond a
/// box is outside of an edge or beyond the image, where the tile keeps nothing.
template <class Arithmetic>
void draw_small(const TriangleStreams::Block& block, const TileSettings& settings, TilePixels& tile) {
  const SampleGrid samples{settings.fill, settings.grid.width, settings.grid.height};
  for (std::int64_t first = 0; first < block.size; first += kWidth) {
    const IntegerMask valid = hn::FirstN(kIntegers, static_cast<std::size_t>(block.size - first));
    const auto field = [&](int f) HWY_ATTR { return hn::Load(kCodes, block.fields[f] + first); };
    LaneCornerOf<typename Arithmetic::Coordinate> corners[3];
    typename Arithmetic::Coordinate x[3], y[3];
    for (int i = 0; i < 3; ++i) {
      x[i] = Arithmetic::coordinate(hn::BitCast(kFloats, field(i)));
      y[i] = Arithmetic::coordinate(hn::BitCast(kFloats, field(3 + i)));
      corners[i] = {x[i], y[i], hn::BitCast(kFloats, field(6 + i))};
    }
    const LaneBox whole = whole_box(x, y);
    const LaneBox box = {hn::Max(whole.x0, integer(tile.box.x0)), hn::Max(whole.y0, integer(tile.box.y0)),
                         whole.x1, whole.y1};
    sort_corners(corners);
    typename Arithmetic::Small triangles(corners, box, valid, settings.fill);
    const LanePlane& plane = triangles.plane;
    if constexpr (!Arithmetic::kIsExact)
      for (std::uint32_t alone = bits_of(hn::AndNot(triangles.draws, valid)); alone != 0; alone &= alone - 1)
        draw_one_by_one<typename Arithmetic::Mode>(
            block, static_cast<std::size_t>(first) + static_cast<std::size_t>(std::countr_zero(alone)),
            samples, tile);
    const auto most = [&](Integer v) HWY_ATTR {
      return hn::GetLane(hn::MaxOfLanes(kIntegers, hn::IfThenElseZero(triangles.draws, v)));
    };
    const int columns = std::min(kSmallSide, most(hn::Sub(box.x1, box.x0)));
    const int rows = std::min(kSmallSide, most(hn::Sub(box.y1, box.y0)));
    const Float sample_x = sample_of(box.x0), sample_y = sample_of(box.y0);
    Float of_column[kSmallSide];
    for (int column = 0; column < kSmallSide; ++column)
      of_column[column] = hn::Mul(
          plane.gx, hn::Sub(hn::Add(sample_x, hn::Set(kFloats, static_cast<float>(column))), plane.x0));
    alignas(64) std::int32_t places[kLanes];
    alignas(64) std::int32_t ranks[kLanes];
    [[maybe_unused]] alignas(64) std::int32_t box_x[kLanes], box_y[kLanes];
    if constexpr (!Arithmetic::kIsExact) {
      hn::Store(box.x0, kIntegers, box_x);
      hn::Store(box.y0, kIntegers, box_y);
    }
    hn::Store(hn::Add(hn::Mul(hn::Sub(box.y0, integer(tile.box.y0)),
                              integer(static_cast<std::int32_t>(tile.pitch))),
                      hn::Sub(box.x0, integer(tile.box.x0))),
              kIntegers, places);
    hn::Store(hn::BitCast(kIntegers, field(9)), kIntegers, ranks);
    for (int row = 0; row < rows; ++row) {
      const Float of_row = depth_of_row(plane, hn::Add(sample_y, hn::Set(kFloats, static_cast<float>(row))));
      triangles.start_row();
      for (int column = 0; column < columns; ++column) {
        const LaneCoverage coverage = triangles.coverage(column);
        std::uint32_t bits = bits_of(coverage.possible);
        if (bits == 0) continue;
        if constexpr (!Arithmetic::kIsExact)
          for (std::uint32_t left = bits ^ bits_of(coverage.certain); left != 0; left &= left - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(left));
            if (!covers_exactly<typename Arithmetic::Mode>(block, static_cast<std::size_t>(first) + lane,
                                                           samples, box_x[lane] + column, box_y[lane] + row))
              bits &= ~(1u << lane);
          }
        alignas(64) float depths[kLanes];
        hn::Store(clamped(hn::Add(of_row, of_column[column]), plane.low, plane.high), kFloats, depths);
        const std::int64_t step = row * tile.pitch + column;
        tile.drawn += std::popcount(bits);
        for (; bits != 0; bits &= bits - 1) {
          const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
          tile.keep(places[lane] + step, depths[lane], ranks[lane]);
        }
      }
    }
  }
}

void draw_fragments(const FragmentStreams::Block& block, const TilePixels& tile) {
  for (std::int64_t i = 0; i < block.size; ++i)
    tile.keep(block.fields[2][i], as_float(block.fields[0][i]),
              static_cast<std::int32_t>(block.fields[1][i]));
}

/// Sets up what of a block reaches the tile; triangles that the lanes cannot hold are drawn at once.
template <class Arithmetic>
void set_up(const TriangleStreams::Block& block, const TileSettings& settings, TilePixels& tile,
            TileTriangles& out) {
  for (std::int64_t first = 0; first < block.size; first += kWidth) {
    const IntegerMask valid = hn::FirstN(kIntegers, static_cast<std::size_t>(block.size - first));
    const auto field = [&](int f) HWY_ATTR { return hn::LoadU(kCodes, block.fields[f] + first); };
    LaneCornerOf<typename Arithmetic::Coordinate> corners[3];
    for (int i = 0; i < 3; ++i)
      corners[i] = {Arithmetic::coordinate(hn::BitCast(kFloats, field(i))),
                    Arithmetic::coordinate(hn::BitCast(kFloats, field(3 + i))),
                    hn::BitCast(kFloats, field(6 + i))};
    sort_corners(corners);
    typename Arithmetic::Triangles triangles(valid, corners, tile.box, settings.fill);
    const LanePlane& plane = triangles.plane;
    const LaneBox& box = triangles.box;
    for (std::uint32_t alone = bits_of(hn::AndNot(triangles.in_lanes, triangles.draws)); alone != 0;
         alone &= alone - 1) {
      clear_untouched(tile);
      draw_one_by_one<typename Arithmetic::Mode>(
          block, static_cast<std::size_t>(first) + static_cast<std::size_t>(std::countr_zero(alone)),
          {settings.fill, settings.grid.width, settings.grid.height}, tile);
    }
    IntegerMask draws = hn::And(triangles.draws, triangles.in_lanes);
    Integer partial = hn::Zero(kIntegers);
    for (int e = 0; e < 3; ++e) {
      const EdgeCut edge = triangles.cut_by(e);
      draws = hn::AndNot(edge.misses, draws);
      partial = hn::Or(partial, hn::IfThenElseZero(edge.cuts, integer(1 << e)));
    }
    if (hn::AllFalse(kIntegers, draws)) continue;

    const Float nearest = nearest_of(plane, box, tile.box);
    const std::size_t end = out.size;
    triangles.store_edges(draws, out);
    store(partial, draws, out.partial + end);
    store(box.x0, draws, out.x0 + end);
    store(box.y0, draws, out.y0 + end);
    store(box.x1, draws, out.x1 + end);
    store(box.y1, draws, out.y1 + end);
    store(plane.d0, draws, out.d0 + end);
    store(plane.gx, draws, out.gx + end);
    store(plane.gy, draws, out.gy + end);
    store(plane.low, draws, out.low + end);
    store(plane.high, draws, out.high + end);
    store(plane.x0, draws, out.px + end);
    store(plane.y0, draws, out.py + end);
    store(nearest, draws, out.nearest + end);
    store(hn::BitCast(kIntegers, field(9)), draws, out.ranks + end);
    out.size += hn::CountTrue(kIntegers, draws);
  }
}

/// Calls visit(block) for the blocks of one of the streams of the tile; with front_to_back roughly in order
/// of depth, without those that are hidden when it is their turn: triangles that are neighbours in the scene
/// lie in one block.
template <class Visit>
HWY_INLINE void visit_blocks(const TileTask& task, TriangleStreams FrontEnd::*streams,
                             const TileSettings& settings, TileScratch& scratch, TilePixels& tile,
                             Visit visit) {
  StreamOrder& order = scratch.stream_order;
  order.clear();
  for (const FrontEnd* front_end : task.front_ends)
    for (const TriangleStreams::Block& block : (front_end->*streams).blocks(task.tile)) order.add(block);
  const bool rejects = settings.techniques.front_to_back;
  if (rejects) order.sort();
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i + 1 < order.size()) order[i + 1].fetch();
    const StreamBounds& bounds = order[i].bounds;
    if (rejects && bounds.are_known() && tile.hides(tile.of_image(bounds.pixels()), bounds.nearest())) {
      scratch.hidden_entries += order[i].size;
      continue;
    }
    visit(order[i]);
    if (rejects) look_for_farthest(tile);
  }
}

/// A tile, from streams to the picture.
template <class Arithmetic>
void draw(const TileTask& task, const TileSettings& settings, TileScratch& scratch,
          const TileOutput& output) {
  // A row's left neighbours are looked at too: the first row has room before it.
  const std::int64_t pitch = settings.grid.pitch();
  TilePixels tile{.depths = scratch.depths.data() + pitch,
                  .ranks = scratch.ranks.data() + pitch,
                  .pitch = pitch,
                  .box = settings.grid.box(task.tile),
                  .side = settings.grid.side(),
                  .farthest = scratch.farthest,
                  .untouched = 0,
                  .next_look = 0};
  start_tile(tile, settings.grid.rows_in_memory());
  if (!task.first_round) {
    clear_untouched(tile);
    load(tile, settings.grid.width, task.kept_depths, task.kept_ranks);
  }
  TileTriangles& triangles = scratch.triangles;
  visit_blocks(task, &FrontEnd::triangles, settings, scratch, tile,
               [&](const TriangleStreams::Block& block) HWY_ATTR {
                 set_up<Arithmetic>(block, settings, tile, triangles);
                 if (triangles.size >= TileTriangles::kSize)
                   draw_triangles<Arithmetic>(scratch, settings, tile);
               });
  draw_triangles<Arithmetic>(scratch, settings, tile);
  visit_blocks(task, &FrontEnd::small_triangles, settings, scratch, tile,
               [&](const TriangleStreams::Block& block)
                   HWY_ATTR { draw_small<Arithmetic>(block, settings, tile); });
  for (const FrontEnd* front_end : task.front_ends) {
    const auto blocks = front_end->fragments.blocks(task.tile);
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      if (i + 1 < blocks.size()) blocks[i + 1].fetch();
      draw_fragments(blocks[i], tile);
    }
  }
  if (task.last_round) {
    resolve(tile, settings, scratch, output);
    hwy::FlushStream();
  } else {
    save(tile, settings.grid.width, task.kept_depths, task.kept_ranks);
  }
}

// The dispatch tables take no templates.
void draw_fixed_8(const TileTask& task, const TileSettings& settings, TileScratch& scratch,
                  const TileOutput& output) {
  draw<FixedArithmetic>(task, settings, scratch, output);
}
void draw_filtered(const TileTask& task, const TileSettings& settings, TileScratch& scratch,
                   const TileOutput& output) {
  draw<FilteredArithmetic>(task, settings, scratch, output);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace rasterbench {
namespace {

HWY_EXPORT(draw_fixed_8);
HWY_EXPORT(draw_filtered);

}  // namespace

DrawTile tile_lanes(Isa isa, std::string_view mode) {
  return is_fixed_8(mode) ? RASTERBENCH_VARIANT(draw_fixed_8, isa) : RASTERBENCH_VARIANT(draw_filtered, isa);
}

}  // namespace rasterbench
#endif  // HWY_ONCE
