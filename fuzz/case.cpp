#include "fuzz/case.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/geometry.h"
#include "scene/dat.h"

namespace rasterbench::fuzz {
namespace {

std::string float_text(float v) {
  if (std::isnan(v)) return "std::numeric_limits<float>::quiet_NaN()";
  if (std::isinf(v)) return fmt::format("{}std::numeric_limits<float>::infinity()", v < 0 ? "-" : "");
  return fmt::format("{:a}f", v);
}

std::string point_text(const Vec3& p) {
  return fmt::format("{{{}, {}, {}}}", float_text(p.x), float_text(p.y), float_text(p.z));
}

/// What the course contract's camera at (0, 0, kDistance) sees of a point, solved for the point. The field of
/// view is one for which tan(theta / 2) is 1/2 in double, so that the camera's numbers are powers of two.
constexpr double kDistance = 2;
const double kTheta = 2 * std::atan(0.5);
constexpr double kNear = 1, kFar = 4;

Vec3 seen_at(const Vec3& p, int width, int height) {
  // d = (a w + b) / w with w the distance along the view axis; a + b / kNear = -1 and a + b / kFar = 1.
  constexpr double b = -2 * kNear * kFar / (kFar - kNear), a = (kFar + kNear) / (kFar - kNear);
  const double w = std::clamp(b / (double{p.z} - a), kNear / 4, 4 * kFar);
  const double of_side = w * 0.5;  // world units from the middle of the image to its top edge
  return {static_cast<float>((2 * double{p.x} - width) / height * of_side),
          static_cast<float>((1 - 2 * double{p.y} / height) * of_side), static_cast<float>(kDistance - w)};
}

bool same_corners(const ScreenTriangle<float>& a, const ScreenTriangle<float>& b) {
  return std::equal(a.x, a.x + 3, b.x) && std::equal(a.y, a.y + 3, b.y) && std::equal(a.d, a.d + 3, b.d);
}

}  // namespace

ScreenInput screen_input(const FuzzCase& fuzz_case) {
  ScreenInput input{.triangles = {},
                    .ids = static_cast<std::int32_t>(fuzz_case.triangles.size()),
                    .width = fuzz_case.parameters.width,
                    .height = fuzz_case.parameters.height,
                    .fill = fuzz_case.fill};
  for (const Triangle& t : fuzz_case.triangles)
    input.triangles.push_back({{t.a.x, t.b.x, t.c.x},
                               {t.a.y, t.b.y, t.c.y},
                               {t.a.z, t.b.z, t.c.z},
                               static_cast<std::int32_t>(input.triangles.size())});
  return input;
}

Scene scene_of(const FuzzCase& fuzz_case) {
  check_scene_parameters(fuzz_case.parameters, "fuzz");
  return {{"fuzz", fuzz_case.triangles}, fuzz_case.parameters};
}

FrameSettings settings_of(const FuzzCase& fuzz_case) {
  return {.width = fuzz_case.parameters.width,
          .height = fuzz_case.parameters.height,
          .fill = fuzz_case.fill,
          .geometry = {.near_rule = fuzz_case.near_rule}};
}

float depth_value(float d, DepthFunction function) {
  if (function == DepthFunction::kNdc) return d;
  if (function == DepthFunction::kReversed) return static_cast<float>((double{d} - 1) / 2);
  return static_cast<float>(-1 - 1.5 * (1 - double{d}));  // -4 on the near plane, -1 on the far plane
}

std::string as_test(const FuzzCase& fuzz_case, std::string_view name, std::string_view relation,
                    std::string_view mode, const std::vector<std::string>& kernels) {
  const SceneParameters& p = fuzz_case.parameters;
  std::string text = fmt::format("TEST(Fuzz, {}) {{\n  const FuzzCase fuzz_case{{\n", name);
  if (fuzz_case.space == Space::kScreen) {
    text +=
        fmt::format("      .space = Space::kScreen,\n      .parameters = {{.height = {}, .width = {}}},\n",
                    p.height, p.width);
  } else {
    text += fmt::format(
        "      .space = Space::kWorld,\n      .parameters = {{.camera = {{{:a}, {:a}, {:a}}},\n"
        "                     .height = {},\n                     .width = {},\n"
        "                     .theta = {:a},\n                     .near_plane = {:a},\n"
        "                     .far_plane = {:a}}},\n",
        p.camera.x, p.camera.y, p.camera.z, p.height, p.width, p.theta, p.near_plane, p.far_plane);
  }
  if (fuzz_case.fill == FillRule::kTopLeft) text += "      .fill = FillRule::kTopLeft,\n";
  if (fuzz_case.near_rule == NearRule::kOff) text += "      .near_rule = NearRule::kOff,\n";
  text += fmt::format("      .seed = {}u,\n      .triangles = {{", fuzz_case.seed);
  for (std::size_t i = 0; i < fuzz_case.triangles.size(); ++i) {
    const Triangle& t = fuzz_case.triangles[i];
    text += fmt::format("{}{{{}, {}, {}}}", i == 0 ? "" : ",\n                    ", point_text(t.a),
                        point_text(t.b), point_text(t.c));
  }
  std::string asked;
  for (const std::string& kernel : kernels)
    asked += fmt::format("{}\"{}\"", asked.empty() ? "" : ", ", kernel);
  text += fmt::format("}}}};\n  EXPECT_EQ(violation(\"{}\", \"{}\", fuzz_case{}), \"\");\n}}\n", relation,
                      mode, asked.empty() ? "" : ", {" + asked + "}");
  return text;
}

bool write_pair(const FuzzCase& fuzz_case, const std::filesystem::path& stem) {
  FuzzCase world = fuzz_case;
  bool exact = true;
  if (fuzz_case.space == Space::kScreen) {
    world.space = Space::kWorld;
    const int width = fuzz_case.parameters.width, height = fuzz_case.parameters.height;
    world.parameters.camera = {0, 0, kDistance};
    world.parameters.theta = kTheta;
    world.parameters.near_plane = kNear;
    world.parameters.far_plane = kFar;
    for (Triangle& t : world.triangles)
      t = {seen_at(t.a, width, height), seen_at(t.b, width, height), seen_at(t.c, width, height)};
    std::vector<ScreenTriangle<float>> slots(world.triangles.size()), extra;
    GeometryCounts counts;
    transform_triangles<float>(world.triangles, 0, make_screen_transform(make_camera(world.parameters)), {},
                               slots.data(), extra, counts);
    const ScreenInput wanted = screen_input(fuzz_case);
    exact = extra.empty() && std::equal(slots.begin(), slots.end(), wanted.triangles.begin(), same_corners);
  }
  const auto with = [&](const char* extension) { return std::filesystem::path(stem).concat(extension); };
  write_dat(scene_of(world).model, with(".dat"));
  write_scene_parameters(world.parameters, with(".txt"));
  return exact;
}

}  // namespace rasterbench::fuzz
