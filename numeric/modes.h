// The list of numeric modes: adding one is a struct here and its name in AllModes.
//
// A name is EDGES or EDGES-VARIANT: the variant is another depth (filtered-unorm24), another reciprocal
// (f32-rcp) or another compilation (f32-fma). Depth formats stand on filtered edges, which make no coverage
// error, so that what differs between them is the depth alone.
#pragma once

#include <span>
#include <string_view>
#include <tuple>

#include "numeric/apart_modes.h"
#include "numeric/cross_edges.h"
#include "numeric/depth.h"
#include "numeric/exact.h"
#include "numeric/filtered_edges.h"
#include "numeric/fixed_edges.h"
#include "numeric/incremental_edges.h"
#include "numeric/plane_edges.h"
#include "numeric/reciprocal.h"
#include "numeric/two_product.h"

namespace rasterbench {

/// Pieces of ModeInfo that several modes share.
namespace mode_text {
inline constexpr std::string_view kF32Plane = "float32, plane through the first corner, clamped";
inline constexpr std::string_view kF32Vertices = "float32";
inline constexpr std::string_view kFilteredEdges =
    "float32 with an error bound per edge, exact where the sign is uncertain";
inline constexpr std::string_view kNoCoverageError =
    "no coverage error; a wrong triangle only where the exact depths are closer than the depth's rounding";
inline constexpr std::string_view kHigham =
    "forward error of the formula, Higham, Accuracy and Stability of Numerical Algorithms, 3.1";
inline constexpr std::string_view kShewchuk =
    "sign exact (Shewchuk 1997); depth: forward error as in Higham, Accuracy and Stability, 3.1";
inline constexpr std::string_view kUnbounded = "unbounded";
inline constexpr std::string_view kNoSource = "none: nothing is promised";
}  // namespace mode_text

using F32Depth = PlaneDepth<float, float, PackedKeys>;
/// Set up in double, evaluated in float: the rounding of the gradients is all that is left of the set-up.
using SteadyF32Depth = PlaneDepth<double, float, PackedKeys>;
using F64Depth = PlaneDepth<double, double, WideKeys>;

inline constexpr ModeBound kF32Bound{};
inline constexpr ModeBound kF64Bound{
    .vertex_unit = 0x1p-53, .edge_unit = 0x1p-53, .gradient_unit = 0x1p-53, .depth_unit = 0x1p-53};
inline constexpr ModeBound kUnboundedF32{.bounded = false};

/// Bound of filtered edges with a depth of these roundings.
constexpr ModeBound filtered_bound(double depth_unit, double depth_step = 0) {
  return {.edge_form = EdgeForm::kExact,
          .edge_unit = 0,
          .gradient_unit = 0x1p-53,
          .depth_unit = depth_unit,
          .depth_step = depth_step};
}
constexpr ModeBound fixed_bound(int fraction_bits) {
  return {.snap = 0.5 / (1 << fraction_bits), .edge_form = EdgeForm::kExact, .edge_unit = 0};
}
constexpr double unorm_step(int bits) { return 2.0 / static_cast<double>((std::uint64_t{1} << bits) - 1); }

struct F32 : Combined<CrossEdges<float>, F32Depth> {
  static constexpr ModeInfo kInfo{
      .name = "f32",
      .vertices = mode_text::kF32Vertices,
      .edges = "float32, (b-a)x(p-a) with ordered end points",
      .depth = mode_text::kF32Plane,
      .bound =
          "a centre is misclassified only within about 4u X px of an edge (u = 2^-24, X = largest "
          "coordinate in px)",
      .bound_source = mode_text::kHigham,
      .numbers = kF32Bound};
};

struct F32Plane : Combined<PlaneEdges, F32Depth> {
  static constexpr ModeInfo kInfo{.name = "f32_plane",
                                  .vertices = mode_text::kF32Vertices,
                                  .edges = "float32, A x + B y + C",
                                  .depth = mode_text::kF32Plane,
                                  .bound =
                                      "a centre is misclassified only within about 8u R px of an edge (R = "
                                      "the distances of the centre and of the edge from the image's origin)",
                                  .bound_source = mode_text::kHigham,
                                  .numbers = {.edge_form = EdgeForm::kPlane}};
};

struct F32Incremental : Combined<IncrementalEdges, F32Depth> {
  static std::uint64_t inside_run(const Prepared& p, std::int32_t x, std::int32_t y, std::int32_t n) {
    return IncrementalEdges::inside_run(p, x, y, n);
  }
  static void depth_run(const Prepared& p, std::int32_t x, std::int32_t y, std::int32_t n, float* depths) {
    for (std::int32_t i = 0; i < n; ++i) depths[i] = depth(p, x + i, y);
  }
  static constexpr ModeInfo kInfo{
      .name = "f32_incremental",
      .vertices = mode_text::kF32Vertices,
      .edges = "float32, (b-a)x(p-a) at every 64th column, one addition a pixel from there",
      .depth = mode_text::kF32Plane,
      .bound = "a centre is misclassified only within about 72u (R + 128) px of an edge (R as in f32)",
      .bound_source = mode_text::kHigham,
      .numbers = {.edge_form = EdgeForm::kIncremental}};
};

struct TwoProductMode : TwoProduct {
  static constexpr ModeInfo kInfo{
      .name = "two_product",
      .vertices = "float32, taken to normalised device coordinates and rounded again",
      .edges = "float32, two products of edge functions >= 0 (the literal course text; fill rule: closed)",
      .depth = "float32, barycentric in normalised device coordinates, clamped",
      .bound = mode_text::kUnbounded,
      .bound_source = mode_text::kNoSource,
      .numbers = kUnboundedF32};
};

struct F64 : Combined<CrossEdges<double>, F64Depth> {
  static constexpr ModeInfo kInfo{
      .name = "f64",
      .vertices = "float64",
      .edges = "float64, (b-a)x(p-a) with ordered end points",
      .depth = "float64, plane through the first corner, clamped; rounded to float32 on output",
      .bound =
          "a centre is misclassified only within about 4u X px of an edge (u = 2^-53, X = largest "
          "coordinate in px)",
      .bound_source = mode_text::kHigham,
      .numbers = kF64Bound};
};

struct Fixed4 : Combined<FixedEdges<4>, F32Depth> {
  static constexpr ModeInfo kInfo{
      .name = "fixed_4",
      .vertices = "float32, snapped to 1/16 px (round to nearest, ties to even)",
      .edges = "int64, exact",
      .depth = "float32, plane through the first snapped corner, clamped",
      .bound = "a centre is misclassified only within 0.707/16 px of an edge; exact on the snapped vertices",
      .bound_source = "half the diagonal of the grid",
      .numbers = fixed_bound(4)};
};

struct Fixed8 : Combined<FixedEdges<8>, F32Depth> {
  static constexpr ModeInfo kInfo{
      .name = "fixed_8",
      .vertices = "float32, snapped to 1/256 px (round to nearest, ties to even)",
      .edges = "int64, exact",
      .depth = "float32, plane through the first snapped corner, clamped",
      .bound = "a centre is misclassified only within 0.707/256 px of an edge; exact on the snapped vertices",
      .bound_source = "half the diagonal of the grid (Direct3D 11.3, 3.4.1)",
      .numbers = fixed_bound(8)};
};

struct Fixed12 : Combined<FixedEdges<12>, F32Depth> {
  static constexpr ModeInfo kInfo{
      .name = "fixed_12",
      .vertices = "float32, snapped to 1/4096 px (round to nearest, ties to even)",
      .edges = "int64, exact",
      .depth = "float32, plane through the first snapped corner, clamped",
      .bound =
          "a centre is misclassified only within 0.707/4096 px of an edge; exact on the snapped vertices",
      .bound_source = "half the diagonal of the grid",
      .numbers = fixed_bound(12)};
};

struct Filtered : Combined<FilteredEdges, SteadyF32Depth> {
  static constexpr ModeInfo kInfo{.name = "filtered",
                                  .vertices = mode_text::kF32Vertices,
                                  .edges = mode_text::kFilteredEdges,
                                  .depth = "float32 plane with gradients set up in float64, clamped",
                                  .bound = mode_text::kNoCoverageError,
                                  .bound_source = mode_text::kShewchuk,
                                  .numbers = filtered_bound(0x1p-24)};
};

struct ExactMode : Exact {
  static constexpr ModeInfo kInfo{
      .name = "exact",
      .vertices = mode_text::kF32Vertices,
      .edges = mode_text::kFilteredEdges,
      .depth = "float64 with an error bound, rationals where the order is uncertain; rounded on output",
      .bound = "no error: coverage and the nearest triangle are those of exact arithmetic",
      .bound_source = "signs and comparisons exact (Shewchuk 1997; rationals of Boost.Multiprecision)",
      .numbers = {.edge_form = EdgeForm::kExact,
                  .edge_unit = 0,
                  .gradient_unit = 0x1p-53,
                  .depth_unit = 0x1p-53,
                  .exact_winner = true}};
};

struct FilteredF64 : Combined<FilteredEdges, F64Depth> {
  static constexpr ModeInfo kInfo{.name = "filtered-f64",
                                  .vertices = mode_text::kF32Vertices,
                                  .edges = mode_text::kFilteredEdges,
                                  .depth = "float64, plane through the first corner, clamped",
                                  .bound = mode_text::kNoCoverageError,
                                  .bound_source = mode_text::kShewchuk,
                                  .numbers = filtered_bound(0x1p-53)};
};

struct FilteredF64r : Combined<FilteredEdges, PlaneDepth<double, double, PackedKeys>> {
  static constexpr ModeInfo kInfo{
      .name = "filtered-f64r",
      .vertices = mode_text::kF32Vertices,
      .edges = mode_text::kFilteredEdges,
      .depth = "float64, plane through the first corner, clamped, rounded once to float32",
      .bound = mode_text::kNoCoverageError,
      .bound_source = mode_text::kShewchuk,
      .numbers = filtered_bound(0x1p-24)};
};

template <int Bits>
struct FilteredUnorm : Combined<FilteredEdges, PlaneDepth<double, double, UnormKeys<Bits>>> {
  static constexpr ModeInfo kInfo{
      .name = Bits == 16   ? "filtered-unorm16"
              : Bits == 24 ? "filtered-unorm24"
                           : "filtered-unorm32",
      .vertices = mode_text::kF32Vertices,
      .edges = mode_text::kFilteredEdges,
      .depth = Bits == 16   ? "float64 plane, rounded to 16 bits of fixed point on [-1, 1]"
               : Bits == 24 ? "float64 plane, rounded to 24 bits of fixed point on [-1, 1]"
                            : "float64 plane, rounded to 32 bits of fixed point on [-1, 1]",
      .bound = mode_text::kNoCoverageError,
      .bound_source = mode_text::kShewchuk,
      .numbers = filtered_bound(0x1p-53, unorm_step(Bits))};
};

struct FilteredReversed
    : Combined<FilteredEdges, PlaneDepth<double, float, PackedFloatKeys<DepthFunction::kReversed>>> {
  static constexpr ModeInfo kInfo{.name = "filtered-reversed_f32",
                                  .vertices = mode_text::kF32Vertices,
                                  .edges = mode_text::kFilteredEdges,
                                  .depth = "reversed z: float32 plane from 1 (near) to 0 (far)",
                                  .bound = mode_text::kNoCoverageError,
                                  .bound_source = mode_text::kShewchuk,
                                  .numbers = filtered_bound(0x1p-24),
                                  .depth_function = DepthFunction::kReversed};
};

struct FilteredInverseW
    : Combined<FilteredEdges, PlaneDepth<double, float, PackedFloatKeys<DepthFunction::kInverseW>>> {
  static constexpr ModeInfo kInfo{.name = "filtered-inverse_w",
                                  .vertices = mode_text::kF32Vertices,
                                  .edges = mode_text::kFilteredEdges,
                                  .depth = "1/w: float32 plane of far/w, from far/near (near) to 1 (far)",
                                  .bound = mode_text::kNoCoverageError,
                                  .bound_source = mode_text::kShewchuk,
                                  .numbers = filtered_bound(0x1p-24),
                                  .depth_function = DepthFunction::kInverseW};
};

struct Fixed8Unorm24 : Combined<FixedEdges<8>, PlaneDepth<double, double, UnormKeys<24>>> {
  static constexpr ModeInfo kInfo{
      .name = "fixed_8-unorm24",
      .vertices = "float32, snapped to 1/256 px (round to nearest, ties to even)",
      .edges = "int64, exact",
      .depth = "float64 plane, rounded to 24 bits of fixed point on [-1, 1] (as GPUs have it)",
      .bound = "as fixed_8, and depths closer than 2^-23 may tie",
      .bound_source = "half the diagonal of the grid; half a step of the depth",
      .numbers = {.snap = 0x1p-9,
                  .edge_form = EdgeForm::kExact,
                  .edge_unit = 0,
                  .gradient_unit = 0x1p-53,
                  .depth_unit = 0x1p-53,
                  .depth_step = unorm_step(24)}};
};

struct F32Rcp : Combined<CrossEdges<float>, PlaneDepth<float, float, PackedKeys, ApproximateReciprocal>> {
  static constexpr ModeInfo kInfo{.name = "f32-rcp",
                                  .vertices = mode_text::kF32Vertices,
                                  .edges = F32::kInfo.edges,
                                  .depth = "float32 plane, 1/area by rcpss, clamped",
                                  .bound = "edges as f32; gradients of the depth within 1.5 * 2^-12",
                                  .bound_source = "Intel SDM, volume 2, RCPSS; Higham, 3.1",
                                  .numbers = {.reciprocal_error = 1.5 * 0x1p-12},
                                  .same_on_every_cpu = false,
                                  .unavailable = kReciprocalUnavailable};
};

struct F32RcpNewton : Combined<CrossEdges<float>, PlaneDepth<float, float, PackedKeys, NewtonReciprocal>> {
  static constexpr ModeInfo kInfo{
      .name = "f32-rcp_newton",
      .vertices = mode_text::kF32Vertices,
      .edges = F32::kInfo.edges,
      .depth = "float32 plane, 1/area by rcpss and one step of Newton's method, clamped",
      .bound = "edges as f32; gradients of the depth within 2^-21",
      .bound_source = "Intel SDM, volume 2, RCPSS: squared, and three roundings",
      .numbers = {.reciprocal_error = 0x1p-21},
      .same_on_every_cpu = false,
      .unavailable = kReciprocalUnavailable};
};

struct F32Fma : ApartMode<FmaVariant, apart::Form::kCross> {
  static std::string_view unavailable() { return apart::fma_unavailable(); }
  static constexpr ModeInfo kInfo{
      .name = "f32-fma",
      .vertices = mode_text::kF32Vertices,
      .edges = "float32, (b-a)x(p-a), each a*b - c*d contracted to fma(a, b, -(c*d))",
      .depth = "float32, plane through the first corner with fused multiply-adds, clamped",
      .bound = F32::kInfo.bound,
      .bound_source = "as f32: a contraction only saves a rounding",
      .numbers = kF32Bound};
};

struct F32PlaneFma : ApartMode<FmaVariant, apart::Form::kPlane> {
  static std::string_view unavailable() { return apart::fma_unavailable(); }
  static constexpr ModeInfo kInfo{
      .name = "f32_plane-fma",
      .vertices = mode_text::kF32Vertices,
      .edges = "float32, A x + B y + C, contracted to fused multiply-adds",
      .depth = "float32, plane through the first corner with fused multiply-adds, clamped",
      .bound = F32Plane::kInfo.bound,
      .bound_source = "as f32_plane: a contraction only saves a rounding",
      .numbers = {.edge_form = EdgeForm::kPlane}};
};

struct TwoProductFma : ApartMode<FmaVariant, apart::Form::kTwoProduct> {
  static std::string_view unavailable() { return apart::fma_unavailable(); }
  static constexpr ModeInfo kInfo{.name = "two_product-fma",
                                  .vertices = TwoProductMode::kInfo.vertices,
                                  .edges = "as two_product, contracted to fused multiply-adds",
                                  .depth = TwoProductMode::kInfo.depth,
                                  .bound = mode_text::kUnbounded,
                                  .bound_source = mode_text::kNoSource,
                                  .numbers = kUnboundedF32};
};

struct F32Fastmath : ApartMode<FastmathVariant, apart::Form::kCross> {
  static constexpr ModeInfo kInfo{.name = "f32-fastmath",
                                  .vertices = mode_text::kF32Vertices,
                                  .edges = "as f32, compiled with -ffast-math",
                                  .depth = "as f32, compiled with -ffast-math",
                                  .bound = mode_text::kUnbounded,
                                  .bound_source = "none: the compiler may reorder as it likes",
                                  .numbers = kUnboundedF32,
                                  .same_on_every_cpu = false};
};

struct TwoProductFastmath : ApartMode<FastmathVariant, apart::Form::kTwoProduct> {
  static constexpr ModeInfo kInfo{.name = "two_product-fastmath",
                                  .vertices = TwoProductMode::kInfo.vertices,
                                  .edges = "as two_product, compiled with -ffast-math",
                                  .depth = "as two_product, compiled with -ffast-math",
                                  .bound = mode_text::kUnbounded,
                                  .bound_source = mode_text::kNoSource,
                                  .numbers = kUnboundedF32,
                                  .same_on_every_cpu = false};
};

/// Not a mode of screen triangles: the kernel ray_cast alone draws it.
inline constexpr ModeInfo kRayCastInfo{
    .name = "ray_cast",
    .vertices = "float32 world coordinates",
    .edges = "Embree's ray-triangle test, float32, one ray per sample (fill rule: closed)",
    .depth = "float64 on the triangle's plane, rounded once to float32",
    .bound = "wrong only at edges and near ties in depth, within a bound per pixel",
    .bound_source = "forward error of float32 rays (reference/ray_comparison.cpp)",
    .numbers = {},
    .same_on_every_cpu = false,
    .has_screen_triangles = false};

using AllModes =
    std::tuple<F32, F32Plane, F32Incremental, TwoProductMode, F64, Fixed4, Fixed8, Fixed12, Filtered,
               ExactMode, FilteredF64, FilteredF64r, FilteredUnorm<16>, FilteredUnorm<24>, FilteredUnorm<32>,
               FilteredReversed, FilteredInverseW, Fixed8Unorm24, F32Rcp, F32RcpNewton, F32Fma, F32PlaneFma,
               TwoProductFma, F32Fastmath, TwoProductFastmath>;

/// Calls visit.template operator()<Mode>() for every mode of screen triangles, in the order of the list.
template <class Visitor>
void for_each_mode(Visitor&& visit) {
  [&]<class... Modes>(std::tuple<Modes...>*) {
    (visit.template operator()<Modes>(), ...);
  }(static_cast<AllModes*>(nullptr));
}

/// Names and promises of every mode, ray_cast last.
std::span<const ModeInfo> mode_infos();

/// The info of a mode by name, or null.
const ModeInfo* find_mode(std::string_view name);

/// The info of a mode that this CPU can run. Throws InputError naming `field`, with a did-you-mean.
const ModeInfo& available_mode(std::string_view name, std::string_view field);

}  // namespace rasterbench
