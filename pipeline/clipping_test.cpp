// The geometry stage where it cuts: the near plane and the guard band.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "numeric/modes.h"
#include "pipeline/geometry_testing.h"

namespace rasterbench {
namespace {

template <class Real>
std::set<CornerOf<Real>> corner_set(const std::vector<ScreenTriangle<Real>>& pieces) {
  std::set<CornerOf<Real>> all;
  for (const auto& piece : pieces)
    for (const auto& corner : corners_of(piece)) all.insert(corner);
  return all;
}

TEST(NearClip, OneCornerBeforeNearLeavesTwoPieces) {
  // The edges from z = 2 to z = 0 meet the near plane half-way, at x = -0.5 and 0.5, y = -0.5.
  const auto result =
      run_geometry({Triangle{{-1, -1, -2}, {1, -1, -2}, {0, 0, 0}}}, {}, plain_camera(kSide, kSide), 5);
  EXPECT_EQ(result.counts.near_clipped, 1);
  EXPECT_EQ(result.counts.drawn, 1);
  EXPECT_EQ(result.counts.pieces, 2);
  ASSERT_EQ(result.extra.size(), 1u);
  EXPECT_EQ(result.slots[0].id, 5);
  EXPECT_EQ(result.extra[0].id, 5);
  EXPECT_EQ(corner_set(result.pieces()),
            (std::set<CornerOf<float>>{{2, 6, 0.125f}, {6, 6, 0.125f}, {2, 6, -1.0f}, {6, 6, -1.0f}}));
}

TEST(NearClip, TwoCornersBeforeNearLeaveOnePiece) {
  const auto result = run_geometry({Triangle{{-1, 1, 0}, {0, 0, -2}, {1, 1, 0}}});
  EXPECT_EQ(result.counts.near_clipped, 1);
  EXPECT_EQ(result.counts.pieces, 1);
  EXPECT_TRUE(result.extra.empty());
  EXPECT_EQ(corner_set(result.pieces()),
            (std::set<CornerOf<float>>{{4, 4, 0.125f}, {2, 2, -1.0f}, {6, 2, -1.0f}}));
}

TEST(NearClip, DoesNotTouchWhatEndsAtThePlane) {
  const auto result = run_geometry({Triangle{{-1, -1, -1}, {1, -1, -1}, {0, 1, -4}}});
  EXPECT_EQ(result.counts.near_clipped, 0);
  EXPECT_EQ(result.counts.pieces, 1);
  EXPECT_EQ(result.slots[0].d[0], -1);
}

TEST(NearClip, CutCornersLieOnThePlaneExactly) {
  Random random(51);
  int cut = 0;
  for (int i = 0; i < 2000; ++i) {
    const Triangle t = random_triangle(random);
    const int behind = (t.a.z > -1) + (t.b.z > -1) + (t.c.z > -1);
    const auto result = run_geometry<double>({t});
    if (result.counts.drawn == 0) continue;
    EXPECT_EQ(result.counts.near_clipped, behind > 0 ? 1 : 0);
    if (result.counts.guard_clipped > 0) continue;
    EXPECT_EQ(result.counts.pieces, behind == 1 ? 2 : 1);
    int on_plane = 0;
    for (const auto& [x, y, d] : corner_set(result.pieces())) {
      EXPECT_GE(d, -1);
      on_plane += d == -1;
    }
    EXPECT_EQ(on_plane, behind > 0 ? 2 : 0);
    cut += behind > 0;
  }
  EXPECT_GT(cut, 300);
}

template <class Real>
void neighbours_agree() {
  Random random(52);
  int shared = 0;
  for (int i = 0; i < 2000; ++i) {
    const Triangle t = random_triangle(random), u = random_triangle(random);
    if ((t.a.z > -1) == (t.b.z > -1)) continue;  // the shared edge a b does not cross the near plane
    // The neighbour has the edge in the other direction, and its corners begin elsewhere.
    const Triangle neighbour = i % 3 == 0   ? Triangle{t.b, t.a, u.c}
                               : i % 3 == 1 ? Triangle{u.c, t.b, t.a}
                                            : Triangle{t.a, u.c, t.b};
    const auto first = run_geometry<Real>({t}), second = run_geometry<Real>({neighbour});
    if (first.counts.drawn + second.counts.drawn < 2 ||
        first.counts.guard_clipped + second.counts.guard_clipped > 0)
      continue;
    // Where the edge meets the plane, roughly; both must have a corner there, with the same bits.
    const double s = (-1.0 - t.a.z) / (double{t.b.z} - t.a.z);
    const double x = 4 + 4 * (t.a.x + s * (t.b.x - t.a.x)), y = 4 - 4 * (t.a.y + s * (t.b.y - t.a.y));
    const auto near_cut = [&](const std::set<CornerOf<Real>>& corners) {
      std::set<CornerOf<Real>> found;
      for (const auto& c : corners)
        if (std::get<2>(c) == -1 && std::hypot(std::get<0>(c) - x, std::get<1>(c) - y) < 1e-4)
          found.insert(c);
      return found;
    };
    const auto a = near_cut(corner_set(first.pieces())), b = near_cut(corner_set(second.pieces()));
    ASSERT_EQ(a.size(), 1u) << i;
    ASSERT_EQ(a, b) << i;
    ++shared;
  }
  EXPECT_GT(shared, 200);
}

TEST(NearClip, NeighboursGetTheSameCutPointInFloat) { neighbours_agree<float>(); }
TEST(NearClip, NeighboursGetTheSameCutPointInDouble) { neighbours_agree<double>(); }

TEST(NearClip, OffDrawsWhatIsInFrontOfTheCameraUncut) {
  const GeometryOptions off{.near_rule = NearRule::kOff};
  // A corner at z = 0.5 is before the near plane: d = 1.25 - 4.5.
  const auto uncut = run_geometry({Triangle{{0, 0, -0.5f}, {1, -1, -2}, {1, 1, -2}}}, off);
  EXPECT_EQ(uncut.counts.drawn, 1);
  EXPECT_EQ(uncut.counts.near_clipped, 0);
  EXPECT_EQ(uncut.slots[0].d[0], -3.25f);
  // A corner at w <= 0 has no place on the screen.
  for (const float z : {0.0f, 0.5f}) {
    const auto gone = run_geometry({Triangle{{-1, -1, -2}, {1, -1, -2}, {0, 0, z}}}, off);
    EXPECT_EQ(gone.counts.drawn, 0);
    EXPECT_EQ(gone.counts.behind_near, 1);
  }
}

/// Pieces as sets of corners, so that neither their order nor their windings count.
template <class Real>
std::multiset<std::array<CornerOf<Real>, 3>> as_set(const std::vector<ScreenTriangle<Real>>& pieces) {
  std::multiset<std::array<CornerOf<Real>, 3>> set;
  for (const auto& piece : pieces) {
    auto corners = corners_of(piece);
    std::sort(corners.begin(), corners.end());
    set.insert(corners);
  }
  return set;
}

TEST(Clipping, FlippedAndRotatedDuplicatesGiveTheSamePieces) {
  Random random(53);
  int of_many = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto [a, b, c] = random_triangle(random, true);
    const auto expected = as_set(run_geometry<float>({Triangle{a, b, c}}).pieces());
    of_many += expected.size() > 1;
    for (const Triangle& other :
         {Triangle{b, c, a}, Triangle{c, a, b}, Triangle{c, b, a}, Triangle{b, a, c}, Triangle{a, c, b}})
      ASSERT_EQ(as_set(run_geometry<float>({other}).pieces()), expected) << i;
  }
  EXPECT_GT(of_many, 300);
}

/// Where a triangle is seen, by the signs of triple products with the ray through each centre, in long
/// double and without any clipping.
struct RayAnswer {
  bool covered;
  bool certain;  ///< no centre that is so near an edge, or a depth so near the near plane, that rounding
                 ///< decides
};

RayAnswer ask_ray(const Triangle& t, double x, double y, long double margin_px) {
  using Vec = std::array<long double, 3>;
  const auto vec = [](const Vec3& p) { return Vec{p.x, p.y, p.z}; };
  const auto cross = [](const Vec& p, const Vec& q) {
    return Vec{p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
  };
  const auto dot = [](const Vec& p, const Vec& q) { return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]; };
  const Vec a = vec(t.a), b = vec(t.b), c = vec(t.c);
  const Vec ray{(static_cast<long double>(x) - 4) / 4, (4 - static_cast<long double>(y)) / 4, -1};
  RayAnswer answer{true, true};
  const long double volume = dot(a, cross(b, c));
  for (const auto& [p, q] : {std::pair{a, b}, {b, c}, {c, a}}) {
    const Vec normal = cross(p, q);
    const long double value = dot(ray, normal) * (volume < 0 ? -1 : 1);
    if (value < 0) answer.covered = false;
    if (std::abs(value) * 4 < margin_px * std::hypot(normal[0], normal[1])) answer.certain = false;
  }
  // The ray meets the triangle at ray * s with 1/s = sum of the edge values / volume; s = z > 0 in front.
  const long double inverse_z =
      (dot(ray, cross(a, b)) + dot(ray, cross(b, c)) + dot(ray, cross(c, a))) / volume;
  if (inverse_z <= 0 || inverse_z > 1) answer.covered = false;
  if (std::abs(inverse_z - 1) < 1e-2L || std::abs(inverse_z) < 1e-9L) answer.certain = false;
  return answer;
}

/// Draws the pieces of random triangles and compares with rays. Top-left: the pieces are a partition, so that
/// every covered centre is covered by exactly one of them.
template <NumericMode Mode>
void coverage_is_that_of_the_rays(long double margin_px) {
  Random random(54);
  int asked = 0, covered = 0, guard_clipped = 0;
  for (int i = 0; i < 4000; ++i) {
    const Triangle t = random_triangle(random, true);
    Camera camera = plain_camera(kSide, kSide);
    if (i % 2 == 0) camera.near_w = 0;  // as where w differs on the near plane
    const auto result = run_geometry<typename Mode::Real>({t}, {}, camera);
    guard_clipped += static_cast<int>(result.counts.guard_clipped);
    std::vector<typename Mode::Prepared> prepared;
    for (const auto& piece : result.pieces()) prepared.push_back(Mode::prepare(piece, FillRule::kTopLeft, 0));
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        const RayAnswer ray = ask_ray(t, x + 0.5, y + 0.5, margin_px);
        if (!ray.certain) continue;
        ++asked;
        covered += ray.covered;
        // What lies wholly beyond far is rejected; elsewhere depth is tested per pixel.
        if (result.counts.beyond_far > 0) continue;
        const auto owners = std::count_if(prepared.begin(), prepared.end(),
                                          [&](const auto& p) { return covers<Mode>(p, x, y); });
        ASSERT_EQ(owners, ray.covered ? 1 : 0) << i << " at " << x << "," << y;
      }
  }
  EXPECT_GT(asked, 100000);
  EXPECT_GT(covered, 10000);
  EXPECT_GT(guard_clipped, 200);
}

