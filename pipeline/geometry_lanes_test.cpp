// The vectorised geometry stage equals the scalar one to the bit, on every instruction set of this CPU.
#include "pipeline/geometry_lanes.h"

#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "pipeline/geometry_testing.h"

namespace rasterbench {
namespace {

/// Triangles of every fate: drawn as they are, rejected by each test, cut by each plane; the last of them do
/// not fill a vector.
std::vector<Triangle> all_fates() {
  Random random(3);
  const auto coordinate = [&](double reach) { return static_cast<float>(random.uniform(-reach, reach)); };
  std::vector<Triangle> triangles;
  for (int i = 0; i < 1003; ++i) {
    const double reach = i % 3 == 0 ? 4 : i % 3 == 1 ? 40 : 4e5;
    const Vec3 at{coordinate(reach), coordinate(reach), coordinate(12)};
    const auto near_by = [&] {
      return Vec3{at.x + coordinate(2), at.y + coordinate(2), at.z + coordinate(2)};
    };
    Triangle t{near_by(), near_by(), near_by()};
    const float special[] = {
        std::numeric_limits<float>::infinity(),  -std::numeric_limits<float>::infinity(),
        std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::denorm_min(),
        std::numeric_limits<float>::max(),       -0.0f};
    if (i % 17 == 0) t.b.y = special[i / 17 % 6];
    if (i % 19 == 0) t.c = t.a;
    if (i % 23 == 0) t.b = {(t.a.x + t.c.x) / 2, (t.a.y + t.c.y) / 2, (t.a.z + t.c.z) / 2};
    triangles.push_back(t);
  }
  return triangles;
}

template <class Real>
void expect_same_bits(const std::vector<ScreenTriangle<Real>>& a,
                      const std::vector<ScreenTriangle<Real>>& b) {
  using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].id, b[i].id) << i;
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(std::bit_cast<Bits>(a[i].x[k]), std::bit_cast<Bits>(b[i].x[k])) << i;
      ASSERT_EQ(std::bit_cast<Bits>(a[i].y[k]), std::bit_cast<Bits>(b[i].y[k])) << i;
      ASSERT_EQ(std::bit_cast<Bits>(a[i].d[k]), std::bit_cast<Bits>(b[i].d[k])) << i;
    }
  }
}

template <class Real>
class GeometryLanes : public testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(GeometryLanes, Reals);

TYPED_TEST(GeometryLanes, AreTheScalarStageToTheBit) {
  const auto triangles = all_fates();
  SceneNeeds
      nothing;  // without these tests the stage must get triangles that pass them, or may do as it likes
  nothing.far_reject = nothing.off_screen_reject = nothing.zero_area_test = false;
  std::int64_t cut = 0;
  for (const bool cull : {false, true})
    for (const NearRule near_rule : {NearRule::kClip, NearRule::kOff})
      for (const SceneNeeds& needs : {SceneNeeds{}, nothing}) {
        GeometryOptions options{.near_rule = near_rule, .cull_back_faces = cull, .needs = needs};
        const auto expected = run_geometry<TypeParam>(triangles, options, plain_camera(kSide, kSide), 7);
        EXPECT_GT(expected.counts.drawn, 40);
        EXPECT_GT(expected.counts.non_finite, 10);
        cut += expected.counts.guard_clipped + expected.counts.near_clipped;
        for (const Isa isa : all_isas()) {
          if (!is_supported(isa)) continue;
          options.isa = isa;
          const auto result = run_geometry<TypeParam>(triangles, options, plain_camera(kSide, kSide), 7);
          expect_same_bits(result.slots, expected.slots);
          expect_same_bits(result.extra, expected.extra);
          for (const auto count :
               {&GeometryCounts::triangles, &GeometryCounts::non_finite, &GeometryCounts::zero_area,
                &GeometryCounts::behind_near, &GeometryCounts::beyond_far, &GeometryCounts::off_screen,
                &GeometryCounts::back_facing, &GeometryCounts::drawn, &GeometryCounts::near_clipped,
                &GeometryCounts::guard_clipped, &GeometryCounts::pieces})
            EXPECT_EQ(result.counts.*count, expected.counts.*count) << to_string(isa);
        }
      }
  EXPECT_GT(cut, 100);
}

TEST(GeometryLanesOfOneCall, LeaveWhatHasNoLane) {
  const auto triangles = all_fates();
  std::vector<ScreenTriangle<float>> slots(64);
  GeometryCounts counts;
  const ScreenTransform transform = make_screen_transform(plain_camera(kSide, kSide));
  EXPECT_EQ(transform_in_lanes(triangles.data(), 64, 0, transform, {}, slots.data(), 0, counts),
            ~std::uint64_t{0});
  EXPECT_EQ(transform_in_lanes(triangles.data(), 3, 0, transform, {}, slots.data(), 0, counts), 7u);
  if (!is_supported(Isa::kAvx2)) GTEST_SKIP() << "this CPU has no avx2";
  const GeometryOptions options{.isa = Isa::kAvx2};
  EXPECT_EQ(transform_in_lanes(triangles.data(), 3, 0, transform, options, slots.data(), 0, counts), 7u);
  EXPECT_EQ(transform_in_lanes(triangles.data(), 7, 0, transform, options, slots.data(), 0, counts) >> 4, 7u);
}

TEST(ScreenBatches, HoldWhatTheArrayHolds) {
  const auto triangles = all_fates();
  const ScreenTransform transform = make_screen_transform(plain_camera(kSide, kSide));
  constexpr std::size_t kSize = ScreenBatch<float>::kSize;
  ASSERT_GT(triangles.size(), 20u);
  for (const Isa isa : all_isas()) {
    if (!is_supported(isa)) continue;
    for (const std::size_t n : {std::size_t{0}, std::size_t{5}, std::min(kSize, triangles.size())}) {
      const std::span<const Triangle> some(triangles.data(), n);
      const GeometryOptions options{.isa = isa};
      std::vector<ScreenTriangle<float>> slots(n), extra, batch_extra;
      ScreenBatch<float> batch;
      GeometryCounts counts, batch_counts;
      transform_triangles<float>(some, 7, transform, options, slots.data(), extra, counts);
      transform_triangles(some, 7, transform, options, batch, batch_extra, batch_counts);
      EXPECT_EQ(batch_counts.pieces, counts.pieces);
      EXPECT_EQ(batch_extra.size(), extra.size());
      for (std::size_t i = 0; i < kSize; ++i) {
        ASSERT_EQ(batch.ids[i], i < n ? slots[i].id : -1) << to_string(isa) << ' ' << i;
        if (batch.ids[i] < 0) continue;
        for (int corner = 0; corner < 3; ++corner) {
          EXPECT_EQ(batch.x[corner][i], slots[i].x[corner]);
          EXPECT_EQ(batch.y[corner][i], slots[i].y[corner]);
          EXPECT_EQ(batch.d[corner][i], slots[i].d[corner]);
        }
      }
    }
  }
}

}  // namespace
}  // namespace rasterbench
