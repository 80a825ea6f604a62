#include "fuzz/shrink.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "fuzz/exact_arithmetic.h"

namespace rasterbench::fuzz {
namespace {

constexpr int kOfNonFinite = 1000, kOfABit = 4;

/// `v` with at most `bits` significant bits.
double rounded(double v, int bits) {
  if (v == 0 || !std::isfinite(v)) return v;
  const int exponent = std::ilogb(v) - bits + 1;
  return std::ldexp(std::nearbyint(std::ldexp(v, -exponent)), exponent);
}

std::vector<double> simpler(double v) {
  std::vector<double> candidates{0, std::nearbyint(v), std::nearbyint(2 * v) / 2, std::nearbyint(4 * v) / 4};
  for (const int bits : {1, 2, 3, 4, 6, 8, 12, 16, 20, 24, 32}) candidates.push_back(rounded(v, bits));
  for (const double factor : {1.0 / 1024, 1.0 / 16, 0.5, 2.0, 16.0, 1024.0}) candidates.push_back(v * factor);
  candidates.push_back(std::abs(v));
  std::erase_if(candidates, [&](double c) { return !(complexity(c) < complexity(v)); });
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](double a, double b) { return complexity(a) < complexity(b); });
  return candidates;
}

class Shrinker {
 public:
  Shrinker(const FuzzCase& failing, FunctionRef<bool(const FuzzCase&)> fails, int most_questions)
      : best_(failing), fails_(fails), questions_left_(most_questions) {}

  FuzzCase run() {
    for (bool better = true; better && questions_left_ > 0;) {
      better = remove_triangles();
      better = shrink_image() || better;
      better = simplify_settings() || better;
      better = simplify_corners() || better;
      if (best_.space == Space::kWorld) better = simplify_camera() || better;
    }
    return best_;
  }

 private:
  bool keep_if_failing(FuzzCase candidate) {
    if (questions_left_ <= 0) return false;
    --questions_left_;
    if (!fails_(candidate)) return false;
    best_ = std::move(candidate);
    return true;
  }

  /// Of few triangles a relation makes few choices: with one triangle less it may need other ones.
  bool keep_with_any_seed(FuzzCase candidate) {
    if (keep_if_failing(candidate)) return true;
    constexpr std::size_t kFew = 4;
    if (candidate.triangles.size() > kFew) return false;
    for (candidate.seed = 0; candidate.seed < kSmallSeeds; ++candidate.seed)
      if (keep_if_failing(candidate)) return true;
    return false;
  }

  /// Halves first, single triangles at last.
  bool remove_triangles() {
    bool better = false;
    for (std::size_t chunk = best_.triangles.size() / 2; chunk >= 1; chunk /= 2)
      for (std::size_t first = 0;
           first + chunk <= best_.triangles.size() && best_.triangles.size() > chunk;) {
        FuzzCase candidate = best_;
        const auto begin = candidate.triangles.begin() + static_cast<std::ptrdiff_t>(first);
        candidate.triangles.erase(begin, begin + static_cast<std::ptrdiff_t>(chunk));
        if (keep_with_any_seed(std::move(candidate)))
          better = true;
        else
          first += chunk;
      }
    return better;
  }

  bool shrink_image() {
    bool better = false;
    for (int SceneParameters::*side : {&SceneParameters::width, &SceneParameters::height}) {
      for (int cut = best_.parameters.*side / 2; cut >= 1; cut /= 2)
        while (best_.parameters.*side > cut && smaller(side, cut)) better = true;
    }
    return better;
  }

  /// Cuts pixels off one end of the image, or, on the screen, off the other one, where that only moves the
  /// triangles.
  bool smaller(int SceneParameters::*side, int cut) {
    FuzzCase candidate = best_;
    candidate.parameters.*side -= cut;
    if (keep_if_failing(candidate)) return true;
    if (best_.space == Space::kWorld) return false;
    float Vec3::*axis = side == &SceneParameters::width ? &Vec3::x : &Vec3::y;
    for (Triangle& t : candidate.triangles)
      for (Vec3* p : {&t.a, &t.b, &t.c}) {
        const auto moved = exact_sum(p->*axis, static_cast<float>(-cut));
        if (!moved || std::abs(*moved) > kGuardBand) return false;
        p->*axis = *moved;
      }
    return keep_if_failing(std::move(candidate));
  }

  bool simplify_settings() {
    bool better = false;
    FuzzCase candidate = best_;
    candidate.fill = FillRule::kClosed;
    candidate.near_rule = NearRule::kClip;
    if (candidate.fill != best_.fill || candidate.near_rule != best_.near_rule)
      better = keep_if_failing(candidate);
    for (std::uint64_t seed = 0; seed < std::min(kSmallSeeds, best_.seed); ++seed) {
      candidate = best_;
      candidate.seed = seed;
      if (keep_if_failing(std::move(candidate))) return true;
    }
    return better;
  }

  bool simplify_corners() {
    bool better = false;
    for (std::size_t i = 0; i < best_.triangles.size(); ++i)
      for (Vec3 Triangle::*corner : {&Triangle::a, &Triangle::b, &Triangle::c})
        for (float Vec3::*axis : {&Vec3::x, &Vec3::y, &Vec3::z})
          for (const double value : simpler(double{(best_.triangles[i].*corner).*axis})) {
            const auto narrow = static_cast<float>(value);
            if (double{narrow} != value) continue;
            FuzzCase candidate = best_;
            (candidate.triangles[i].*corner).*axis = narrow;
            if (!keep_if_failing(std::move(candidate))) continue;
            better = true;
            break;
          }
    return better;
  }

  bool simplify_camera() {
    bool better = false;
    const auto simplify = [&](auto number) {  // a reference to one of a case's numbers
      for (const double value : simpler(number(best_))) {
        FuzzCase candidate = best_;
        number(candidate) = value;
        if (keep_if_failing(std::move(candidate))) return better = true, void();
      }
    };
    simplify([](FuzzCase& c) -> double& { return c.parameters.camera.x; });
    simplify([](FuzzCase& c) -> double& { return c.parameters.camera.y; });
    simplify([](FuzzCase& c) -> double& { return c.parameters.camera.z; });
    simplify([](FuzzCase& c) -> double& { return c.parameters.theta; });
    simplify([](FuzzCase& c) -> double& { return c.parameters.near_plane; });
    simplify([](FuzzCase& c) -> double& { return c.parameters.far_plane; });
    return better;
  }

  static constexpr std::uint64_t kSmallSeeds = 8;

  FuzzCase best_;
  FunctionRef<bool(const FuzzCase&)> fails_;
  int questions_left_;
};

}  // namespace

int complexity(double v) {
  if (!std::isfinite(v)) return kOfNonFinite;
  if (v == 0) return std::signbit(v) ? 1 : 0;
  int exponent = 0;
  const double significand = std::frexp(std::abs(v), &exponent);
  const auto bits = static_cast<std::uint64_t>(std::ldexp(significand, 53));
  const int significant = 53 - std::countr_zero(bits);
  return 1 + kOfABit * significant + std::abs(exponent - 1) + (v < 0 ? 1 : 0);
}

FuzzCase shrink(const FuzzCase& failing, FunctionRef<bool(const FuzzCase&)> fails, int most_questions) {
  return Shrinker(failing, fails, most_questions).run();
}

}  // namespace rasterbench::fuzz
