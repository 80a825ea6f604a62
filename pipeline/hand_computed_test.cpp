// The pipeline of accuracy.md, section 1, worked out on paper for two cameras, and every stage against the
// numbers of that sheet. Both pictures have 8 x 4 pixels (r = 2), theta = pi/2, so S_y = 1/tan(pi/4) = 1 and
// S_x = 1/2, and f = 9 n, so that (n+f)/(n-f) = -1.25 and 2nf/(n-f) = -2.25 n. With z = -w in front of the
// camera:
//   x_S = u/(2z)        x_px = 4 (x_S + 1) = 4 + 2 u/z
//   y_S = v/z           y_px = 2 (1 - y_S) = 2 - 2 v/z
//   d = (-1.25 w - 2.25 n)/(-w) = 1.25 - 2.25 n/z
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <vector>

#include "kernels/kernel.h"

namespace rasterbench {
namespace {

constexpr int kWidth = 8, kHeight = 4;

struct Pixel {
  int row, column;
};

/// What the sheet says about one camera and its triangle.
struct Sheet {
  Vec3d camera;
  double near_plane;
  Triangle triangle;
  Camera rows;                     ///< world to clip
  std::array<Vec3d, 3> view;       ///< (u, v, w) of each corner
  std::array<Vec3d, 3> projected;  ///< (x_S, y_S, d) of each corner
  std::array<Vec3d, 3> pixels;     ///< (x_px, y_px, d) of each corner
  std::vector<Pixel> covered;      ///< row by row
  std::array<std::pair<Pixel, float>, 2> depths;
  double shade;
  std::array<std::uint32_t, 3> colour;  ///< of the object (250, 110, 40)

