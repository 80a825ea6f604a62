// Float modes compiled apart from everything else: with fused multiply-adds, or with -ffast-math.
//
// Each variant is a namespace of numeric/apart.inc, compiled with flags of its own. It shares no inline
// function with the rest of the program: a linker keeps one copy of an inline function, and it might be the
// one that needs an instruction which the CPU lacks, or ignores NaNs. So only plain data and functions that
// are not inline cross this line, and a call covers a run of pixels.
#pragma once

#include <cstdint>

namespace rasterbench::apart {

/// Which of the edge forms a variant evaluates.
enum class Form { kCross, kPlane, kTwoProduct };

/// What is computed once per triangle; which members count depends on the form. As CrossEdges, PlaneEdges,
/// TwoProduct and DepthPlane have them.
struct Setup {
  float ax[3], ay[3], dx[3], dy[3], c[3], least[3];
  float px[3], py[3], pd[3];            // kTwoProduct: corners in normalised device coordinates, depths
  float width, height;                  // of the image, for kTwoProduct
  float x0, y0, d0, gx, gy, low, high;  // the plane of depths
};

/// The corners in canonical order (in the triangle's own for kTwoProduct), in pixels, and depths.
struct Corners {
  float x[3], y[3], d[3];
};

/// setup: false where the triangle draws nothing. inside_run: bit i says whether pixel (x + i, y) is inside,
/// n <= 64. depth_run: n depths from pixel (x, y) on.
#define RASTERBENCH_APART_FUNCTIONS                                                                \
  bool setup(Form form, const Corners& corners, bool closed, int width, int height, Setup& setup); \
  bool inside_edge(Form form, const Setup& setup, int e, std::int32_t x, std::int32_t y);          \
  float edge_value(Form form, const Setup& setup, int e, std::int32_t x, std::int32_t y);          \
  std::uint64_t inside_run(Form form, const Setup& setup, std::int32_t x, std::int32_t y, int n);  \
  void depth_run(Form form, const Setup& setup, std::int32_t x, std::int32_t y, int n, float* depths);

/// a*b + c is one instruction with one rounding; needs a CPU with FMA.
namespace fma {
RASTERBENCH_APART_FUNCTIONS
}
/// -ffast-math: the compiler may reorder, contract, and assume that there is no NaN.
namespace fastmath {
RASTERBENCH_APART_FUNCTIONS
}
#undef RASTERBENCH_APART_FUNCTIONS

/// Why this CPU or build cannot run the variant; empty where it can.
const char* fma_unavailable();

}  // namespace rasterbench::apart
