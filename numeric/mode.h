// A numeric mode is the exact arithmetic of coverage and depth: two scalar functions with every operation in
// order.
//
// A mode M provides, besides its names and its error bound:
//   M::Real       format of the screen vertices that geometry hands over
//   M::kDepthFunction   what the depth of a vertex is
//   M::Prepared   what is computed once per triangle; holds `box`, the pixels it can cover, and `rank`
//   M::prepare(triangle, grid, rank)   gives a Prepared; a triangle that draws nothing has an empty box. The
//                 triangle must outlive the keys made of it
//   M::inside_edge(prepared, e, x, y)  edge test e of three at the sample of pixel (x, y)
//   M::kMonotone  whether the pixels of a row that pass an edge test form one half-line, so that spans can be
//                 searched
//   M::inside(prepared, x, y)   all three edge tests; covers(prepared, x, y) is inside() within the box
//   M::edge_value(prepared, e, x, y)   the number that the test of edge e looks at, for explanations
//   M::depth(prepared, x, y)    depth at the sample; always within the depths of the corners
//   M::Key, M::key(depth, rank) keys order fragments: the smallest key owns a pixel
//   M::kClear     key of an empty pixel: every fragment nearer than the far plane is smaller
//   M::value(key), M::output_depth(key, map), M::rank(key)  what resolve needs back
// and may provide, where a run of pixels is cheaper than its pixels (same results):
//   M::inside_run(prepared, x, y, n)   bit i of the answer is inside(prepared, x + i, y); n <= 64, and the
//   run
//                 does not cross a column that is a multiple of 64
//   M::depth_run(prepared, x, y, n, depths)   depths[i] = depth(prepared, x + i, y)
//
// A mode's bits do not depend on the strategy, the threads, the tiles or the order of triangles (Invariant
// 0); ModeInfo says where they may depend on the CPU or the compiler.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <compare>
#include <concepts>
#include <cstdint>
#include <string_view>

#include "numeric/bound.h"
#include "numeric/screen.h"

