// Ray casting as a reference: what the rays see, what is refused, and that a comparison with them neither
// blames what rounding explains nor excuses what it does not.
#include "reference/embree.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <numeric>
#include <random>

#include "numeric/modes.h"
#include "pipeline/frame.h"
#include "reference/ray_scene.h"
#include "reference/specification.h"
#include "scene/scene.h"
#include "scene/test_folder.h"

namespace rasterbench {
namespace {

constexpr ModeBound kDouble = F64::kInfo.numbers;

// From (0, 0, 3) along -z, near plane at distance n; a pixel of the plane z = 0 is 3 / (4 scale) world units
// wide in a picture 8 pixels high.
Camera camera_at_3(int width, int height, double n = 1, double f = 5, double scale = 3) {
  SceneParameters parameters;
  parameters.camera = {0, 0, 3};
  parameters.theta = 2 * std::atan(1 / scale);
  parameters.near_plane = n, parameters.far_plane = f;
  parameters.width = width, parameters.height = height;
  return make_camera(parameters);
}

// The corner on the plane z that camera_at_3(8, 8) sees at pixel position (x, y).
Vec3 at_pixel(double x, double y, double z = 0) {
  const double k = (3 - z) / 3;
  return {static_cast<float>((x / 4 - 1) * k), static_cast<float>((1 - y / 4) * k), static_cast<float>(z)};
}

std::int64_t count(const IdImage& image, std::int32_t id) {
  return std::count(image.ids.begin(), image.ids.end(), id);
}

// Triangles of sizes from 1e-3 to 3 world units, a quarter of them slivers, in a cube of 8 units.
std::vector<Triangle> random_triangles(int number, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1), exponent(-3, 0.5);
  std::vector<Triangle> triangles;
  for (int i = 0; i < number; ++i) {
    const double size = std::pow(10, exponent(random));
    const auto around = [&](const Vec3& p, double radius) {
      return Vec3{static_cast<float>(p.x + radius * unit(random)),
                  static_cast<float>(p.y + radius * unit(random)),
                  static_cast<float>(p.z + radius * unit(random))};
    };
    const Vec3 a = around({0, 0, 0}, 4), b = around(a, size), c = around(a, size);
    triangles.push_back({a, b, i % 4 != 0 ? c : around(b, 1e-4 * size)});
  }
  return triangles;
}

class Embree : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (!has_embree()) GTEST_SKIP() << embree_version();
  }
  bool robust() const { return GetParam(); }
  IdImage cast(const std::vector<Triangle>& triangles, const Camera& camera = camera_at_3(8, 8),
               int threads = 2) const {
    return ray_cast(triangles, camera, robust(), threads).picture;
  }
};
INSTANTIATE_TEST_SUITE_P(Builds, Embree, testing::Bool(),
                         [](const auto& test) { return test.param ? "robust" : "fast"; });

TEST_P(Embree, SeesATriangleCountedByHand) {
  // No edge passes through a sample: 0 + 1 + ... + 7 samples are below the diagonal.
  const IdImage image = cast({{at_pixel(-0.2, 0), at_pixel(7.8, 8), at_pixel(-0.2, 8)}});
  EXPECT_EQ(count(image, 0), 28);
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) EXPECT_EQ(image.ids[static_cast<std::size_t>(8 * i + j)], j < i ? 0 : -1);
  // At w = 3: d = (n + f)/(f - n) - 2nf/((f - n) w) = 1.5 - 2.5 / 3.
  EXPECT_NEAR(image.depths[8], 1.5 - 2.5 / 3, 1e-14);
  EXPECT_EQ(image.depths[0], 1);
}

