// confetti: equilateral triangles at random places, in random orientations, all inside the picture: the load
// is even over the picture and, with distribution=heavy, very uneven over the triangles or, with
// distribution=corner, over the picture: what schedules differ in.
//
// Size: a triangle of s pixels that faces the camera has edges of s pixels in a picture of 1080 lines (s
// H/1080 in one of H lines), whatever its distance; then it is turned at random, which halves its area on
// average: about 0.22 s^2 pixels are covered.
//   uniform  s uniform in [0.5, 1.5] * size
//   heavy    s from a Pareto distribution with alpha = 16/13 = 1.23 without its largest 1/256: mean `size`,
//            smallest 0.29 size, largest 26 size (at most 800 pixels: above size = 30 the mean is therefore
//            lower). 0.7 % of the triangles then have half of the area.
//   corner   sizes as uniform; the centres of nine of ten triangles lie in the upper left corner, a quarter
//   of
//            the picture wide and high, and the others anywhere: its rows and tiles have 145 times the
//            triangles that others of equal area have.
// A triangle is wholly in the picture, so the large ones keep away from its border.
//
// Only + - * / and sqrt are used, so that the bytes are the same everywhere: 1/alpha = 1/2 + 1/4 + 1/16 makes
// the power a chain of square roots, and orientations come from points in a ball, not from angles.

#include <algorithm>
#include <cmath>

#include "scene/generator.h"

namespace rasterbench {
namespace {

constexpr double kTanHalf = 0.41421356237309503;  // of half the default field of view, pi/4: sqrt(2) - 1
constexpr double kAspect = 16.0 / 9.0;
constexpr double kLines = 1080;
constexpr double kDistance = 4;                // the camera's, from the origin, on the z axis
constexpr double kNearest = 2, kFarthest = 6;  // centres are this far from the camera
constexpr double kLargest = 800;               // pixels; a bigger triangle may not fit into the picture
constexpr double kTail = 1.0 / 256;            // heavy: (smallest / largest)^alpha, what the cut takes away
constexpr double kTailPower = 0.35355339059327373;  // kTail^(3/16) = (smallest / largest)^(alpha - 1)
// Heavy: mean over smallest size, alpha/(alpha-1) (1 - (smallest/largest)^(alpha-1)) / (1 - kTail).
constexpr double kMeanOverSmallest = 16.0 / 3.0 * (1 - kTailPower) / (1 - kTail);
constexpr double kInCorner = 0.9;     // corner: share of the triangles whose centres lie there
constexpr double kCornerSide = 0.25;  // corner: its width and height as shares of the picture's
constexpr double kSqrt3 = 1.7320508075688772;

double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// u^(-13/16) = u^-(1/2 + 1/4 + 1/16).
double power_minus_13_16(double u) {
  const double half = std::sqrt(u), quarter = std::sqrt(half), sixteenth = std::sqrt(std::sqrt(quarter));
  return 1 / (half * quarter * sixteenth);
}

/// Edge length in pixels.
double random_size(Random& random, double mean, bool heavy) {
  if (!heavy) return mean * random.uniform(0.5, 1.5);
  const double u = 1 - random.uniform() * (1 - kTail);
  return std::min(kLargest, mean / kMeanOverSmallest * power_minus_13_16(u));
}

Vec3d random_direction(Random& random) {
  for (;;) {
    const Vec3d p{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    const double square = dot(p, p);
    if (square > 1 || square < 1e-4) continue;
    const double length = std::sqrt(square);
    return {p.x / length, p.y / length, p.z / length};
  }
}

/// A unit vector, uniform among those at right angles to `axis`.
Vec3d random_direction_across(Random& random, const Vec3d& axis) {
  for (;;) {
    const Vec3d p = random_direction(random);
    const double along = dot(p, axis);
    const Vec3d q{p.x - along * axis.x, p.y - along * axis.y, p.z - along * axis.z};
    const double length = std::sqrt(dot(q, q));
    if (length > 0.01) return {q.x / length, q.y / length, q.z / length};
  }
}

/// Anywhere in the picture, or in its upper left corner.
enum class Region { kPicture, kCorner };

Triangle random_triangle(Random& random, double pixels, Region region) {
  // In units of the distance to the camera: the radius of the circle through the corners, and the window that
  // the centre may lie in so that the sphere of that radius stays between the four side planes.
  const double radius =
      pixels * (2 * kTanHalf / kLines) / kSqrt3 * (1 + 1e-6);  // room for the rounding to float
  const double tan_x = kAspect * kTanHalf;
  const double window_x = tan_x - radius * std::sqrt(1 + tan_x * tan_x);
  const double window_y = kTanHalf - radius * std::sqrt(1 + kTanHalf * kTanHalf);
  const double distance = random.uniform(kNearest, kFarthest);
  const double part = 2 * (region == Region::kCorner ? kCornerSide : 1);
  const Vec3d centre{distance * random.uniform(-window_x, part * window_x - window_x),
                     distance * random.uniform(window_y - part * window_y, window_y), kDistance - distance};

  const Vec3d u = random_direction(random);
  const Vec3d v = random_direction_across(random, u);
  const double r = radius * distance;
  const auto corner = [&](double along_u, double along_v) {
    return Vec3{static_cast<float>(centre.x + r * (along_u * u.x + along_v * v.x)),
                static_cast<float>(centre.y + r * (along_u * u.y + along_v * v.y)),
                static_cast<float>(centre.z + r * (along_u * u.z + along_v * v.z))};
  };
  return {corner(1, 0), corner(-0.5, kSqrt3 / 2), corner(-0.5, -kSqrt3 / 2)};
}

Scene make_confetti(const GeneratorValues& values) {
  const std::int64_t count = values.integer("triangles");
  const double size = values.number("size");
  const bool heavy = values.integer("distribution") == 1, corner = values.integer("distribution") == 2;
  Random random(static_cast<std::uint64_t>(values.integer("seed")));

  Scene scene;
  scene.model.triangles = room_for_triangles(count);
  for (std::int64_t i = 0; i < count; ++i) {
    const double pixels = random_size(random, size, heavy);
    const bool hot = corner && random.uniform() < kInCorner;
    scene.model.triangles.push_back(
        random_triangle(random, pixels, hot ? Region::kCorner : Region::kPicture));
  }
  scene.parameters.camera = {0, 0, kDistance};
  scene.parameters.near_plane = 1;  // the largest triangle reaches from 1.3 to 8.2
  scene.parameters.far_plane = 9;
  return scene;
}

const GeneratorRegistration kConfetti({
    .name = "confetti",
    .meaning = "random triangles, all over the picture or most in one corner, of like or of very unlike "
               "size: load balance",
    .keys = {{.name = "triangles",
              .meaning = "number",
              .default_value = 100000,
              .minimum = 1,
              .maximum = 2e8,
              .integer = true},
             {.name = "seed",
              .meaning = "which confetti",
              .default_value = 1,
              .maximum = kMaxSeed,
              .integer = true},
             {.name = "size",
              .meaning = "mean edge in pixels of a picture of 1080 lines, facing the camera",
              .default_value = 12,
              .minimum = 0.1,
              .maximum = 500},
             {.name = "distribution",
              .meaning = "uniform: sizes in 0.5..1.5 size; heavy: Pareto sizes, alpha 1.23; corner: sizes as "
                         "uniform, nine of ten triangles in the upper left sixteenth of the picture",
              .words = {"uniform", "heavy", "corner"}}},
    .make = make_confetti,
});

}  // namespace
}  // namespace rasterbench
