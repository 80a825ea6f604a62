// The arithmetic of mode fixed_8 in the loops of fused_tiles.
// To be included as fixed_lanes-inl.h is.
#if defined(RASTERBENCH_KERNELS_TILE_FIXED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef RASTERBENCH_KERNELS_TILE_FIXED_INL_H_
#undef RASTERBENCH_KERNELS_TILE_FIXED_INL_H_
#else
#define RASTERBENCH_KERNELS_TILE_FIXED_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "kernels/fixed_lanes-inl.h"
#include "kernels/tile_lanes.h"
#include "kernels/tile_vectors-inl.h"
#include "numeric/modes.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

/// Cut to [-limit, limit].
HWY_INLINE Double cut(Double v, double limit) {
  const Double most = hn::Set(kDoubles, limit);
  return hn::Max(hn::Min(v, most), hn::Neg(most));
}

/// Set-up of a vector of triangles for a tile.
class TileSetup {
 public:
  /// Corners in 1/256 px from the tile's first sample.
  HWY_INLINE TileSetup(IntegerMask lanes, const LaneCorner (&corners)[3], FillRule fill) {
    const auto magnitude = [](Integer a, Integer b) HWY_ATTR { return hn::Max(hn::Abs(a), hn::Abs(b)); };
    const LaneCorner &a = corners[0], &b = corners[1], &c = corners[2];
    const Integer extent_x = hn::Sub(hn::Max(hn::Max(a.x, b.x), c.x), hn::Min(hn::Min(a.x, b.x), c.x));
    const Integer extent_y = hn::Sub(hn::Max(hn::Max(a.y, b.y), c.y), hn::Min(hn::Min(a.y, b.y), c.y));
    const Integer farthest = hn::Max(hn::Max(magnitude(a.x, a.y), magnitude(b.x, b.y)), magnitude(c.x, c.y));
    const Integer extent = hn::Max(extent_x, extent_y);
    // Differences below 2^14 times coordinates below 2^15: two such products and their difference fit.
    const IntegerMask is_near = hn::And(hn::Lt(extent, integer(1 << 14)), hn::Lt(farthest, integer(1 << 15)));
    in_reach = hn::Lt(extent, integer(kReach));
    if (hn::AllFalse(kIntegers, hn::AndNot(is_near, lanes)))
      edges_near(corners, fill);
    else
      edges_far(corners, fill);
  }

  Integer value[3], per_column[3], per_row[3];
  IntegerMask has_area;
  /// Whether edges do not overflow in 32 bits within a tile.
  IntegerMask in_reach;

 private:
  /// |dx| + |dy| < 2^23, times a tile of 128 pixels, is below 2^30.
  static constexpr std::int32_t kReach = 1 << 22;

  /// The part of an edge that both ways share; `flip` as is_flipped().
  HWY_INLINE void direct(int e, const LaneCorner (&c)[3], IntegerMask negative) {
    const LaneCorner &from = c[kEdgeFrom[e]], &to = c[kEdgeTo[e]];
    const IntegerMask flip = e == 2 ? hn::Not(negative) : negative;
    const Integer ex = hn::Sub(to.x, from.x), ey = hn::Sub(to.y, from.y);
    per_row[e] = hn::IfThenElse(flip, hn::Neg(ex), ex);
    per_column[e] = hn::IfThenElse(flip, ey, hn::Neg(ey));
  }

  /// 0 where samples on the edge belong to the triangle, else 1.
  HWY_INLINE Integer least(int e, FillRule fill) const {
    const Integer zero = hn::Zero(kIntegers);
    if (fill == FillRule::kClosed) return zero;
    const IntegerMask owned =
        hn::Or(hn::Gt(per_column[e], zero), hn::And(hn::Eq(per_column[e], zero), hn::Gt(per_row[e], zero)));
    return hn::IfThenZeroElse(owned, integer(1));
  }

  HWY_INLINE void edges_near(const LaneCorner (&c)[3], FillRule fill) {
    const Integer area = hn::Sub(hn::Mul(hn::Sub(c[1].x, c[0].x), hn::Sub(c[2].y, c[0].y)),
                                 hn::Mul(hn::Sub(c[1].y, c[0].y), hn::Sub(c[2].x, c[0].x)));
    has_area = hn::Ne(area, hn::Zero(kIntegers));
    for (int e = 0; e < 3; ++e) {
      direct(e, c, hn::Lt(area, hn::Zero(kIntegers)));
      const LaneCorner& from = c[kEdgeFrom[e]];
      // dx (0 - ay) - dy (0 - ax)
      const Integer at_origin = hn::Neg(hn::Add(hn::Mul(per_row[e], from.y), hn::Mul(per_column[e], from.x)));
      value[e] = hn::ShiftRight<8>(hn::Sub(at_origin, least(e, fill)));
    }
  }

