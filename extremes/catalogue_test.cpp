// The catalogue: complete, strict, and exact where it says so.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>

#include "extremes/constructions.h"
#include "extremes/meshes.h"
#include "pipeline/geometry.h"
#include "scene/test_folder.h"

namespace rasterbench::extremes {
namespace {

std::vector<Case> built_in() { return read_catalogue(built_in_catalogue(), "catalogue.toml"); }

TEST(Catalogue, HoldsEveryNumber) {
  std::set<int> numbers;
  for (const Case& one : built_in()) {
    numbers.insert(one.number);
    EXPECT_EQ(one.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-"), std::string::npos)
        << one.name;
  }
  for (int number = 1; number <= 45; ++number) EXPECT_TRUE(numbers.contains(number)) << number;
}

constexpr const char* kSmallest = R"([[case]]
number = 9
name = "small"
world = [[0,0,0, 1,0,0, 0,1,0]]
must = { pixels = 0 }
)";

Case read_one(const std::string& text) {
  const auto cases = read_catalogue(text, "c.toml");
  EXPECT_EQ(cases.size(), 1u);
  return cases.at(0);
}

TEST(Catalogue, FillsInDefaults) {
  const Case one = read_one(kSmallest);
  EXPECT_EQ(one.number, 9);
  EXPECT_EQ(one.parameters.width, 64);
  EXPECT_EQ(one.fills, (std::vector{FillRule::kClosed, FillRule::kTopLeft}));
  EXPECT_EQ(one.near_rule, NearRule::kClip);
  EXPECT_EQ(one.must.pixels, 0);
  EXPECT_FALSE(one.must.match_oracle || one.must.watertight || one.must.same_as);
}

TEST(Catalogue, ReadsBitsThatDecimalsHide) {
  const Case one = read_one(R"([[case]]
number = 1
name = "bits"
world = [[nan, inf, -inf, -0.0, "-0x0p0", "0x1.8p-149", 1e-45, "0x1.fffffep+127", 7]]
must = { pixels = 0 }
)");
  const Triangle t = scene_of(one).model.triangles.at(0);
  EXPECT_TRUE(std::isnan(t.a.x));
  EXPECT_EQ(t.a.y, INFINITY);
  EXPECT_EQ(t.a.z, -INFINITY);
  EXPECT_TRUE(t.b.x == 0 && std::signbit(t.b.x));
  EXPECT_TRUE(t.b.y == 0 && std::signbit(t.b.y));
  EXPECT_EQ(std::bit_cast<std::uint32_t>(t.b.z), 2u) << "a tie, rounded to even";
  EXPECT_EQ(std::bit_cast<std::uint32_t>(t.c.x), 1u);
  EXPECT_EQ(t.c.y, std::numeric_limits<float>::max());
}

TEST(Catalogue, RefusesWhatItDoesNotKnow) {
  // The part of kSmallest that is replaced, by what, and what the error says, the line first.
  const struct {
    std::string from, to;
    std::vector<std::string> parts;
  } mistakes[] = {
      {"must", "colour = 3\nmust", {"c.toml:5", "colour", "unknown key of [[case]]"}},
      {"pixels", "pixel", {"c.toml:5", "pixel:", "did you mean 'pixels'"}},
      {"{ pixels = 0 }", "{}", {"c.toml:1", "must", "asks for nothing"}},
      {"{ pixels = 0 }", "{ match = [\"oracel\"] }", {"c.toml:5", "match", "did you mean 'oracle'"}},
      {"{ pixels = 0 }", "{ survivors = [\"f64\"] }", {"c.toml:1", "must", "about the truth"}},
      {"{ pixels = 0 }",
       "{ match = [\"truth\"], survivors = [\"f65\"] }",
       {"c.toml:5", "survivors", "did you mean 'f64'"}},
      {"{ pixels = 0 }", "{ equal = true }", {"c.toml:1", "about the oracle"}},
      {"{ pixels = 0 }", "{ error = [\"x\"] }", {"c.toml:1", "model_file or parameter_file"}},
      {"{ pixels = 0 }", "{ owners = [[64, 0, 1]] }", {"c.toml:5", "pixel 64,0 is not in the image"}},
      {"{ pixels = 0 }", "{ same_as = { change = \"shifted\" } }", {"c.toml:5", "on the screen"}},
      {"world = [[0,0,0, 1,0,0, 0,1,0]]\nmust = { pixels = 0 }",
       "screen = [[0,0,2, 1,0,2, 0,1,2]]\nmust = { same_as = { change = \"mirrored\" } }",
       {"c.toml:1", "top-left"}},
      {"{ pixels = 0 }", "{ counts = { lost = 1 } }", {"c.toml:5", "lost", "unknown key of counts"}},
      {"number = 9\n", "", {"c.toml:1", "number", "missing"}},
      {"number = 9", "number = 9.5", {"c.toml:2", "number", "whole number"}},
      {"[[0,0,0, 1,0,0, 0,1,0]]", "[[0,0,0]]", {"c.toml:4", "world", "9 numbers"}},
      {"[[0,0,0, 1,0,0, 0,1,0]]", "[[0,0,0, 1,0,0, 0,1,1e39]]", {"c.toml:4", "float32"}},
      {"[[0,0,0, 1,0,0, 0,1,0]]", "[[0,0,0, 1,0,0, 0,1,\"one\"]]", {"c.toml:4", "world", "must be a number"}},
      {"world = [[0,0,0, 1,0,0, 0,1,0]]",
       "generator = \"teapot\"\nscreen = [[0,0,2, 1,0,2, 0,1,2]]",
       {"c.toml:1", "this one has 2"}},
      {"world = [[0,0,0, 1,0,0, 0,1,0]]",
       "screen = [[0,0,2, 1,0,2, 0,1,2]]\nsize = [48, 64]",
       {"c.toml:5", "size", "powers of two"}},
      {"world = [[0,0,0, 1,0,0, 0,1,0]]",
       "screen = [[0,0,2, 1,0,2, 0,1,2]]\ncamera = [1, 2, 3]",
       {"c.toml:5", "camera", "unknown key"}},
      {"world = [[0,0,0, 1,0,0, 0,1,0]]",
       "construct = { name = \"fun\" }",
       {"c.toml:4", "name", "did you mean 'fan'"}},
      {"world = [[0,0,0, 1,0,0, 0,1,0]]",
       "construct = { name = \"fan\", triangles = 2.5 }",
       {"c.toml:4", "triangles", "whole number"}},
      {"world = [[0,0,0, 1,0,0, 0,1,0]]",
       "construct = { name = \"fan\", blades = 3 }",
       {"c.toml:4", "blades", "unknown key of construct"}},
      {"[[case]]", "[[cases]]", {"c.toml:1", "cases", "unknown key of a catalogue"}},
      {"{ pixels = 0 }", "{ pixels = 0", {"c.toml:"}},
      {"must = { pixels = 0 }\n",
       "must = { pixels = 0 }\n" + std::string(kSmallest),
       {"c.toml:6", "two cases"}},
  };
  for (const auto& mistake : mistakes) {
    std::string text = kSmallest;
    text.replace(text.find(mistake.from), mistake.from.size(), mistake.to);
    const std::string error = input_error([&] { read_catalogue(text, "c.toml"); });
    for (const std::string& part : mistake.parts)
      EXPECT_NE(error.find(part), std::string::npos) << part << " is not in: " << error << "\n" << text;
  }
}

TEST(Catalogue, FilesThatCannotBeReadAreNamed) {
  const TestFolder folder;
  EXPECT_NE(input_error([&] { read_catalogue_file(folder / "none.toml"); }).find("none.toml"),
            std::string::npos);
  EXPECT_EQ(read_catalogue_file(folder.file("small.toml", kSmallest)).size(), 1u);
}

/// The double screen corners of a scene, unclipped.
std::vector<ScreenTriangle<double>> projected(const Scene& scene) {
  std::vector<ScreenTriangle<double>> slots(scene.model.triangles.size()), extra;
  GeometryCounts counts;
  transform_triangles<double>(scene.model.triangles, 0, make_screen_transform(make_camera(scene.parameters)),
                              {}, slots.data(), extra, counts);
  return slots;
}

TEST(ScreenScene, PutsCornersWhereTheyAreTold) {
  // Fractions of 1/4096 px and depths with three fraction bits: the pipeline adds no rounding to them.
  const std::vector<ScreenCorners> corners{
      {{{0.000244140625, 63.999755859375, 2}, {33.5, 1.125, 4.125}, {-7.25, 20.0625, 8.875}}},
      {{{-100, -200, 1}, {2000.5, 3.5, 3}, {0.5, 1000.5, 9}}}};
  const auto screen = projected(screen_scene(corners, 128, 64));
  for (std::size_t t = 0; t < corners.size(); ++t)
    for (int i = 0; i < 3; ++i) {
      const ScreenCorner& c = corners[t][static_cast<std::size_t>(i)];
      EXPECT_EQ(screen[t].x[i], c.x);
      EXPECT_EQ(screen[t].y[i], c.y);
      EXPECT_EQ(screen[t].d[i], (1.25 * c.w - 2.25) / c.w);
    }
  EXPECT_NE(input_error([&] { screen_scene(corners, 100, 64); }).find("100x64"), std::string::npos);
}

TEST(ScreenScene, LiteralCasesAreExact) {
  int checked = 0;
  for (const Case& one : built_in()) {
    if (one.input.screen.empty() || one.name == "nearly_collinear") continue;  // that one is about rounding
    const Scene scene = scene_of(one);
    const auto screen = projected(scene);
    for (std::size_t t = 0; t < screen.size(); ++t) {
      if (screen[t].id < 0) continue;
      for (std::size_t i = 0; i < 3; ++i, ++checked) {
        EXPECT_EQ(screen[t].x[i], one.input.screen[t][3 * i]) << one.name;
        EXPECT_EQ(screen[t].y[i], one.input.screen[t][3 * i + 1]) << one.name;
      }
    }
  }
  EXPECT_GT(checked, 50);
}

double area(const ScreenCorners& t) {
  return ((t[1].x - t[0].x) * (t[2].y - t[0].y) - (t[1].y - t[0].y) * (t[2].x - t[0].x)) / 2;
}

TEST(Meshes, TurnNoTriangleOver) {
  // Otherwise an overlap would be the mesh's and not the mode's.
  for (const auto& mesh :
       {jittered_plane(2000, 0.3, 0, 1, 64, 64), jittered_plane(500, 0.25, 2, 1, 64, 64), lattice(4, 64, 64),
        refined_plane(1, 0.05, 64, 64), fan(50, 1, kFlatW, 0, 64, 64)}) {
    ASSERT_GT(mesh.size(), 40u);
    for (const ScreenCorners& t : mesh) EXPECT_GT(area(t), 0.01);
  }
}

TEST(Meshes, RefinedPlaneHasNoTJunctions) {
  // Every edge inside of the square belongs to two triangles, in opposite directions.
  std::map<std::array<double, 4>, int> edges;
  const auto mesh = refined_plane(1, 0.05, 64, 64);
  for (const ScreenCorners& t : mesh)
    for (std::size_t e = 0; e < 3; ++e) {
      const ScreenCorner &a = t[e], &b = t[(e + 1) % 3];
      ++edges[{a.x, a.y, b.x, b.y}];
      --edges[{b.x, b.y, a.x, a.y}];
    }
  int border = 0;
  for (const auto& [edge, surplus] : edges) {
    if (surplus == 0) continue;
    ++border;
    const auto [ax, ay, bx, by] = edge;
    EXPECT_TRUE((ax == bx && (ax == -8 || ax == 72)) || (ay == by && (ay == -8 || ay == 72)));
  }
  EXPECT_GT(border, 16);
  EXPECT_LT(border, static_cast<int>(mesh.size()));
}

TEST(Meshes, SphereIsClosed) {
  std::map<std::array<float, 6>, int> edges;
  for (const Triangle& t : sphere(8, 1.5)) {
    const Vec3 corners[] = {t.a, t.b, t.c};
    for (std::size_t e = 0; e < 3; ++e) {
      const Vec3 &a = corners[e], &b = corners[(e + 1) % 3];
      ++edges[{a.x, a.y, a.z, b.x, b.y, b.z}];
      --edges[{b.x, b.y, b.z, a.x, a.y, a.z}];
    }
  }
  EXPECT_GT(edges.size(), 100u);
  for (const auto& [edge, surplus] : edges) EXPECT_EQ(surplus, 0);
}

TEST(Meshes, TranslationKeepsTheView) {
  Scene scene{.model = {.name = "t", .triangles = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}}, .parameters = {}};
  scene.parameters.camera = {0, 0, 4};
  const Scene moved = translated(scene, 1024);
  EXPECT_EQ(moved.parameters.camera.z, 1028);
  EXPECT_EQ(moved.model.triangles[0].b.z, 1024);
  const auto before = projected(scene), after = projected(moved);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(before[0].x[i], after[0].x[i], 1e-9);
    EXPECT_NEAR(before[0].y[i], after[0].y[i], 1e-9);
  }
}

}  // namespace
}  // namespace rasterbench::extremes
