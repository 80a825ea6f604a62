// The arithmetic of mode filtered in the loops of fused_tiles: float32 with an error bound, double where an
// orientation or a gradient needs it, and the scalar specification where the sign is uncertain. Signs are
// exact either way, so that the bound may be wider than that of FilteredEdges. To be included as
// fixed_lanes-inl.h is.
#if defined(RASTERBENCH_KERNELS_TILE_FILTERED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef RASTERBENCH_KERNELS_TILE_FILTERED_INL_H_
#undef RASTERBENCH_KERNELS_TILE_FILTERED_INL_H_
#else
#define RASTERBENCH_KERNELS_TILE_FILTERED_INL_H_
#endif

#include <hwy/highway.h>

#include <bit>
#include <cstdint>
#include <limits>

#include "kernels/fixed_lanes-inl.h"
#include "kernels/tile_lanes.h"
#include "kernels/tile_vectors-inl.h"
#include "numeric/modes.h"

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

using FloatCorner = LaneCornerOf<Float>;  // in pixels

/// Set-up of a vector of triangles, of sorted corners: FilteredEdges and SteadyF32Depth.
struct FilteredSetup {
  HWY_INLINE explicit FilteredSetup(const FloatCorner (&c)[3]) {
    const Wide x1 = wide(c[1].x) - wide(c[0].x), y1 = wide(c[1].y) - wide(c[0].y);
    const Wide x2 = wide(c[2].x) - wide(c[0].x), y2 = wide(c[2].y) - wide(c[0].y);
    const Wide forth = x1 * y2, back = y1 * x2, area = forth - back;
    Wide certain_area;
    for (std::size_t i = 0; i < Wide::kParts; ++i) {  // the filter of FilteredEdges
      const Double magnitude = hn::Add(hn::Abs(forth.parts[i]), hn::Abs(back.parts[i]));
      const auto exceeds = hn::Gt(hn::Abs(area.parts[i]), hn::Mul(hn::Set(kDoubles, 5 * 0x1p-53), magnitude));
      certain_area.parts[i] = hn::IfThenElseZero(exceeds, area.parts[i]);
    }
    const Float orientation = narrow(certain_area), zero = hn::Zero(kFloats);
    is_certain = hn::RebindMask(kIntegers, hn::Ne(orientation, zero));
    const FloatMask negative = hn::Lt(orientation, zero);

    const Wide d1 = wide(c[1].d) - wide(c[0].d), d2 = wide(c[2].d) - wide(c[0].d);
    plane.d0 = c[0].d;
    plane.gx = narrow((d1 * y2 - d2 * y1) / area);
    plane.gy = narrow((d2 * x1 - d1 * x2) / area);
    plane.low = hn::Min(hn::Min(c[0].d, c[1].d), c[2].d);
    plane.high = hn::Max(hn::Max(c[0].d, c[1].d), c[2].d);
    plane.x0 = c[0].x;
    plane.y0 = c[0].y;

    // Beyond the extents by as much as a block of a small triangle's samples is.
    const Float margin = hn::Set(kFloats, float{kSmallSide});
    const Float width = hn::Add(hn::Sub(c[2].x, c[0].x), margin);
    const Float height = hn::Add(
        hn::Sub(hn::Max(hn::Max(c[0].y, c[1].y), c[2].y), hn::Min(hn::Min(c[0].y, c[1].y), c[2].y)), margin);
    size = zero;
    for (int e = 0; e < 3; ++e) {
      const FloatCorner &from = c[kEdgeFrom[e]], &to = c[kEdgeTo[e]];
      const Float ex = hn::Sub(to.x, from.x), ey = hn::Sub(to.y, from.y);
      const FloatMask flip = e == 2 ? hn::Not(negative) : negative;
      dx[e] = hn::IfThenElse(flip, hn::Neg(ex), ex);
      dy[e] = hn::IfThenElse(flip, hn::Neg(ey), ey);
      size = hn::Max(size, hn::Add(hn::Mul(hn::Abs(ex), height), hn::Mul(hn::Abs(ey), width)));
    }
    is_negative = negative;
  }

