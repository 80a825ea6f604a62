#include "pipeline/resolve.h"

#include <cmath>

namespace rasterbench {

std::uint32_t shade_flat(const Triangle& t, const Rgb& colour) {
  const double ux = double{t.b.x} - t.a.x, uy = double{t.b.y} - t.a.y, uz = double{t.b.z} - t.a.z;
  const double vx = double{t.c.x} - t.a.x, vy = double{t.c.y} - t.a.y, vz = double{t.c.z} - t.a.z;
  const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
  const double length = std::sqrt(nx * nx + ny * ny + nz * nz);
  const double s =
      std::max(0.0, (nx + ny + nz) / (length * std::sqrt(3.0)));  // -n.L with L = (-1,-1,-1)/sqrt(3)
  const auto channel = [s](std::uint8_t c) { return static_cast<std::uint8_t>(std::min(255.0, s * c)); };
  return pack_rgba({channel(colour.r), channel(colour.g), channel(colour.b)});
}

}  // namespace rasterbench
