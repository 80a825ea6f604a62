#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "fuzz/generate.h"

namespace rasterbench::fuzz {
namespace {

constexpr float kBand = static_cast<float>(kGuardBand);

float ulps_off(float v, int ulps) {
  const float towards =
      ulps < 0 ? -std::numeric_limits<float>::infinity() : std::numeric_limits<float>::infinity();
  for (int i = std::abs(ulps); i > 0; --i) v = std::nextafter(v, towards);
  return v;
}

float denormal(Dice& dice) {
  const auto bits = static_cast<std::uint32_t>(dice.bits());
  return std::bit_cast<float>(bits & 0x807fffffu);
}

/// How the coordinates of a case come about.
enum class Grid { kNone, kHalves, kPixels, kSixteenths, kFine };

class ScreenCases {
 public:
  explicit ScreenCases(Random& random) : dice_(random) {}

  FuzzCase make() {
    FuzzCase fuzz_case;
    const auto side = [&] { return 1 + dice_.pick(dice_.one_in(3) ? 40 : 12); };
    width_ = side();
    height_ = side();
    if (dice_.one_in(20)) {  // wide: large coordinates inside the image, and incremental edges restart
      width_ = 65 + dice_.pick(4000);
      height_ = 1 + dice_.pick(3);
    }
    fuzz_case.parameters.width = width_;
    fuzz_case.parameters.height = height_;
    fuzz_case.fill = dice_.one_in(2) ? FillRule::kTopLeft : FillRule::kClosed;
    grid_ = static_cast<Grid>(dice_.pick(5));
    on_grid_only_ = dice_.one_in(2);
    depths_ = dice_.pick(5);
    plane_ = {static_cast<float>(dice_.pick(9) - 4) / 16, static_cast<float>(dice_.pick(9) - 4) / 256,
              static_cast<float>(dice_.pick(9) - 4) / 256};
    const int count = 1 + dice_.pick(dice_.one_in(4) ? 24 : 6);
    while (static_cast<int>(made_.size()) < count) made_.push_back(triangle());
    fuzz_case.triangles = made_;
    return fuzz_case;
  }

 private:
  float on_grid(int side) {
    const auto steps = [&](int per_pixel) {
      const int low = -2 * per_pixel, count = (side + 4) * per_pixel + 1;
      return static_cast<float>(low + dice_.pick(count)) / static_cast<float>(per_pixel);
    };
    switch (grid_) {
      case Grid::kHalves:
        return steps(2);
      case Grid::kPixels:
        return steps(1) + 0.5f;
      case Grid::kSixteenths:
        return steps(16);
      case Grid::kFine:
        return steps(4096);
      case Grid::kNone:
        break;
    }
    return static_cast<float>(dice_.uniform(-0.3 * side - 1, 1.3 * side + 1));
  }

  float coordinate(int side) {
    if (on_grid_only_) return on_grid(side);
    switch (dice_.pick(24)) {
      case 0: {  // at or next to a sample
        const float sample = static_cast<float>(dice_.pick(side)) + 0.5f;
        return ulps_off(sample, dice_.pick(5) - 2);
      }
      case 1: {  // far away
        const auto far = static_cast<float>(dice_.magnitude(1, 5.1));
        return dice_.one_in(2) ? std::min(far, kBand) : -std::min(far, kBand);
      }
      case 2:
        return dice_.one_in(2) ? kBand : -kBand;
      case 3:
        return dice_.one_in(4) ? -0.0f : denormal(dice_);
      default:
        return on_grid(side);
    }
  }

  float depth(float x, float y) {
    if (dice_.one_in(30)) {
      const std::array<float, 8> special{-1,   1,     ulps_off(1, -1), ulps_off(1, 1),
                                         0.0f, -0.0f, 1.25f,           denormal(dice_)};
      return special[static_cast<std::size_t>(dice_.pick(8))];
    }
    switch (depths_) {
      case 0:
        return 0.5f;
      case 1:
        return static_cast<float>(dice_.pick(17) - 8) / 8;
      case 2:  // all in one plane, to rounding
        return std::clamp(plane_[0] + plane_[1] * x + plane_[2] * y, -1.0f, 1.0f);
      case 3:  // deep in the distance, where depths crowd
        return static_cast<float>(1 - dice_.magnitude(-8, -1));
      default:
        return static_cast<float>(dice_.uniform(-1, 1));
    }
  }

  Vec3 at(float x, float y) { return {x, y, depth(x, y)}; }

  const Triangle& any_made() {
    return made_[static_cast<std::size_t>(dice_.pick(static_cast<int>(made_.size())))];
  }

  Vec3 any_corner_made() {
    const Triangle& t = any_made();
    return dice_.one_in(3) ? t.a : dice_.one_in(2) ? t.b : t.c;
  }