  LanePlane plane;
  IntegerMask is_certain;  ///< the orientation; other lanes hold nothing of use
  FloatMask is_negative;   ///< the orientation
  Float dx[3], dy[3];      ///< the inside turned positive
  /// In px^2, above |dx (y - ay)| + |dy (x - ax)| of every edge at samples within or kSmallSide px beyond the
  /// triangle's extents. Rounded in float32.
  Float size;
};

/// u of float32. The roundings of `size` and of an error are paid by counting one u more than is needed.
constexpr float kUnit = 0x1p-24f;
/// More than what underflow adds to an error.
constexpr float kUnderflow = 0x1p-120f;

/// As FixedSmall.
class FilteredSmall {
 public:
  /// Of sorted corners. A sample beyond a box is outside of an edge, as exact arithmetic will say where the
  /// floats do not.
  HWY_INLINE FilteredSmall(const FloatCorner (&corners)[3], const LaneBox& box, IntegerMask lanes, FillRule) {
    const FilteredSetup setup(corners);
    plane = setup.plane;
    draws = hn::And(lanes, setup.is_certain);
    const Float x = sample_of(box.x0), y = sample_of(box.y0);
    for (int e = 0; e < 3; ++e) {
      const FloatCorner& from = corners[kEdgeFrom[e]];
      value_of_row_[e] =
          hn::Sub(hn::Mul(setup.dx[e], hn::Sub(y, from.y)), hn::Mul(setup.dy[e], hn::Sub(x, from.x)));
      per_column_[e] = setup.dy[e];
      per_row_[e] = setup.dx[e];
    }
    value_of_row_[0] = hn::IfThenElse(hn::RebindMask(kFloats, draws), value_of_row_[0],
                                      hn::Set(kFloats, -std::numeric_limits<float>::infinity()));
    // 5 for the first sample, as in FilteredEdges; each of three steps down and three to the right adds the
    // rounding of its sum and that of dx or dy, which moves a value by less than its products in all.
    error_ =
        hn::Add(hn::Mul(setup.size, hn::Set(kFloats, (5 + 6 + 2 + 1) * kUnit)), hn::Set(kFloats, kUnderflow));
  }

  HWY_INLINE void start_row() {
    for (int e = 0; e < 3; ++e) {
      value_[e] = value_of_row_[e];
      value_of_row_[e] = hn::Add(value_of_row_[e], per_row_[e]);
    }
  }
  HWY_INLINE LaneCoverage coverage(int) {
    const Float smallest = hn::Min(hn::Min(value_[0], value_[1]), value_[2]);
    for (int e = 0; e < 3; ++e) value_[e] = hn::Sub(value_[e], per_column_[e]);
    return {hn::RebindMask(kIntegers, hn::Ge(smallest, hn::Neg(error_))),
            hn::RebindMask(kIntegers, hn::Gt(smallest, error_))};
  }

  LanePlane plane;
  IntegerMask draws;  ///< has an area for certain

 private:
  Float value_of_row_[3], value_[3], per_column_[3], per_row_[3], error_;
};

/// The first and last samples of boxes.
struct CornerSamples {
  Float x0, y0, x1, y1;
};
HWY_INLINE CornerSamples corner_samples(const LaneBox& box, const PixelBox& tile) {
  const Integer left = integer(tile.x0), top = integer(tile.y0), one = integer(1);
  return {sample_of(hn::Add(box.x0, left)), sample_of(hn::Add(box.y0, top)),
          sample_of(hn::Add(hn::Sub(box.x1, one), left)), sample_of(hn::Add(hn::Sub(box.y1, one), top))};
}

/// The smallest and largest values over boxes of an edge function as floats give it. Each of its operations
/// rounds monotonically: they are those at two corners.
struct EdgeRange {
  Float smallest, largest;
};
HWY_INLINE EdgeRange range_of_edge(Float dx, Float dy, Float from_x, Float from_y, const CornerSamples& at) {
  const Float of_y0 = hn::Mul(dx, hn::Sub(at.y0, from_y)), of_y1 = hn::Mul(dx, hn::Sub(at.y1, from_y));
  const Float of_x0 = hn::Mul(dy, hn::Sub(at.x0, from_x)), of_x1 = hn::Mul(dy, hn::Sub(at.x1, from_x));
  return {hn::Sub(hn::Min(of_y0, of_y1), hn::Max(of_x0, of_x1)),
          hn::Sub(hn::Max(of_y0, of_y1), hn::Min(of_x0, of_x1))};
}