TEST_P(Embree, SmallestIdWinsATieWhateverTheHierarchy) {
  // Every triangle four times, twice with the other winding, in a random order.
  const std::vector<Triangle> once = random_triangles(300, 9);
  std::vector<Triangle> triangles;
  for (int copy = 0; copy < 4; ++copy)
    for (const Triangle& t : once)
      triangles.push_back(copy == 0   ? t
                          : copy == 1 ? Triangle{t.c, t.b, t.a}
                          : copy == 2 ? Triangle{t.b, t.c, t.a}
                                      : Triangle{t.a, t.c, t.b});
  const Camera camera = camera_at_3(160, 120, 0.5, 100, 1);
  const IdImage image = cast(triangles, camera), alone = cast(once, camera);
  EXPECT_EQ(image.ids, alone.ids);
  EXPECT_GT(image.ids.size() - static_cast<std::size_t>(count(image, -1)), 5000u);

  std::vector<std::uint32_t> ids(triangles.size());
  std::iota(ids.begin(), ids.end(), 0u);
  for (const unsigned seed : {1u, 2u})
    for (const bool fast_build : {false, true}) {
      std::shuffle(ids.begin(), ids.end(), std::mt19937(seed));
      std::vector<Triangle> slots;
      for (const std::uint32_t id : ids) slots.push_back(triangles[id]);
      RayScene scene(slots, ids, camera, {.robust = robust(), .fast_build = fast_build});
      GeometryCounts counts;
      scene.copy(0, slots.size(), counts);
      scene.build();
      for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 160; ++x)
          ASSERT_EQ(scene.nearest(scene.rays().row(y).at(x)).id,
                    image.ids[static_cast<std::size_t>(160 * y + x)])
              << x << ' ' << y;
    }
}

TEST_P(Embree, BeginsOnTheNearPlaneAndEndsBeforeTheFarPlane) {
  // A wall from behind the camera to far away: the near plane w = 1 shows x = -1 at pixel -8, w = 5 at 1.6.
  const IdImage wall = cast({{{-1, -100, 50}, {-1, 100, 50}, {-1, 0, -1e6f}}});
  for (std::size_t p = 0; p < 64; ++p) EXPECT_EQ(wall.ids[p], p % 8 < 2 ? 0 : -1);
  for (const float z : {1.9375f, 2.0f, 2.0000002f, 2.0625f}) {
    const IdImage one = cast({{{-9, -9, z}, {9, -9, z}, {0, 9, z}}});
    EXPECT_EQ(count(one, 0), z <= 2 ? 64 : 0) << z;
    EXPECT_TRUE(z != 2 || one.depths[27] == -1);
  }
  for (const float z : {-1.9999998f, -2.0f, -2.0000002f})
    EXPECT_EQ(count(cast({{{-99, -99, z}, {99, -99, z}, {0, 99, z}}}), 0), z > -2 ? 64 : 0) << z;
  EXPECT_EQ(count(cast({{{-9, -9, 4}, {9, -9, 4}, {0, 9, 7}}}), 0), 0);
}

TEST_P(Embree, LeavesOutWhatDrawsNothingAndKeepsTheIds) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const Vec3 a{-9, -9, 0}, b{9, -9, 0}, c{0, 9, 0};
  EXPECT_EQ(count(cast({}), -1), 64);
  EXPECT_EQ(
      count(cast({{a, a, b}, {a, a, a}, {{nan, 0, 0}, b, c}, {a, {0, inf, 0}, c}, {a, {0, -9, 0}, b}}), -1),
      64);
  EXPECT_EQ(count(cast({{a, a, b}, {{nan, 0, 0}, b, c}, {a, c, b}, {a, {0, 0, -inf}, c}}), 2), 64);
}

