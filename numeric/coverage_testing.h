// Helpers of the unit tests of numeric modes: which modes a test is for, triangles, owners per pixel, and
// coverage in exact integers.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "numeric/modes.h"
#include "scene/generator.h"

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

/// Tests of every mode that this CPU can run; the others are skipped with their reason.
template <class Mode>
class EveryMode : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto reason = find_mode(Mode::kInfo.name)->unavailable; !reason.empty())
      GTEST_SKIP() << Mode::kInfo.name << ": " << reason;
  }
};

/// Tests of what a bounded mode promises.
template <class Mode>
class BoundedMode : public EveryMode<Mode> {
 protected:
  void SetUp() override {
    EveryMode<Mode>::SetUp();
    if (!Mode::kInfo.numbers.bounded)
      GTEST_SKIP() << Mode::kInfo.name << " is unbounded: it promises nothing";
  }
};

/// Whether the arithmetic is compiled apart (numeric/apart.h).
template <class Mode>
constexpr bool kIsApart = std::is_base_of_v<apart::Setup, typename Mode::Prepared>;

/// Whether an edge function is exactly zero at both of its corners, so that the triangles round a corner
/// share it as the fill rule says. Products of the same differences cancel; fused they leave a rounding, and
/// the other forms round on the way.
template <class Mode>
constexpr bool kIsZeroAtCorners = Mode::kInfo.numbers.edge_form == EdgeForm::kExact ||
                                  (Mode::kInfo.numbers.edge_form == EdgeForm::kCross && !kIsApart<Mode>);

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

/// In an image of 64 x 64 pixels, for modes that ask. Not for modes whose keys need the triangle.
template <NumericMode Mode>
typename Mode::Prepared prepare(const Point& a, const Point& b, const Point& c, FillRule fill) {
  return Mode::prepare(screen_triangle<typename Mode::Real>(a, b, c), SampleGrid{fill, 64, 64}, 0);
}

/// The depth at a sample as a number, whatever the mode's type for it.
template <NumericMode Mode>
double depth_at(const typename Mode::Prepared& prepared, int x, int y) {
  return Mode::depth(prepared, x, y);
}

/// A long thin triangle whose corners are float32 numbers in [1, extent] and whose depths are in [-1, 1].
inline std::array<Point, 3> random_sliver(Random& random, double extent) {
  const auto coordinate = [&](double v) {
    return static_cast<double>(static_cast<float>(std::clamp(v, 1.0, extent)));
  };
  const auto anywhere = [&] { return coordinate(random.uniform(1, extent)); };
  const auto depth = [&] { return static_cast<double>(static_cast<float>(random.uniform(-1, 1))); };
  const Point a{anywhere(), anywhere(), depth()}, b{anywhere(), anywhere(), depth()};
  const double t = random.uniform(), width = std::pow(10.0, random.uniform(-4, 1));
  return {a,
          b,
          {coordinate(a.x + t * (b.x - a.x) + random.uniform(-width, width)),
           coordinate(a.y + t * (b.y - a.y) + random.uniform(-width, width)), depth()}};
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

/// A point in integer units, of which a test says how many make a pixel. Coordinates up to 2^60 in 128 bits,
/// of any size in a big integer.
template <class Integer>
struct IntegerPoint {
  Integer x, y;
};
template <class Integer>
using IntegerTriangle = std::array<IntegerPoint<Integer>, 3>;
using IntPoint = IntegerPoint<Int128>;
using IntTriangle = IntegerTriangle<Int128>;

/// (b - a) x (p - a), exact.
template <class Integer>
Integer cross(const IntegerPoint<Integer>& a, const IntegerPoint<Integer>& b,
              const IntegerPoint<Integer>& p) {
  return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

/// Exact coverage of `sample`. Top-left is derived here from its geometry and not from the slopes of edges:
/// it is the closed rule for a sample moved to the right by an infinitesimal, and down by a still smaller
/// one.
template <class Integer>
bool exactly_covers(const IntegerTriangle<Integer>& t, const IntegerPoint<Integer>& sample, FillRule fill) {
  const Integer area2 = cross(t[0], t[1], t[2]);
  if (area2 == 0) return false;
  for (std::size_t e = 0; e < 3; ++e) {
    IntegerPoint<Integer> a = t[e], b = t[(e + 1) % 3];
    if (area2 < 0) std::swap(a, b);
    const Integer value = cross(a, b, sample);
    if (value < 0) return false;
    if (value > 0 || fill == FillRule::kClosed) continue;
    const Integer step_right = cross(a, b, {sample.x + 1, sample.y});
    const Integer step_down = cross(a, b, {sample.x, sample.y + 1});
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
