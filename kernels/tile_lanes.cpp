#include "kernels/tile_lanes.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <stdexcept>

#include "base/isa_dispatch.h"
#include "kernels/fragments.h"
#include "numeric/depth.h"
#include "numeric/modes.h"
#include "pipeline/resolve.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/tile_lanes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h:
#include <hwy/highway.h>

#include "kernels/fixed_lanes-inl.h"
#include "kernels/tile_filtered-inl.h"
#include "kernels/tile_fixed-inl.h"
#include "kernels/tile_vectors-inl.h"
#include "pipeline/stream_lanes-inl.h"

#ifndef RASTERBENCH_TILE_LANES_ONCE
#define RASTERBENCH_TILE_LANES_ONCE
namespace rasterbench {
namespace {

/// The depth of an empty pixel: with kNoRank it is the mode's kClear, so that d = 1 is not drawn.
constexpr float kClearDepth = 0x1.fffffep-1f;

constexpr int kBlockShift = 4, kBlockSide = 1 << kBlockShift;

/// A tile's pixels while it is drawn.
struct TilePixels {
  float* depths;
  std::int32_t* ranks;
  std::int64_t pitch;
  PixelBox box;     ///< of the image
  int block_shift;  ///< log2 of the blocks in a row
  std::int32_t blocks() const { return 1 << 2 * block_shift; }

  std::int32_t width() const { return box.x1 - box.x0; }
  std::int32_t height() const { return box.y1 - box.y0; }

  /// Keeps a fragment if its key is smaller.
  void keep(std::int64_t place, float depth, std::int32_t rank) {
    const float old_depth = depths[place];
    const std::int32_t old_rank = ranks[place];
    const bool kept = (depth < old_depth) | ((depth == old_depth) & (rank < old_rank));
    depths[place] = kept ? depth : old_depth;
    ranks[place] = kept ? rank : old_rank;
  }
};

/// Keeps a tile until the next round, and brings it back.
void save(const TilePixels& tile, int image_width, float* depths, std::int32_t* ranks) {
  for (std::int32_t y = 0; y < tile.height(); ++y) {
    const std::int64_t at = std::int64_t{tile.box.y0 + y} * image_width + tile.box.x0;
    std::copy_n(tile.depths + y * tile.pitch, tile.width(), depths + at);
    std::copy_n(tile.ranks + y * tile.pitch, tile.width(), ranks + at);
  }
}
void load(TilePixels& tile, int image_width, const float* depths, const std::int32_t* ranks) {
  for (std::int32_t y = 0; y < tile.height(); ++y) {
    const std::int64_t at = std::int64_t{tile.box.y0 + y} * image_width + tile.box.x0;
    std::copy_n(depths + at, tile.width(), tile.depths + y * tile.pitch);
    std::copy_n(ranks + at, tile.width(), tile.ranks + y * tile.pitch);
  }
}

float as_float(std::uint32_t bits) { return std::bit_cast<float>(bits); }
std::uint32_t as_bits(float value) { return std::bit_cast<std::uint32_t>(value); }

/// Entry i of a block, as a screen triangle without its id.
ScreenTriangle<float> triangle_of(const TriangleStreams::Block& block, std::size_t i) {
  ScreenTriangle<float> t{};
  for (int corner = 0; corner < 3; ++corner) {
    t.x[corner] = as_float(block.fields[corner][i]);
    t.y[corner] = as_float(block.fields[3 + corner][i]);
    t.d[corner] = as_float(block.fields[6 + corner][i]);
  }
  return t;
}

/// One triangle of any size, pixel by pixel.
template <NumericMode Mode>
void draw_one_by_one(const TriangleStreams::Block& block, std::size_t i, const SampleGrid& grid,
                     TilePixels& tile) {
  const std::uint32_t rank = block.fields[9][i];
  const auto prepared = Mode::prepare(triangle_of(block, i), grid, rank);
  const PixelBox box = intersect(prepared.box, tile.box);
  for_each_fragment<Mode>(prepared, box, [&](std::int32_t x, std::int32_t y, typename Mode::Key key) {
    tile.keep((y - tile.box.y0) * tile.pitch + (x - tile.box.x0),
              decode(static_cast<std::uint32_t>(key >> 32)), static_cast<std::int32_t>(rank));
  });
}

/// Whether entry i of a block covers a sample that its lane was not certain of. Out of line: it is rare.
template <NumericMode Mode>
[[gnu::noinline]] bool covers_exactly(const TriangleStreams::Block& block, std::size_t i,
                                      const SampleGrid& grid, std::int32_t x, std::int32_t y) {
  return covers<Mode>(Mode::prepare(triangle_of(block, i), grid, block.fields[9][i]), x, y);
}

/// Sorts `indices` by their values, but for those that differ by little. Finite values; `room` is for its
/// use.
void sort_roughly(const float* values, std::vector<std::uint32_t>& indices,
                  std::vector<std::uint32_t>& room) {
  if (indices.size() < 2) return;
  float low = values[indices[0]], high = low;
  for (const std::uint32_t i : indices) {
    low = std::min(low, values[i]);
    high = std::max(high, values[i]);
  }
  constexpr std::size_t kClasses = 64;
  const float range = high - low;
  const float scale = range > 0x1p-100f ? (kClasses - 1) / range : 0.0f;
  const auto class_of = [&](std::uint32_t i) { return static_cast<std::size_t>((values[i] - low) * scale); };
  std::uint32_t ends[kClasses + 1] = {};
  for (const std::uint32_t i : indices) ++ends[class_of(i) + 1];
  for (std::size_t c = 1; c <= kClasses; ++c) ends[c] += ends[c - 1];
  room.swap(indices);
  indices.resize(room.size());
  for (const std::uint32_t i : room) indices[ends[class_of(i)]++] = i;
}

/// Appends survivor i to a tile.
void append(const FrontEnd::Survivors& from, std::size_t i, std::int64_t tile, TriangleStreams& streams) {
  TriangleStreams::Block& block = streams.room(tile, 1);
  const auto end = static_cast<std::size_t>(block.size++);
  for (int corner = 0; corner < 3; ++corner) {
    block.fields[corner][end] = as_bits(from.x[corner][i]);
    block.fields[3 + corner][end] = as_bits(from.y[corner][i]);
    block.fields[6 + corner][end] = as_bits(from.d[corner][i]);
  }
  block.fields[9][end] = static_cast<std::uint32_t>(from.ranks[i]);
}

/// Appends survivor i to every tile that its box touches. `box` lies within the image.
void append_to_tiles(const FrontEnd::Survivors& from, std::size_t i, const PixelBox& box,
                     const TileGrid& grid, TriangleStreams& streams) {
  for (std::int64_t row = box.y0 >> grid.shift; row <= (box.y1 - 1) >> grid.shift; ++row)
    for (std::int64_t column = box.x0 >> grid.shift; column <= (box.x1 - 1) >> grid.shift; ++column)
      append(from, i, row * grid.columns + column, streams);
}

}  // namespace
}  // namespace rasterbench
#endif

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

