// All verdicts on a picture of one scene: against the exact oracle, against the end-to-end truth, and against
// ray casting. Keeps what they need, so that many kernels and modes can be judged in turn.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "numeric/modes.h"
#include "pipeline/frame.h"
#include "reference/accuracy.h"
#include "reference/embree.h"
#include "reference/end_to_end.h"
#include "reference/oracle.h"
#include "reference/specification.h"

namespace rasterbench {

/// A picture against the end-to-end truth. Every pixel is in exactly one of the classes.
struct EndToEndVerdict {
  std::int64_t pixels = 0;
  std::int64_t identical = 0;
  std::int64_t ambiguous = 0;   ///< the truth itself is undecided: counted neither way
  std::int64_t edge_ties = 0;   ///< wrong; a vertex's rounding or the mode's bound explains it, at an edge
  std::int64_t depth_ties = 0;  ///< wrong; the same, at a near tie in depth
  std::int64_t unbounded = 0;   ///< wrong, in a mode that promises nothing
  std::int64_t errors = 0;      ///< wrong, and nothing explains it
  double max_depth_error_steps = 0;  ///< of d, over identical pixels, in steps of 2^-24
  std::int64_t worst_pixel = -1;     ///< the first error, or -1
  std::int64_t wrong() const { return edge_ties + depth_ties + unbounded + errors; }
};

/// The colours of a picture with these owners (-1: background), shaded by the contract.
std::vector<std::uint32_t> shade_owners(std::span<const std::int32_t> ids, const Scene& scene);

/// False in a program that was compiled with -ffast-math (RASTERBENCH_FAST_MATH), whose oracle is not exact
/// and whose specifications are not those of the modes. Such a program times frames and judges none.
bool can_judge();

/// Judges pictures of one scene at one size, fill rule, tie rule and near rule. The scene must outlive it.
class Judge {
 public:
  /// Throws InputError in a program that cannot judge.
  Judge(const Scene& scene, const FrameSettings& settings, int threads);
  ~Judge();

  /// Against the exact oracle on the screen triangles that `mode` is given. The mode must have some.
  Accuracy against_oracle(const Picture& picture, const ModeInfo& mode);
  /// The same with the corners snapped as the mode snaps them: its edges must be without error there.
  Accuracy against_snapped_oracle(const Picture& picture, const ModeInfo& mode);
  /// Which pixels `mode` can get wrong by its bound; the mode must be bounded.
  Prediction prediction(const ModeInfo& mode);
  /// `accuracy`: the picture's, from against_oracle(); null for ray_cast.
  EndToEndVerdict against_truth(const Picture& picture, const ModeInfo& mode, const Accuracy* accuracy);
  /// Where there is no Embree: an InputError.
  RayComparison against_rays(const Picture& picture, const ModeInfo& mode, bool robust = false);

  const OracleImage& oracle(const ModeInfo& mode);
  const EndToEndTruth& truth();
  const RayCastPicture& rays(bool robust);
  const Camera& camera() const { return camera_; }
  const Scene& scene() const { return scene_; }
  const FrameSettings& settings() const { return settings_; }
  /// The oracle's picture, shaded.
  const std::vector<std::uint32_t>& oracle_colours(const ModeInfo& mode);

  /// The screen triangles that modes of this vertex format and depth function are given.
  template <class Real>
  struct Screen {
    std::vector<ScreenTriangle<Real>> triangles;
    OracleImage oracle;
    std::vector<std::uint32_t> colours;
  };

  /// Calls visit(OracleInput<Real>, Screen<Real>&) for the mode's own format.
  template <class Visit>
  auto with_screen(const ModeInfo& mode, Visit visit) {
    return mode.numbers.vertex_unit == 0x1p-53 ? visit(input<double>(mode), screen<double>(mode))
                                               : visit(input<float>(mode), screen<float>(mode));
  }

 private:
  template <class Real>
  Screen<Real>& screen(const ModeInfo& mode);
  template <class Real>
  OracleInput<Real> input(const ModeInfo& mode);
  const Comparison& oracle_against_truth(const ModeInfo& mode);

  const Scene& scene_;
  FrameSettings settings_;
  Camera camera_;
  int threads_;
  template <class Real>
  using Screens = std::map<DepthFunction, std::unique_ptr<Screen<Real>>>;
  std::pair<Screens<float>, Screens<double>> screens_;
  std::map<std::pair<DepthFunction, bool>, Comparison> geometry_;  // by depth function and (bool) float64
  std::optional<EndToEndTruth> truth_;
  std::map<bool, RayCastPicture> rays_;  // by robust
};

}  // namespace rasterbench
