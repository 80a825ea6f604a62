// Depth at a sample: the plane through the corners of a screen triangle, in several arithmetics.
#pragma once

#include <algorithm>
#include <cstdint>

#include "numeric/mode.h"

namespace rasterbench {

/// The plane through three corners, evaluated as clamp((d0 + gy dy) + gx dx): anchored at the first corner
/// and clamped to the corners' depths because rounding would leave them (accuracy.md, section 1). Units of
/// dx, dy are the caller's.
template <class Real>
struct DepthPlane {
  Real d0, gx, gy, low, high;

  Real at(Real dx, Real dy) const {
    const Real d = (d0 + gy * dy) + gx * dx;
    const Real raised = d > low ? d : low;  // a NaN (0 times an overflown gradient) becomes low
    return raised < high ? raised : high;
  }
};

/// What divides by the area.
struct Division {
  template <class Real>
  static Real quotient(Real numerator, Real denominator) {
    return numerator / denominator;
  }
};

/// The plane set up in SetupReal and evaluated in Real: (x0, y0) is the first corner, in pixels.
template <class SetupReal, class Real, class KeysOf, class Quotient = Division>
struct PlaneDepth {
  using Keys = KeysOf;

  struct Setup : DepthPlane<Real> {
    Real x0, y0;
  };

  /// `t` in canonical order.
  template <class CornerReal>
  static Setup setup(const ScreenTriangle<CornerReal>& t) {
    const auto wide = [](CornerReal v) { return static_cast<SetupReal>(v); };
    const SetupReal x1 = wide(t.x[1]) - wide(t.x[0]), y1 = wide(t.y[1]) - wide(t.y[0]);
    const SetupReal x2 = wide(t.x[2]) - wide(t.x[0]), y2 = wide(t.y[2]) - wide(t.y[0]);
    const SetupReal d1 = wide(t.d[1]) - wide(t.d[0]), d2 = wide(t.d[2]) - wide(t.d[0]);
    const SetupReal area2 = x1 * y2 - y1 * x2;
    const auto narrow = [](SetupReal v) { return static_cast<Real>(v); };
    return {{static_cast<Real>(t.d[0]), narrow(Quotient::quotient(d1 * y2 - d2 * y1, area2)),
             narrow(Quotient::quotient(d2 * x1 - d1 * x2, area2)),
             static_cast<Real>(std::min({t.d[0], t.d[1], t.d[2]})),
             static_cast<Real>(std::max({t.d[0], t.d[1], t.d[2]}))},
            static_cast<Real>(t.x[0]),
            static_cast<Real>(t.y[0])};
  }

  static Real at(const Setup& s, std::int32_t x, std::int32_t y) {
    return s.DepthPlane<Real>::at((static_cast<Real>(x) + Real{0.5}) - s.x0,
                                  (static_cast<Real>(y) + Real{0.5}) - s.y0);
  }
};

}  // namespace rasterbench
