#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "fuzz/generate.h"

namespace rasterbench::fuzz {
namespace {

class WorldCases {
 public:
  explicit WorldCases(Random& random) : dice_(random) {}

  FuzzCase make() {
    FuzzCase fuzz_case{.space = Space::kWorld};
    if (dice_.one_in(4)) {
      Scene scene = generate(specification());
      fuzz_case.parameters = scene.parameters;
      fuzz_case.triangles = std::move(scene.model.triangles);
      if (dice_.one_in(2)) aim(fuzz_case.parameters);
    } else {
      aim(fuzz_case.parameters);
      camera_ = fuzz_case.parameters;
      const int count = 1 + dice_.pick(dice_.one_in(3) ? 30 : 8);
      lattice_ = dice_.one_in(3);
      while (static_cast<int>(made_.size()) < count) made_.push_back(triangle());
      fuzz_case.triangles = made_;
    }
    const auto side = [&] { return 1 + dice_.pick(dice_.one_in(3) ? 64 : 20); };
    fuzz_case.parameters.width = dice_.one_in(6) ? 65 + dice_.pick(140) : side();  // runs and tiles: 64 px
    fuzz_case.parameters.height = dice_.one_in(3) ? fuzz_case.parameters.width : side();
    if (dice_.one_in(2)) fuzz_case.fill = FillRule::kTopLeft;
    if (dice_.one_in(8)) fuzz_case.near_rule = NearRule::kOff;
    return fuzz_case;
  }

 private:
  std::string specification() {
    const int seed = dice_.pick(1000), count = 64 + dice_.pick(300);
    switch (dice_.pick(4)) {
      case 0:
        return fmt::format("confetti:triangles={},seed={}", count, seed);
      case 1:
        return fmt::format("teapot:triangles={}", count);
      case 2:
        return fmt::format("terrain:triangles={},seed={}", count, seed);
      default:
        return fmt::format("layers:triangles={},depth={}", count, 1 + dice_.pick(4));
    }
  }

  /// The camera and its planes.
  void aim(SceneParameters& p) {
    const double distance = dice_.one_in(2) ? std::ldexp(1.0, dice_.pick(5) - 2) : dice_.magnitude(-2, 3);
    switch (dice_.pick(4)) {
      case 0:
        p.camera = {0, 0, distance};
        break;
      case 1:
        p.camera = {0, dice_.one_in(2) ? distance : -distance, 0};
        break;
      default:
        p.camera = {dice_.uniform(-distance, distance), dice_.uniform(-distance, distance),
                    dice_.uniform(-distance, distance)};
    }
    const double pi = std::numbers::pi;
    // 2 atan(1/2): the camera's numbers are short, and pictures of lattices are lattices.
    p.theta = dice_.one_in(2)   ? 2 * std::atan(0.5)
              : dice_.one_in(6) ? dice_.magnitude(-4, -1)
                                : dice_.uniform(0.1, pi - 0.1);
    if (dice_.one_in(3)) {
      p.near_plane = distance / 2;
      p.far_plane = 2 * distance;
    } else {
      p.near_plane = distance * dice_.magnitude(-3, 0);
      const double least = dice_.one_in(8) ? -5 : 0, most = dice_.one_in(8) ? 9 : 3;
      p.far_plane = p.near_plane * (1 + dice_.magnitude(least, most));
    }
  }

  float coordinate() {
    const double distance = std::hypot(camera_.camera.x, camera_.camera.y, camera_.camera.z);
    switch (dice_.pick(40)) {
      case 0:
        return static_cast<float>(dice_.one_in(2) ? dice_.magnitude(0, 30) : -dice_.magnitude(0, 30));
      case 1:
        return std::bit_cast<float>(static_cast<std::uint32_t>(dice_.bits()) & 0x807fffffu);  // denormal
      case 2:
        return dice_.one_in(2) ? 0.0f : -0.0f;
      case 3:
        if (!dice_.one_in(10)) break;
        return dice_.one_in(2) ? std::numeric_limits<float>::quiet_NaN()
                               : std::numeric_limits<float>::infinity();
      default:
        break;
    }
    if (lattice_) return static_cast<float>((dice_.pick(17) - 8) / 8.0 * distance);
    return static_cast<float>(dice_.uniform(-1.5, 1.5) * distance);
  }

  Vec3 corner() {
    if (!made_.empty() && dice_.one_in(3)) {
      const Triangle& t = made_[static_cast<std::size_t>(dice_.pick(static_cast<int>(made_.size())))];
      return dice_.one_in(2) ? t.a : t.b;
    }
    if (dice_.one_in(8)) return on_near_plane();
    return {coordinate(), coordinate(), coordinate()};
  }

  /// About where the near plane is: exactly on it where rounding is kind.
  Vec3 on_near_plane() {
    const Vec3d& m = camera_.camera;
    const double distance = std::hypot(m.x, m.y, m.z), share = (distance - camera_.near_plane) / distance;
    Vec3 p{static_cast<float>(m.x * share), static_cast<float>(m.y * share), static_cast<float>(m.z * share)};
    const double aside = dice_.uniform(-1, 1) * camera_.near_plane;
    if (m.x == 0 && !dice_.one_in(3)) p.x += static_cast<float>(aside);
    return p;
  }

  Triangle triangle() {
    if (!made_.empty() && dice_.one_in(5)) {
      Triangle t = made_[static_cast<std::size_t>(dice_.pick(static_cast<int>(made_.size())))];
      if (dice_.one_in(2)) return {t.c, t.b, t.a};
      t.b.y = std::nextafter(t.b.y, 2 * t.b.y + 1);
      return t;
    }
    if (!made_.empty() && dice_.one_in(4)) {
      const Triangle t = made_.back();
      return {t.b, t.a, corner()};
    }
    return {corner(), corner(), corner()};
  }

  Dice dice_;
  SceneParameters camera_;
  bool lattice_ = false;
  std::vector<Triangle> made_;
};

}  // namespace

FuzzCase world_case(Random& random) { return WorldCases(random).make(); }

}  // namespace rasterbench::fuzz
