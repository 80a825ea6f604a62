#include "scene/parameters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "scene/test_folder.h"

namespace rasterbench {
namespace {

const std::string kGood = "210 215 225\n28 32 40\n0.7 0.78 1.51\n1080 1920\n0.785398163\n0.1 10\n";

/// kGood with the first `from` replaced by `to`.
std::string changed(const std::string& from, const std::string& to) {
  std::string text = kGood;
  return text.replace(text.find(from), from.size(), to);
}

/// The error on a file of this text, without the file's path, which it must begin with.
std::string error_of(const std::string& text) {
  const TestFolder folder;
  const std::string path = folder.file("x.txt", text).string();
  const std::string error = input_error([&] { read_scene_parameters(path); });
  EXPECT_TRUE(error.starts_with(path)) << error;
  return error.substr(std::min(path.size(), error.size()));
}

SceneParameters read(const std::string& text) {
  const TestFolder folder;
  return read_scene_parameters(folder.file("x.txt", text));
}

void expect_equal(const SceneParameters& a, const SceneParameters& b) {
  EXPECT_EQ(a.object.r, b.object.r);
  EXPECT_EQ(a.object.g, b.object.g);
  EXPECT_EQ(a.object.b, b.object.b);
  EXPECT_EQ(a.background.r, b.background.r);
  EXPECT_EQ(a.background.g, b.background.g);
  EXPECT_EQ(a.background.b, b.background.b);
  EXPECT_EQ(a.camera.x, b.camera.x);
  EXPECT_EQ(a.camera.y, b.camera.y);
  EXPECT_EQ(a.camera.z, b.camera.z);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.theta, b.theta);
  EXPECT_EQ(a.near_plane, b.near_plane);
  EXPECT_EQ(a.far_plane, b.far_plane);
}

TEST(Parameters, ReadsTheContract) {
  const SceneParameters p = read("1 2 3\n4 5 6\n-0.5 +1.5 2e-1\n7 8\n.5\n1e-9 1E9\n");
  EXPECT_EQ(p.object.r, 1);
  EXPECT_EQ(p.object.b, 3);
  EXPECT_EQ(p.background.g, 5);
  EXPECT_EQ(p.camera.x, -0.5);
  EXPECT_EQ(p.camera.y, 1.5);
  EXPECT_EQ(p.camera.z, 0.2);
  EXPECT_EQ(p.height, 7);
  EXPECT_EQ(p.width, 8);
  EXPECT_EQ(p.theta, 0.5);
  EXPECT_EQ(p.near_plane, 1e-9);
  EXPECT_EQ(p.far_plane, 1e9);
}

TEST(Parameters, AnyWhiteSpaceSeparates) {
  expect_equal(read(kGood), SceneParameters{.camera = {0.7, 0.78, 1.51}});
  std::string text = kGood;
  for (char& c : text)
    if (c == '\n') c = ' ';
  expect_equal(read(text), read(kGood));
  text.pop_back();
  expect_equal(read(text), read(kGood));
  for (char& c : text)
    if (c == ' ') c = '\t';
  expect_equal(read("\r\n\v\f" + text + "\r\n\r\n"), read(kGood));
}

TEST(Parameters, WritingAndReadingKeepsEveryBit) {
  const TestFolder folder;
  SceneParameters p;
  p.object = {0, 255, 1};
  p.camera = {0.1, -1.0 / 3, 1e-30};
  p.height = 65536;
  p.width = 1;
  p.theta = std::nextafter(3.0, 4.0);
  p.near_plane = 1e-9;
  p.far_plane = 1.0 / 3 * 1e9;
  write_scene_parameters(p, folder / "x.txt");
  expect_equal(read_scene_parameters(folder / "x.txt"), p);
  write_scene_parameters(SceneParameters{.camera = {0.7, 0.78, 1.51}}, folder / "y.txt");
  EXPECT_EQ(read_bytes(folder / "y.txt"), kGood);
  EXPECT_EQ(input_error([&] { write_scene_parameters({.theta = 4}, "z.txt"); }),
            "z.txt: theta: 4 is not in (0, pi) radians; degrees?");
}

TEST(Parameters, Colours) {
  EXPECT_EQ(error_of(changed("210", "256")), ":1: object red: '256' is not an integer in 0..255");
  EXPECT_EQ(error_of(changed("215", "-1")), ":1: object green: '-1' is not an integer in 0..255");
  EXPECT_EQ(error_of(changed("225", "0.5")), ":1: object blue: '0.5' is not an integer in 0..255");
  EXPECT_EQ(error_of(changed("28", "red")), ":2: background red: 'red' is not an integer in 0..255");
  EXPECT_EQ(error_of(changed("32", "9999999999999")),
            ":2: background green: '9999999999999' is not an integer in 0..255");
  EXPECT_EQ(error_of(changed("40", "+-4")), ":2: background blue: '+-4' is not an integer in 0..255");
}

TEST(Parameters, Camera) {
  EXPECT_EQ(error_of(changed("0.7 ", "0,7 ")), ":3: camera x: '0,7' is not a number");
  EXPECT_EQ(error_of(changed("0.78", "nan")), ":3: camera y: 'nan' is not finite");
  EXPECT_EQ(error_of(changed("1.51", "-inf")), ":3: camera z: '-inf' is not finite");
  EXPECT_EQ(error_of(changed("1.51", "1e999")), ":3: camera z: '1e999' is out of the range of a double");
  EXPECT_EQ(error_of(changed("1.51", "1.51m")), ":3: camera z: '1.51m' is not a number");
  EXPECT_EQ(error_of(changed("1.51", "0x1p3")), ":3: camera z: '0x1p3' is not a number");
  EXPECT_EQ(error_of(changed("0.7 0.78 1.51", "0 -0 0.0")),
            ":3: camera x: the camera is at the origin, which it should look at");
  EXPECT_EQ(error_of(changed("0.7 0.78 1.51", "1.7e308 1.7e308 0")),
            ":3: camera x: the camera's distance from the origin, inf, is out of range");
}

TEST(Parameters, Size) {
  EXPECT_EQ(error_of(changed("1080", "0")), ":4: height: '0' is not an integer in 1..65536");
  EXPECT_EQ(error_of(changed("1920", "65537")), ":4: width: '65537' is not an integer in 1..65536");
  EXPECT_EQ(error_of(changed("1920", "1e3")), ":4: width: '1e3' is not an integer in 1..65536");
  EXPECT_EQ(error_of(changed("1080", "1080.0")), ":4: height: '1080.0' is not an integer in 1..65536");
}

TEST(Parameters, Theta) {
  const std::string theta = "0.785398163";
  EXPECT_EQ(error_of(changed(theta, "0")), ":5: theta: 0 is not in (0, pi) radians");
  EXPECT_EQ(error_of(changed(theta, "-0.5")), ":5: theta: -0.5 is not in (0, pi) radians");
  EXPECT_EQ(error_of(changed(theta, "45")), ":5: theta: 45 is not in (0, pi) radians; degrees?");
  EXPECT_EQ(error_of(changed(theta, "180")), ":5: theta: 180 is not in (0, pi) radians; degrees?");
  EXPECT_EQ(error_of(changed(theta, "3.1416")), ":5: theta: 3.1416 is not in (0, pi) radians; degrees?");
  EXPECT_EQ(error_of(changed(theta, "180.5")), ":5: theta: 180.5 is not in (0, pi) radians");
  EXPECT_EQ(error_of(changed(theta, "3.141592653589793")),
            ":5: theta: 3.141592653589793 is not in (0, pi) radians");
  EXPECT_EQ(error_of(changed(theta, "1e-310")), ":5: theta: 1e-310 is too small");
  EXPECT_EQ(read(changed(theta, "3.141592653589")).theta, 3.141592653589);
}

TEST(Parameters, NearAndFar) {
  EXPECT_EQ(error_of(changed("0.1 10", "0 10")), ":6: near: 0 is not above 0");
  EXPECT_EQ(error_of(changed("0.1 10", "-1 10")), ":6: near: -1 is not above 0");
  EXPECT_EQ(error_of(changed("0.1 10", "10 10")), ":6: near: 10 is not below far, 10");
  EXPECT_EQ(error_of(changed("0.1 10", "11 10")), ":6: near: 11 is not below far, 10");
  EXPECT_EQ(error_of(changed("0.1 10", "1\n1e308")),
            ":7: far: near * far, 1 * 1e+308, is out of the range of a double");
}

TEST(Parameters, TooFewAndTooMany) {
  EXPECT_EQ(error_of(""), ":1: object red: missing: the file ends here");
  EXPECT_EQ(error_of(" \n\n"), ":3: object red: missing: the file ends here");
  EXPECT_EQ(error_of(changed("0.1 10\n", "0.1")), ":6: far: missing: the file ends here");
  EXPECT_EQ(error_of(kGood + "\n7 8"), ":8: '7' after the last field, far");
  EXPECT_EQ(error_of(kGood + "# comment"), ":7: '#' after the last field, far");
}

TEST(Parameters, AnotherFileIsNotPrinted) {
  EXPECT_EQ(error_of(std::string("\x89PNG\0\x1a", 6) + std::string(60, 'x')),
            ":1: object red: '?PNG??xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...' is not an integer in 0..255");
  EXPECT_EQ(error_of(std::string(70000, '1')), ": longer than 65536 bytes: not a scene parameter file");
  EXPECT_EQ(input_error([] { read_scene_parameters("/no/such/x.txt"); }),
            "/no/such/x.txt: cannot open: No such file or directory");
  EXPECT_EQ(input_error([] { read_scene_parameters("/tmp"); }), "/tmp: cannot read: Is a directory");
}

TEST(Parameters, CheckNamesTheLineOnlyWhereItIsKnown) {
  SceneParameters p;
  check_scene_parameters(p, "--size");
  p.height = 0;
  EXPECT_EQ(input_error([&] { check_scene_parameters(p, "--size"); }),
            "--size: height: 0 is not in 1..65536");
  EXPECT_EQ(input_error([&] {
              check_scene_parameters(p, "f", {{"height", 9}});
            }),
            "f:9: height: 0 is not in 1..65536");
  p.height = 1;
  p.width = 65537;
  EXPECT_EQ(input_error([&] { check_scene_parameters(p, "--size"); }),
            "--size: width: 65537 is not in 1..65536");
  p.width = 1;
  p.theta = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(input_error([&] { check_scene_parameters(p, "f"); }), "f: theta: nan is not finite");
  p.theta = 1;
  p.far_plane = std::numeric_limits<double>::infinity();
  EXPECT_EQ(input_error([&] { check_scene_parameters(p, "f"); }), "f: far: inf is not finite");
}

TEST(Parameters, FramingShowsTheWholeModel) {
  for (const float size : {1e-20f, 1.0f, 1e6f, 3e38f}) {
    Model model;
    model.triangles = {{{size, 0, 0}, {0, size, 0}, {0, 0, -size}},
                       {{-size, 0, 0}, {0, -size, 0}, {0, 0, size}}};
    model.triangles.push_back({{std::numeric_limits<float>::quiet_NaN(), 0, 0},
                               {std::numeric_limits<float>::infinity(), 0, 0},
                               {0, 0, 0}});
    const SceneParameters p = framing_parameters(model);
    check_scene_parameters(p, "framing");
    const Camera c = make_camera(p);
    for (std::size_t i = 0; i < 2; ++i) {
      for (const Vec3& v : {model.triangles[i].a, model.triangles[i].b, model.triangles[i].c}) {
        const auto at = [&](const AffineRow& r) { return r.x * v.x + r.y * v.y + r.z * v.z + r.w; };
        const double w = at(c.w);
        EXPECT_GT(at(c.near_distance), 0);
        EXPECT_LE(std::abs(at(c.x)), w);
        EXPECT_LE(std::abs(at(c.y)), w);
        EXPECT_LE(std::abs(at(c.z)), w);
      }
    }
  }
  expect_equal(framing_parameters({}), SceneParameters{});
}

}  // namespace
}  // namespace rasterbench
