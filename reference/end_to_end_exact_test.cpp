#include "reference/end_to_end_exact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "scene/generator.h"

namespace rasterbench::end_to_end {
namespace {

constexpr int kBits = 1024;

TEST(EndToEndInterval, HoldsTheExactResult) {
  const Interval two(2, 128), root = square_root(2, 128);
  EXPECT_EQ((root * root - two).sign(), Sign::kUnknown);
  EXPECT_EQ((root - two).sign(), Sign::kNegative);
  EXPECT_EQ((root * root * root * root - Interval(3, 128)).sign(), Sign::kPositive);
  EXPECT_EQ((two / root - root).sign(), Sign::kUnknown);
  EXPECT_EQ((two - two).sign(), Sign::kZero);
  // Products and quotients of negative numbers, and of intervals around 0.
  EXPECT_EQ((Interval(-3, 64) * two + Interval(6, 64)).sign(), Sign::kZero);
  EXPECT_EQ((Interval(6, 64) / Interval(-3, 64) + two).sign(), Sign::kZero);
  Interval around(64);
  mpfr_set_si(around.low.get(), -2, MPFR_RNDN);
  mpfr_set_si(around.high.get(), 3, MPFR_RNDN);
  const Interval square = around * around;
  EXPECT_EQ(mpfr_get_d(square.low.get(), MPFR_RNDN), -6);
  EXPECT_EQ(mpfr_get_d(square.high.get(), MPFR_RNDN), 9);
  // An integer of more bits than the interval's.
  const Integer large = (Integer(1) << 100) + 1;
  EXPECT_EQ((Interval(large, 64) - Interval(large, 64)).sign(), Sign::kUnknown);
  for (const double angle : {1e-300, 0.785398163, 1.5, 3.141592653589793}) {
    const Interval tangent = tangent_of_half(angle, 53);
    EXPECT_LE(mpfr_get_d(tangent.low.get(), MPFR_RNDN), mpfr_get_d(tangent.high.get(), MPFR_RNDN));
    EXPECT_NEAR(mpfr_get_d(tangent.low.get(), MPFR_RNDN) / std::tan(angle / 2), 1, 0x1p-50);
  }
}

Scene scene_at(const Vec3d& camera, double theta = 0.785398163) {
  Scene scene;
  scene.parameters.camera = camera;
  scene.parameters.theta = theta;
  scene.parameters.near_plane = 1;  // an integer, as the far plane is: nothing has to be scaled
  return scene;
}

// The numbers that double has for the true camera are those of make_camera but for the rounding of a few
// operations.
TEST(EndToEndExact, TransformIsTheCameraOfTheScene) {
  constexpr int kWidth = 640, kHeight = 361;
  Random random(1);
  double largest = 0;
  const auto compare = [&](double got, double expected) {
    EXPECT_EQ(got == 0, expected == 0);
    if (expected != 0) largest = std::max(largest, std::abs(got / expected - 1));
  };
  for (int i = 0; i < 300; ++i) {
    Scene scene = scene_at({random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)},
                           random.uniform(0.01, 3.1));
    if (i % 10 == 0) scene.parameters.camera.z = 0;
    if (i % 30 == 0) scene.parameters.camera.x = 0;  // on the Y axis
    scene.parameters.width = kWidth;
    scene.parameters.height = kHeight;
    const SampleTransform transform = ExactScene(scene, kWidth, kHeight, kBits).transform();
    const Camera camera = make_camera(scene.parameters);
    const double unit = transform.unit;
    for (double Vec3d::*c : {&Vec3d::x, &Vec3d::y, &Vec3d::z}) {
      double AffineRow::*of_row = c == &Vec3d::x   ? &AffineRow::x
                                  : c == &Vec3d::y ? &AffineRow::y
                                                   : &AffineRow::z;
      compare(transform.u.*c * unit, kWidth * camera.x.*of_row);
      compare(transform.v.*c * unit, kHeight * camera.y.*of_row);
      compare(transform.z.*c * unit, camera.w.*of_row);
    }
    compare(transform.distance * unit, camera.w.w);
  }
  RecordProperty("largest_relative_difference_2^-53", std::to_string(largest * 0x1p53));
  EXPECT_LT(largest, 16 * 0x1p-53);
  EXPECT_GT(largest, 0);
}

// Lines through the view axis on which samples lie exactly; whether a sum of irrational numbers is zero.
TEST(EndToEndExact, RecognisesZero) {
  const auto sign = [](const Vec3d& camera, const RayForm& form, Sample sample) {
    return ExactScene(scene_at(camera), 100, 100, kBits).sign(form, sample);
  };
  // |M| = 3: X D u + Y v = 2 * 3 * 5 - 6 * 5 and D c - w = 3 * 2 - 6.
  EXPECT_EQ(sign({2, 1, 2}, {5, -5, 6, 2}, {2, 6}), Sign::kZero);
  EXPECT_EQ(sign({2, 1, 2}, {5, -5, 7, 2}, {2, 6}), Sign::kNegative);
  EXPECT_EQ(sign({2, 1, 2}, {5, -4, 6, 2}, {2, 6}), Sign::kPositive);
  // |M| = sqrt(3): only term by term.
  EXPECT_EQ(sign({1, 1, 1}, {5, 0, 0, 0}, {0, 6}), Sign::kZero);
  EXPECT_EQ(sign({1, 1, 1}, {0, 5, 0, 0}, {3, 0}), Sign::kZero);
  EXPECT_EQ(sign({1, 1, 1}, {0, 0, 0, 1}, {3, 0}), Sign::kPositive);
  EXPECT_EQ(sign({1, 1, 1}, {1, -2, 0, 0}, {1, 1}), Sign::kNegative);  // sqrt(3) - 2
  // On the Y axis everything but the tangent is rational.
  EXPECT_EQ(sign({0, 3, 0}, {5, -5, 2, 2}, {2, 2}), Sign::kZero);
  EXPECT_EQ(sign({0, 3, 0}, {5, -5, 2, 3}, {2, 2}), Sign::kPositive);
}

TEST(EndToEndExact, GivesUpAtTheHighestPrecision) {
  // Zero is recognised in integers, whatever the precision.
  const Integer large = (Integer(1) << 300) + 1;
  const RayForm zero{5 * large, -5 * large, 6 * large, 2 * large};
  EXPECT_EQ(ExactScene(scene_at({2, 1, 2}), 9, 9, 8).sign(zero, {2, 6}), Sign::kZero);
  // D - 99/70 with D = sqrt(2) is 7e-5.
  const RayForm form{0, 0, 99, 70};
  EXPECT_EQ(ExactScene(scene_at({1, 0, 1}), 9, 9, 8).sign(form, {1, 1}), Sign::kUnknown);
  EXPECT_EQ(ExactScene(scene_at({1, 0, 1}), 9, 9, 64).sign(form, {1, 1}), Sign::kNegative);
}

// What double claims is true, also where edges pass samples closely; and it is silent only there.
TEST(EndToEndFilter, BoundsHold) {
  constexpr int kWidth = 12, kHeight = 9;
  std::int64_t open = 0, open_far_from_edges = 0, visible = 0;
  for (const Vec3d& camera : {Vec3d{0.7, 0.78, 1.51}, {0.05, 0.1, -0.2}, {300, 100, 200}, {0, 0, 2}}) {
    Scene scene = scene_at(camera);
    scene.parameters.near_plane = 1e-3;  // every triangle is in front of the far plane
    scene.parameters.far_plane = 1e9;
    Random random(7);
    const auto coordinate = [&] { return static_cast<float>(random.uniform(-1, 1)); };
    constexpr int kTriangles = 300;
    for (int i = 0; i < kTriangles; ++i) {
      Triangle t = {{coordinate(), coordinate(), coordinate()},
                    {coordinate(), coordinate(), coordinate()},
                    {coordinate(), coordinate(), coordinate()}};
      // One third slivers; one third with an edge through the look-at point, which a sample sees.
      if (i % 3 == 1) t.c = {t.b.x + 1e-6f * t.c.x, t.b.y + 1e-6f * t.c.y, t.b.z + 1e-6f * t.c.z};
      if (i % 3 == 2) t.b = {-t.a.x, -t.a.y, -t.a.z};
      scene.model.triangles.push_back(t);
    }
    const ExactScene exact(scene, kWidth + 1, kHeight, kBits);  // odd: a sample in the middle
    const SampleTransform transform = exact.transform();
    for (int id = 0; id < kTriangles; ++id) {
      const FilteredTriangle filtered(scene.model.triangles[static_cast<std::size_t>(id)], transform);
      const ExactTriangle truth = exact.triangle(id);
      const int orientation = -truth.volume.sign();
      EXPECT_TRUE(filtered.orientation() == 0 || filtered.orientation() == orientation) << id;
      EXPECT_NE(orientation, 0);
      for (int i = 0; i < kHeight; ++i) {
        const FilteredTriangle::Row row = filtered.row(i);
        const IndexRange all{0, kWidth}, rows = filtered.rows(), box = filtered.columns();
        const IndexRange columns = filtered.columns(row, orientation, all);
        for (int j = 0; j <= kWidth; ++j) {
          const Sample sample = {2 * j - kWidth, kHeight - 1 - 2 * i};
          const Sign is_visible = exact.visible(truth, sample, FillRule::kClosed, NearRule::kOff);
          const auto f = filtered.fragment(row, j, orientation);
          ASSERT_NE(is_visible, Sign::kUnknown);
          if (is_visible == Sign::kPositive) {
            ++visible;
            const double distance = exact.distance(truth, sample).value();
            ASSERT_TRUE(f) << id << ": " << j << ", " << i;
            ASSERT_LE(f->nearest, distance);
            ASSERT_GE(f->farthest, distance);
            ASSERT_FALSE(row.misses || i < rows.first || i > rows.last || j < box.first || j > box.last ||
                         j < columns.first || j > columns.last);
          } else {
            ASSERT_FALSE(f && f->covers) << id << ": " << j << ", " << i;
          }
          if (f && !f->covers) {
            ++open;
            open_far_from_edges += 2 * j != kWidth || 2 * i + 1 != kHeight;
          }
        }
      }
    }
  }
  EXPECT_GT(visible, 1000);
  EXPECT_GE(open, 4 * 100);  // the third with an edge through the middle
  EXPECT_EQ(open_far_from_edges, 0);
}

}  // namespace
}  // namespace rasterbench::end_to_end
