#include "kernels/front_end_lanes.h"

#include <bit>
#include <limits>
#include <stdexcept>

#include "base/isa_dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/front_end_lanes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h:
#include <hwy/highway.h>

#include "kernels/fixed_lanes-inl.h"
#include "kernels/tile_filtered-inl.h"
#include "kernels/tile_fixed-inl.h"
#include "kernels/tile_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

std::uint32_t as_bits(float value) { return std::bit_cast<std::uint32_t>(value); }

/// Appends survivor i to a tile. Compiled for each instruction set: a call of SSE code out of AVX2's, whose
/// upper halves of registers are in use, took 100 ns on an AMD Zen 3.
void append(const FrontEnd::Survivors& from, std::size_t i, std::int64_t tile, TriangleStreams& streams) {
  TriangleStreams::Block& block = streams.room(tile, 1);
  block.bounds.add(from.bounds);
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

/// The bounds of vectors of triangles.
class LaneBounds {
 public:
  HWY_INLINE LaneBounds()
      : nearest_(hn::Set(kFloats, std::numeric_limits<float>::infinity())),
        x0_(integer(std::numeric_limits<std::int32_t>::max())),
        y0_(x0_),
        x1_(hn::Zero(kIntegers)),
        y1_(x1_) {}

  /// Of the lanes of `mask`.
  HWY_INLINE void add(Float nearest, const LaneBox& box, IntegerMask mask) {
    nearest_ = hn::IfThenElse(hn::RebindMask(kFloats, mask), hn::Min(nearest_, nearest), nearest_);
    x0_ = hn::IfThenElse(mask, hn::Min(x0_, box.x0), x0_);
    y0_ = hn::IfThenElse(mask, hn::Min(y0_, box.y0), y0_);
    x1_ = hn::IfThenElse(mask, hn::Max(x1_, box.x1), x1_);
    y1_ = hn::IfThenElse(mask, hn::Max(y1_, box.y1), y1_);
  }
  HWY_INLINE StreamBounds of_all() const {
    const auto lowest = [](Integer v) HWY_ATTR { return hn::GetLane(hn::MinOfLanes(kIntegers, v)); };
    const auto highest = [](Integer v) HWY_ATTR { return hn::GetLane(hn::MaxOfLanes(kIntegers, v)); };
    return {hn::GetLane(hn::MinOfLanes(kFloats, nearest_)),
            {lowest(x0_), lowest(y0_), highest(x1_), highest(y1_)}};
  }

 private:
  Float nearest_;
  Integer x0_, y0_, x1_, y1_;
};

template <class Arithmetic>
void select(const ScreenBatch<float>& in, const TileSettings& settings, FrontEnd& front_end) {
  FrontEnd::Survivors& out = front_end.survivors;
  const TileGrid& grid = settings.grid;
  std::size_t size = 0;
  std::int64_t tiles = 0;
  LaneBounds bounds;
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
    Float d[3];
    for (int i = 0; i < 3; ++i) {
      d[i] = hn::Load(kFloats, in.d[i] + first);
      store(px[i], draws, out.x[i] + size);
      store(py[i], draws, out.y[i] + size);
      store(d[i], draws, out.d[i] + size);
    }
    if (settings.techniques.front_to_back) bounds.add(hn::Min(hn::Min(d[0], d[1]), d[2]), box, draws);
    store(first_wins ? ids : hn::Sub(last_id, ids), draws, out.ranks + size);
    size += hn::CountTrue(kIntegers, draws);
  }
  out.size = static_cast<std::int64_t>(size);
  out.tiles = tiles;
  out.bounds = {};
  if (settings.techniques.front_to_back && size > 0) {
    const StreamBounds all = bounds.of_all();
    // What is strewn over the image is hidden nowhere as a whole.
    const PixelBox pixels = all.pixels();
    if (2 * (pixels.x1 - pixels.x0) <= grid.width || 2 * (pixels.y1 - pixels.y0) <= grid.height)
      out.bounds = all;
  }
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
          append(from, at + static_cast<std::size_t>(std::countr_zero(bits)), tile, streams);
          return;
        }
        TriangleStreams::Block& block = streams.room(tile);
        block.bounds.add(from.bounds);
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

// The dispatch tables take no templates.
void select_fixed_8(const ScreenBatch<float>& in, const TileSettings& settings, FrontEnd& front_end) {
  select<FixedArithmetic>(in, settings, front_end);
}
void distribute_fixed_8(const TileSettings& settings, FrontEnd& front_end) {
  distribute<FixedArithmetic>(settings, front_end);
}
void select_filtered(const ScreenBatch<float>& in, const TileSettings& settings, FrontEnd& front_end) {
  select<FilteredArithmetic>(in, settings, front_end);
}
void distribute_filtered(const TileSettings& settings, FrontEnd& front_end) {
  distribute<FilteredArithmetic>(settings, front_end);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace rasterbench {
namespace {

HWY_EXPORT(select_fixed_8);
HWY_EXPORT(select_filtered);
HWY_EXPORT(distribute_fixed_8);
HWY_EXPORT(distribute_filtered);

}  // namespace

bool is_fixed_8(std::string_view mode) {
  if (mode == Fixed8::kInfo.name) return true;
  if (mode == Filtered::kInfo.name) return false;
  throw std::logic_error("fused_tiles has no loops for this mode");
}

FrontEndLanes front_end_lanes(Isa isa, std::string_view mode) {
  return is_fixed_8(mode) ? FrontEndLanes{RASTERBENCH_VARIANT(select_fixed_8, isa),
                                          RASTERBENCH_VARIANT(distribute_fixed_8, isa)}
                          : FrontEndLanes{RASTERBENCH_VARIANT(select_filtered, isa),
                                          RASTERBENCH_VARIANT(distribute_filtered, isa)};
}

}  // namespace rasterbench
#endif  // HWY_ONCE
