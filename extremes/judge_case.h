// One stress case in one numeric mode and kernel, judged by everything that the case asks for.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "extremes/catalogue.h"
#include "extremes/verdict.h"
#include "reference/judge.h"

namespace rasterbench::extremes {

/// A scene at one fill rule, with its judge.
struct JudgedScene {
  JudgedScene(Scene drawn, const FrameSettings& drawn_as, int threads)
      : scene(std::move(drawn)), settings(drawn_as), judge(scene, settings, threads) {}
  JudgedScene(const JudgedScene&) = delete;
  JudgedScene& operator=(const JudgedScene&) = delete;

  Scene scene;
  FrameSettings settings;
  Judge judge;
};

/// What a case draws, and draws again. Serially, unless the case is about threads: the pictures are so small
/// that threads would cost more than they save.
struct DrawnCase {
  const Case& one;
  JudgedScene& base;
  JudgedScene* changed;  ///< of Must::same_as, or null
  const ModeInfo& mode;
  std::string_view kernel;
};

/// Judges one case in many modes and kernels; keeps what the judges need.
class CaseJudge {
 public:
  /// `threads` for the judges. Throws InputError where the scene cannot be made.
  CaseJudge(const Case& one, int threads);

  /// The verdict for a mode that this CPU can run. kNotCarried where the kernel does not suit it. Watertight
  /// meshes are counted elsewhere (watertight.h).
  Finding judge(const ModeInfo& mode, std::string_view kernel);

 private:
  Finding judge_drawn(const DrawnCase& drawn);

  Case one_;
  std::vector<std::unique_ptr<JudgedScene>> base_, changed_;  // by fill rule
};

/// Whether the picture of the changed scene is what it must be (constructions.h: the changes).
Finding judge_change(const DrawnCase& drawn, const Picture& picture);

/// Whether every permutation, number of threads, tile size and schedule draws the bits of `specification`.
Finding judge_executions(const DrawnCase& drawn, const Picture& specification);

/// Background pixels that background does not connect to the image's border (four neighbours).
std::int64_t enclosed_background(const Picture& picture);

/// The case of a file that has to be refused or warned of: read in a folder of its own, which is gone
/// afterwards.
Finding judge_reading(const Case& one);

/// The scene of a case, read through a file where it is given as one.
Scene open_case(const Case& one);

/// What a wrong pixel means in a mode: kReported where it promises nothing, or draws by rays.
Verdict wrong_in(const ModeInfo& mode);

/// "pixel 3,4".
std::string pixel_name(std::int64_t index, int width);

}  // namespace rasterbench::extremes