template <class Arithmetic>
void select(const ScreenBatch<float>& in, const TileSettings& settings, FrontEnd& front_end) {
  FrontEnd::Survivors& out = front_end.survivors;
  const TileGrid& grid = settings.grid;
  std::size_t size = 0;
  std::int64_t tiles = 0;
  const bool first_wins = settings.tie == TieRule::kFirst;
  const auto last_id = integer(static_cast<std::int32_t>(settings.triangle_count - 1));
  for (std::size_t first = 0; first < ScreenBatch<float>::kSize; first += kLanes) {
    const Integer ids = hn::Load(kIntegers, in.ids + first);
    IntegerMask draws = hn::Gt(ids, integer(-1));
    if (hn::AllFalse(kIntegers, draws)) continue;
    Float px[3], py[3];
    typename Arithmetic::Coordinate x[3], y[3];
    for (int i = 0; i < 3; ++i) {
      px[i] = hn::Load(kFloats, in.x[i] + first);
      py[i] = hn::Load(kFloats, in.y[i] + first);
      x[i] = Arithmetic::coordinate(px[i]);
      y[i] = Arithmetic::coordinate(py[i]);
    }
    const LaneBox box = within(whole_box(x, y), grid.width, grid.height);
    draws = hn::And(draws, box.holds_a_sample());
    if (hn::AllFalse(kIntegers, draws)) continue;
    const LaneTiles corner(box, grid.shift);
    const Integer touched = hn::Mul(hn::Add(hn::Sub(corner.x1, corner.x0), integer(1)),
                                    hn::Add(hn::Sub(corner.y1, corner.y0), integer(1)));
    // At most 2^26 in a lane.
    tiles += hn::GetLane(hn::SumOfLanes(kIntegers, hn::IfThenElseZero(draws, touched)));
    for (int i = 0; i < 3; ++i) {
      store(px[i], draws, out.x[i] + size);
      store(py[i], draws, out.y[i] + size);
      store(hn::Load(kFloats, in.d[i] + first), draws, out.d[i] + size);
    }
    store(first_wins ? ids : hn::Sub(last_id, ids), draws, out.ranks + size);
    size += hn::CountTrue(kIntegers, draws);
  }
  out.size = static_cast<std::int64_t>(size);
  out.tiles = tiles;
}

