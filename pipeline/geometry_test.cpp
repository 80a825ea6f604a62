// The geometry stage without clipping: projection, what is rejected and why, and what is counted.
#include "pipeline/geometry.h"

#include <gtest/gtest.h>

#include <limits>

#include "pipeline/geometry_testing.h"

namespace rasterbench {
namespace {

/// The sum of every reason not to draw.
std::int64_t rejected(const GeometryCounts& c) {
  return c.non_finite + c.zero_area + c.behind_near + c.beyond_far + c.off_screen + c.back_facing;
}

/// The only triangle of `triangle` is rejected, for the reason that `reason` counts, and for no other.
void expect_rejected(const Triangle& triangle, std::int64_t GeometryCounts::*reason,
                     const GeometryOptions& options = {}) {
  const auto result = run_geometry({triangle}, options);
  EXPECT_EQ(result.counts.*reason, 1);
  EXPECT_EQ(rejected(result.counts), 1);
  EXPECT_EQ(result.counts.triangles, 1);
  EXPECT_EQ(result.counts.drawn, 0);
  EXPECT_EQ(result.counts.pieces, 0);
  EXPECT_EQ(result.slots[0].id, -1);
  EXPECT_TRUE(result.extra.empty());
}

const Triangle kInFront{{-1, -1, -2}, {1, -1, -2}, {0, 1, -4}};  // faces the camera

TEST(Geometry, ProjectsToPixels) {
  const auto result = run_geometry({kInFront});
  const auto& t = result.slots[0];
  EXPECT_EQ(t.id, 0);
  // x = 4 + 4 P.x/z, y = 4 - 4 P.y/z, d = 1.25 - 2.25/z; the corners stay in their order.
  EXPECT_EQ(corners_of(t),
            (std::array<CornerOf<float>, 3>{{{2, 6, 0.125f}, {6, 6, 0.125f}, {4, 3, 0.6875f}}}));
  EXPECT_EQ(result.counts.drawn, 1);
  EXPECT_EQ(result.counts.pieces, 1);
  EXPECT_EQ(result.counts.near_clipped, 0);
  EXPECT_EQ(result.counts.guard_clipped, 0);
  EXPECT_EQ(rejected(result.counts), 0);
}

TEST(Geometry, CornersOfTheImageAreThoseOfTheViewport) {
  const Triangle corners{{-2, 2, -2}, {2, 2, -2}, {2, -2, -2}};
  const auto t = run_geometry({corners}, {}, plain_camera(16, 6)).slots[0];
  EXPECT_EQ(t.x[0], 0);
  EXPECT_EQ(t.y[0], 0);
  EXPECT_EQ(t.x[1], 16);
  EXPECT_EQ(t.y[2], 6);
}

TEST(Geometry, CornerSamplingPutsTheOutermostSamplesOnTheCorners) {
  // The PLY contract: column j lies at -1 + 2j/(W-1). Samples are at (j+.5, i+.5) in any case.
  const Camera camera = plain_camera(9, 5, Sampling::kCorner);
  const auto t = run_geometry({Triangle{{-2, 2, -2}, {2, -2, -2}, {1, 0, -2}}}, {}, camera).slots[0];
  EXPECT_EQ(t.x[0], 0.5f);
  EXPECT_EQ(t.y[0], 0.5f);
  EXPECT_EQ(t.x[1], 8.5f);
  EXPECT_EQ(t.y[1], 4.5f);
  EXPECT_EQ(t.x[2], 6.5f);  // 3/4 of the way from 0.5 to 8.5
  EXPECT_EQ(t.y[2], 2.5f);
}

TEST(Geometry, DepthIsMinusOneAtNearAndOneAtFar) {
  const auto t = run_geometry({Triangle{{0, 0, -1}, {1, 0, -9}, {0, 1, -9}}}).slots[0];
  EXPECT_EQ(t.d[0], -1);
  EXPECT_EQ(t.d[1], 1);
}

TEST(Geometry, RejectsWhatIsNotFinite) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (int position = 0; position < 9; ++position)
    for (const float bad : {nan, -nan, inf, -inf}) {
      Triangle t = kInFront;
      Vec3* const corners[] = {&t.a, &t.b, &t.c};
      float* const fields[] = {&corners[position / 3]->x, &corners[position / 3]->y,
                               &corners[position / 3]->z};
      *fields[position % 3] = bad;
      SCOPED_TRACE(position);
      expect_rejected(t, &GeometryCounts::non_finite);
    }
}

TEST(Geometry, RejectsZeroArea) {
  const Vec3 a{-1, -1, -2}, b{1, -1, -2}, c{0, 1, -4};
  for (const Triangle& t :
       {Triangle{a, a, a}, Triangle{a, a, c}, Triangle{a, b, a}, Triangle{a, b, b},
        Triangle{{-1, -1, -2}, {0, 0, -3}, {1, 1, -4}}, Triangle{{0, 0, -2}, {0, 0, -3}, {0, 0, -8}},
        Triangle{{-0.0f, 0, -2}, {0, -0.0f, -2}, {1, 1, -3}}})
    expect_rejected(t, &GeometryCounts::zero_area);
}

TEST(Geometry, KeepsTinyTriangles) {
  // Their area underflows in float32: 1e-30 squared is no float.
  const auto result = run_geometry({Triangle{{0, 0, -2}, {1e-30f, 0, -2}, {0, 1e-30f, -2}}});
  EXPECT_EQ(result.counts.drawn, 1);
}

TEST(Geometry, RejectsWhatLiesBehindTheCameraOrBeforeNear) {
  expect_rejected({{-1, -1, 2}, {1, -1, 3}, {0, 1, 4}}, &GeometryCounts::behind_near);
  expect_rejected({{-1, -1, -0.5f}, {1, -1, -0.75f}, {0, 1, 4}}, &GeometryCounts::behind_near);
  expect_rejected({{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}, &GeometryCounts::behind_near);  // w = 0
}

TEST(Geometry, RejectsWhatLiesBeyondFar) {
  expect_rejected({{-1, -1, -9.5f}, {1, -1, -10}, {0, 1, -100}}, &GeometryCounts::beyond_far);
  expect_rejected({{-1, -1, -9}, {1, -1, -9}, {0, 1, -9}}, &GeometryCounts::beyond_far);  // d = 1: not drawn
  EXPECT_EQ(run_geometry({Triangle{{-1, -1, -8.99f}, {1, -1, -10}, {0, 1, -100}}}).counts.drawn, 1);
}

TEST(Geometry, RejectsWhatMissesTheImage) {
  for (const auto& [dx, dy] : {std::pair{-9.f, 0.f}, {9.f, 0.f}, {0.f, -9.f}, {0.f, 9.f}}) {
    const Triangle t{{-1 + dx, -1 + dy, -2}, {1 + dx, -1 + dy, -2}, {dx, 1 + dy, -4}};
    expect_rejected(t, &GeometryCounts::off_screen);
  }
  // Beyond the shorter side of a picture and within the longer one: 5 to 7 px to the right, or down.
  const Triangle right{{3, 2, -2}, {5, 2, -2}, {4, 3, -2}}, below{{-3, -3, -2}, {-2, -3, -2}, {-2, -5, -2}};
  EXPECT_EQ(run_geometry({right}, {}, plain_camera(4, 8)).counts.off_screen, 1);
  EXPECT_EQ(run_geometry({below}, {}, plain_camera(8, 4)).counts.off_screen, 1);
  // A corner of the image is enough to be looked at.
  EXPECT_EQ(
      run_geometry({Triangle{at_pixel(-5, -5, 2), at_pixel(1, -4, 2), at_pixel(-4, 1, 2)}}).counts.drawn, 1);
}

TEST(Geometry, BackFacesAreDrawnUnlessCulled) {
  const Triangle back{kInFront.c, kInFront.b, kInFront.a};
  const GeometryOptions cull{.cull_back_faces = true};
  EXPECT_EQ(run_geometry({back}).counts.drawn, 1);
  EXPECT_EQ(run_geometry({kInFront}, cull).counts.drawn, 1);
  expect_rejected(back, &GeometryCounts::back_facing, cull);
}

TEST(Geometry, BackFacesAreCulledAfterClipping) {
  // What a triangle shows does not depend on where the near plane or the guard band cuts it.
  const GeometryOptions cull{.cull_back_faces = true};
  const Triangle fronts[] = {
      {{-1, -1, -2}, {1, -1, -2}, {0, -0.9f, 1}},                    // one corner behind the camera
      {{-1, -0.9f, 0}, {1, -0.9f, 0}, {0, -1, -5}},                  // two
      {{-1e6f, -1e6f, -2}, {1e6f, -1e6f, -2}, {0, 1e6f, -2}},        // larger than the guard band
      {{-0.5f, -0.5f, -1}, {0.5f, -0.5f, -0.5f}, {0.1f, 0.8f, -2}},  // a corner exactly on the near plane
      {{0.5f, -0.5f, -0.5f}, {0.1f, 0.8f, -2}, {-0.5f, -0.5f, -1}},
      {{0.1f, 0.8f, -2}, {-0.5f, -0.5f, -1}, {0.5f, -0.5f, -0.5f}},
  };
  for (const Triangle& front : fronts) {
    // Which way it faces, from its normal: towards the camera at the origin.
    const double ux = front.b.x - front.a.x, uy = front.b.y - front.a.y, uz = front.b.z - front.a.z;
    const double vx = front.c.x - front.a.x, vy = front.c.y - front.a.y, vz = front.c.z - front.a.z;
    const double facing = -((uy * vz - uz * vy) * front.a.x + (uz * vx - ux * vz) * front.a.y +
                            (ux * vy - uy * vx) * front.a.z);
    const Triangle reversed{front.c, front.b, front.a};
    const auto& [towards, away] = facing > 0 ? std::pair(front, reversed) : std::pair(reversed, front);
    EXPECT_EQ(run_geometry({towards}, cull).counts.drawn, 1) << &front - fronts;
    EXPECT_EQ(run_geometry({away}, cull).counts.back_facing, 1) << &front - fronts;
    EXPECT_EQ(run_geometry({away}).counts.drawn, 1) << &front - fronts;
  }
}

TEST(Geometry, IdsCountFromTheFirst) {
  const auto result = run_geometry<float>({kInFront, {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, kInFront}, {},
                                          plain_camera(kSide, kSide), 1000);
  EXPECT_EQ(result.slots[0].id, 1000);
  EXPECT_EQ(result.slots[1].id, -1);
  EXPECT_EQ(result.slots[2].id, 1002);
}

TEST(Geometry, CountsAddUp) {
  Random random(41);
  const float inf = std::numeric_limits<float>::infinity();
  std::vector<Triangle> triangles;
  for (int i = 0; i < 5000; ++i) {
    Triangle t = random_triangle(random, i % 2 == 0);
    if (i % 50 == 0) t.b.y = inf;
    if (i % 50 == 1) t.c = t.a;
    triangles.push_back(t);
  }
  for (const NearRule near_rule : {NearRule::kClip, NearRule::kOff})
    for (const bool cull : {false, true}) {
      const auto result = run_geometry(triangles, {near_rule, cull});
      const GeometryCounts& c = result.counts;
      EXPECT_EQ(c.triangles, 5000);
      EXPECT_EQ(c.triangles, rejected(c) + c.drawn);
      EXPECT_EQ(c.non_finite, 100);
      EXPECT_EQ(c.zero_area, 100);
      for (const std::int64_t count : {c.behind_near, c.off_screen, c.drawn, c.guard_clipped})
        EXPECT_GT(count, 0);
      EXPECT_EQ(c.near_clipped > 0, near_rule == NearRule::kClip);
      EXPECT_EQ(c.back_facing > 0, cull);
      const auto drawn =
          std::count_if(result.slots.begin(), result.slots.end(), [](const auto& t) { return t.id >= 0; });
      EXPECT_EQ(c.drawn, drawn);
      EXPECT_EQ(c.pieces, drawn + static_cast<std::int64_t>(result.extra.size()));
      for (std::size_t i = 0; i < result.slots.size(); ++i)
        ASSERT_TRUE(result.slots[i].id == -1 || result.slots[i].id == static_cast<std::int32_t>(i));
      // Further pieces follow in the order of their ids, and belong to triangles that are drawn.
      EXPECT_TRUE(std::is_sorted(result.extra.begin(), result.extra.end(),
                                 [](const auto& a, const auto& b) { return a.id < b.id; }));
      for (const auto& piece : result.extra)
        ASSERT_GE(result.slots[static_cast<std::size_t>(piece.id)].id, 0);
    }
}

TEST(Geometry, CountsAreAddedFieldByField) {
  const GeometryCounts one{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  GeometryCounts sum = one;
  sum += one;
  const std::array got{sum.triangles,    sum.non_finite,    sum.zero_area,   sum.behind_near,
                       sum.beyond_far,   sum.off_screen,    sum.back_facing, sum.drawn,
                       sum.near_clipped, sum.guard_clipped, sum.pieces};
  for (std::size_t i = 0; i < got.size(); ++i) EXPECT_EQ(got[i], 2 * static_cast<std::int64_t>(i + 1));
}

TEST(Geometry, FloatIsDoubleRoundedOnce) {
  Random random(42);
  std::vector<Triangle> triangles;
  for (int i = 0; i < 3000; ++i) triangles.push_back(random_triangle(random, i % 2 == 0));
  const auto single = run_geometry<float>(triangles);
  const auto wide = run_geometry<double>(triangles);
  const auto a = single.pieces();
  const auto b = wide.pieces();
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(single.counts.pieces, wide.counts.pieces);
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].id, b[i].id);
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(a[i].x[k], static_cast<float>(b[i].x[k]));
      ASSERT_EQ(a[i].y[k], static_cast<float>(b[i].y[k]));
      ASSERT_EQ(a[i].d[k], static_cast<float>(b[i].d[k]));
    }
  }
}

}  // namespace
}  // namespace rasterbench
