// The whole pipeline from the float32 values of the files to the owner of every pixel, in arithmetic wide
// enough to be certain (accuracy.md, level 2): double with error bounds, multiprecision floats where that
// does not decide, and "ambiguous" where no precision does.
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
  kMultiprecision,  ///< intervals of 256-bit floats or more (MPFR)
  kAmbiguous,       ///< nothing: an exact tie to all that precision, or closer than it resolves
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

/// Draws scene.model by the specified pipeline (accuracy.md, section 1) with the camera's own constants
/// (square roots, tangent) taken at the same precision as everything else, on `threads` threads. width and
/// height replace those of the scene's parameters. Throws InputError if the picture does not fit into memory.
EndToEndTruth render_end_to_end(const Scene& scene, int width, int height, FillRule fill, NearRule near_rule,
                                int threads);

}  // namespace rasterbench