/// The samples of a vector of tiny triangles: boxes of at most 2 x 2 pixels, each within one tile.
struct TinySamples {
  static constexpr int kSide = 2, kPlaces = kSide * kSide;
  IntegerMask covered[kPlaces];
  Float depths[kPlaces];
  Integer places[kPlaces];  ///< in the tile
  IntegerMask certain;      ///< lanes that need no exact arithmetic; unless Arithmetic::kIsExact
};

template <class Arithmetic>
HWY_INLINE TinySamples sample_tiny(const LaneCornerOf<typename Arithmetic::Coordinate> (&unsorted)[3],
                                   const LaneBox& box, IntegerMask tiny, const TileGrid& grid,
                                   FillRule fill) {
  LaneCornerOf<typename Arithmetic::Coordinate> corners[3] = {unsorted[0], unsorted[1], unsorted[2]};
  sort_corners(corners);
  typename Arithmetic::Small triangles(corners, box, tiny, fill);
  const LanePlane& plane = triangles.plane;
  const Integer in_tile = integer(grid.side() - 1);
  const Integer place =
      hn::Add(hn::Mul(hn::And(box.y0, in_tile), integer(grid.pitch())), hn::And(box.x0, in_tile));
  TinySamples samples;
  samples.certain = triangles.draws;
  for (int row = 0; row < TinySamples::kSide; ++row) {
    const Integer y = hn::Add(box.y0, integer(row));
    const Float of_row = depth_of_row(plane, sample_of(y));
    const IntegerMask in_row = hn::Lt(y, box.y1);
    triangles.start_row();
    for (int column = 0; column < TinySamples::kSide; ++column) {
      const int i = row * TinySamples::kSide + column;
      const LaneCoverage coverage = triangles.coverage(column);
      const Integer x = hn::Add(box.x0, integer(column));
      samples.covered[i] = hn::And(hn::And(in_row, hn::Lt(x, box.x1)), coverage.certain);
      if constexpr (!Arithmetic::kIsExact)
        samples.certain = hn::AndNot(hn::AndNot(coverage.certain, coverage.possible), samples.certain);
      samples.depths[i] = depth_at(plane, of_row, sample_of(x));
      samples.places[i] = hn::Add(place, integer(row * grid.pitch() + column));
    }
  }
  return samples;
}

/// Calls visit(tile, its lanes as a mask, as bits) for each tile among `lanes`.
template <class Visit>
HWY_INLINE void for_each_tile(IntegerMask lanes, Integer tiles, Visit visit) {
  alignas(64) std::int32_t tile_of[kLanes];
  hn::Store(tiles, kIntegers, tile_of);
  for (std::uint32_t left = bits_of(lanes); left != 0;) {
    const std::int32_t tile = tile_of[std::countr_zero(left)];
    const IntegerMask here = hn::And(lanes, hn::Eq(tiles, integer(tile)));
    const std::uint32_t bits = bits_of(here);
    visit(tile, here, bits);
    left &= ~bits;
  }
}

HWY_INLINE void append(Integer v, IntegerMask mask, std::uint32_t* to) {
  hn::StoreU(hn::BitCast(kCodes, compressed(v, mask)), kCodes, to);
}
HWY_INLINE void append(Float v, IntegerMask mask, std::uint32_t* to) {
  append(hn::BitCast(kIntegers, v), mask, to);
}

