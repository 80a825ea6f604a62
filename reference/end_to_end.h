// The whole pipeline from the float32 values of the files to the owner of every pixel, in arithmetic wide
// enough to be certain (accuracy.md, level 2): double with error bounds, exact integers and multiprecision
// intervals where that does not decide, and "ambiguous" where no precision does. Square roots and the tangent
// are taken at their true values, not rounded to double.
#pragma once

#include <cstdint>
#include <vector>

#include "numeric/screen.h"
#include "reference/double_renderer.h"
#include "scene/scene.h"

namespace rasterbench {

/// Who decided a pixel.
enum class DecidedBy : std::uint8_t {
  kDouble,          ///< double precision with error bounds
  kMultiprecision,  ///< exact integers (ties), or intervals of 256-bit floats or more (MPFR)
  kAmbiguous,       ///< nothing: a sign that is not zero, but nearer to it than the precision resolves
};

/// The true picture of a scene. `truth.ids` of an ambiguous pixel is the smallest id among its candidates
/// (as if every undecided comparison were an exact tie), never to be counted against anyone.
struct EndToEndTruth {
  IdImage truth;                       ///< ids, depths d (1 = background)
  std::vector<DecidedBy> decided;      ///< width * height
  std::int64_t by_multiprecision = 0;  ///< pixels
  std::int64_t ambiguous = 0;          ///< pixels
  double seconds = 0;
};

/// More bits than any scene has been seen to need: a sign that is still open here is given up.
inline constexpr int kMaxPrecisionBits = 16384;

/// Draws scene.model by the specified pipeline (accuracy.md, section 1), sampling at pixel centres, on
/// `threads` threads; the result does not depend on their number. width and height replace those of the
/// scene's parameters. Of the triangles that cover a sample between the near and the far plane, the nearest
/// owns it, of those at exactly the same depth the one with the smallest id. A triangle with a non-finite
/// corner, without area or seen edge-on draws nothing, all of it decided exactly. Depths are rounded to
/// double (a few units in the last place of the distance from the camera). Signs that `max_bits` bits do not
/// decide make a pixel ambiguous. Throws InputError if the picture does not fit into memory. Preconditions:
/// checked parameters, 1 <= width, height <= kMaxImageSide, threads >= 1, max_bits >= 2.
EndToEndTruth render_end_to_end(const Scene& scene, int width, int height, FillRule fill, NearRule near_rule,
                                int threads, int max_bits = kMaxPrecisionBits);

}  // namespace rasterbench
