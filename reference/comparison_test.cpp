#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>

#include "numeric/modes.h"
#include "pipeline/geometry.h"
#include "reference/double_renderer.h"

namespace rasterbench {
namespace {

struct Drawn {
  std::vector<std::int32_t> ids;
  std::vector<float> depths;
};

// A correct kernel: the geometry stage and the scalar specification of a mode, triangle by triangle.
template <class Mode>
Drawn draw_in_mode(const std::vector<Triangle>& triangles, const Camera& camera, FillRule fill,
                   NearRule near_rule) {
  using Real = typename Mode::Real;
  std::vector<ScreenTriangle<Real>> pieces(triangles.size()), extra;
  GeometryCounts counts;
  transform_triangles<Real>(triangles, 0, make_screen_transform(camera),
                            {.near_rule = near_rule, .cull_back_faces = false}, pieces.data(), extra, counts);
  pieces.insert(pieces.end(), extra.begin(), extra.end());
  const int width = camera.viewport.width, height = camera.viewport.height;
  std::vector<typename Mode::Key> keys(static_cast<std::size_t>(width * height), Mode::kClear);
  for (const auto& piece : pieces) {
    if (piece.id < 0) continue;
    const auto prepared = Mode::prepare(piece, fill, static_cast<std::uint32_t>(piece.id));
    const PixelBox box = intersect(prepared.box, {0, 0, width, height});
    for (int y = box.y0; y < box.y1; ++y)
      for (int x = box.x0; x < box.x1; ++x) {
        if (!Mode::inside(prepared, x, y)) continue;
        auto& key = keys[static_cast<std::size_t>(y * width + x)];
        key = std::min(key, Mode::key(Mode::depth(prepared, x, y), prepared.rank));
      }
  }
  Drawn drawn;
  for (const auto& key : keys) {
    drawn.ids.push_back(key == Mode::kClear ? -1 : static_cast<std::int32_t>(Mode::rank(key)));
    drawn.depths.push_back(Mode::output_depth(key));
  }
  return drawn;
}

Camera camera_on_z_axis(const Viewport& viewport, double distance, double n, double f, double scale) {
  const double a = (n + f) / (n - f), b = 2 * n * f / (n - f);
  return {.x = {scale * viewport.height / viewport.width, 0, 0, 0},
          .y = {0, scale, 0, 0},
          .z = {0, 0, a, b - distance * a},
          .w = {0, 0, -1, distance},
          .near_distance = {0, 0, -1, distance - n},
          .viewport = viewport,
          .near_w = n};
}

// Triangles of sizes from 1e-4 to 10 world units, a quarter of them slivers, in a cube that the camera stands
// in.
std::vector<Triangle> random_triangles(int count, double spread, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1), exponent(-4, 1);
  std::vector<Triangle> triangles;
  for (int i = 0; i < count; ++i) {
    const double size = std::pow(10, exponent(random));
    const auto around = [&](const Vec3& p, double radius) {
      return Vec3{static_cast<float>(p.x + radius * unit(random)),
                  static_cast<float>(p.y + radius * unit(random)),
                  static_cast<float>(p.z + radius * unit(random))};
    };
    const Vec3 a = around({0, 0, 0}, spread), b = around(a, size), c = around(a, size);
    const float t = static_cast<float>(0.5 * (1 + unit(random)));
    const Vec3 between = {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
    triangles.push_back({a, b, i % 4 ? c : around(between, 1e-5 * size)});
  }
  return triangles;
}

template <class Mode>
Comparison judge(const std::vector<Triangle>& triangles, const Camera& camera, FillRule fill,
                 NearRule near_rule) {
  const Drawn drawn = draw_in_mode<Mode>(triangles, camera, fill, near_rule);
  return compare_with_double(render_in_double(triangles, camera, fill, near_rule), drawn.ids, drawn.depths,
                             triangles, camera, near_rule, Mode::kInfo.numbers);
}

/// Modes whose edges are cross products or exact and whose depths are d: what the double renderer's bounds
/// are about. The oracle judges the others (prediction_test.cpp).
template <class Mode>
class EveryMode : public testing::Test {};
using Modes = testing::Types<F32, F64, Fixed8, Fixed12, Filtered, ExactMode>;
struct ModeNames {
  template <class Mode>
  static std::string GetName(int) {
    return std::string(Mode::kInfo.name);
  }
};
TYPED_TEST_SUITE(EveryMode, Modes, ModeNames);

void expect_explained(const Comparison& result, double worst_share) {
  EXPECT_EQ(result.errors, 0) << "first at " << result.worst_pixel << " of " << result.pixels;
  EXPECT_EQ(result.identical + result.edge_ties + result.depth_ties, result.pixels);
  EXPECT_LE(static_cast<double>(result.pixels - result.identical), worst_share * double(result.pixels));
}

TYPED_TEST(EveryMode, RandomTrianglesAreWithinTheBound) {
  const Viewport viewport{.width = 200, .height = 150, .sampling = Sampling::kCentre};
  for (unsigned seed = 0; seed < 3; ++seed)
    for (const FillRule fill : {FillRule::kClosed, FillRule::kTopLeft})
      for (const NearRule near_rule : {NearRule::kClip, NearRule::kOff}) {
        const Camera camera = camera_on_z_axis(viewport, 3, 0.01, 100, 1.5);
        expect_explained(judge<TypeParam>(random_triangles(3000, 4, seed), camera, fill, near_rule), 0.03);
      }
}

TYPED_TEST(EveryMode, ExtremeScenesAreWithinTheBound) {
  for (const double scale : {1e-6, 1e-3, 1e3, 1e6, 1e9, 1e19, 1e30}) {
    std::vector<Triangle> triangles = random_triangles(300, 4, 7);
    std::mt19937 random(3);
    for (Triangle& t : triangles)
      for (Vec3* p : {&t.a, &t.b, &t.c})
        if (random() % 3 == 0)
          *p = {static_cast<float>(p->x * scale), static_cast<float>(p->y * scale),
                static_cast<float>(p->z * scale)};
    for (const double n : {1e-9, 1e-3, 1.0, 2.9}) {
      const Camera camera = camera_on_z_axis({90, 70, Sampling::kCorner}, 3, n, n + 1e5, 1);
      for (const NearRule near_rule : {NearRule::kClip, NearRule::kOff})
        expect_explained(judge<TypeParam>(triangles, camera, FillRule::kClosed, near_rule), 1);
    }
  }
}

// A wide picture, in which a float resolves 2^-8 px.
TYPED_TEST(EveryMode, WidePictureIsWithinTheBound) {
  const Camera camera = camera_on_z_axis({kMaxImageSide, 2, Sampling::kCentre}, 3, 0.01, 100, 1e-4);
  expect_explained(judge<TypeParam>(random_triangles(500, 4, 5), camera, FillRule::kClosed, NearRule::kClip),
                   0.1);
}

TYPED_TEST(EveryMode, SharedEdgesAndEqualDepthsAreTies) {
  // A grid whose edges pass through centres; every cell twice, at the same depth.
  const Camera camera = camera_on_z_axis({64, 64, Sampling::kCentre}, 3, 1, 5, 3);
  std::vector<Triangle> grid;
  for (int copy = 0; copy < 2; ++copy)
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) {
        const auto corner = [&](int r, int c) {
          return Vec3{static_cast<float>((8 * c - 31.5) / 32), static_cast<float>((31.5 - 8 * r) / 32), 0.0f};
        };
        grid.push_back({corner(i, j), corner(i, j + 1), corner(i + 1, j + 1)});
        grid.push_back({corner(i, j), corner(i + 1, j + 1), corner(i + 1, j)});
      }
  for (const FillRule fill : {FillRule::kClosed, FillRule::kTopLeft})
    expect_explained(judge<TypeParam>(grid, camera, fill, NearRule::kClip), 0);
  // The same picture with the ids of the copies: every pixel is a tie.
  const IdImage truth = render_in_double(grid, camera, FillRule::kClosed, NearRule::kClip);
  Drawn drawn = draw_in_mode<TypeParam>(grid, camera, FillRule::kClosed, NearRule::kClip);
  for (std::int32_t& id : drawn.ids)
    if (id >= 0) id += 128;
  const Comparison result = compare_with_double(truth, drawn.ids, drawn.depths, grid, camera, NearRule::kClip,
                                                TypeParam::kInfo.numbers);
  expect_explained(result, 1);
  EXPECT_GT(result.depth_ties, 2000);
  EXPECT_GT(result.edge_ties, 500);
}

// Pictures that are wrong, each by one defect.
template <class Mode>
class Mutations {
 public:
  Comparison of(const Drawn& drawn) const {
    return compare_with_double(truth_, drawn.ids, drawn.depths, triangles_, camera_, NearRule::kClip,
                               Mode::kInfo.numbers);
  }
  Drawn drawn_from(const std::vector<Triangle>& triangles) const {
    return draw_in_mode<Mode>(triangles, camera_, FillRule::kClosed, NearRule::kClip);
  }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  const IdImage& truth() const { return truth_; }

