// How far a picture is from the oracle's: the metrics of accuracy.md, section 3, per image.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "reference/oracle.h"
#include "scene/camera.h"

namespace rasterbench {

/// A picture that is judged. Row 0 on top; all spans have width * height elements.
struct JudgedPicture {
  std::span<const std::int32_t> ids;       ///< -1 = background
  std::span<const double> values;          ///< depth values as stored by the mode, of its depth function
  std::span<const std::uint32_t> colours;  ///< RGBA8, red in the lowest byte
};

/// The class of a pixel; the classes of a picture's pixels are counted in Accuracy.
enum class PixelClass : std::uint8_t {
  kSame,         ///< the oracle's owner
  kExactTie,     ///< another triangle of exactly the same depth: only its id differs
  kEdge,         ///< wrong, and an edge within the mode's bound explains it
  kDepth,        ///< wrong, and a depth gap within the mode's bound explains it
  kUnexplained,  ///< wrong beyond the bound of a bounded mode
  kUnbounded,    ///< wrong, in a mode that promises nothing
};

struct Accuracy {
  std::int64_t pixels = 0;
  std::int64_t wrong = 0;            ///< ids that differ from the oracle's
  std::int64_t false_positives = 0;  ///< drawn where the oracle has background
  std::int64_t false_negatives = 0;  ///< background where the oracle has a triangle
  std::int64_t exact_ties = 0;       ///< counts of the classes
  std::int64_t edge = 0, depth = 0, unexplained = 0, unbounded = 0;
  std::int64_t predicted = 0;  ///< pixels that the mode can get wrong by its bound; -1: unbounded
  /// Largest distance in pixels of a sample to the outline of the triangle that was wrongly drawn there or
  /// left out; triangles in the wrong order of depth do not count.
  double worst_distance = 0;
  double max_depth_error_steps = 0;     ///< over pixels of equal id, of d, in steps of 2^-24
  double max_depth_error_world = 0;     ///< the same in world units along the view axis
  std::int64_t depth_out_of_bound = 0;  ///< pixels of equal id whose depth is beyond the bound of the mode
  double silhouette_hausdorff = 0;      ///< pixels; see silhouette.h
  std::int64_t colours_changed = 0;     ///< pixels with a channel that differs
  std::int64_t colours_changed_8 = 0;   ///< with a channel that differs by more than 8
  double psnr = 0;                      ///< of the colours, decibels; infinite where they are equal
  double ssim = 1;                      ///< of the colours; see similarity.h
  /// Index of the wrong pixel farthest from its edge or, where no coverage is wrong, of the largest gap
  /// between the exact depths of the drawn triangle and the owner; -1 where nothing is wrong. Exact ties come
  /// last.
  std::int64_t worst_pixel = -1;
  std::vector<PixelClass> classes = {};  ///< per pixel
  bool within_bound() const { return unexplained == 0 && depth_out_of_bound == 0; }
};

/// Judges `picture`, drawn from `input` in a mode with `bound`; `oracle` is exact_owners(input) and
/// `oracle_colours` its picture, shaded. A wrong pixel is within the bound if the mode may find there what it
/// drew: the triangle drawn may cover the sample, at a depth not behind that of any triangle that must. Its
/// class is kDepth where the depths that the mode may find for the two triangles overlap, and kEdge
/// otherwise. Throws Error if sizes do not match.
template <class Real>
Accuracy measure_accuracy(const JudgedPicture& picture, const OracleInput<Real>& input,
                          const OracleImage& oracle, std::span<const std::uint32_t> oracle_colours,
                          const Camera& camera, const ModeBound& bound, int threads);

/// The picture's classes as colours over a grey version of it: kSame stays grey, each other class has a
/// colour of its own (colour-blind safe), a wrong pixel is enlarged to at least 3 x 3 so that it can be seen,
/// and a legend with counts is drawn below. Returns RGBA8 of width x (height + legend rows).
struct DifferenceImage {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels = {};
};
DifferenceImage difference_image(const Accuracy& accuracy, std::span<const std::uint32_t> colours, int width,
                                 int height);

}  // namespace rasterbench
