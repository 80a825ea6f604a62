#include "extremes/constructions.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/suggest.h"
#include "extremes/meshes.h"

namespace rasterbench::extremes {
namespace {

GeneratorKey whole(std::string name, double fallback, double low, double high) {
  return {
      .name = std::move(name), .default_value = fallback, .minimum = low, .maximum = high, .integer = true};
}
GeneratorKey real(std::string name, double fallback, double low, double high) {
  return {.name = std::move(name), .default_value = fallback, .minimum = low, .maximum = high};
}

constexpr double kMostTriangles = 1e8;  // more than any case needs, and 4 GB

/// A family on the screen: mesh(values, width, height) gives its corners.
template <class Mesh>
ConstructionKind on_screen(std::string name, std::vector<GeneratorKey> keys, Mesh mesh) {
  return {.name = std::move(name),
          .keys = std::move(keys),
          .on_screen = true,
          .make = [mesh](const GeneratorValues& v, const SceneParameters& p) {
            return screen_scene(mesh(v, p.width, p.height), p.width, p.height);
          }};
}

std::uint64_t seed_of(const GeneratorValues& v) { return static_cast<std::uint64_t>(v.integer("seed")); }

Scene make_sphere(const GeneratorValues& v, const SceneParameters& p) {
  Scene scene{.model = {.name = "sphere",
                        .triangles = sphere(static_cast<int>(v.integer("rings")), v.number("radius"))},
              .parameters = p};
  if (v.integer("far_first") == 0) return scene;
  const auto towards_camera = [&](const Triangle& t) {
    const auto of = [&](const Vec3& c) { return c.x * p.camera.x + c.y * p.camera.y + c.z * p.camera.z; };
    return of(t.a) + of(t.b) + of(t.c);
  };
  std::stable_sort(
      scene.model.triangles.begin(), scene.model.triangles.end(),
      [&](const Triangle& a, const Triangle& b) { return towards_camera(a) < towards_camera(b); });
  return scene;
}

Scene make_ground_plane(const GeneratorValues& v, const SceneParameters& p) {
  return {.model = {.name = "ground_plane",
                    .triangles = ground_plane(v.integer("triangles"), v.number("extent"), v.number("jitter"),
                                              seed_of(v))},
          .parameters = p};
}

Scene make_translated_teapot(const GeneratorValues& v, const SceneParameters& p) {
  Scene scene = generate("teapot:triangles=" + std::to_string(v.integer("triangles")));
  scene.parameters = p;
  return translated(std::move(scene), v.number("distance"));
}

std::vector<ConstructionKind> all_kinds() {
  const GeneratorKey seed = whole("seed", 1, 0, kMaxSeed);
  const GeneratorKey count = whole("count", 100, 1, kMostTriangles);
  return {
      on_screen("fan",
                {whole("triangles", 20000, 3, kMostTriangles), real("radius", 1, 0.01, 1e6),
                 real("rim_w", kFlatW, 0.01, 100), real("turn", 0, 0, 7)},
                [](const GeneratorValues& v, int w, int h) {
                  return fan(v.integer("triangles"), v.number("radius"), v.number("rim_w"), v.number("turn"),
                             w, h);
                }),
      on_screen("lattice", {whole("cell", 4, 1, 65536)},
                [](const GeneratorValues& v, int w, int h) {
                  return lattice(static_cast<int>(v.integer("cell")), w, h);
                }),
      on_screen("jittered_plane",
                {whole("triangles", 1000, 2, kMostTriangles), real("jitter", 0.25, 0, 0.3),
                 whole("grid", 0, 0, 4096), seed},
                [](const GeneratorValues& v, int w, int h) {
                  return jittered_plane(v.integer("triangles"), v.number("jitter"),
                                        static_cast<int>(v.integer("grid")), seed_of(v), w, h);
                }),
      on_screen("refined_plane", {real("finest", 1, 0.05, 1e4), real("growth", 0.02, 0, 1)},
                [](const GeneratorValues& v, int w, int h) {
                  return refined_plane(v.number("finest"), v.number("growth"), w, h);
                }),
      on_screen("scattered", {count, whole("grid", 16, 1, 4096), seed},
                [](const GeneratorValues& v, int w, int h) {
                  return scattered(v.integer("count"), static_cast<int>(v.integer("grid")), seed_of(v), w, h);
                }),
      on_screen("slivers", {count, real("breadth", 1e-4, 0, 1e4), seed},
                [](const GeneratorValues& v, int w, int h) {
                  return slivers(v.integer("count"), v.number("breadth"), seed_of(v), w, h);
                }),
      {.name = "sphere",
       .keys = {whole("rings", 16, 2, 4096), real("radius", 1, 1e-30, 1e30), whole("far_first", 0, 0, 1)},
       .make = make_sphere},
      {.name = "ground_plane",
       .keys = {whole("triangles", 1000, 2, kMostTriangles), real("extent", 1, 1e-30, 1e30),
                real("jitter", 0.25, 0, 0.3), seed},
       .make = make_ground_plane},
      {.name = "translated_teapot",
       .keys = {whole("triangles", 1000, 60, kMostTriangles), real("distance", 0, 0, 1e30)},
       .make = make_translated_teapot},
  };
}

Vec3 world_point(const double* p) {
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

template <class Edit>
void for_each_corner(Scene& scene, Edit edit) {
  for (Triangle& t : scene.model.triangles)
    for (Vec3* corner : {&t.a, &t.b, &t.c}) edit(*corner);
}

Scene literal_screen_scene(const Case& one) {
  std::vector<ScreenCorners> corners;
  for (const auto& row : one.input.screen) {
    ScreenCorners t;
    for (std::size_t i = 0; i < 3; ++i) t[i] = {row[3 * i], row[3 * i + 1], row[3 * i + 2]};
    corners.push_back(t);
  }
  return screen_scene(corners, one.parameters.width, one.parameters.height);
}

}  // namespace

std::span<const ConstructionKind> construction_kinds() {
  static const std::vector<ConstructionKind> kinds = all_kinds();
  return kinds;
}

const ConstructionKind& find_construction(const std::string& name) {
  std::vector<std::string> known;
  for (const ConstructionKind& kind : construction_kinds()) {
    if (kind.name == name) return kind;
    known.push_back(kind.name);
  }
  throw InputError(unknown_name("construction", name, known));
}

bool is_on_screen(const CaseInput& input) {
  return !input.screen.empty() || (input.construct && find_construction(input.construct->name).on_screen);
}

Scene scene_of(const Case& one) {
  Scene scene;
  if (!one.input.screen.empty()) {
    scene = literal_screen_scene(one);
  } else if (one.input.construct) {
    scene = find_construction(one.input.construct->name)
                .make(GeneratorValues(one.input.construct->values), one.parameters);
  } else if (!one.input.generator.empty()) {
    scene = generate(one.input.generator);
    scene.parameters = one.parameters;
  } else {
    for (const auto& row : one.input.world)
      scene.model.triangles.push_back(
          {world_point(row.data()), world_point(row.data() + 3), world_point(row.data() + 6)});
    scene.parameters = one.parameters;
  }
  scene.model.name = one.name;
  check_scene_parameters(scene.parameters, "case " + one.name);
  return scene;
}

std::span<const std::string> change_names() {
  static const std::vector<std::string> names{"reversed", "duplicated", "positive_zeros",
                                              "scaled",   "mirrored",   "shifted"};
  return names;
}

bool needs_screen_scene(const std::string& change) { return change == "mirrored" || change == "shifted"; }

Scene changed_scene(const Case& one, const Change& change) {
  Scene scene = scene_of(one);
  const auto& name = change.name;
  if (name == "reversed") {
    for (Triangle& t : scene.model.triangles) std::swap(t.b, t.c);
  } else if (name == "duplicated") {
    const std::size_t count = scene.model.triangles.size();
    for (std::size_t i = 0; i < count; ++i) {
      const Triangle t = scene.model.triangles[i];
      scene.model.triangles.push_back({t.a, t.c, t.b});
    }
  } else if (name == "positive_zeros") {
    for_each_corner(scene, [](Vec3& p) { p = {p.x + 0.0f, p.y + 0.0f, p.z + 0.0f}; });
  } else if (name == "mirrored") {
    for_each_corner(scene, [](Vec3& p) { p.x = -p.x; });
  } else if (name == "scaled") {
    const auto f = [&](double v) { return v * change.factor; };
    for_each_corner(scene, [&](Vec3& p) {
      p = {static_cast<float>(f(p.x)), static_cast<float>(f(p.y)), static_cast<float>(f(p.z))};
    });
    SceneParameters& p = scene.parameters;
    p.camera = {f(p.camera.x), f(p.camera.y), f(p.camera.z)};
    p.near_plane = f(p.near_plane);
    p.far_plane = f(p.far_plane);
    check_scene_parameters(p, "case " + one.name + ", scaled");
  } else {
    // A pixel at depth w is w / height world units wide.
    const double height = scene.parameters.height;
    for_each_corner(scene, [&](Vec3& p) {
      const double w = scene.parameters.camera.z - p.z;
      p.x = static_cast<float>(p.x + change.x * w / height);
      p.y = static_cast<float>(p.y - change.y * w / height);
    });
  }
  return scene;
}

}  // namespace rasterbench::extremes