template <class Arithmetic>
void distribute(const TileSettings& settings, FrontEnd& front_end) {
  using Coordinate = typename Arithmetic::Coordinate;
  const FrontEnd::Survivors& from = front_end.survivors;
  const TileGrid& grid = settings.grid;
  for (std::int64_t first = 0; first < from.size; first += kWidth) {
    const auto at = static_cast<std::size_t>(first);
    const IntegerMask valid = hn::FirstN(kIntegers, static_cast<std::size_t>(from.size - first));
    Float px[3], py[3];
    LaneCornerOf<Coordinate> corners[3];
    Coordinate x[3], y[3];
    for (int i = 0; i < 3; ++i) {
      px[i] = hn::LoadU(kFloats, from.x[i] + at);
      py[i] = hn::LoadU(kFloats, from.y[i] + at);
      x[i] = Arithmetic::coordinate(px[i]);
      y[i] = Arithmetic::coordinate(py[i]);
      corners[i] = {x[i], y[i], hn::LoadU(kFloats, from.d[i] + at)};
    }
    const Integer ranks = hn::LoadU(kIntegers, from.ranks + at);
    const LaneBox whole = whole_box(x, y), box = within(whole, grid.width, grid.height);
    const LaneTiles corner(box, grid.shift);
    const IntegerMask in_one =
        hn::And(valid, hn::And(hn::Eq(corner.x0, corner.x1), hn::Eq(corner.y0, corner.y1)));
    const Integer tiles =
        hn::Add(hn::Mul(corner.y0, integer(static_cast<std::int32_t>(grid.columns))), corner.x0);

    const auto longest = hn::Max(hn::Sub(whole.x1, whole.x0), hn::Sub(whole.y1, whole.y0));
    const auto at_most = [&](int side) HWY_ATTR { return hn::Lt(longest, integer(side + 1)); };
    IntegerMask tiny = hn::FirstN(kIntegers, 0);
    if (settings.techniques.fragments) tiny = hn::And(in_one, at_most(TinySamples::kSide));
    if (!hn::AllFalse(kIntegers, tiny)) {
      const TinySamples samples = sample_tiny<Arithmetic>(corners, box, tiny, grid, settings.fill);
      if constexpr (!Arithmetic::kIsExact) tiny = hn::And(tiny, samples.certain);
      IntegerMask any = hn::And(tiny, samples.covered[0]);
      for (int i = 1; i < TinySamples::kPlaces; ++i) any = hn::Or(any, hn::And(tiny, samples.covered[i]));
      for_each_tile(any, tiles, [&](std::int32_t tile, IntegerMask here, std::uint32_t) HWY_ATTR {
        for (int i = 0; i < TinySamples::kPlaces; ++i) {
          const IntegerMask mask = hn::And(here, samples.covered[i]);
          if (hn::AllFalse(kIntegers, mask)) continue;
          FragmentStreams::Block& block = front_end.fragments.room(tile);
          append(samples.depths[i], mask, block.fields[0] + block.size);
          append(ranks, mask, block.fields[1] + block.size);
          append(samples.places[i], mask, block.fields[2] + block.size);
          block.size += static_cast<std::int64_t>(hn::CountTrue(kIntegers, mask));
        }
      });
    }
    const auto append_triangles = [&](IntegerMask lanes, TriangleStreams& streams) HWY_ATTR {
      for_each_tile(lanes, tiles, [&](std::int32_t tile, IntegerMask here, std::uint32_t bits) HWY_ATTR {
        if ((bits & (bits - 1)) == 0) {  // alone in its tile
          rasterbench::append(from, at + static_cast<std::size_t>(std::countr_zero(bits)), tile, streams);
          return;
        }
        TriangleStreams::Block& block = streams.room(tile);
        for (int i = 0; i < 3; ++i) {
          append(px[i], here, block.fields[i] + block.size);
          append(py[i], here, block.fields[3 + i] + block.size);
          append(corners[i].d, here, block.fields[6 + i] + block.size);
        }
        append(ranks, here, block.fields[9] + block.size);
        block.size += static_cast<std::int64_t>(hn::CountTrue(kIntegers, here));
      });
    };
    const IntegerMask small = hn::AndNot(tiny, at_most(kSmallSide));
    append_triangles(hn::And(small, in_one), front_end.small_triangles);
    append_triangles(hn::AndNot(hn::Or(tiny, small), in_one), front_end.triangles);
    const IntegerMask in_many = hn::AndNot(in_one, valid);
    if (hn::AllFalse(kIntegers, in_many)) continue;
    alignas(64) std::int32_t x0[kLanes], y0[kLanes], x1[kLanes], y1[kLanes];
    hn::Store(box.x0, kIntegers, x0);
    hn::Store(box.y0, kIntegers, y0);
    hn::Store(box.x1, kIntegers, x1);
    hn::Store(box.y1, kIntegers, y1);
    const std::uint32_t are_small = bits_of(small);
    for (std::uint32_t left = bits_of(in_many); left != 0; left &= left - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(left));
      append_to_tiles(from, at + lane, {x0[lane], y0[lane], x1[lane], y1[lane]}, grid,
                      are_small >> lane & 1 ? front_end.small_triangles : front_end.triangles);
    }
  }
}

