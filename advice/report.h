// An answer of the command advise as text and as JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "advice/recommendation.h"
#include "harness/point.h"

namespace rasterbench {

/// Everything that is said about one scene.
struct Advice {
  std::string model, scene_file;  ///< as on the command line
  FrameSettings settings;
  Camera camera;
  Tolerance tolerance;
  SceneFacts facts;
  std::vector<ModeVerdict> verdicts;
  Measurements measurements;
  std::optional<Recommendation> recommendation;  ///< empty: no mode keeps the tolerance by its bound
  EndToEndVerdict end_to_end;                    ///< on the recommended configuration's picture

  const Ranked& chosen() const { return recommendation->finalists[recommendation->chosen]; }
  std::string command() const;  ///< of the recommended configuration
};

/// For people. `explain`: also what the geometry stage leaves out, why each mode can go wrong, and every
/// configuration that was tried.
std::string advice_text(const Advice& advice, bool explain);

/// One object: "model", "size", "tolerance", "scene", "needs", "modes", "tried", "finalists",
/// "recommendation" (null where no mode suffices) with its "command", and "nearest", the mode that misses the
/// tolerance by the least (null where one suffices). Lengths in pixels, times in milliseconds, depths as
/// their keys say.
Json advice_json(const Advice& advice);

}  // namespace rasterbench