/// As FixedTileTriangles.
class FilteredTileTriangles {
 public:
  HWY_INLINE FilteredTileTriangles(IntegerMask lanes, const FloatCorner (&corners)[3], const PixelBox& tile,
                                   FillRule)
      : corners_(corners), setup_(corners) {
    const LaneBox whole = whole_box<Float>({corners[0].x, corners[1].x, corners[2].x},
                                           {corners[0].y, corners[1].y, corners[2].y});
    const Integer left = integer(tile.x0), top = integer(tile.y0);
    box = within(
        {hn::Sub(whole.x0, left), hn::Sub(whole.y0, top), hn::Sub(whole.x1, left), hn::Sub(whole.y1, top)},
        tile.x1 - tile.x0, tile.y1 - tile.y0);
    plane = setup_.plane;
    draws = hn::And(lanes, box.holds_a_sample());
    in_lanes = setup_.is_certain;
    // 5 as in FilteredEdges.
    error_ = hn::Add(hn::Mul(setup_.size, hn::Set(kFloats, (5 + 1) * kUnit)), hn::Set(kFloats, kUnderflow));
    error_of_steps_ = hn::Zero(kFloats);
    samples_ = corner_samples(box, tile);
  }

  /// Each operation of an edge function rounds monotonically: its smallest and largest values over the box
  /// are those at two corners. What is certain there is certain at every sample. To be asked of each edge
  /// before store_edges(), which needs the errors of those that cut.
  HWY_INLINE EdgeCut cut_by(int e) {
    const FloatCorner& from = corners_[kEdgeFrom[e]];
    const auto [smallest, largest] = range_of_edge(setup_.dx[e], setup_.dy[e], from.x, from.y, samples_);
    const FloatMask misses = hn::Lt(largest, hn::Neg(error_)), cuts = hn::Le(smallest, error_);
    // FilteredCut goes from the first sample of the box through samples of the box, where the edge function
    // is at most m. Along a side of the box it changes by at most 2 m: dx, dy and the product with dy carry a
    // rounding of 2 u m each, and each sum one of u m, in all (rows + 6) u m, and 2 for what is of second
    // order.
    const Float most = hn::Max(hn::Abs(smallest), hn::Abs(largest));
    const Float steps = hn::ConvertTo(kFloats, hn::Add(hn::Sub(box.y1, box.y0), integer(8)));
    const Float of_steps = hn::Mul(hn::Mul(steps, most), hn::Set(kFloats, kUnit));
    error_of_steps_ = hn::Max(error_of_steps_, hn::IfThenElseZero(cuts, of_steps));
    return {hn::RebindMask(kIntegers, misses), hn::RebindMask(kIntegers, cuts)};
  }

  HWY_INLINE void store_edges(IntegerMask lanes, TileTriangles& out) const {
    for (int i = 0; i < 3; ++i) {
      store(corners_[i].x, lanes, out.x[i] + out.size);
      store(corners_[i].y, lanes, out.y[i] + out.size);
    }
    store(hn::Add(error_, error_of_steps_), lanes, out.error + out.size);
    store(hn::IfThenElseZero(hn::RebindMask(kIntegers, setup_.is_negative), integer(1)), lanes,
          out.is_negative + out.size);
  }

  LanePlane plane;
  LaneBox box;
  IntegerMask draws;
  IntegerMask in_lanes;

 private:
  const FloatCorner (&corners_)[3];
  FilteredSetup setup_;
  CornerSamples samples_;
  Float error_;           // of an edge function at one sample
  Float error_of_steps_;  // what going from sample to sample adds
};

/// FilteredEdges::inside() of triangle i.
class ExactTriangle {
 public:
  ExactTriangle(const TileTriangles& t, std::size_t i, FillRule fill) {
    ScreenTriangle<float> triangle{};
    for (int corner = 0; corner < 3; ++corner) {
      triangle.x[corner] = t.x[corner][i];
      triangle.y[corner] = t.y[corner][i];
    }
    FilteredEdges::setup(triangle, fill, edges_);
  }

  bool covers(std::int32_t x, std::int32_t y) const { return FilteredEdges::inside(edges_, x, y); }

 private:
  FilteredEdges::Setup edges_;
};