  HWY_INLINE void edges_far(const LaneCorner (&c)[3], FillRule fill) {
    const Wide area = wide(hn::Sub(c[1].x, c[0].x)) * wide(hn::Sub(c[2].y, c[0].y)) -
                      wide(hn::Sub(c[1].y, c[0].y)) * wide(hn::Sub(c[2].x, c[0].x));
    const Integer sign = narrow(area, [](Double v) HWY_ATTR { return cut(v, 1); });
    has_area = hn::Ne(sign, hn::Zero(kIntegers));
    for (int e = 0; e < 3; ++e) {
      direct(e, c, hn::Lt(sign, hn::Zero(kIntegers)));
      const LaneCorner& from = c[kEdgeFrom[e]];
      const Wide at_origin = wide(hn::Neg(per_row[e])) * wide(from.y) - wide(per_column[e]) * wide(from.x) -
                             wide(least(e, fill));
      value[e] = narrow(at_origin, [](Double v) HWY_ATTR {
        return cut(hn::Floor(hn::Mul(v, hn::Set(kDoubles, 0x1p-8))), 0x1p30);
      });
    }
  }
};

/// Small triangles, each in a lane, at the samples of their boxes one row after the other.
class FixedSmall {
 public:
  /// Of sorted corners. A sample beyond a box is outside of an edge, or beyond the image.
  HWY_INLINE FixedSmall(const LaneCorner (&corners)[3], const LaneBox& box, IntegerMask lanes, FillRule fill)
      : plane(depth_plane(corners)), edges_(small_edges(corners, box.x0, box.y0, fill)) {
    draws = hn::And(lanes, edges_.draws);
    // Other lanes hold whatever follows a stream's last entry: outside of an edge that stays where it is.
    edges_.value[0] = hn::IfThenElse(draws, edges_.value[0], integer(-1));
    edges_.per_row[0] = hn::IfThenElseZero(draws, edges_.per_row[0]);
    edges_.per_column[0] = hn::IfThenElseZero(draws, edges_.per_column[0]);
  }

  HWY_INLINE void start_row() {
    for (int e = 0; e < 3; ++e) {
      value_[e] = edges_.value[e];
      edges_.value[e] = hn::Add(edges_.value[e], edges_.per_row[e]);
    }
  }
  /// Of the samples of a column; to be asked from left to right.
  HWY_INLINE LaneCoverage coverage(int) {
    const IntegerMask inside = hn::Gt(hn::Or(hn::Or(value_[0], value_[1]), value_[2]), integer(-1));
    for (int e = 0; e < 3; ++e) value_[e] = hn::Add(value_[e], edges_.per_column[e]);
    return {inside, inside};
  }

  LanePlane plane;
  IntegerMask draws;  ///< has an area

 private:
  SmallEdges edges_;
  Integer value_[3];
};

/// What an edge does to the samples of boxes.
HWY_INLINE EdgeCut cut(Integer value, Integer per_column, Integer per_row, const LaneBox& box) {
  const Integer zero = hn::Zero(kIntegers), one = integer(1);
  const Integer last_x = hn::Sub(box.x1, one), last_y = hn::Sub(box.y1, one);
  const Integer at_x0 = hn::Mul(per_column, box.x0), at_x1 = hn::Mul(per_column, last_x);
  const Integer at_y0 = hn::Mul(per_row, box.y0), at_y1 = hn::Mul(per_row, last_y);
  const Integer largest = hn::Add(value, hn::Add(hn::Max(at_x0, at_x1), hn::Max(at_y0, at_y1)));
  const Integer smallest = hn::Add(value, hn::Add(hn::Min(at_x0, at_x1), hn::Min(at_y0, at_y1)));
  return {hn::Lt(largest, zero), hn::Lt(smallest, zero)};
}

/// A vector of triangles of any size, set up for a tile.
class FixedTileTriangles {
 public:
  using Corners = LaneCorner[3];