namespace rasterbench {

/// Pixels x0 <= x < x1, y0 <= y < y1.
struct PixelBox {
  std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  bool operator==(const PixelBox&) const = default;
  bool empty() const { return x0 >= x1 || y0 >= y1; }
  bool contains(std::int32_t x, std::int32_t y) const { return x >= x0 && x < x1 && y >= y0 && y < y1; }
};

inline PixelBox intersect(const PixelBox& a, const PixelBox& b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

/// Monotone map of a float to unsigned integers; -0 and +0 map alike. NaN is not an input.
inline std::uint32_t encode(float depth) {
  const auto bits = std::bit_cast<std::uint32_t>(depth + 0.0f);
  return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}
inline std::uint64_t encode(double depth) {
  const auto bits = std::bit_cast<std::uint64_t>(depth + 0.0);
  return bits >> 63 ? ~bits : bits | (std::uint64_t{1} << 63);
}

inline float decode(std::uint32_t code) {
  return std::bit_cast<float>(code & 0x80000000u ? code & 0x7fffffffu : ~code);
}
inline double decode(std::uint64_t code) {
  return std::bit_cast<double>(code >> 63 ? code & ~(std::uint64_t{1} << 63) : ~code);
}

/// (depth, rank) in 64 bits: encode(depth) << 32 | rank. Ordered as an integer, so that one atomic minimum
/// decides a pixel. A depth of a wider format is rounded once.
template <DepthFunction Function>
struct PackedFloatKeys {
  using Key = std::uint64_t;
  static constexpr DepthFunction kDepthFunction = Function;
  static constexpr float kFar = static_cast<float>(far_value(Function));
  // encode(kFar), of 1, 0 and -1: encode() itself is no constant expression, since it adds zeros.
  static constexpr Key kFarCode = kFar > 0 ? 0xbf800000u : kFar < 0 ? 0x407fffffu : 0x80000000u;
  static constexpr Key kClear = (kFarCode << 32) - 1;
  template <class Depth>
  static Key key(Depth depth, std::uint32_t rank) {
    return Key{encode(static_cast<float>(depth))} << 32 | rank;
  }
  static double value(Key key) {
    return key == kClear ? double{kFar} : double{decode(static_cast<std::uint32_t>(key >> 32))};
  }
  static float output_depth(Key key, const DepthMap& map = {}) {
    if (key == kClear) return 1.0f;
    const float depth = decode(static_cast<std::uint32_t>(key >> 32));
    if constexpr (Function == DepthFunction::kNdc) return depth;
    return static_cast<float>(map.offset + map.scale * double{depth});
  }
  static std::uint32_t rank(Key key) { return static_cast<std::uint32_t>(key); }
};
using PackedKeys = PackedFloatKeys<DepthFunction::kNdc>;

/// (depth, rank) in 64 bits, the depth d in fixed point: round((d + 1) / 2 * (2^Bits - 1)), ties to even.
template <int Bits>
struct UnormKeys {
  using Key = std::uint64_t;
  static constexpr DepthFunction kDepthFunction = DepthFunction::kNdc;
  static constexpr std::uint32_t kMax = static_cast<std::uint32_t>((std::uint64_t{1} << Bits) - 1);
  static constexpr Key kClear = (Key{kMax} << 32) - 1;
  static Key key(double depth, std::uint32_t rank) {
    const double unit = std::clamp(depth * 0.5 + 0.5, 0.0, 1.0);  // -1 lies on the near plane, give or take
    return static_cast<Key>(std::nearbyint(unit * kMax)) << 32 | rank;
  }
  static double value(Key key) { return key == kClear ? 1 : static_cast<double>(key >> 32) / kMax * 2 - 1; }
  static float output_depth(Key key, const DepthMap& = {}) { return static_cast<float>(value(key)); }
  static std::uint32_t rank(Key key) { return static_cast<std::uint32_t>(key); }
};

/// (depth, rank) where the depth has 64 bits: no single word holds it, so atomics cannot decide a pixel.
struct WideKey {
  std::uint64_t depth;
  std::uint32_t rank;
  auto operator<=>(const WideKey&) const = default;
};
struct WideKeys {
  using Key = WideKey;
  static constexpr DepthFunction kDepthFunction = DepthFunction::kNdc;
  static constexpr Key kClear{0xbff0000000000000u - 1, 0xffffffffu};  // 0xbff0... = encode(1.0)
  static Key key(double depth, std::uint32_t rank) { return {encode(depth), rank}; }
  static double value(const Key& key) { return key == kClear ? 1 : decode(key.depth); }
  static float output_depth(const Key& key, const DepthMap& = {}) { return static_cast<float>(value(key)); }
  static std::uint32_t rank(const Key& key) { return key.rank; }
};

/// Names and promises of a mode, for lists and reports.
struct ModeInfo {
  std::string_view name;
  std::string_view vertices;      ///< format of the screen vertices
  std::string_view edges;         ///< arithmetic of the edge functions
  std::string_view depth;         ///< arithmetic and format of the depth
  std::string_view bound;         ///< the error bound in words
  std::string_view bound_source;  ///< where the bound comes from
  ModeBound numbers = {};         ///< the same for the machine
  DepthFunction depth_function = DepthFunction::kNdc;
  /// The same bits on every CPU and from every compiler that keeps to IEEE 754; if not, the bits are stable
  /// on one type of CPU and one compiler. (The same bits whatever the threads, tiles and order: always.)
  bool same_on_every_cpu = true;
  bool has_screen_triangles = true;   ///< false: rays are cast, so that the oracle has nothing to judge
  std::string_view unavailable = {};  ///< why this CPU or this build cannot run the mode, or empty
};

template <class Mode>
concept NumericMode = requires(const ScreenTriangle<typename Mode::Real>& triangle,
                               const typename Mode::Prepared& prepared, typename Mode::Key key) {
  {
    Mode::prepare(triangle, SampleGrid{FillRule::kClosed}, std::uint32_t{})
    } -> std::same_as<typename Mode::Prepared>;
  { Mode::inside_edge(prepared, 0, 0, 0) } -> std::same_as<bool>;
  { Mode::inside(prepared, 0, 0) } -> std::same_as<bool>;
  { Mode::edge_value(prepared, 0, 0, 0) } -> std::convertible_to<double>;
  { Mode::key(Mode::depth(prepared, 0, 0), std::uint32_t{}) } -> std::same_as<typename Mode::Key>;
  { Mode::output_depth(key, DepthMap{}) } -> std::same_as<float>;
  { Mode::value(key) } -> std::same_as<double>;
  { Mode::kDepthFunction } -> std::convertible_to<DepthFunction>;
  { Mode::kMonotone } -> std::convertible_to<bool>;
  { prepared.box } -> std::convertible_to<PixelBox>;
};

/// Modes whose key is one 64-bit word.
template <class Mode>
concept PackedKeyMode = NumericMode<Mode> && std::same_as<typename Mode::Key, std::uint64_t>;

/// Modes whose edge tests split a row once.
template <class Mode>
concept MonotoneMode = NumericMode<Mode> && Mode::kMonotone;

/// Modes that offer runs of pixels.
template <class Mode>
concept RunMode = NumericMode<Mode> && requires(const typename Mode::Prepared& prepared) {
  { Mode::inside_run(prepared, 0, 0, 1) } -> std::same_as<std::uint64_t>;
};

/// The specification of coverage: the bounding box is part of it. A mode that counts has a covers() of its
/// own.
template <NumericMode Mode>
bool covers(const typename Mode::Prepared& prepared, std::int32_t x, std::int32_t y) {
  if constexpr (requires { Mode::covers(prepared, x, y); }) return Mode::covers(prepared, x, y);
  return prepared.box.contains(x, y) && Mode::inside(prepared, x, y);
}

/// Swaps a and b unless a comes first in the order (x, y, d).
template <class Real>
void sort_corners(ScreenTriangle<Real>& t, int a, int b) {
  const bool ordered =
      t.x[a] != t.x[b] ? t.x[a] < t.x[b] : (t.y[a] != t.y[b] ? t.y[a] < t.y[b] : t.d[a] <= t.d[b]);
  if (ordered) return;
  std::swap(t.x[a], t.x[b]);
  std::swap(t.y[a], t.y[b]);
  std::swap(t.d[a], t.d[b]);
}

/// Corners in lexicographic order: both triangles at an edge then evaluate the same expression for it, so
/// that no centre is lost or claimed twice, and depth does not depend on the order or winding in which a
/// triangle was given.
template <class Real>
ScreenTriangle<Real> canonical(ScreenTriangle<Real> t) {
  sort_corners(t, 0, 1);
  sort_corners(t, 1, 2);
  sort_corners(t, 0, 1);
  return t;
}

/// The edges of a triangle in canonical order: both triangles at an edge then see it run the same way.
inline constexpr int kEdgeFrom[3] = {0, 1, 0};
inline constexpr int kEdgeTo[3] = {1, 2, 2};

/// Whether the sign of edge e is turned so that the inside is positive: edge 02 runs against the loop
/// 0 -> 1 -> 2 -> 0.
constexpr bool is_flipped(bool area_is_negative, int e) { return area_is_negative != (e == 2); }

/// Top-left: whether a sample on an edge with direction (dx, dy), the inside turned positive, belongs to the
/// triangle. y points down: the inside is to the right of an edge where dy < 0 (a left edge), below a level
/// one where dx > 0.
template <class Number>
constexpr bool owns_edge(Number dx, Number dy) {
  return dy < 0 || (dy == 0 && dx > 0);
}

/// Pixels whose samples lie within the corners' extents, edges included. Subtracting one half in double is
/// exact wherever the result can decide a pixel of the image.
template <class Real>
PixelBox sample_box(const ScreenTriangle<Real>& t) {
  const double low_x = std::min({t.x[0], t.x[1], t.x[2]}), high_x = std::max({t.x[0], t.x[1], t.x[2]});
  const double low_y = std::min({t.y[0], t.y[1], t.y[2]}), high_y = std::max({t.y[0], t.y[1], t.y[2]});
  return {static_cast<std::int32_t>(std::ceil(low_x - 0.5)),
          static_cast<std::int32_t>(std::ceil(low_y - 0.5)),
          static_cast<std::int32_t>(std::floor(high_x - 0.5)) + 1,
          static_cast<std::int32_t>(std::floor(high_y - 0.5)) + 1};
}

/// A mode of an edge arithmetic and a depth arithmetic. Edges has Real, Setup, kMonotone, corners() (the
/// canonical and, for fixed point, snapped triangle), setup() (false: draws nothing), value(),
/// inside_edge() and, where all three at once are cheaper, inside(); Depth is as in depth.h.
template <class Edges, class Depth>
struct Combined : Depth::Keys {
  using Real = typename Edges::Real;
  static constexpr bool kMonotone = Edges::kMonotone;

  struct Prepared : Edges::Setup {
    PixelBox box;
    typename Depth::Setup plane;
    std::uint32_t rank;
  };

  static Prepared prepare(const ScreenTriangle<Real>& triangle, const SampleGrid& grid, std::uint32_t rank) {
    const ScreenTriangle<Real> t = Edges::corners(triangle);
    Prepared p{};
    p.rank = rank;
    if (!Edges::setup(t, grid, p)) return p;  // draws nothing: the box stays empty
    p.box = sample_box(t);
    p.plane = Depth::setup(t);
    return p;
  }

  static bool inside_edge(const Prepared& p, int e, std::int32_t x, std::int32_t y) {
    return Edges::inside_edge(p, e, x, y);
  }

  static bool inside(const Prepared& p, std::int32_t x, std::int32_t y) {
    if constexpr (requires { Edges::inside(p, x, y); }) return Edges::inside(p, x, y);
    return inside_edge(p, 0, x, y) && inside_edge(p, 1, x, y) && inside_edge(p, 2, x, y);
  }

  static auto edge_value(const Prepared& p, int e, std::int32_t x, std::int32_t y) {
    return Edges::value(p, e, x, y);
  }

  static auto depth(const Prepared& p, std::int32_t x, std::int32_t y) { return Depth::at(p.plane, x, y); }
};

}  // namespace rasterbench