TEST_P(Embree, SamplesAtCornersAndWithoutPerspective) {
  const std::vector<Triangle> triangles = random_triangles(300, 4);
  for (const Camera& camera :
       {look_at_origin({1, 2, 3}, 1, 0.5, 50, {.width = 90, .height = 70, .sampling = Sampling::kCorner}),
        orthographic_at_origin({1, 2, 3}, 3, 0.5, 50, {.width = 90, .height = 70})}) {
    const RayCastPicture rays = ray_cast(triangles, camera, robust(), 1);
    const IdImage truth = render_in_double(triangles, camera, FillRule::kClosed, NearRule::kClip);
    const RayComparison result = compare_with_rays(rays, truth.ids, truth.depths, triangles, camera, kDouble);
    EXPECT_EQ(result.errors, 0);
    EXPECT_GT(result.identical, 6290);
    EXPECT_LT(count(truth, -1), 5000);
    EXPECT_LT(result.max_depth_difference, 1e-9);
  }
}

TEST_P(Embree, SameWhateverTheThreadsAndModesOfTheCpuStay) {
#if defined(__SSE2__)
  const unsigned before = _mm_getcsr();
#endif
  const std::vector<Triangle> triangles = random_triangles(5000, 6);
  const Camera camera = camera_at_3(160, 120, 0.5, 100, 1);
  const IdImage one = cast(triangles, camera, 1), three = cast(triangles, camera, 3);
  EXPECT_EQ(one.ids, three.ids);
  EXPECT_EQ(one.depths, three.depths);
#if defined(__SSE2__)
  constexpr unsigned kStickyFlags = 0x3f;
  EXPECT_EQ(_mm_getcsr() & ~kStickyFlags, before & ~kStickyFlags);
#endif
}

TEST_P(Embree, RefusesWhatItCannotHold) {
  const Camera camera = camera_at_3(8, 8);
  const std::vector<Triangle> huge = {{{0, 0, 0}, {1, 0, 0}, {0, 0x1p41f, 0}}};
  EXPECT_EQ(input_error([&] { cast(huge); }),
            "triangle: ray casting takes coordinates up to 2^40, and 2199023255552 is one");
  const float largest = static_cast<float>(RayScene::kMaxCoordinate);
  // The robust test accepts rays that miss by 2^-23 of the triangle's size.
  EXPECT_EQ(count(cast({{{0, -largest, 0}, {0, largest, 0}, {-largest, 0, 0}}}), 0), robust() ? 64 : 32);
  EXPECT_NE(input_error([&] {
              cast({}, look_at_origin({0, 0, 1e13}, 1, 1, 5, {.width = 8, .height = 8}));
            }).find("near plane: ray casting takes coordinates up to 2^40"),
            std::string::npos);

  const std::vector<Triangle> many = random_triangles(20000, 1);
  RayScene scene(many, {}, camera, {.robust = robust(), .max_bytes = 100000});
  GeometryCounts counts;
  scene.copy(0, many.size(), counts);
  EXPECT_EQ(input_error([&] { scene.build(); }),
            "the ray-casting hierarchy of 20000 triangles does not fit into memory");
}

void expect_explained(const RayComparison& result, std::int64_t most_ties) {
  EXPECT_EQ(result.errors, 0) << "first at " << result.worst_pixel << " of " << result.pixels;
  EXPECT_EQ(result.identical + result.edge_ties + result.depth_ties, result.pixels);
  EXPECT_LE(result.pixels - result.identical, most_ties);
}

TEST_P(Embree, RandomTrianglesAgreeWithTheDoubleRenderer) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    const std::vector<Triangle> triangles = random_triangles(3000, seed);
    const Camera camera = camera_at_3(200, 150, 0.01, 100, 1);
    const IdImage truth = render_in_double(triangles, camera, FillRule::kClosed, NearRule::kClip);
    expect_explained(compare_with_rays(ray_cast(triangles, camera, robust(), 2), truth.ids, truth.depths,
                                       triangles, camera, kDouble),
                     15);
  }
}