  /// Of sorted corners.
  HWY_INLINE FixedTileTriangles(IntegerMask lanes, Corners& corners, const PixelBox& tile, FillRule fill)
      : plane(depth_plane(corners)), setup_(lanes, from_tile(corners, tile), fill) {
    const auto least = [](Integer a, Integer b, Integer c) HWY_ATTR { return hn::Min(hn::Min(a, b), c); };
    const auto most = [](Integer a, Integer b, Integer c) HWY_ATTR { return hn::Max(hn::Max(a, b), c); };
    const auto first_at = [](Integer v) HWY_ATTR { return hn::ShiftRight<8>(hn::Add(v, integer(255))); };
    const auto end_at = [](Integer v) HWY_ATTR { return hn::Add(hn::ShiftRight<8>(v), integer(1)); };
    box = within({first_at(least(corners[0].x, corners[1].x, corners[2].x)),
                  first_at(least(corners[0].y, corners[1].y, corners[2].y)),
                  end_at(most(corners[0].x, corners[1].x, corners[2].x)),
                  end_at(most(corners[0].y, corners[1].y, corners[2].y))},
                 tile.x1 - tile.x0, tile.y1 - tile.y0);
    draws = hn::And(hn::And(lanes, setup_.has_area), box.holds_a_sample());
    in_lanes = setup_.in_reach;
  }

  /// Whether edge e leaves samples of the box outside: all of them, or some.
  HWY_INLINE EdgeCut cut_by(int e) const {
    return cut(setup_.value[e], setup_.per_column[e], setup_.per_row[e], box);
  }

  HWY_INLINE void store_edges(IntegerMask lanes, TileTriangles& out) const {
    for (int e = 0; e < 3; ++e) {
      store(setup_.value[e], lanes, out.value[e] + out.size);
      store(setup_.per_column[e], lanes, out.per_column[e] + out.size);
      store(setup_.per_row[e], lanes, out.per_row[e] + out.size);
    }
  }

  LanePlane plane;
  LaneBox box;           ///< within the tile, from its first pixel
  IntegerMask draws;     ///< has an area and samples
  IntegerMask in_lanes;  ///< the others need the scalar specification

 private:
  /// In 1/256 px from the tile's first sample.
  static HWY_INLINE Corners& from_tile(Corners& corners, const PixelBox& tile) {
    const Integer left = integer(tile.x0 * 256 + 128), top = integer(tile.y0 * 256 + 128);
    for (LaneCorner& corner : corners) {
      corner.x = hn::Sub(corner.x, left);
      corner.y = hn::Sub(corner.y, top);
    }
    return corners;
  }

  TileSetup setup_;
};

/// The edges that cut the box of one triangle, at the columns of a vector and one row after the other.
template <int kEdges>
class FixedCut {
 public:
  HWY_INLINE FixedCut(const TileTriangles& t, std::size_t i, const int (&cutting)[3], const PixelBox&,
                      const PixelBox&)
      : t_(t), i_(i), cutting_(cutting) {}

  /// `columns` and rows from y0 on count from the tile's first pixel.
  HWY_INLINE void start(Integer columns, std::int32_t y0) {
    for (int k = 0; k < kEdges; ++k) {
      const int e = cutting_[k];
      per_row_[k] = integer(t_.per_row[e][i_]);
      value_[k] = hn::Add(integer(t_.value[e][i_] + t_.per_row[e][i_] * y0),
                          hn::Mul(integer(t_.per_column[e][i_]), columns));
    }
  }
  /// Those of `in_box` that are inside.
  HWY_INLINE IntegerMask next_row(IntegerMask in_box) {
    if constexpr (kEdges == 0) return in_box;
    Integer signs = value_[0];
    for (int k = 1; k < kEdges; ++k) signs = hn::Or(signs, value_[k]);
    for (int k = 0; k < kEdges; ++k) value_[k] = hn::Add(value_[k], per_row_[k]);
    return hn::And(in_box, hn::Gt(signs, integer(-1)));
  }

 private:
  const TileTriangles& t_;
  std::size_t i_;
  const int (&cutting_)[3];
  Integer value_[3], per_row_[3];
};

/// What the loops need of a mode.
struct FixedArithmetic {
  using Mode = Fixed8;
  static constexpr bool kIsExact = true;  ///< in vectors, for triangles that are small
  using Coordinate = Integer;
  using Small = FixedSmall;
  using Triangles = FixedTileTriangles;
  template <int kEdges>
  using Cut = FixedCut<kEdges>;

  static HWY_INLINE Integer coordinate(Float pixels) { return snapped(pixels); }
  /// What edge e of triangle i does to parts of its box.
  static HWY_INLINE EdgeCut cut_by(const TileTriangles& t, std::size_t i, int e, const LaneBox& parts,
                                   const PixelBox&) {
    return cut(integer(t.value[e][i]), integer(t.per_column[e][i]), integer(t.per_row[e][i]), parts);
  }
};

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
