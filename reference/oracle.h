// The exact oracle: who owns each pixel if the screen triangles that a kernel was given are drawn in exact
// arithmetic (accuracy.md, level 1), how near that answer is to another one, and which pixels a numeric mode
// can therefore get wrong.
//
// Shares no arithmetic with any kernel or numeric mode: double with forward error bounds decides almost
// everything, exact products of doubles most of what lies on an edge, and rationals (GMP through
// Boost.Multiprecision) the rest.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "numeric/bound.h"
#include "numeric/screen.h"

namespace rasterbench {

/// What the oracle judges: screen triangles. Corners are exact numbers; what has id < 0, a corner that is not
/// finite or an area of exactly zero draws nothing.
template <class Real>
struct OracleInput {
  std::span<const ScreenTriangle<Real>> triangles;
  int width = 0;  ///< of the image in pixels
  int height = 0;
  FillRule fill = FillRule::kClosed;
  TieRule tie = TieRule::kFirst;
  DepthFunction depth_function = DepthFunction::kNdc;
};

/// What the oracle had to do. The counts do not depend on the number of threads.
struct OracleEffort {
  std::int64_t coverage_tests = 0;      ///< edge functions whose sign was asked for
  std::int64_t coverage_fallbacks = 0;  ///< of those, undecided in doubles: decided by rationals
  std::int64_t depth_tests = 0;         ///< comparisons of two depths at a sample
  std::int64_t depth_fallbacks = 0;     ///< of those, decided by rationals
  double seconds = 0;
};

/// The exact picture, row 0 on top, with its margins. All vectors have width * height elements.
struct OracleImage {
  int width = 0;
  int height = 0;
  std::vector<std::int32_t> ids;     ///< of the owner; -1 = background
  std::vector<std::int32_t> pieces;  ///< the owner's index in OracleInput::triangles, or -1
  std::vector<double> values;        ///< owner's depth value (of the depth function), within 2^-48 relative
                                     ///< to its corners' largest; far_value() in the background
  /// Distance in pixels from the sample to the nearest edge that could change its owner: the owner's own, or
  /// that of a triangle whose depth value there, clamped to its corners', does not exceed the owner's by more
  /// than kDepthReach. Infinite if there is none within a pixel and a half. Computed in double.
  std::vector<float> edge_margin;
  /// By how much the depth value of the next covering triangle exceeds the owner's (far_value() counts as the
  /// background's); 0 = exact tie, positive otherwise. Pieces of the owner's own triangle make no tie. In the
  /// background: by how much the nearest covering triangle lies beyond far_value(); infinite without any.
  std::vector<float> depth_gap;
  OracleEffort effort;

  static constexpr double kDepthReach = 0x1p-10;
};

/// The exact owners, on `threads` threads. A pixel's owner is, of the triangles that cover its sample with a
/// depth value below far_value(), the one with the smallest exact (depth, rank). Throws InputError if the
/// picture does not fit into memory.
template <class Real>
OracleImage exact_owners(const OracleInput<Real>& input, int threads);

/// Why a pixel of a mode's picture can differ from the oracle's: bits of Prediction::reasons.
enum PredictionReason : std::uint8_t {
  kEdgeCanFlip = 1,   ///< a sample within the bound of an edge
  kDepthCanFlip = 2,  ///< two depths within their bounds of each other, or one of the far plane
};

/// Which pixels a mode can get wrong by its bound: a proof, not a sample. Every pixel with reasons == 0 has
/// the oracle's owner in every implementation that keeps to the bound.
struct Prediction {
  std::vector<std::uint8_t> reasons;  ///< width * height
  std::int64_t pixels = 0;            ///< with reasons != 0
  double max_depth_error = 0;         ///< bound of the depth value's error where the owner is certain
};

/// `oracle` is exact_owners(input); `bound.bounded` must be true; snapping, edge form and depth format are
/// taken from it. Throws Error if sizes do not match.
template <class Real>
Prediction predict_wrong(const OracleInput<Real>& input, const OracleImage& oracle, const ModeBound& bound,
                         int threads);

}  // namespace rasterbench
