// Judges a picture of which only the colours are known: which pixels differ from the true picture of the
// scene, and what explains each of them.
//
// The truth is end_to_end.h's: the specified pipeline in arithmetic that is wide enough to be certain. A
// pixel that differs is explained by what a program in float64 or float32 may compute there: the triangles
// that its roundings may let cover the sample, at depths that they may let be the nearest (footprint.h). What
// shows the colour of none of them is wrong, whatever the arithmetic.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pipeline/frame.h"
#include "scene/scene.h"

namespace rasterbench {

/// What a pixel of the picture is.
enum class PixelFinding : std::uint8_t {
  kSame,       ///< the true colour
  kShade,      ///< a difference of 1 in a channel, which the contract tolerates
  kAmbiguous,  ///< the truth itself is undecided: counted neither way
  kFillRule,   ///< the sample lies exactly on an edge; shows what the other fill rule shows
  kEdge64,     ///< a neighbour at an edge: the sample is as near to it as float64 roundings are
  kDepth64,    ///< a triangle at the same depth, as far as float64 can tell
  kEdge32,     ///< the same for a program that computes in float32 throughout
  kDepth32,
  kLiteral,     ///< beyond that, but what the literal formula of the course text shows in float32 as well
  kHidden,      ///< WRONG from here on: a triangle that covers the sample behind the nearest one
  kMissing,     ///< background where a triangle must be
  kOutside,     ///< a triangle drawn beyond its edges, by more than roundings
  kUnwritten,   ///< black (0, 0, 0), which is neither the background nor any triangle here
  kColour,      ///< a colour that nothing near this pixel has
  kUnexamined,  ///< differs; not looked at, since so many others do
};
inline constexpr int kFindings = static_cast<int>(PixelFinding::kUnexamined) + 1;

/// Its name in records ("edge_float32") and its meaning in a sentence.
struct FindingWords {
  const char* name;
  const char* meaning;
};
FindingWords words_of(PixelFinding finding);
inline bool is_wrong(PixelFinding finding) { return finding >= PixelFinding::kHidden; }

struct PictureFindings {
  std::vector<PixelFinding> pixels;  ///< width * height, row 0 on top
  std::array<std::int64_t, kFindings> counts{};
  std::int64_t of(PixelFinding finding) const { return counts[static_cast<std::size_t>(finding)]; }
  std::int64_t wrong() const;   ///< pixels that nothing explains
  std::int64_t differ() const;  ///< pixels that are not the true colour, explained or not
};

/// A numeric mode of the suite and in how many pixels its picture differs from the judged one.
struct NearestMode {
  std::string numeric;
  FillRule fill = FillRule::kClosed;
  std::int64_t differing = 0;  ///< pixels whose colour is not the same
};

/// A whole picture that is the true one but for something simple.
struct WholePicture {
  std::string transformed;  ///< "upside down", "mirrored", "red and blue swapped"; empty: nothing of the kind
  std::int64_t differing = 0;  ///< pixels that still differ when that is undone
};

/// Judges pictures of one scene under one fill rule. The scene must outlive it.
class PictureJudge {
 public:
  PictureJudge(const Scene& scene, const FrameSettings& settings, int threads);
  ~PictureJudge();

  PictureFindings judge(std::span<const std::uint32_t> colours);

  /// The modes that a program is likely to compute in, the nearest first; of equal ones that of the judged
  /// fill rule.
  std::vector<NearestMode> nearest(std::span<const std::uint32_t> colours);

  /// Whether undoing a simple mistake makes a picture that differs a lot (nearly) right.
  WholePicture whole(std::span<const std::uint32_t> colours) const;

  const std::vector<std::uint32_t>& truth() const { return truth_; }  ///< colours
  std::uint32_t background() const;
  const std::vector<std::int32_t>& owners() const { return owners_; }  ///< ids, -1 = background

 private:
  class Candidates;

  const Scene& scene_;
  FrameSettings settings_;
  Camera camera_;
  std::vector<std::int32_t> owners_;
  std::vector<std::uint32_t> truth_, other_fill_;
  std::vector<bool> ambiguous_;
  std::map<std::pair<std::string, FillRule>, std::vector<std::uint32_t>> modes_;
  const std::vector<std::uint32_t>& mode_colours(const std::string& numeric, FillRule fill);
};

/// At most so many pixels of a picture are looked at one by one.
inline constexpr std::int64_t kMostExamined = 20000;

}  // namespace rasterbench