/// Fetches a block ahead of its use: blocks lie anywhere in memory.
template <class Block>
HWY_INLINE void fetch(const Block* block) {
  if (block == nullptr) return;
  const auto* bytes = reinterpret_cast<const char*>(block);
  for (std::size_t line = 0; line < sizeof(Block); line += 64) __builtin_prefetch(bytes + line);
}

/// Draws the small triangles of a block, each in a lane: one place of all boxes at a time. A sample beyond a
/// box is outside of an edge or beyond the image, where the tile keeps nothing.
template <class Arithmetic>
void draw_small(const TriangleStreams::Block& block, const TileSettings& settings, TilePixels& tile) {
  fetch(block.next);
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
        for (; bits != 0; bits &= bits - 1) {
          const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
          tile.keep(places[lane] + step, depths[lane], ranks[lane]);
        }
      }
    }
  }
}

/// Sets up what of a block reaches the tile; triangles that the lanes cannot hold are drawn at once.
template <class Arithmetic>
void set_up(const TriangleStreams::Block& block, const TileSettings& settings, TilePixels& tile,
            TileTriangles& out) {
  fetch(block.next);
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
         alone &= alone - 1)
      draw_one_by_one<typename Arithmetic::Mode>(
          block, static_cast<std::size_t>(first) + static_cast<std::size_t>(std::countr_zero(alone)),
          {settings.fill, settings.grid.width, settings.grid.height}, tile);
    IntegerMask draws = hn::And(triangles.draws, triangles.in_lanes);
    Integer partial = hn::Zero(kIntegers);
    for (int e = 0; e < 3; ++e) {
      const EdgeCut edge = triangles.cut_by(e);
      draws = hn::AndNot(edge.misses, draws);
      partial = hn::Or(partial, hn::IfThenElseZero(edge.cuts, integer(1 << e)));
    }
    if (hn::AllFalse(kIntegers, draws)) continue;

    // Each operation of the depth rounds monotonically: the smallest of a box is that of a corner.
    const auto nearer_end = [&](Float gradient, Integer low, Integer high) HWY_ATTR {
      const auto rises = hn::RebindMask(kIntegers, hn::Gt(gradient, hn::Zero(kFloats)));
      return hn::IfThenElse(rises, low, hn::Sub(high, integer(1)));
    };
    const Integer near_x = hn::Add(nearer_end(plane.gx, box.x0, box.x1), integer(tile.box.x0));
    const Integer near_y = hn::Add(nearer_end(plane.gy, box.y0, box.y1), integer(tile.box.y0));
    const Float nearest = depth_at(plane, depth_of_row(plane, sample_of(near_y)), sample_of(near_x));

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

/// The pixels of the tile in a block.
PixelBox block_box(const TilePixels& tile, std::int32_t block) {
  const std::int32_t x = (block & ((1 << tile.block_shift) - 1)) << kBlockShift;
  const std::int32_t y = block >> tile.block_shift << kBlockShift;
  return intersect({x, y, x + kBlockSide, y + kBlockSide}, {0, 0, tile.width(), tile.height()});
}

/// The largest depth in a box that begins where a vector does: what is farther everywhere is hidden.
float farthest_depth(const TilePixels& tile, const PixelBox& box) {
  Float most = hn::Set(kFloats, -std::numeric_limits<float>::infinity());
  for (std::int32_t y = box.y0; y < box.y1; ++y)
    for (std::int32_t x = box.x0; x < box.x1; x += kWidth)
      most = hn::Max(most, hn::LoadU(kFloats, tile.depths + y * tile.pitch + x));
  return hn::GetLane(hn::MaxOfLanes(kFloats, most));
}

/// Draws the samples of triangle i that floats leave uncertain, in the columns of `box` from x on. Out of
/// line: it is rare.
template <class Arithmetic, int kEdges>
HWY_NOINLINE void draw_uncertain(const TileTriangles& t, std::size_t i, const int (&cutting)[3],
                                 const PixelBox& box, FillRule fill, std::int32_t x, TilePixels tile) {
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
  draw_box<Arithmetic>(t, i, cutting, edges, {t.x0[i], t.y0[i], t.x1[i], t.y1[i]}, t.x0[i], fill, tile);
}

