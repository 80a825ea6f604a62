// What a numeric mode that keeps to its bound may make of one screen triangle: which samples it may and which
// it must find covered, and which depths it may find there.
#pragma once

#include <array>
#include <span>

#include "numeric/bound.h"
#include "reference/oracle_triangle.h"

namespace rasterbench::reference {

/// Depth values low .. high.
struct DepthInterval {
  double low = 0, high = 0;
  bool contains(double value) const { return value >= low && value <= high; }
};

class BoundedTriangle {
 public:
  /// Whether a mode may find a sample covered, and whether every mode has to.
  struct Coverage {
    bool may = false, must = false;
  };

  /// `exact` must outlive the object. Precondition: bound.bounded, or the answers are those of a mode that
  /// would keep to the numbers.
  BoundedTriangle(const OracleTriangle& exact, const ModeBound& bound, DepthFunction function);

  /// A superset of the pixels 0 <= x < width of a row of samples at height `y` that a mode may find covered.
  Span span(double y, int width) const;

  Coverage coverage(const ScreenPoint& sample, OracleEffort& effort) const;

  /// Depth values as stored by the mode at a sample that it finds covered.
  DepthInterval depths(const ScreenPoint& sample) const;

 private:
  /// The plane of the depth as a mode sets it up from one of the corners: gradients per pixel, and their
  /// errors.
  struct Plane {
    OracleCorner anchor;
    double gx = 0, gy = 0;              // of the exact corners
    double gx_most = 0, gy_most = 0;    // largest magnitude that a mode may compute
    double gx_error = 0, gy_error = 0;  // of the gradients, but for the snap of the corners
  };

  double rounding_tolerance(const OracleEdge& edge, double reach_x, double reach_y, double sample_x,
                            double sample_y, double value) const;
  double edge_tolerance(const OracleEdge& edge, const ScreenPoint& sample, double value) const;
  void bound_the_area();
  bool add_plane(std::size_t anchor);

  const OracleTriangle& exact_;
  ModeBound bound_;
  double far_;
  double edge_unit_;            // of the edge functions, and of their evaluation here
  double underflow_;            // of a product in the format of the edges or the depth
  double reach_;                // how far outside of the corners' extents a mode's box may reach
  bool coverage_is_exact_;      // the same samples as in exact arithmetic, ties included
  bool may_turn_over_ = false;  // the sign of the area is uncertain
  std::array<double, 3> slack_{};
  std::array<Plane, 3> planes_;
  std::size_t plane_count_ = 0;  // 0: nothing is known but the corners' depths
};

}  // namespace rasterbench::reference
