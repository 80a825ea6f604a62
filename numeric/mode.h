// A numeric mode is the exact arithmetic of coverage and depth: two scalar functions with every operation in
// order.
//
// A mode M provides, besides its names and its error bound:
//   M::Real       format of the screen vertices that geometry hands over
//   M::Prepared   what is computed once per triangle; holds `box`, the pixels it can cover
//   M::prepare(triangle, fill, rank)   gives a Prepared; a triangle that draws nothing has an empty box
//   M::inside_edge(prepared, e, x, y)  edge test e of three at the sample of pixel (x, y); in a row, the
//                 pixels that pass form one half-line (monotone), so that spans can be searched
//   M::inside(prepared, x, y)   all three edge tests; covers(prepared, x, y) is inside() within the box
//   M::depth(prepared, x, y)    depth at the sample; always within the depths of the corners
//   M::Key, M::key(depth, rank) keys order fragments: the smallest key owns a pixel
//   M::kClear     key of an empty pixel: every fragment with depth < 1 is smaller
//   M::output_depth(key), M::rank(key)  what resolve needs back
//
// No fused multiply-add, no approximate reciprocal: a mode's bits are the same on every CPU (Invariant 0).
#pragma once

#include <algorithm>
#include <bit>
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
/// decides a pixel.
struct PackedKeys {
  using Key = std::uint64_t;
  static constexpr Key kClear = (std::uint64_t{0xbf800000u} << 32) - 1;  // 0xbf800000 = encode(1.0f)
  static Key key(float depth, std::uint32_t rank) { return std::uint64_t{encode(depth)} << 32 | rank; }
  static float output_depth(Key key) {
    return key == kClear ? 1.0f : decode(static_cast<std::uint32_t>(key >> 32));
  }
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
  static constexpr Key kClear{0xbff0000000000000u - 1, 0xffffffffu};  // 0xbff0... = encode(1.0)
  static Key key(double depth, std::uint32_t rank) { return {encode(depth), rank}; }
  static float output_depth(const Key& key) {
    return key == kClear ? 1.0f : static_cast<float>(decode(key.depth));
  }
  static std::uint32_t rank(const Key& key) { return key.rank; }
};

/// Names and promises of a mode, for lists and reports.
struct ModeInfo {
  std::string_view name;
  std::string_view vertices;  ///< format of the screen vertices
  std::string_view edges;     ///< arithmetic of the edge functions
  std::string_view depth;     ///< arithmetic and format of the depth
  std::string_view bound;     ///< the error bound in words
  ModeBound numbers;          ///< the same for the machine
};

template <class Mode>
concept NumericMode = requires(const ScreenTriangle<typename Mode::Real>& triangle,
                               const typename Mode::Prepared& prepared, typename Mode::Key key) {
  { Mode::prepare(triangle, FillRule::kClosed, std::uint32_t{}) } -> std::same_as<typename Mode::Prepared>;
  { Mode::inside_edge(prepared, 0, 0, 0) } -> std::same_as<bool>;
  { Mode::inside(prepared, 0, 0) } -> std::same_as<bool>;
  { Mode::key(Mode::depth(prepared, 0, 0), std::uint32_t{}) } -> std::same_as<typename Mode::Key>;
  { Mode::output_depth(key) } -> std::same_as<float>;
  { prepared.box } -> std::convertible_to<PixelBox>;
};

/// Modes whose key is one 64-bit word.
template <class Mode>
concept PackedKeyMode = NumericMode<Mode> && std::same_as<typename Mode::Key, std::uint64_t>;

/// The specification of coverage: the bounding box is part of it.
template <NumericMode Mode>
bool covers(const typename Mode::Prepared& prepared, std::int32_t x, std::int32_t y) {
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

/// The plane through three corners, evaluated as clamp((d0 + gy dy) + gx dx): anchored at the first corner
/// and clamped to the corners' depths because rounding would leave them (accuracy.md, section 1). Units of
/// dx, dy are the caller's.
template <class Real>
struct DepthPlane {
  Real d0, gx, gy, low, high;

  /// (x1, y1) and (x2, y2) are corners 1 and 2 relative to corner 0; area2 = x1 y2 - y1 x2, not zero.
  static DepthPlane through(const Real (&d)[3], Real x1, Real y1, Real x2, Real y2, Real area2) {
    const Real d1 = d[1] - d[0];
    const Real d2 = d[2] - d[0];
    return {d[0], (d1 * y2 - d2 * y1) / area2, (d2 * x1 - d1 * x2) / area2, std::min({d[0], d[1], d[2]}),
            std::max({d[0], d[1], d[2]})};
  }

  Real at(Real dx, Real dy) const {
    const Real d = (d0 + gy * dy) + gx * dx;
    const Real raised = d > low ? d : low;  // a NaN (0 times an overflown gradient) becomes low
    return raised < high ? raised : high;
  }
};

}  // namespace rasterbench