/// The column at which the vector of a column begins.
HWY_INLINE std::int32_t vector_start(std::int32_t column) { return column & ~(kWidth - 1); }

/// Draws a large triangle by the blocks of the tile: those outside of an edge or behind what is there are
/// left out, and of the others each is cut by few edges. Whether any was hidden and none drawn.
template <class Arithmetic>
bool draw_in_blocks(const TileTriangles& t, std::size_t i, FillRule fill, const TilePixels& tile,
                    float* farthest, bool rejects) {
  const PixelBox box{t.x0[i], t.y0[i], t.x1[i], t.y1[i]};
  const LanePlane plane = {hn::Set(kFloats, t.d0[i]),  hn::Set(kFloats, t.gx[i]),   hn::Set(kFloats, t.gy[i]),
                           hn::Set(kFloats, t.low[i]), hn::Set(kFloats, t.high[i]), hn::Set(kFloats, t.px[i]),
                           hn::Set(kFloats, t.py[i])};
  bool drawn = false, hidden = false;
  const std::int32_t blocks = tile.blocks();
  for (std::int32_t first = 0; first < blocks; first += kWidth) {
    const Integer index = counting_from(kIntegers, first);
    const Integer left = hn::ShiftLeft<kBlockShift>(hn::And(index, integer((1 << tile.block_shift) - 1)));
    const Integer top = hn::ShiftLeft<kBlockShift>(hn::ShiftRightSame(index, tile.block_shift));
    const LaneBox part = {hn::Max(left, integer(box.x0)), hn::Max(top, integer(box.y0)),
                          hn::Min(hn::Add(left, integer(kBlockSide)), integer(box.x1)),
                          hn::Min(hn::Add(top, integer(kBlockSide)), integer(box.y1))};
    IntegerMask todo = hn::And(part.holds_a_sample(), hn::Lt(index, integer(blocks)));
    if (hn::AllFalse(kIntegers, todo)) continue;
    std::uint32_t cuts[3] = {};
    for (int e = 0; e < 3; ++e) {
      if ((t.partial[i] >> e & 1) == 0) continue;
      const EdgeCut edge = Arithmetic::cut_by(t, i, e, part, tile.box);
      todo = hn::AndNot(edge.misses, todo);
      cuts[e] = bits_of(edge.cuts);
    }
    if (rejects) {
      const Integer last_x = hn::Sub(part.x1, integer(1)), last_y = hn::Sub(part.y1, integer(1));
      const Integer near_x = hn::Add(t.gx[i] > 0 ? part.x0 : last_x, integer(tile.box.x0));
      const Integer near_y = hn::Add(t.gy[i] > 0 ? part.y0 : last_y, integer(tile.box.y0));
      const Float nearest = depth_at(plane, depth_of_row(plane, sample_of(near_y)), sample_of(near_x));
      const IntegerMask behind =
          hn::RebindMask(kIntegers, hn::Gt(nearest, hn::LoadU(kFloats, farthest + first)));
      hidden = hidden || !hn::AllFalse(kIntegers, hn::And(todo, behind));
      todo = hn::AndNot(behind, todo);
    }
    for (std::uint32_t bits = bits_of(todo); bits != 0; bits &= bits - 1) {
      const std::int32_t lane = std::countr_zero(bits), block = first + lane;
      const PixelBox whole = block_box(tile, block), here = intersect(box, whole);
      int cutting[3] = {}, edges = 0;
      for (int e = 0; e < 3; ++e) {
        cutting[edges] = e;
        edges += cuts[e] >> lane & 1;
      }
      draw_box<Arithmetic>(t, i, cutting, edges, here, vector_start(here.x0), fill, tile);
      if (rejects) farthest[block] = farthest_depth(tile, whole);
      drawn = true;
    }
  }
  return hidden && !drawn;
}

/// The largest of n floats, with as many behind them as a vector has.
HWY_INLINE float largest(const float* values, std::int32_t n) {
  Float most = hn::Set(kFloats, -std::numeric_limits<float>::infinity());
  for (std::int32_t i = 0; i < n; i += kWidth) most = hn::Max(most, hn::LoadU(kFloats, values + i));
  return hn::GetLane(hn::MaxOfLanes(kFloats, most));
}