 private:
  Camera camera_ = camera_on_z_axis({160, 120, Sampling::kCentre}, 3, 0.5, 100, 1.5);
  std::vector<Triangle> triangles_ = random_triangles(200, 2, 11);
  IdImage truth_ = render_in_double(triangles_, camera_, FillRule::kClosed, NearRule::kClip);
};

TYPED_TEST(EveryMode, WrongPicturesAreCaught) {
  const Mutations<TypeParam> check;
  const Drawn good = check.drawn_from(check.triangles());
  ASSERT_EQ(check.of(good).errors, 0);
  const auto pixels = good.ids.size();
  const std::size_t width = 160;

  // Nothing drawn at all: only pixels on an edge are excused.
  const Drawn none = check.drawn_from({});
  const auto covered = pixels - static_cast<std::size_t>(std::count(good.ids.begin(), good.ids.end(), -1));
  EXPECT_GT(static_cast<double>(check.of(none).errors), 0.98 * static_cast<double>(covered));

  // One pixel without its triangle, or with a triangle that is nowhere near, or that does not exist.
  std::size_t inner = pixels;  // in the middle of nine pixels of one triangle
  for (std::size_t p = width + 1; p + width + 1 < pixels && inner == pixels; ++p) {
    bool same = good.ids[p] >= 0;
    for (const std::size_t q :
         {p - width - 1, p - width, p - width + 1, p - 1, p + 1, p + width - 1, p + width, p + width + 1})
      same = same && good.ids[q] == good.ids[p];
    if (same) inner = p;
  }
  ASSERT_LT(inner, pixels);
  std::int32_t elsewhere = 0;
  while (std::count(good.ids.begin(), good.ids.end(), elsewhere) > 0) ++elsewhere;
  for (const std::int32_t wrong : {-1, elsewhere, 200, -2}) {
    Drawn bad = good;
    bad.ids[inner] = wrong;
    if (wrong == -1) bad.depths[inner] = 1;
    EXPECT_EQ(check.of(bad).errors, 1) << wrong;
    EXPECT_EQ(check.of(bad).worst_pixel, static_cast<std::int64_t>(inner));
  }

  // A wrong depth, and a NaN.
  for (const float depth : {good.depths[inner] + 0.01f, std::nanf("")}) {
    Drawn bad = good;
    bad.depths[inner] = depth;
    EXPECT_EQ(check.of(bad).errors, 1);
  }

  // Every triangle of ten pixels and more is missed when absent.
  for (std::size_t id = 0; id < check.triangles().size(); ++id) {
    if (std::count(good.ids.begin(), good.ids.end(), static_cast<std::int32_t>(id)) < 10) continue;
    std::vector<Triangle> triangles = check.triangles();
    triangles[id].b = triangles[id].a;
    EXPECT_GT(check.of(check.drawn_from(triangles)).errors, 0) << id;
  }

  // The picture shifted by a pixel, and by a tenth of one.
  Drawn shifted = good;
  std::rotate(shifted.ids.begin(), shifted.ids.begin() + 1, shifted.ids.end());
  std::rotate(shifted.depths.begin(), shifted.depths.begin() + 1, shifted.depths.end());
  EXPECT_GT(check.of(shifted).errors, 100);
  Camera moved = camera_on_z_axis({160, 120, Sampling::kCentre}, 3, 0.5, 100, 1.5);
  moved.x.w = 0.1 * 2 / 160;
  EXPECT_GT(
      check.of(draw_in_mode<TypeParam>(check.triangles(), moved, FillRule::kClosed, NearRule::kClip)).errors,
      20);

  // The farthest triangle in front.
  Camera reversed = camera_on_z_axis({160, 120, Sampling::kCentre}, 3, 0.5, 100, 1.5);
  for (double* k : {&reversed.z.x, &reversed.z.y, &reversed.z.z, &reversed.z.w}) *k = -*k;
  Drawn swapped = draw_in_mode<TypeParam>(check.triangles(), reversed, FillRule::kClosed, NearRule::kClip);
  for (float& depth : swapped.depths) depth = depth < 1 ? -depth : 1;
  EXPECT_GT(check.of(swapped).errors, 100);
}

TEST(Comparison, RefusesPicturesOfDifferentSizes) {
  const Camera camera = camera_on_z_axis({4, 4, Sampling::kCentre}, 3, 1, 5, 3);
  const IdImage truth = render_in_double({}, camera, FillRule::kClosed, NearRule::kClip);
  const std::vector<std::int32_t> ids(15, -1);
  const std::vector<float> depths(16, 1);
  EXPECT_ANY_THROW(compare_with_double(truth, ids, depths, {}, camera, NearRule::kClip, F32::kInfo.numbers));
}

}  // namespace
}  // namespace rasterbench