/// Edge e of triangle i: dx (y - from.y) - dy (x - from.x), positive inside.
struct FilteredEdge {
  HWY_INLINE FilteredEdge(const TileTriangles& t, std::size_t i, int e) {
    const int from = kEdgeFrom[e], to = kEdgeTo[e];
    const float sign = is_flipped(t.is_negative[i] != 0, e) ? -1.0f : 1.0f;
    x = t.x[from][i];
    y = t.y[from][i];
    dx = sign * (t.x[to][i] - x);
    dy = sign * (t.y[to][i] - y);
  }

  float x, y, dx, dy;
};

/// As FixedCut. What is uncertain counts as outside and is told after the last row, so that the rows have no
/// way out.
template <int kEdges>
class FilteredCut {
 public:
  HWY_INLINE FilteredCut(const TileTriangles& t, std::size_t i, const int (&cutting)[3], const PixelBox& box,
                         const PixelBox& tile)
      : first_column_(box.x0), error_(hn::Set(kFloats, t.error[i])) {
    const float x = static_cast<float>(tile.x0 + box.x0) + 0.5f;
    const float y = static_cast<float>(tile.y0 + box.y0) + 0.5f;
    for (int k = 0; k < kEdges; ++k) {
      const FilteredEdge edge(t, i, cutting[k]);
      first_[k] = edge.dx * (y - edge.y) - edge.dy * (x - edge.x);
      per_column_[k] = edge.dy;
      per_row_[k] = hn::Set(kFloats, edge.dx);
    }
  }

  HWY_INLINE void start(Integer columns, std::int32_t) {
    least_ = hn::Set(kFloats, std::numeric_limits<float>::infinity());
    const Float steps = hn::ConvertTo(kFloats, hn::Sub(columns, integer(first_column_)));
    for (int k = 0; k < kEdges; ++k)
      value_[k] = hn::Sub(hn::Set(kFloats, first_[k]), hn::Mul(hn::Set(kFloats, per_column_[k]), steps));
  }

  HWY_INLINE IntegerMask next_row(IntegerMask in_box) {
    if constexpr (kEdges == 0) return in_box;
    Float smallest = value_[0];
    for (int k = 1; k < kEdges; ++k) smallest = hn::Min(smallest, value_[k]);
    for (int k = 0; k < kEdges; ++k) value_[k] = hn::Add(value_[k], per_row_[k]);
    least_ = hn::Min(least_, hn::Abs(smallest));
    return hn::And(in_box, hn::RebindMask(kIntegers, hn::Gt(smallest, error_)));
  }
  /// Columns of `in_box` in which a sample is uncertain, of the rows since start() or since this was asked
  /// last.
  HWY_INLINE IntegerMask take_uncertain(IntegerMask in_box) {
    const IntegerMask uncertain = hn::And(in_box, hn::RebindMask(kIntegers, hn::Le(least_, error_)));
    least_ = hn::Set(kFloats, std::numeric_limits<float>::infinity());
    return uncertain;
  }

 private:
  std::int32_t first_column_;
  Float error_, least_, value_[3], per_row_[3];
  float first_[3], per_column_[3];
};

/// What the loops need of a mode.
struct FilteredArithmetic {
  using Mode = Filtered;
  static constexpr bool kIsExact = false;
  using Coordinate = Float;
  using Small = FilteredSmall;
  using Triangles = FilteredTileTriangles;
  template <int kEdges>
  using Cut = FilteredCut<kEdges>;

  static HWY_INLINE Float coordinate(Float pixels) { return pixels; }
  static HWY_INLINE EdgeCut cut_by(const TileTriangles& t, std::size_t i, int e, const LaneBox& parts,
                                   const PixelBox& tile) {
    const FilteredEdge edge(t, i, e);
    const auto set = [](float v) HWY_ATTR { return hn::Set(kFloats, v); };
    const auto [smallest, largest] =
        range_of_edge(set(edge.dx), set(edge.dy), set(edge.x), set(edge.y), corner_samples(parts, tile));
    const Float error = set(t.error[i]);
    return {hn::RebindMask(kIntegers, hn::Lt(largest, hn::Neg(error))),
            hn::RebindMask(kIntegers, hn::Le(smallest, error))};
  }
};

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