/// Draws the triangles that are set up and empties their list.
template <class Arithmetic>
void draw_triangles(TileScratch& scratch, const TileSettings& settings, TilePixels& tile) {
  TileTriangles& triangles = scratch.triangles;
  std::vector<std::uint32_t>& order = scratch.order;
  const bool rejects = settings.techniques.front_to_back;
  const auto box_area = [&](std::size_t i) {
    return (triangles.x1[i] - triangles.x0[i]) * (triangles.y1[i] - triangles.y0[i]);
  };
  // Triangles of few pixels hide nothing and cost less than to be sorted.
  constexpr std::int32_t kLarge = 256;  // pixels of the box
  order.clear();
  for (std::size_t i = 0; i < triangles.size; ++i)
    if (box_area(i) >= kLarge) order.push_back(static_cast<std::uint32_t>(i));
  if (rejects) sort_roughly(triangles.nearest, order, scratch.unsorted);
  float* const farthest = scratch.farthest;
  float limit = largest(farthest, tile.blocks());
  for (const std::uint32_t i : order) {
    if (rejects && triangles.nearest[i] > limit) {
      ++scratch.hidden_entries;
      continue;
    }
    scratch.hidden_entries +=
        draw_in_blocks<Arithmetic>(triangles, i, settings.fill, tile, farthest, rejects);
    limit = largest(farthest, tile.blocks());
  }
  const std::int64_t area = std::int64_t{tile.width()} * tile.height();
  std::int64_t drawn = 0;
  const auto is_hidden = [&](std::size_t i) {
    const auto at = [&](std::int32_t x, std::int32_t y) {
      return farthest[(y >> kBlockShift << tile.block_shift) + (x >> kBlockShift)];
    };
    const std::int32_t x0 = triangles.x0[i], x1 = triangles.x1[i] - 1, y0 = triangles.y0[i],
                       y1 = triangles.y1[i] - 1;
    if (std::max((x1 >> kBlockShift) - (x0 >> kBlockShift), (y1 >> kBlockShift) - (y0 >> kBlockShift)) > 1)
      return false;
    return triangles.nearest[i] >
           std::max(std::max(at(x0, y0), at(x1, y0)), std::max(at(x0, y1), at(x1, y1)));
  };
  for (std::size_t i = 0; i < triangles.size; ++i) {
    if (box_area(i) >= kLarge) continue;
    if (rejects && is_hidden(i)) {
      ++scratch.hidden_entries;
      continue;
    }
    draw_triangle<Arithmetic>(triangles, i, settings.fill, tile);
    drawn += box_area(i);
    // A look at every pixel is worth it once as many were drawn.
    if (drawn < area || !rejects) continue;
    for (std::int32_t block = 0; block < tile.blocks(); ++block)
      farthest[block] = farthest_depth(tile, block_box(tile, block));
    drawn = 0;
  }
  triangles.size = 0;
}

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

void clear(const TilePixels& tile, int rows) {
  const Float empty = hn::Set(kFloats, kClearDepth);
  const Float beyond = hn::Set(kFloats, -std::numeric_limits<float>::infinity());
  const Integer no_rank = integer(kNoRank);
  for (std::int32_t y = 0; y < rows; ++y) {
    const Integer inside = integer(y < tile.height() ? tile.width() : 0);
    float* const depths = tile.depths + y * tile.pitch;
    std::int32_t* const ranks = tile.ranks + y * tile.pitch;
    for (std::int32_t x = 0; x < tile.pitch; x += kWidth) {
      const IntegerMask in_image = hn::Lt(counting_from(kIntegers, x), inside);
      hn::StoreU(hn::IfThenElse(hn::RebindMask(kFloats, in_image), empty, beyond), kFloats, depths + x);
      hn::StoreU(no_rank, kIntegers, ranks + x);
    }
  }
}

