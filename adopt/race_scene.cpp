#include "adopt/race_scene.h"

#include <bit>
#include <cmath>

namespace rasterbench {
namespace {

constexpr int kWidth = 320, kHeight = 180;
constexpr int kSize = 8;     // pixels: side of a triangle, and from one stack to the next
constexpr int kLevels = 32;  // triangles in a stack: two for each of the 16 threads
constexpr double kDistance = 4;
constexpr double kFarthest = -0.8, kSpacing = 0.05;  // world units

}  // namespace

Scene race_scene() {
  Scene scene;
  scene.model.name = "races";
  scene.parameters.object = {250, 220, 190};
  scene.parameters.background = {20, 30, 60};
  scene.parameters.camera = {0, 0, kDistance};
  scene.parameters.width = kWidth;
  scene.parameters.height = kHeight;
  scene.parameters.theta = 2 * std::atan(0.25);  // sees -1 .. 1 at z = 0, from top to bottom
  scene.parameters.near_plane = 1;
  scene.parameters.far_plane = 10;
  constexpr int kColumns = kWidth / kSize, kRows = kHeight / kSize;
  constexpr double kPixel = 2.0 / kHeight;  // world units at z = 0
  for (int level = 0; level < kLevels; level += 2)
    for (int i = 0; i < kColumns * kRows; ++i) {
      // To and fro (the parity of the bits of level / 2): static threads that did not start together still
      // meet.
      const bool is_reversed = std::popcount(static_cast<unsigned>(level / 2)) % 2 == 1;
      const int stack = is_reversed ? kColumns * kRows - 1 - i : i;
      for (int l = level; l < level + 2; ++l) {
        const double middle = kFarthest + kSpacing * l;
        // Tilted against the light by turns, a little: the planes of two levels stay apart.
        const double slope_x = 0.2 * std::cos(2.4 * l), slope_y = 0.2 * std::sin(2.4 * l);
        // Off the samples: no corner and no edge runs through one.
        const double left = (kSize * (stack % kColumns) + 0.3 - kWidth / 2.0) * kPixel;
        const double top = (kHeight / 2.0 - kSize * (stack / kColumns) - 0.2) * kPixel;
        const auto corner = [&](double right, double down) {
          const double dx = right * kSize * kPixel, dy = -down * kSize * kPixel;
          // The same place on the screen at every depth.
          const double z = middle + slope_x * dx + slope_y * dy, scale = (kDistance - z) / kDistance;
          return Vec3{static_cast<float>((left + dx) * scale), static_cast<float>((top + dy) * scale),
                      static_cast<float>(z)};
        };
        scene.model.triangles.push_back({corner(0, 0), corner(0.05, 0.93), corner(0.91, 0.07)});
      }
    }
  return scene;
}

}  // namespace rasterbench
