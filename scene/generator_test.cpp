#include "scene/generator.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

#include "scene/test_folder.h"

namespace rasterbench {
namespace {

std::string bytes_hash(const std::string& specification) {
  const std::vector<Triangle> triangles = generate(specification).model.triangles;
  return fmt::format("{:016x}", XXH3_64bits(triangles.data(), triangles.size() * sizeof(Triangle)));
}

std::int64_t count(const std::string& specification) {
  return static_cast<std::int64_t>(generate(specification).model.triangles.size());
}

Vec3d cross_of(const Triangle& t) {
  const Vec3d u{double{t.b.x} - t.a.x, double{t.b.y} - t.a.y, double{t.b.z} - t.a.z};
  const Vec3d v{double{t.c.x} - t.a.x, double{t.c.y} - t.a.y, double{t.c.z} - t.a.z};
  return {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
}

std::array<Vec3, 3> corners(const Triangle& t) { return {t.a, t.b, t.c}; }

struct ScreenPoint {
  double x, y, d, in_front_of_near;
};

ScreenPoint project(const Camera& c, const Vec3& v) {
  const auto at = [&](const AffineRow& r) { return r.x * v.x + r.y * v.y + r.z * v.z + r.w; };
  const double w = at(c.w);
  return {at(c.x) / w, at(c.y) / w, at(c.z) / w, at(c.near_distance)};
}

std::string error_of(const std::string& specification) {
  return input_error([&] { generate(specification); });
}

TEST(Generators, AreListedByName) {
  std::vector<std::string> names;
  for (const Generator& generator : generators()) names.push_back(generator.name);
  EXPECT_EQ(names, (std::vector<std::string>{"confetti", "layers", "teapot", "terrain"}));
  for (const Generator& generator : generators()) {
    EXPECT_FALSE(generator.meaning.empty());
    for (const GeneratorKey& key : generator.keys) {
      EXPECT_FALSE(key.meaning.empty()) << key.name;
      if (!key.words.empty()) continue;
      EXPECT_LE(key.minimum, key.default_value) << key.name;
      EXPECT_GE(key.maximum, key.default_value) << key.name;
    }
  }
}

TEST(Generators, SpecificationsThatAreWrong) {
  EXPECT_EQ(error_of("teapto"), "teapto: unknown generator 'teapto'; did you mean 'teapot'?");
  EXPECT_EQ(error_of(""), "unknown generator ''; known: confetti, layers, teapot, terrain");
  EXPECT_EQ(error_of("terrain:"), "terrain:: no KEY=VALUE after ':'");
  EXPECT_EQ(error_of("terrain:seed"), "terrain:seed: 'seed' is not KEY=VALUE");
  EXPECT_EQ(error_of("terrain:seed=1,,"), "terrain:seed=1,,: no KEY=VALUE after the last ','");
  EXPECT_EQ(error_of("terrain:,seed=1"), "terrain:,seed=1: '' is not KEY=VALUE");
  EXPECT_EQ(error_of("terrain:sead=1"), "terrain:sead=1: unknown key 'sead'; did you mean 'seed'?");
  EXPECT_EQ(error_of("terrain:seed=1,seed=1"), "terrain:seed=1,seed=1: seed: given twice");
  EXPECT_EQ(error_of("terrain:seed="), "terrain:seed=: seed: '' is not a number");
  EXPECT_EQ(error_of("terrain:seed=1x"), "terrain:seed=1x: seed: '1x' is not a number");
  EXPECT_EQ(error_of("terrain:seed=nan"), "terrain:seed=nan: seed: 'nan' is not a number");
  EXPECT_EQ(error_of("terrain:seed=1e999"), "terrain:seed=1e999: seed: '1e999' is not a number");
  EXPECT_EQ(error_of("terrain:seed=0.5"), "terrain:seed=0.5: seed: 0.5 is not an integer");
  EXPECT_EQ(error_of("terrain:seed=-1"), "terrain:seed=-1: seed: -1 is not in 0..9007199254740991");
  EXPECT_EQ(error_of("terrain:roughness=1.5"), "terrain:roughness=1.5: roughness: 1.5 is not in 0..1");
  EXPECT_EQ(error_of("teapot:triangles=63"), "teapot:triangles=63: triangles: 63 is not in 64..200000000");
  EXPECT_EQ(error_of("layers:order=backwards"),
            "layers:order=backwards: order: unknown value 'backwards'; known: front-to-back, back-to-front, "
            "random");
  EXPECT_EQ(error_of("layers:order=front-to-bak"),
            "layers:order=front-to-bak: order: unknown value 'front-to-bak'; did you mean 'front-to-back'?");
}

TEST(Generators, NumbersMayBeWrittenWithExponents) {
  EXPECT_EQ(count("confetti:triangles=1e3"), 1000);
  EXPECT_EQ(bytes_hash("confetti:triangles=1e2,size=1.2e1"), bytes_hash("confetti:size=12,triangles=100"));
  EXPECT_EQ(generate("confetti:triangles=1e1").model.name, "confetti:triangles=1e1");
}

TEST(Generators, TheSameBytesEverywhere) {
  EXPECT_EQ(bytes_hash("teapot:triangles=1000"), "9a526f7de179e98c");
  EXPECT_EQ(bytes_hash("terrain:triangles=1000"), "6f842d93449701eb");
  EXPECT_EQ(bytes_hash("terrain:triangles=1000,seed=2,roughness=0.7"), "6d46d42c7d8c0585");
  EXPECT_EQ(bytes_hash("confetti:triangles=1000"), "0e7f941a7b3fde94");
  EXPECT_EQ(bytes_hash("confetti:triangles=1000,seed=2,distribution=heavy"), "4aec9c449349b608");
  EXPECT_EQ(bytes_hash("confetti:triangles=1000,distribution=corner"), "394ab4efdc31542c");
  EXPECT_EQ(bytes_hash("layers:triangles=1000"), "5741f92733991a02");
  EXPECT_EQ(bytes_hash("layers:triangles=1000,order=random,seed=2"), "182c3791b020fd96");
}

TEST(Generators, TheSeedChangesTheModel) {
  for (const std::string name :
       {"terrain:triangles=200", "confetti:triangles=200", "layers:triangles=200,order=random"}) {
    EXPECT_EQ(bytes_hash(name), bytes_hash(name + ",seed=1"));
    EXPECT_NE(bytes_hash(name), bytes_hash(name + ",seed=2"));
    EXPECT_NE(bytes_hash(name), bytes_hash(name + ",seed=9007199254740991"));
  }
}

TEST(Generators, CountsAreNearTheWish) {
  EXPECT_EQ(count("teapot"), 43056);
  EXPECT_EQ(count("teapot:triangles=64"), 52);
  EXPECT_EQ(count("confetti"), 100000);
  EXPECT_EQ(count("confetti:triangles=1"), 1);
  EXPECT_EQ(count("terrain"), 500000);
  EXPECT_EQ(count("terrain:triangles=2"), 2);
  EXPECT_EQ(count("layers:triangles=2,depth=1"), 2);
  EXPECT_EQ(count("layers:triangles=2,depth=10"), 20) << "at least a quad for each wall";
  for (const std::int64_t wish : {3000, 50000, 123456}) {
    for (const std::string name : {"teapot", "terrain", "layers", "confetti"}) {
      const auto got = static_cast<double>(count(fmt::format("{}:triangles={}", name, wish)));
      EXPECT_NEAR(got / static_cast<double>(wish), 1, 0.2) << name << " " << wish;
    }
  }
}

TEST(Generators, EveryTriangleIsFiniteHasAnAreaAndIsInFrontOfNear) {
  for (const std::string specification :
       {"teapot", "teapot:triangles=64", "teapot:triangles=3e5", "terrain", "terrain:triangles=2",
        "terrain:triangles=1e5,roughness=1,seed=3", "terrain:roughness=0", "confetti", "confetti:size=0.1",
        "confetti:size=500,triangles=1e4", "confetti:distribution=heavy",
        "confetti:size=0.1,distribution=heavy", "confetti:distribution=corner", "layers",
        "layers:depth=1000,order=random"}) {
    const Scene scene = generate(specification);
    check_scene_parameters(scene.parameters, specification);
    EXPECT_EQ(scene.parameters.width, 1920);
    EXPECT_EQ(scene.parameters.height, 1080);
    const Camera camera = make_camera(scene.parameters);
    std::size_t bad = 0;
    for (const Triangle& t : scene.model.triangles) {
      const Vec3d n = cross_of(t);
      bool good = std::isfinite(n.x + n.y + n.z) && n.x * n.x + n.y * n.y + n.z * n.z > 0;
      for (const Vec3& v : corners(t)) {
        const ScreenPoint p = project(camera, v);
        good = good && p.in_front_of_near > 0 && p.d < 1;
      }
      bad += good ? 0 : 1;
    }
    EXPECT_EQ(bad, 0u) << specification;
  }
}

TEST(Random, IsSplitMix64) {
  Random random(1234567);  // the values of the authors' C code
  EXPECT_EQ(random.bits(), 6457827717110365317u);
  EXPECT_EQ(random.bits(), 3203168211198807973u);
  EXPECT_EQ(random.bits(), 9817491932198370423u);
  double sum = 0;
  for (int i = 0; i < 10000; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    sum += u;
  }
  EXPECT_NEAR(sum / 10000, 0.5, 0.02);
}

TEST(Teapot, ItsBoxIsCentredAndTwoWide) {
  for (const std::string specification : {"teapot", "teapot:triangles=64", "teapot:triangles=2000"}) {
    Vec3 low{9, 9, 9}, high{-9, -9, -9};
    for (const Triangle& t : generate(specification).model.triangles) {
      for (const Vec3& v : corners(t)) {
        low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
        high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
      }
    }
    EXPECT_NEAR(high.x, 1, 1e-6);
    EXPECT_EQ(low.x, -high.x);
    EXPECT_EQ(low.y, -high.y);
    EXPECT_EQ(low.z, -high.z);
    EXPECT_LT(high.y, 0.6);
    EXPECT_LT(high.z, 0.7);
  }
}

TEST(Teapot, ItsTrianglesFaceOutward) {
  // The pot is near enough to a convex body of revolution that normals point away from a point inside the
  // body.
  double volume = 0;
  std::size_t outward = 0;
  const std::vector<Triangle> triangles = generate("teapot").model.triangles;
  for (const Triangle& t : triangles) {
    const Vec3d n = cross_of(t);
    volume += (n.x * t.a.x + n.y * t.a.y + n.z * t.a.z) / 6;
    outward += n.x * t.a.x + n.y * t.a.y + n.z * t.a.z > 0 ? 1u : 0u;
  }
  EXPECT_GT(volume, 0.7);
  EXPECT_GT(static_cast<double>(outward), 0.75 * static_cast<double>(triangles.size()));
}

TEST(Teapot, ItsOnlyHolesAreTheKnownOnes) {
  // Edges that no triangle shares, to the bit: rim and lid at the gap, and both ends of handle and spout: 4 +
  // 4 + 4 + 4 edges of patches, n segments each.
  using Point = std::array<float, 3>;
  std::map<std::pair<Point, Point>, int> edges;
  const Scene scene = generate("teapot:triangles=6320");  // n = 10
  ASSERT_EQ(scene.model.triangles.size(), 6320u);
  for (const Triangle& t : scene.model.triangles) {
    const std::array<Vec3, 3> v = corners(t);
    for (std::size_t i = 0; i < 3; ++i) {
      const Point from{v[i].x, v[i].y, v[i].z};
      const Point to{v[(i + 1) % 3].x, v[(i + 1) % 3].y, v[(i + 1) % 3].z};
      ++edges[{from, to}];
    }
  }
  int open = 0;
  for (const auto& [edge, times] : edges) {
    EXPECT_EQ(times, 1) << "two triangles run along an edge in the same direction";
    open += edges.contains({edge.second, edge.first}) ? 0 : 1;
  }
  EXPECT_EQ(open, 16 * 10);
}

TEST(Terrain, FacesUpAndItsFrontEdgeIsBelowThePicture) {
  for (const std::string specification :
       {"terrain:triangles=1e5", "terrain:triangles=1e4,roughness=1,seed=4"}) {
    const Scene scene = generate(specification);
    const Camera camera = make_camera(scene.parameters);
    for (const Triangle& t : scene.model.triangles) {
      ASSERT_GT(cross_of(t).y, 0);
      for (const Vec3& v : corners(t)) {
        ASSERT_LE(std::abs(v.y), 0.35f);
        if (v.z == 1) {
          ASSERT_LT(project(camera, v).y, -1);
        }
      }
    }
  }
}

TEST(Terrain, RoughnessIsRough) {
  const auto steepness = [](const std::string& specification) {
    double sum = 0;
    for (const Triangle& t : generate(specification).model.triangles) sum += std::abs(t.a.y - t.b.y);
    return sum;
  };
  EXPECT_GT(steepness("terrain:triangles=1e5,roughness=0.9"),
            3 * steepness("terrain:triangles=1e5,roughness=0.2"));
}

TEST(Confetti, IsAllInThePicture) {
  for (const std::string specification :
       {"confetti:triangles=3e4", "confetti:triangles=3e4,distribution=heavy",
        "confetti:triangles=3e3,size=500", "confetti:triangles=3e4,size=500,distribution=heavy",
        "confetti:triangles=3e3,size=500,distribution=corner"}) {
    const Scene scene = generate(specification);
    const Camera camera = make_camera(scene.parameters);
    for (const Triangle& t : scene.model.triangles) {
      for (const Vec3& v : corners(t)) {
        const ScreenPoint p = project(camera, v);
        ASSERT_LE(std::abs(p.x), 1);
        ASSERT_LE(std::abs(p.y), 1);
        ASSERT_LE(std::abs(p.d), 1);
      }
    }
  }
}

TEST(Confetti, SizesHaveTheirMean) {
  // In world units: edge = s * distance of the centre * 2 tan(theta/2) / 1080.
  for (const std::string distribution : {"uniform", "heavy"}) {
    const Scene scene = generate("confetti:triangles=2e5,size=10,distribution=" + distribution);
    double sum = 0, smallest = 1e9, largest = 0;
    for (const Triangle& t : scene.model.triangles) {
      const double distance = 4 - (double{t.a.z} + t.b.z + t.c.z) / 3;
      const double edge = std::hypot(double{t.a.x} - t.b.x, double{t.a.y} - t.b.y, double{t.a.z} - t.b.z);
      const double pixels = edge / distance * 1080 / (2 * std::tan(scene.parameters.theta / 2));
      sum += pixels;
      smallest = std::min(smallest, pixels);
      largest = std::max(largest, pixels);
    }
    EXPECT_NEAR(sum / 2e5, 10, 0.2) << distribution;
    const bool heavy = distribution == "heavy";
    EXPECT_NEAR(smallest, heavy ? 2.89 : 5, 0.01);
    EXPECT_NEAR(largest, heavy ? 261.5 : 15, heavy ? 2 : 0.01);
  }
}

TEST(Confetti, NineOfTenAreInTheCorner) {
  const auto in_corner = [](const std::string& distribution) {
    const Scene scene = generate("confetti:triangles=1e5,size=4,distribution=" + distribution);
    const Camera camera = make_camera(scene.parameters);
    std::size_t inside = 0;
    for (const Triangle& t : scene.model.triangles) {
      const ScreenPoint a = project(camera, t.a), b = project(camera, t.b), c = project(camera, t.c);
      const double x = (a.x + b.x + c.x) / 3, y = (a.y + b.y + c.y) / 3;  // y up, both in -1..1
      inside += x < -0.5 && y > 0.5;
    }
    return static_cast<double>(inside) / 1e5;
  };
  EXPECT_NEAR(in_corner("corner"), 0.9 + 0.1 / 16, 0.01);
  EXPECT_NEAR(in_corner("uniform"), 1.0 / 16, 0.005);
}

TEST(Layers, EveryWallFillsThePictureInItsOrder) {
  for (const std::string order : {"front-to-back", "back-to-front"}) {
    const Scene scene = generate("layers:triangles=800,depth=4,order=" + order);
    const Camera camera = make_camera(scene.parameters);
    const std::size_t per_wall = scene.model.triangles.size() / 4;
    double last = order == "front-to-back" ? -2 : 2;
    for (std::size_t wall = 0; wall < 4; ++wall) {
      ScreenPoint low{9, 9, 9, 0}, high{-9, -9, -9, 0};
      double area = 0;
      for (std::size_t i = 0; i < per_wall; ++i) {
        const Triangle& t = scene.model.triangles[wall * per_wall + i];
        const ScreenPoint a = project(camera, t.a), b = project(camera, t.b), c = project(camera, t.c);
        area += ((b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y)) / 2;
        for (const ScreenPoint& p : {a, b, c}) {
          low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.d, p.d), 0};
          high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.d, p.d), 0};
        }
      }
      EXPECT_NEAR(low.x, -1.02, 1e-6);
      EXPECT_NEAR(high.x, 1.02, 1e-6);
      EXPECT_NEAR(low.y, -1.02, 1e-6);
      EXPECT_NEAR(high.y, 1.02, 1e-6);
      EXPECT_NEAR(area, 2.04 * 2.04, 1e-5) << "no triangle is turned away or missing";
      EXPECT_LT(low.d, high.d) << "the walls have relief";
      EXPECT_TRUE(order == "front-to-back" ? low.d > last : high.d < last) << "walls never interpenetrate";
      last = order == "front-to-back" ? high.d : low.d;
    }
  }
}

TEST(Layers, RandomOrderIsAPermutation) {
  auto a = generate("layers:triangles=800").model.triangles;
  auto b = generate("layers:triangles=800,order=random").model.triangles;
  const auto less = [](const Triangle& s, const Triangle& t) { return std::memcmp(&s, &t, sizeof(s)) < 0; };
  EXPECT_FALSE(
      std::is_sorted(b.begin(), b.end(), [](const Triangle& s, const Triangle& t) { return s.a.z > t.a.z; }));
  std::sort(a.begin(), a.end(), less);
  std::sort(b.begin(), b.end(), less);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(Triangle)), 0);
}

}  // namespace
}  // namespace rasterbench