// Telephoto: from the camera's position float32 rays would miss the model by pixels.
TEST_P(Embree, FarAwayCamerasAgreeWithTheDoubleRenderer) {
  for (const double distance : {1e2, 1e4}) {
    const std::vector<Triangle> triangles = random_triangles(3000, 2);
    const Camera camera = look_at_origin({0.6 * distance, 0, 0.8 * distance}, 10 / distance, distance - 8,
                                         distance + 8, {.width = 200, .height = 150});
    const IdImage truth = render_in_double(triangles, camera, FillRule::kClosed, NearRule::kClip);
    expect_explained(compare_with_rays(ray_cast(triangles, camera, robust(), 2), truth.ids, truth.depths,
                                       triangles, camera, kDouble),
                     distance < 1e3 ? 15 : 900);
  }
}

TEST_P(Embree, ExtremeScenesAreExplained) {
  for (const double scale : {1e-6, 1e-3, 1e3, 1e6, 1e9, 1e11}) {
    std::vector<Triangle> triangles = random_triangles(300, 7);
    std::mt19937 random(3);
    for (Triangle& t : triangles)
      for (Vec3* p : {&t.a, &t.b, &t.c})
        if (random() % 3 == 0)
          *p = {static_cast<float>(p->x * scale), static_cast<float>(p->y * scale),
                static_cast<float>(p->z * scale)};
    for (const double n : {1e-9, 1e-3, 1.0, 2.9}) {
      const Camera camera = camera_at_3(90, 70, n, n + 1e5, 1);
      const IdImage truth = render_in_double(triangles, camera, FillRule::kClosed, NearRule::kClip);
      const RayComparison result = compare_with_rays(ray_cast(triangles, camera, robust(), 2), truth.ids,
                                                     truth.depths, triangles, camera, kDouble);
      EXPECT_EQ(result.errors, 0) << fmt::format("scale {}, near {}, first at {}", scale, n,
                                                 result.worst_pixel);
    }
  }
}

// Pictures that are wrong, each by one defect, must not be excused.
TEST_P(Embree, WrongPicturesAreCaught) {
  const std::vector<Triangle> triangles = random_triangles(400, 11);
  const Camera camera = camera_at_3(160, 120, 0.5, 100, 1);
  const RayCastPicture rays = ray_cast(triangles, camera, robust(), 2);
  const IdImage good = render_in_double(triangles, camera, FillRule::kClosed, NearRule::kClip);
  const auto judge = [&](const IdImage& image) {
    return compare_with_rays(rays, image.ids, image.depths, triangles, camera, F32::kInfo.numbers);
  };
  const auto draw = [&](const std::vector<Triangle>& all, const Camera& from) {
    return render_in_double(all, from, FillRule::kClosed, NearRule::kClip);
  };
  ASSERT_EQ(judge(good).errors, 0);
  const auto covered = static_cast<double>(good.ids.size() - static_cast<std::size_t>(count(good, -1)));

  EXPECT_GT(static_cast<double>(judge(draw({}, camera)).errors), 0.99 * covered);
  // Each triangle of five pixels and more is missed when it is absent.
  for (std::size_t id = 0; id < triangles.size(); ++id) {
    if (count(good, static_cast<std::int32_t>(id)) < 5) continue;
    std::vector<Triangle> without = triangles;
    without[id].b = without[id].a;
    EXPECT_GT(judge(draw(without, camera)).errors, 0) << id;
  }
  Camera moved = camera;
  moved.x.w += 0.1 * 2 / 160;  // a tenth of a pixel
  EXPECT_GT(judge(draw(triangles, moved)).errors, 50);
  Camera reversed = camera;
  for (double* k : {&reversed.z.x, &reversed.z.y, &reversed.z.z, &reversed.z.w}) *k = -*k;
  IdImage farthest = draw(triangles, reversed);
  for (double& depth : farthest.depths) depth = depth < 1 ? -depth : 1;
  EXPECT_GT(judge(farthest).errors, 50);

  // One pixel with the id of a triangle that is nowhere near, or that does not exist.
  const auto pixel_where = [&](auto predicate) {
    return static_cast<std::size_t>(std::find_if(good.ids.begin(), good.ids.end(), predicate) -
                                    good.ids.begin());
  };
  const std::size_t middle = pixel_where([](std::int32_t id) { return id >= 0; });
  const std::size_t empty = pixel_where([](std::int32_t id) { return id < 0; });
  const auto elsewhere = static_cast<std::int32_t>(std::find_if(triangles.begin(), triangles.end(),
                                                                [](const Triangle& t) {
                                                                  return std::min({t.a.z, t.b.z, t.c.z}) > 3;
                                                                }) -
                                                   triangles.begin());
  for (const std::size_t pixel : {middle, empty})
    for (const std::int32_t wrong : {elsewhere, 400, -2}) {
      IdImage bad = good;
      bad.ids[pixel] = wrong;
      bad.depths[pixel] = -1;
      RayCastPicture wrong_rays = rays;
      wrong_rays.picture.ids[pixel] = wrong;
      for (const RayComparison& result :
           {judge(bad), compare_with_rays(wrong_rays, good.ids, good.depths, triangles, camera, kDouble)}) {
        EXPECT_EQ(result.errors, 1) << wrong;
        EXPECT_EQ(result.worst_pixel, static_cast<std::int64_t>(pixel));
        EXPECT_EQ(result.verdicts[pixel], PixelVerdict::kError);
      }
    }

  // Rays that meet nothing, or what is farthest, or that are a tenth of a pixel off.
  for (const IdImage& seen : {draw({}, camera), farthest, draw(triangles, moved)}) {
    const RayComparison result =
        compare_with_rays({.picture = seen}, good.ids, good.depths, triangles, camera, kDouble);
    EXPECT_GT(result.errors, 50);
    EXPECT_LT(result.edge_ties + result.depth_ties, result.errors / 10);
  }
}

