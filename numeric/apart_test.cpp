// Modes that are compiled apart: fused multiply-adds against std::fma, and what -ffast-math must not bring
// along.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "numeric/coverage_testing.h"

namespace rasterbench {
namespace {

/// a*b - c*d and a*b + c as GCC contracts them.
float fused_difference(float a, float b, float c, float d) { return std::fma(a, b, -(c * d)); }

template <class Mode>
class Fused : public EveryMode<Mode> {};
using FusedModes = testing::Types<F32Fma, F32PlaneFma, TwoProductFma>;
TYPED_TEST_SUITE(Fused, FusedModes, ModeNames);

/// The edge function as the mode's description has it.
template <class Mode>
float literal_value(const typename Mode::Prepared& p, int e, int x, int y) {
  if constexpr (std::is_same_v<Mode, TwoProductFma>) {
    const float sx = 2 * (static_cast<float>(x) + 0.5f) / p.width - 1;
    const float sy = 1 - 2 * (static_cast<float>(y) + 0.5f) / p.height;
    const int next = (e + 1) % 3;
    return fused_difference(p.px[e] - sx, p.py[next] - sy, p.px[next] - sx, p.py[e] - sy);
  } else {
    const float sx = static_cast<float>(x) + 0.5f, sy = static_cast<float>(y) + 0.5f;
    if constexpr (std::is_same_v<Mode, F32PlaneFma>)
      return fused_difference(p.dx[e], sy, p.dy[e], sx) + p.c[e];
    else
      return fused_difference(p.dx[e], sy - p.ay[e], p.dy[e], sx - p.ax[e]);
  }
}

TYPED_TEST(Fused, EdgeFunctionsAreThoseOfTheDescription) {
  Random random(95);
  for (int i = 0; i < 300; ++i) {
    const auto t = random_sliver(random, 60);
    const auto prepared = prepare<TypeParam>(t[0], t[1], t[2], FillRule::kClosed);
    for (int k = 0; k < 50; ++k) {
      const int x = static_cast<int>(random.bits() % 64), y = static_cast<int>(random.bits() % 64);
      float values[3];
      for (int e = 0; e < 3; ++e) {
        values[e] = TypeParam::edge_value(prepared, e, x, y);
        ASSERT_EQ(values[e], (literal_value<TypeParam>(prepared, e, x, y)));
      }
      bool inside = values[0] * values[1] >= 0 && values[0] * values[2] >= 0;
      if constexpr (!std::is_same_v<TypeParam, TwoProductFma>)
        inside = values[0] >= 0 && values[1] >= 0 && values[2] >= 0;
      ASSERT_EQ(TypeParam::inside(prepared, x, y), inside);
    }
  }
}

TEST(Fused, DepthsAreThoseOfTheDescription) {
  if (find_mode("f32-fma")->unavailable != "") GTEST_SKIP() << find_mode("f32-fma")->unavailable;
  Random random(96);
  int contracted = 0;
  for (int i = 0; i < 300; ++i) {
    const auto corners = random_sliver(random, 60);
    const auto t = canonical(screen_triangle<float>(corners[0], corners[1], corners[2]));
    const auto prepared = F32Fma::prepare(t, FillRule::kClosed, 0);
    const auto plain = F32::prepare(t, FillRule::kClosed, 0);
    const float x1 = t.x[1] - t.x[0], y1 = t.y[1] - t.y[0], d1 = t.d[1] - t.d[0];
    const float x2 = t.x[2] - t.x[0], y2 = t.y[2] - t.y[0], d2 = t.d[2] - t.d[0];
    const float area = fused_difference(x1, y2, y1, x2);
    if (area == 0) continue;
    const float gx = fused_difference(d1, y2, d2, y1) / area, gy = fused_difference(d2, x1, d1, x2) / area;
    for (int x = 0; x < 60; ++x) {
      const float along_y = std::fma(gy, 7.5f - t.y[0], t.d[0]);
      const float depth = std::fma(gx, static_cast<float>(x) + 0.5f - t.x[0], along_y);
      ASSERT_EQ(F32Fma::depth(prepared, x, 7), std::clamp(depth, prepared.low, prepared.high));
      contracted += F32Fma::depth(prepared, x, 7) != F32::depth(plain, x, 7);
    }
  }
  EXPECT_GT(contracted, 100);
}

TEST(Fused, ChangesWhatIsCovered) {
  if (find_mode("f32-fma")->unavailable != "") GTEST_SKIP() << find_mode("f32-fma")->unavailable;
  // An edge that ends at a centre: products of the same differences cancel exactly, fused they do not. The
  // two sides of the edge see opposite numbers, so that one of them loses the centre.
  const Point from{0.3, 0.1}, to{6.5, 4.5}, left{1, 9}, right{9, 1};
  const auto covers_end = [&]<class Mode>(const Point& third) {
    return covers<Mode>(prepare<Mode>(from, to, third, FillRule::kClosed), 6, 4);
  };
  EXPECT_TRUE(covers_end.template operator()<F32>(left));
  EXPECT_TRUE(covers_end.template operator()<F32>(right));
  EXPECT_NE(covers_end.template operator()<F32Fma>(left), covers_end.template operator()<F32Fma>(right));
}

/// Whether this thread's arithmetic keeps denormals.
bool keeps_denormals() {
  volatile float smallest = std::numeric_limits<float>::min();
  volatile float half = smallest / 2;  // a denormal result
  volatile float again = half * 2;     // a denormal operand
  return half != 0 && again == smallest;
}

TEST(Fastmath, DoesNotFlushDenormalsInTheProcess) {
  // A program that is linked with -ffast-math does: its start-up code sets FTZ and DAZ.
  const auto prepared = prepare<F32Fastmath>({1, 1}, {9, 2}, {3, 8}, FillRule::kClosed);
  EXPECT_TRUE(covers<F32Fastmath>(prepared, 4, 3));
  EXPECT_TRUE(keeps_denormals());
  bool in_thread = false;
  std::jthread([&] { in_thread = keeps_denormals(); }).join();
  EXPECT_TRUE(in_thread);
#if defined(__SSE__)
  constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
  EXPECT_EQ(_mm_getcsr() & (kFlushToZero | kDenormalsAreZero), 0u);
#endif
}

template <class Mode>
class Fastmath : public testing::Test {};
using FastmathModes = testing::Types<F32Fastmath, TwoProductFastmath>;
TYPED_TEST_SUITE(Fastmath, FastmathModes, ModeNames);

TYPED_TEST(Fastmath, DrawsRoughlyTheSameTriangle) {
  // Unbounded: nothing is promised. But a triangle that rounding does not touch is drawn.
  const Point a{2.25, 1.25}, b{13.25, 3.75}, c{5.75, 14.25};
  const auto prepared = prepare<TypeParam>(a, b, c, FillRule::kClosed);
  const auto plain = prepare<F64>(a, b, c, FillRule::kClosed);
  int covered = 0;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) {
      covered += covers<F64>(plain, x, y);
      EXPECT_EQ(covers<TypeParam>(prepared, x, y), covers<F64>(plain, x, y)) << x << "," << y;
    }
  EXPECT_GT(covered, 50);
}

}  // namespace
}  // namespace rasterbench