TEST(GuardBand, CoverageInTheImageIsUnchangedInDouble) { coverage_is_that_of_the_rays<F64>(1e-6L); }
// At 2^17 px a float32 has steps of 2^-6 px (to the nearest: half of it), and snapping adds 2^-9.
TEST(GuardBand, CoverageInTheImageIsUnchangedInFloat) { coverage_is_that_of_the_rays<F32>(0.02L); }
TEST(GuardBand, CoverageInTheImageIsUnchangedInFixedPoint) { coverage_is_that_of_the_rays<Fixed8>(0.02L); }

TEST(GuardBand, CutsOnlyWhatLeavesIt) {
  // z = 4: one world unit is one pixel, and x = 2^17 px lies at 2^17 - 4.
  const float inside = 131068, outside = 131072;
  EXPECT_EQ(run_geometry({Triangle{{0, 0, -4}, {inside, 0, -4}, {0, 3, -4}}}).counts.guard_clipped, 0);
  const auto cut = run_geometry({Triangle{{0, 0, -4}, {outside, 0, -4}, {0, 3, -4}}});
  EXPECT_EQ(cut.counts.guard_clipped, 1);
  EXPECT_EQ(cut.counts.pieces, 2);
}

TEST(GuardBand, ExtremesStayFiniteAndInside) {
  for (const float far : {1e6f, 1e9f, 1e19f, 1e30f, 3e38f}) {
    const Triangle triangles[] = {{{-far, -far, -2}, {far, -far, -2}, {0, far, -2}},
                                  {{-far, -1, far}, {far, 0, -far}, {0, far, -far}},
                                  {{-far, -far, -far}, {far, -far, -far}, {0, far, -far}},
                                  {{0, 0, -1}, {far, 1, -1}, {1, far, -1}},
                                  {{0, 0, -2}, {far, far, far}, {-far, far, far}},
                                  {{1 / far, 0, -2}, {0, 1 / far, -2}, {far, far, -2}}};
    for (const Triangle& t : triangles) {
      const auto single = run_geometry<float>({t});
      const auto wide = run_geometry<double>({t});
      EXPECT_EQ(single.counts.non_finite, 0);
      EXPECT_EQ(single.counts.zero_area, 0);
      EXPECT_EQ(single.pieces().size(), wide.pieces().size());
      const auto check = [&](const auto& pieces) {
        for (const auto& piece : pieces)
          for (int k = 0; k < 3; ++k) {
            ASSERT_LE(std::abs(piece.x[k]), kGuardBand);  // also false for NaN
            ASSERT_LE(std::abs(piece.y[k]), kGuardBand);
            ASSERT_GE(piece.d[k], -1.001);
            ASSERT_LE(piece.d[k], 1.251);
          }
      };
      SCOPED_TRACE(testing::Message() << "triangle " << &t - triangles << " of " << far);
      check(single.pieces());
      check(wide.pieces());
    }
    // The first one fills the lower half of the image, whatever its size.
    EXPECT_EQ(run_geometry({triangles[0]}).counts.drawn, 1);
  }
}

}  // namespace
}  // namespace rasterbench
