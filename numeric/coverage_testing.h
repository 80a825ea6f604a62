// Helpers of the unit tests of numeric modes: triangles, owners per pixel, and coverage in exact integers.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "numeric/modes.h"

namespace rasterbench {

/// The list of modes as googletest wants it, so that a new mode is tested by being in AllModes.
template <class Tuple>
struct TestTypes;
template <class... Modes>
struct TestTypes<std::tuple<Modes...>> {
  using Type = testing::Types<Modes...>;
};
using ModeTypes = TestTypes<AllModes>::Type;

struct ModeNames {
  template <class Mode>
  static std::string GetName(int) {
    return std::string(Mode::kInfo.name);
  }
};

inline constexpr FillRule kFillRules[] = {FillRule::kClosed, FillRule::kTopLeft};

/// A corner in pixels.
struct Point {
  double x, y;
  double d = 0.5;
};

template <class Real>
ScreenTriangle<Real> screen_triangle(const Point& a, const Point& b, const Point& c) {
  const auto r = [](double v) { return static_cast<Real>(v); };
  return {{r(a.x), r(b.x), r(c.x)}, {r(a.y), r(b.y), r(c.y)}, {r(a.d), r(b.d), r(c.d)}, 0};
}

template <NumericMode Mode>
typename Mode::Prepared prepare(const Point& a, const Point& b, const Point& c, FillRule fill) {
  return Mode::prepare(screen_triangle<typename Mode::Real>(a, b, c), fill, 0);
}

/// How many triangles cover each pixel of an image.
template <NumericMode Mode>
class Owners {
 public:
  Owners(int width, int height, FillRule fill)
      : bounds_{0, 0, width, height},
        fill_(fill),
        counts_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  void add(const Point& a, const Point& b, const Point& c) { add(prepare<Mode>(a, b, c, fill_)); }

  void add(const typename Mode::Prepared& prepared) {
    const PixelBox box = intersect(prepared.box, bounds_);
    for (int y = box.y0; y < box.y1; ++y)
      for (int x = box.x0; x < box.x1; ++x)
        if (covers<Mode>(prepared, x, y)) ++counts_[index(x, y)];
  }

  int at(int x, int y) const { return counts_[index(x, y)]; }
  int sum() const {
    int sum = 0;
    for (const int count : counts_) sum += count;
    return sum;
  }

 private:
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y * bounds_.x1 + x); }

  PixelBox bounds_;
  FillRule fill_;
  std::vector<int> counts_;
};

__extension__ using Int128 = __int128;

/// A point in integer units, of which a test says how many make a pixel.
struct IntPoint {
  std::int64_t x, y;
};
using IntTriangle = std::array<IntPoint, 3>;

/// (b - a) x (p - a), exact for coordinates up to 2^60.
inline Int128 cross(const IntPoint& a, const IntPoint& b, const IntPoint& p) {
  return Int128{b.x - a.x} * (p.y - a.y) - Int128{b.y - a.y} * (p.x - a.x);
}

/// Exact coverage of `sample`. Top-left is derived here from its geometry and not from the slopes of edges:
/// it is the closed rule for a sample moved to the right by an infinitesimal, and down by a still smaller
/// one.
inline bool exactly_covers(const IntTriangle& t, const IntPoint& sample, FillRule fill) {
  const Int128 area2 = cross(t[0], t[1], t[2]);
  if (area2 == 0) return false;
  for (std::size_t e = 0; e < 3; ++e) {
    IntPoint a = t[e], b = t[(e + 1) % 3];
    if (area2 < 0) std::swap(a, b);
    const Int128 value = cross(a, b, sample);
    if (value < 0) return false;
    if (value > 0 || fill == FillRule::kClosed) continue;
    const Int128 step_right = cross(a, b, {sample.x + 1, sample.y});
    const Int128 step_down = cross(a, b, {sample.x, sample.y + 1});
    if (step_right < 0 || (step_right == 0 && step_down < 0)) return false;
  }
  return true;
}

/// Distance in units from `p` to the line through a and b; infinite where a = b.
inline long double distance_to_line(const IntPoint& a, const IntPoint& b, const IntPoint& p) {
  return std::abs(static_cast<long double>(cross(a, b, p))) /
         std::hypot(static_cast<long double>(b.x - a.x), static_cast<long double>(b.y - a.y));
}

}  // namespace rasterbench