  Vec3 corner() {
    if (!made_.empty() && dice_.one_in(3)) {
      Vec3 shared = any_corner_made();
      if (dice_.one_in(3)) shared.z = depth(shared.x, shared.y);
      return shared;
    }
    const float x = coordinate(width_), y = coordinate(height_);
    return at(x, y);
  }

  /// Between a and b, at most a few ulps or a small distance off their line.
  Vec3 near_line(const Vec3& a, const Vec3& b) {
    const double t = dice_.one_in(3) ? dice_.pick(5) * 0.25 : dice_.uniform(-0.2, 1.2);
    const double size = dice_.one_in(2) ? 0 : dice_.magnitude(-7, -1), off = dice_.one_in(2) ? size : -size;
    const auto between = [&](float from, float to, double aside) {
      const auto v = static_cast<float>(from + t * (double{to} - from) + aside);
      return std::clamp(ulps_off(v, dice_.one_in(2) ? dice_.pick(3) - 1 : 0), -kBand, kBand);
    };
    const double length = std::hypot(double{b.x} - a.x, double{b.y} - a.y);
    const double unit = length > 0 ? off / length : 0;
    const float x = between(a.x, b.x, -unit * (double{b.y} - a.y));
    const float y = between(a.y, b.y, unit * (double{b.x} - a.x));
    return at(x, y);
  }

  /// Two points whose line meets two samples, exactly where the image is small.
  std::array<Vec3, 2> through_samples() {
    const auto sample = [&](int side) { return static_cast<float>(dice_.pick(side)) + 0.5f; };
    const float x = sample(width_), y = sample(height_);
    const float dx = sample(width_) - x, dy = sample(height_) - y;
    const auto steps = static_cast<float>(dice_.pick(4)), back = static_cast<float>(dice_.pick(4));
    return {at(x - back * dx, y - back * dy), at(x + steps * dx, y + steps * dy)};
  }

  /// Two points whose line meets a sample but for the rounding of the second one: the sign there is decided
  /// by the last bits.
  std::array<Vec3, 2> past_a_sample() {
    const Vec3 a = corner();
    const double sx = dice_.pick(width_) + 0.5, sy = dice_.pick(height_) + 0.5;
    const double reach = dice_.one_in(3) ? -dice_.magnitude(-1, 2) : 1 + dice_.magnitude(-2, 2);
    const auto beyond = [&](float from, double to) {
      return std::clamp(static_cast<float>(from + reach * (to - from)), -kBand, kBand);
    };
    return {a, at(beyond(a.x, sx), beyond(a.y, sy))};
  }

  void nudge(float& v) { v = std::clamp(ulps_off(v, dice_.one_in(2) ? 1 : -1), -kBand, kBand); }

  Triangle triangle() {
    switch (dice_.pick(made_.empty() ? 4 : 8)) {
      case 0: {
        if (on_grid_only_) return {corner(), corner(), corner()};
        const Vec3 a = corner(), b = corner();
        return {a, b, near_line(a, b)};
      }
      case 1: {
        const auto [a, b] = on_grid_only_ || dice_.one_in(3) ? through_samples() : past_a_sample();
        return {a, b, !on_grid_only_ && dice_.one_in(3) ? near_line(a, b) : corner()};
      }
      case 4: {  // a copy, nearly
        Triangle t = any_made();
        Vec3& p = dice_.one_in(2) ? t.a : t.c;
        nudge(on_grid_only_ || dice_.one_in(3) ? p.z : dice_.one_in(2) ? p.x : p.y);
        return t;
      }
      case 5: {  // the same again, flipped
        const Triangle& t = any_made();
        return {t.c, t.b, t.a};
      }
      case 6: {  // a neighbour
        const Triangle& t = any_made();
        return {t.b, t.a, corner()};
      }
      default:
        return {corner(), corner(), corner()};
    }
  }

  Dice dice_;
  int width_ = 1, height_ = 1;
  Grid grid_ = Grid::kNone;
  bool on_grid_only_ = false;  // so that relations that need exact results have them
  int depths_ = 0;
  std::array<float, 3> plane_{};
  std::vector<Triangle> made_;
};

}  // namespace

double Dice::magnitude(double low_exponent, double high_exponent) {
  return std::pow(10.0, uniform(low_exponent, high_exponent));
}

FuzzCase screen_case(Random& random) { return ScreenCases(random).make(); }

FuzzCase make_case(std::uint64_t seed, std::int64_t index, Space space) {
  // The seeds of neighbours are unrelated: each is an output of the generator itself.
  Random of_index(seed ^ Random(static_cast<std::uint64_t>(index)).bits());
  Random random(of_index.bits());
  FuzzCase fuzz_case = space == Space::kScreen ? screen_case(random) : world_case(random);
  fuzz_case.seed = of_index.bits() % 1000;  // few digits are enough, and read better in a test
  return fuzz_case;
}

}  // namespace rasterbench::fuzz