TEST_P(Embree, RefusesPicturesOfDifferentSizes) {
  const Camera camera = camera_at_3(8, 8);
  const RayCastPicture rays = ray_cast({}, camera, robust(), 1);
  const std::vector<std::int32_t> ids(63, -1);
  const std::vector<double> depths(64, 1);
  EXPECT_ANY_THROW(compare_with_rays(rays, ids, depths, {}, camera, kDouble));
}

TEST_P(Embree, SharedScenesAgreeWithF32) {
  const std::filesystem::path folder =
      std::filesystem::path(__FILE__).parent_path().parent_path().parent_path() / "shared/scenes";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no scenes in ../shared/scenes";
  struct Case {
    const char *model, *parameters;
    std::int64_t most_ties;
  };
  for (const Case& c : {Case{"ldraw_racer/ldraw_racer.dat", "ldraw_racer/ldraw_racer.txt", 60},
                        Case{"dungeon/dungeon.dat", "dungeon/dungeon.txt", 60},
                        Case{"teapot/teapot_43k.dat", "teapot/teapot_43k.txt", 5}}) {
    const Scene scene = open_scene((folder / c.model).string(), (folder / c.parameters).string());
    const FrameSettings settings{.width = 480, .height = 270};
    const Picture picture = render_specification(scene, "f32", settings);
    const std::vector<double> depths(picture.depths.begin(), picture.depths.end());
    const Camera camera = sized_camera(scene, settings);
    const RayComparison result =
        compare_with_rays(ray_cast(scene.model.triangles, camera, robust(), 2), picture.ids, depths,
                          scene.model.triangles, camera, F32::kInfo.numbers);
    SCOPED_TRACE(c.model);
    expect_explained(result, c.most_ties);
    EXPECT_LT(result.max_depth_difference, 1e-4);
  }
}

TEST(EmbreeMissing, SaysSo) {
  if (has_embree()) GTEST_SKIP() << "Embree " << embree_version();
  EXPECT_EQ(input_error([] { ray_cast({}, camera_at_3(8, 8), false, 1); }),
            "--embree: Embree was not found at build time");
}

}  // namespace
}  // namespace rasterbench