  Scene scene() const {
    Scene scene;
    scene.model.triangles = {triangle};
    scene.parameters = {.object = {250, 110, 40},
                        .background = {10, 20, 30},
                        .camera = camera,
                        .height = kHeight,
                        .width = kWidth,
                        .theta = std::numbers::pi / 2,
                        .near_plane = near_plane,
                        .far_plane = 9 * near_plane};
    return scene;
  }
};

/// M = (0, 0, 5): D = D_g = 5, e_U = (5, 0, 0)/5 = (1, 0, 0), e_V = (0, 25, 0)/25 = (0, 1, 0), e_W = (0, 0,
/// 1). n = 1, f = 9. u = P.x, v = P.y, w = P.z - 5.
///   A = (-2.34375, -1.3125, 3.5)   z = 1.5   u/z = -1.5625   v/z = -0.875   2.25/z = 1.5
///   B = (3, -3, -1)                z = 6     u/z =  0.5      v/z = -0.5     2.25/z = 0.375
///   C = (-2.8125, 2.625, 2)        z = 3     u/z = -0.9375   v/z =  0.875   2.25/z = 0.75
/// Coverage: edges AB from (.875, 3.75) to (5, 3), BC to (2.125, .25), CA. At the height y of a row the
/// triangle spans, with x_CA = 2.125 - (y - .25)/2.8 and x_BC = 2.125 + (y - .25) 23/22,
///   y = 0.5   2.0357 .. 2.3864   no centre (1.5 and 2.5 lie outside)
///   y = 1.5   1.6786 .. 3.4318   2.5
///   y = 2.5   1.3214 .. 4.4773   1.5 2.5 3.5 (not 4.5)
///   y = 3.5   0.9643 .. 2.25     1.5; on the right it is AB: x = .875 + (3.75 - 3.5) 5.5
/// Depth: d = 1.25 - (10 - 2x + y)/8 has the value of every corner: 1.25 - 1.5, 1.25 - 0.375, 1.25 - 0.75.
///   at (2.5, 1.5) 1.25 - 6.5/8 = 0.4375; at (1.5, 3.5) 1.25 - 10.5/8 = -0.0625
/// Shade: AB = (5.34375, -1.6875, -4.5), AC = (-0.46875, 3.9375, -1.5);
///   AB x AC = (2.53125 + 17.71875, 2.109375 + 8.015625, 21.041015625 - 0.791015625)
///           = (20.25, 10.125, 20.25) = 10.125 (2, 1, 2), of length 10.125 * 3
///   s = (2 + 1 + 2)/(3 sqrt(3)) = 0.96225045; 250 s = 240.56, 110 s = 105.85, 40 s = 38.49
Sheet straight_ahead() {
  return {.camera = {0, 0, 5},
          .near_plane = 1,
          .triangle = {{-2.34375f, -1.3125f, 3.5f}, {3, -3, -1}, {-2.8125f, 2.625f, 2}},
          .rows = {.x = {0.5, 0, 0, 0},
                   .y = {0, 1, 0, 0},
                   .z = {0, 0, -1.25, 4},  // -1.25 (P.z - 5) - 2.25
                   .w = {0, 0, -1, 5},
                   .near_distance = {0, 0, -1, 4},
                   .viewport = {kWidth, kHeight, Sampling::kCentre},
                   .near_w = 1},
          .view = {{{-2.34375, -1.3125, -1.5}, {3, -3, -6}, {-2.8125, 2.625, -3}}},
          .projected = {{{-0.78125, -0.875, -0.25}, {0.25, -0.5, 0.875}, {-0.46875, 0.875, 0.5}}},
          .pixels = {{{0.875, 3.75, -0.25}, {5, 3, 0.875}, {2.125, 0.25, 0.5}}},
          .covered = {{1, 2}, {2, 1}, {2, 2}, {2, 3}, {3, 1}},
          .depths = {{{{1, 2}, 0.4375f}, {{3, 1}, -0.0625f}}},
          .shade = 0.96225045,
          .colour = {240, 105, 38}};
}

/// M = (12, 15, 16): D = 25, D_g = 20. e_U = (16, 0, -12)/20 = (.8, 0, -.6),
/// e_V = (-12*15, 144 + 256, -15*16)/(20*25) = (-.36, .8, -.48), e_W = (12, 15, 16)/25 = (.48, .6, .64).
/// n = 10, f = 90. Corners are M + u e_U + v e_V + w e_W:
///   A: (u, v, w) = (-25, -21.875, -25)   P = M + (-20, 0, 15) + (7.875, -17.5, 10.5) + (-12, -15, -16)
///                                          = (-12.125, -17.5, 25.5)
///   B: (75, -25, -50)                    P = M + (60, 0, -45) + (9, -20, 12) + (-24, -30, -32) = (57, -35,
///   -49) C: (0, 10.9375, -12.5)               P = M + (-3.9375, 8.75, -5.25) + (-6, -7.5, -8) =
///   (2.0625, 16.25, 2.75) A: z = 25     u/z = -1    v/z = -0.875   22.5/z = 0.9 B: z = 50     u/z = 1.5 v/z
///   = -0.5     22.5/z = 0.45 C: z = 12.5   u/z = 0     v/z = 0.875    22.5/z = 1.8
/// Coverage: edges AB from (2, 3.75) to (7, 3), BC to (4, .25), CA. With x_CA = 4 - (y - .25) 4/7 and
/// x_BC = 4 + (y - .25) 12/11,
///   y = 0.5   3.8571 .. 4.2727   no centre
///   y = 1.5   3.2857 .. 5.3636   3.5 4.5
///   y = 2.5   2.7143 .. 6.4545   3.5 4.5 5.5 (not 2.5, not 6.5)
///   y = 3.5   2.1429 .. 3.6667   2.5 3.5; on the right it is AB: x = 2 + (3.75 - 3.5)/.15
/// Depth: with d = .35 + gx (x - 2) + gy (y - 3.75), B gives 5 gx - .75 gy = .45 and C gives 2 gx - 3.5 gy =
/// -.9:
///   gx = 2.25/16 = .140625, gy = 5.4/16 = .3375
///   at (3.5, 1.5) .35 + .2109375 - .759375 = -.1984375; at (5.5, 2.5) .35 + .4921875 - .421875 = .4203125
/// Shade: AB = (69.125, -17.5, -74.5), AC = (14.1875, 33.75, -22.75);
///   AB x AC = (398.125 + 2514.375, -1056.96875 + 1572.59375, 2332.96875 + 248.28125)
///           = (2912.5, 515.625, 2581.25) = 3.125 (932, 165, 826), 932^2 + 165^2 + 826^2 = 1578125 = 125^2 *
///           101
///   s = (932 + 165 + 826)/(125 sqrt(303)) = 0.88378808; 250 s = 220.95, 110 s = 97.22, 40 s = 35.35
Sheet off_axis() {
  return {.camera = {12, 15, 16},
          .near_plane = 10,
          .triangle = {{-12.125f, -17.5f, 25.5f}, {57, -35, -49}, {2.0625f, 16.25f, 2.75f}},
          .rows = {.x = {0.4, 0, -0.3, 0},
                   .y = {-0.36, 0.8, -0.48, 0},
                   .z = {-0.6, -0.75, -0.8, 8.75},  // -1.25 (P.e_W - 25) - 22.5
                   .w = {-0.48, -0.6, -0.64, 25},
                   .near_distance = {-0.48, -0.6, -0.64, 15},
                   .viewport = {kWidth, kHeight, Sampling::kCentre},
                   .near_w = 10},
          .view = {{{-25, -21.875, -25}, {75, -25, -50}, {0, 10.9375, -12.5}}},
          .projected = {{{-0.5, -0.875, 0.35}, {0.75, -0.5, 0.8}, {0, 0.875, -0.55}}},
          .pixels = {{{2, 3.75, 0.35}, {7, 3, 0.8}, {4, 0.25, -0.55}}},
          .covered = {{1, 3}, {1, 4}, {2, 3}, {2, 4}, {2, 5}, {3, 2}, {3, 3}},
          .depths = {{{{1, 3}, -0.1984375f}, {{2, 5}, 0.4203125f}}},
          .shade = 0.88378808,
          .colour = {220, 97, 35}};
}

class HandComputed : public testing::TestWithParam<Sheet (*)()> {
 protected:
  const Sheet sheet = GetParam()();
};

void expect_row(const AffineRow& row, const AffineRow& expected, const char* name) {
  constexpr double kTolerance = 1e-14;  // times the size of the constants, up to 25
  EXPECT_NEAR(row.x, expected.x, kTolerance) << name;
  EXPECT_NEAR(row.y, expected.y, kTolerance) << name;
  EXPECT_NEAR(row.z, expected.z, kTolerance) << name;
  EXPECT_NEAR(row.w, expected.w, 25 * kTolerance) << name;
}

TEST_P(HandComputed, Camera) {
  const Camera camera = make_camera(sheet.scene().parameters);
  expect_row(camera.x, sheet.rows.x, "x");
  expect_row(camera.y, sheet.rows.y, "y");
  expect_row(camera.z, sheet.rows.z, "z");
  expect_row(camera.w, sheet.rows.w, "w");
  expect_row(camera.near_distance, sheet.rows.near_distance, "near_distance");
  EXPECT_EQ(camera.near_w, sheet.near_plane);
  EXPECT_EQ(camera.viewport.width, kWidth);
  EXPECT_EQ(camera.viewport.height, kHeight);
  EXPECT_EQ(camera.viewport.sampling, Sampling::kCentre);
}

TEST_P(HandComputed, ViewAndProjectedCoordinates) {
  const Camera camera = make_camera(sheet.scene().parameters);
  const auto at = [](const AffineRow& row, const Vec3& p) {
    return row.x * double{p.x} + row.y * double{p.y} + row.z * double{p.z} + row.w;
  };
  const Vec3 corners[] = {sheet.triangle.a, sheet.triangle.b, sheet.triangle.c};
  for (std::size_t i = 0; i < 3; ++i) {
    const double w = at(camera.w, corners[i]);
    EXPECT_NEAR(w, -sheet.view[i].z, 1e-12);
    EXPECT_NEAR(at(camera.x, corners[i]), 0.5 * sheet.view[i].x, 1e-12);  // S_x u
    EXPECT_NEAR(at(camera.y, corners[i]), sheet.view[i].y, 1e-12);        // S_y v
    EXPECT_NEAR(at(camera.near_distance, corners[i]), w - sheet.near_plane, 1e-12);
    EXPECT_NEAR(at(camera.x, corners[i]) / w, sheet.projected[i].x, 1e-13);
    EXPECT_NEAR(at(camera.y, corners[i]) / w, sheet.projected[i].y, 1e-13);
    EXPECT_NEAR(at(camera.z, corners[i]) / w, sheet.projected[i].z, 1e-13);
  }
}

TEST_P(HandComputed, ScreenTriangle) {
  const Scene scene = sheet.scene();
  ScreenTriangle<double> slot{};
  std::vector<ScreenTriangle<double>> extra;
  GeometryCounts counts;
  transform_triangles<double>(scene.model.triangles, 0, make_screen_transform(make_camera(scene.parameters)),
                              {}, &slot, extra, counts);
  EXPECT_EQ(counts.drawn, 1);
  EXPECT_TRUE(extra.empty());
  EXPECT_EQ(slot.id, 0);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(slot.x[i], sheet.pixels[i].x, 1e-12);
    EXPECT_NEAR(slot.y[i], sheet.pixels[i].y, 1e-12);
    EXPECT_NEAR(slot.d[i], sheet.pixels[i].z, 1e-13);
  }
}

TEST_P(HandComputed, ShadeTruncatesTheColour) {
  const Rgb object{250, 110, 40};
  const std::uint32_t colour = shade_flat(sheet.triangle, object);
  const std::array<std::uint32_t, 3> channels{colour & 0xffu, colour >> 8 & 0xffu, colour >> 16 & 0xffu};
  EXPECT_EQ(channels, sheet.colour);
  // The sheet agrees with itself.
  EXPECT_EQ(static_cast<std::uint32_t>(sheet.shade * object.r), sheet.colour[0]);
  EXPECT_EQ(static_cast<std::uint32_t>(sheet.shade * object.g), sheet.colour[1]);
  EXPECT_EQ(static_cast<std::uint32_t>(sheet.shade * object.b), sheet.colour[2]);
}

/// What a mode's stored depth may differ by from the sheet: these corners are multiples of 1/8 px, which
/// every mode holds, and no plane of the sheets has a term above one.
double depth_tolerance(std::string_view mode) {
  const ModeBound& bound = find_mode(mode)->numbers;
  return 2e-7 + 0.51 * bound.depth_step + bound.reciprocal_error;
}

/// Draws `scene` with every listed kernel in every mode that it has, and calls check(renderer, tolerance of
/// depths).
template <class Check>
void with_every_kernel(const Scene& scene, Check check) {
  for (const Kernel& kernel : kernels())
    for (const Kernel::Variant& variant : kernel.variants()) {
      if (kernel.info().hidden || !variant.make) continue;
      for (const FillRule fill : {FillRule::kClosed, FillRule::kTopLeft}) {  // no centre lies on an edge
        if (fill == FillRule::kTopLeft && !find_mode(variant.mode)->has_screen_triangles) continue;
        const FrameSettings settings{.width = kWidth, .height = kHeight, .fill = fill};
        const auto renderer = variant.make({.scene = &scene, .settings = settings, .execution = {}});
        renderer->draw();
        SCOPED_TRACE(fmt::format("{} {}", kernel.info().name, variant.mode));
        check(*renderer, depth_tolerance(variant.mode));
      }
    }
}

std::size_t index(const Pixel& pixel) { return static_cast<std::size_t>(pixel.row * kWidth + pixel.column); }

TEST_P(HandComputed, Frame) {
  std::vector<std::int32_t> ids(kWidth * kHeight, -1);
  std::vector<std::uint32_t> colours(ids.size(), 0xff1e140au);  // (10, 20, 30)
  for (const Pixel& pixel : sheet.covered) {
    ids[index(pixel)] = 0;
    colours[index(pixel)] = sheet.colour[0] | sheet.colour[1] << 8 | sheet.colour[2] << 16 | 0xff000000u;
  }
  const Scene scene = sheet.scene();
  with_every_kernel(scene, [&](const Renderer& renderer, double tolerance) {
    EXPECT_EQ(renderer.ids(), ids);
    EXPECT_EQ(std::vector(renderer.colours().begin(), renderer.colours().end()), colours);
    for (const auto& [pixel, depth] : sheet.depths)
      EXPECT_NEAR(renderer.depths()[index(pixel)], depth, tolerance);
    for (std::size_t i = 0; i < ids.size(); ++i) EXPECT_EQ(renderer.depths()[i] == 1.0f, ids[i] == -1) << i;
  });
}

TEST_P(HandComputed, ReversedWindingIsBlackWithTheSameCoverage) {
  Scene scene = sheet.scene();
  std::swap(scene.model.triangles[0].b, scene.model.triangles[0].c);
  with_every_kernel(scene, [&](const Renderer& renderer, double tolerance) {
    const auto ids = renderer.ids();
    EXPECT_EQ(std::count(ids.begin(), ids.end(), 0), static_cast<std::ptrdiff_t>(sheet.covered.size()));
    for (const Pixel& pixel : sheet.covered) {
      EXPECT_EQ(ids[index(pixel)], 0);
      EXPECT_EQ(renderer.colours()[index(pixel)], 0xff000000u);
    }
    for (const auto& [pixel, depth] : sheet.depths)
      EXPECT_NEAR(renderer.depths()[index(pixel)], depth, tolerance);
  });
}

TEST_P(HandComputed, AHiddenTriangleStaysHidden) {
  // The same triangle moved away along its lines of sight, z by 5/4: same pixels, larger depth.
  const Sheet& s = sheet;
  const auto pushed = [&](const Vec3& p) {
    return Vec3{static_cast<float>(s.camera.x + 1.25 * (p.x - s.camera.x)),
                static_cast<float>(s.camera.y + 1.25 * (p.y - s.camera.y)),
                static_cast<float>(s.camera.z + 1.25 * (p.z - s.camera.z))};
  };
  for (const bool nearer_first : {false, true}) {
    Scene scene = sheet.scene();
    const Triangle behind{pushed(s.triangle.a), pushed(s.triangle.b), pushed(s.triangle.c)};
    scene.model.triangles = nearer_first ? std::vector{s.triangle, behind} : std::vector{behind, s.triangle};
    with_every_kernel(scene, [&](const Renderer& renderer, double tolerance) {
      for (const Pixel& pixel : s.covered) EXPECT_EQ(renderer.ids()[index(pixel)], nearer_first ? 0 : 1);
      for (const auto& [pixel, depth] : s.depths)
        EXPECT_NEAR(renderer.depths()[index(pixel)], depth, tolerance);
    });
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras, HandComputed, testing::Values(&straight_ahead, &off_axis),
                         [](const auto& test) { return test.index == 0 ? "StraightAhead" : "OffAxis"; });

}  // namespace
}  // namespace rasterbench