template <class Arithmetic>
void draw(const TileTask& task, const TileSettings& settings, TileScratch& scratch,
          const TileOutput& output) {
  // A row's left neighbours are looked at too: the first row has room before it.
  const std::int64_t pitch = settings.grid.pitch();
  TilePixels tile{scratch.depths.data() + pitch, scratch.ranks.data() + pitch, pitch,
                  settings.grid.box(task.tile), std::max(settings.grid.shift - kBlockShift, 0)};
  std::fill_n(scratch.farthest, std::size(scratch.farthest), -std::numeric_limits<float>::infinity());
  std::fill_n(scratch.farthest, tile.blocks(),
              task.first_round ? kClearDepth : std::numeric_limits<float>::infinity());
  for (const FrontEnd* front_end : task.front_ends) {
    fetch(front_end->triangles.blocks(task.tile));
    fetch(front_end->small_triangles.blocks(task.tile));
    fetch(front_end->fragments.blocks(task.tile));
  }
  clear(tile, settings.grid.rows_in_memory());
  if (!task.first_round) load(tile, settings.grid.width, task.kept_depths, task.kept_ranks);
  TileTriangles& triangles = scratch.triangles;
  for (const FrontEnd* front_end : task.front_ends)
    for (auto block = front_end->triangles.blocks(task.tile); block != nullptr; block = block->next) {
      set_up<Arithmetic>(*block, settings, tile, triangles);
      if (triangles.size >= TileTriangles::kSize) draw_triangles<Arithmetic>(scratch, settings, tile);
    }
  draw_triangles<Arithmetic>(scratch, settings, tile);
  for (const FrontEnd* front_end : task.front_ends)
    for (auto block = front_end->small_triangles.blocks(task.tile); block != nullptr; block = block->next)
      draw_small<Arithmetic>(*block, settings, tile);
  for (const FrontEnd* front_end : task.front_ends)
    for (auto block = front_end->fragments.blocks(task.tile); block != nullptr; block = block->next) {
      fetch(block->next);
      for (std::int64_t i = 0; i < block->size; ++i)
        tile.keep(block->fields[2][i], as_float(block->fields[0][i]),
                  static_cast<std::int32_t>(block->fields[1][i]));
    }
  if (task.last_round) {
    resolve(tile, settings, scratch, output);
    hwy::FlushStream();
  } else {
    save(tile, settings.grid.width, task.kept_depths, task.kept_ranks);
  }
}

// The dispatch tables take no templates.
void select_fixed_8(const ScreenBatch<float>& in, const TileSettings& settings, FrontEnd& front_end) {
  select<FixedArithmetic>(in, settings, front_end);
}
void distribute_fixed_8(const TileSettings& settings, FrontEnd& front_end) {
  distribute<FixedArithmetic>(settings, front_end);
}
void draw_fixed_8(const TileTask& task, const TileSettings& settings, TileScratch& scratch,
                  const TileOutput& output) {
  draw<FixedArithmetic>(task, settings, scratch, output);
}

void select_filtered(const ScreenBatch<float>& in, const TileSettings& settings, FrontEnd& front_end) {
  select<FilteredArithmetic>(in, settings, front_end);
}
void distribute_filtered(const TileSettings& settings, FrontEnd& front_end) {
  distribute<FilteredArithmetic>(settings, front_end);
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

#define RASTERBENCH_TILE_LANES(mode)                                                                \
  HWY_EXPORT(select_##mode);                                                                        \
  HWY_EXPORT(distribute_##mode);                                                                    \
  HWY_EXPORT(draw_##mode);                                                                          \
  TileLanes mode##_for(Isa isa) {                                                                   \
    if (isa == Isa::kBaseline) /* vectors of one lane */                                            \
      return {HWY_STATIC_DISPATCH(select_##mode), HWY_STATIC_DISPATCH(distribute_##mode),           \
              HWY_STATIC_DISPATCH(draw_##mode)};                                                    \
    const std::size_t index = dispatch_index(isa);                                                  \
    return {HWY_DISPATCH_TABLE(select_##mode)[index], HWY_DISPATCH_TABLE(distribute_##mode)[index], \
            HWY_DISPATCH_TABLE(draw_##mode)[index]};                                                \
  }

RASTERBENCH_TILE_LANES(fixed_8)
RASTERBENCH_TILE_LANES(filtered)
#undef RASTERBENCH_TILE_LANES

}  // namespace

const TileLanes& tile_lanes(Isa isa, std::string_view mode) {
  static const TileLanes fixed[] = {fixed_8_for(Isa::kBaseline), fixed_8_for(Isa::kSse4),
                                    fixed_8_for(Isa::kAvx2), fixed_8_for(Isa::kAvx512)};
  static const TileLanes filtered[] = {filtered_for(Isa::kBaseline), filtered_for(Isa::kSse4),
                                       filtered_for(Isa::kAvx2), filtered_for(Isa::kAvx512)};
  if (mode != Fixed8::kInfo.name && mode != Filtered::kInfo.name)
    throw std::logic_error("fused_tiles has no loops for this mode");
  return (mode == Fixed8::kInfo.name ? fixed : filtered)[static_cast<std::size_t>(isa)];
}

}  // namespace rasterbench
#endif  // HWY_ONCE
