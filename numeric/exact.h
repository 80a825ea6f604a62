// Mode exact: coverage and the nearest triangle are those of exact arithmetic on the float32 screen vertices.
#pragma once

#include "numeric/exact_depth.h"
#include "numeric/filtered_edges.h"

namespace rasterbench {

struct Exact : ExactKeys {
  using Real = float;
  static constexpr bool kMonotone = true;
  using Plane = PlaneDepth<double, double, ExactKeys>;

  struct Prepared : FilteredEdges::Setup {
    PixelBox box;
    Plane::Setup plane;
    float depth_error;  ///< of the plane at samples of the box
    const ScreenTriangle<float>* triangle;
    std::uint32_t rank;
  };

  static Prepared prepare(const ScreenTriangle<float>& triangle, const SampleGrid& grid, std::uint32_t rank) {
    const ScreenTriangle<float> t = canonical(triangle);
    Prepared p{};
    p.rank = rank;
    p.triangle = &triangle;
    if (!FilteredEdges::setup(t, grid, p)) return p;  // draws nothing: the box stays empty
    p.box = sample_box(t);
    p.plane = Plane::setup(t);
    p.depth_error = depth_error(t, p.plane);
    return p;
  }

  static bool inside_edge(const Prepared& p, int e, std::int32_t x, std::int32_t y) {
    return FilteredEdges::inside_edge(p, e, x, y);
  }

  static bool inside(const Prepared& p, std::int32_t x, std::int32_t y) {
    return FilteredEdges::inside(p, x, y);
  }

  static float edge_value(const Prepared& p, int e, std::int32_t x, std::int32_t y) {
    return FilteredEdges::value(p, e, x, y);
  }

  static ExactDepth depth(const Prepared& p, std::int32_t x, std::int32_t y) {
    return {Plane::at(p.plane, x, y), p.depth_error, x, y, p.triangle};
  }

 private:
  static float depth_error(const ScreenTriangle<float>& t, const Plane::Setup& plane);
};

}  // namespace rasterbench
