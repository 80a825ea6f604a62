// A point: one configuration of a study.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "execution/execution.h"
#include "pipeline/frame.h"
#include "reference/llvmpipe.h"
#include "scene/scene.h"

namespace rasterbench {

using Json = nlohmann::ordered_json;  // keeps the order in which keys are written

/// A scene as a study names it.
struct SceneReference {
  std::string name;        ///< short label, unique in the study
  std::string model;       ///< MODEL: a path or a generator's specification
  std::string parameters;  ///< SCENE.txt, or empty
  std::int64_t line = 0;   ///< of the study file that names it; 0: the command line
};

/// "MODEL" or "MODEL@SCENE.txt"; the label is the generator's specification or the files' stems.
SceneReference parse_scene_reference(const std::string& text);

/// What is fixed when a process starts; a runner process serves one environment.
struct Environment {
  std::string binding = "none";         ///< OMP_PROC_BIND: none, close, spread
  std::string wait_policy = "default";  ///< OMP_WAIT_POLICY: default, active, passive
  std::string runtime =
      "default";             ///< of OpenMP: default (what the build links), libgomp, libomp (preloaded)
  int llvmpipe_threads = 0;  ///< LP_NUM_THREADS, which Mesa reads once per process; 0: no llvmpipe

  auto operator<=>(const Environment&) const = default;
};

/// The known words of each field of Environment.
inline const std::vector<std::string> kBindings{"none", "close", "spread"};
inline const std::vector<std::string> kWaitPolicies{"default", "active", "passive"};
inline const std::vector<std::string> kRuntimes{"default", "libgomp", "libomp"};
inline const std::vector<std::string> kFillRules{"closed", "top-left"};
inline const std::vector<std::string> kNearRules{"clip", "off"};
inline const std::vector<std::string> kCaches{"warm", "cold"};
inline const std::vector<std::string> kGeneralities{"minimal", "full"};
/// Other programs that do the same job, drawn as they are: no kernels of ours.
inline const std::vector<std::string> kPeers{kLlvmpipe};

/// The text of `json`; bytes that are not UTF-8 (file names may hold any) are replaced, never an error.
std::string dump(const Json& json, int indent = -1);

struct Point {
  SceneReference scene;
  int width = 0;  ///< pixels
  int height = 0;
  std::string kernel;
  std::string numeric = "f32";
  FillRule fill = FillRule::kClosed;
  NearRule near_rule = NearRule::kClip;
  ExecutionConfig execution;
  Environment environment;
  int tile = 64;               ///< pixels; counts only for kernels that have tiles
  std::string cache = "warm";  ///< warm, or cold: the caches are swept before each sample
  Generality generality = Generality::kMinimal;
  Isa isa = best_isa();
  Techniques techniques = {};  ///< those that are asked for; see techniques_of()

  FrameSettings settings() const;
};

/// The techniques of a point that make a difference to it: of those that are asked for the ones that its
/// kernel has and its instruction set can carry. None for peers.
Techniques techniques_of(const Point& point);

/// Whether a peer draws the point. Its kernel, numeric and backend are the peer's name; it has a scene, a
/// size and threads, and the environment that these ask for, and of every other axis the value that the peer
/// has.
bool is_peer(const Point& point);
Point peer_point(const std::string& peer, const SceneReference& scene, int width, int height, int threads);

/// "scene/WxH/kernel/numeric/fill/near/backend:schedule,chunk/threads" and the axes that differ from their
/// defaults: what
/// --filter matches.
std::string point_name(const Point& point);

/// The record's `config`, without the scene's hash.
Json point_config(const Point& point);

/// Everything that a runner process needs to run the point, and back.
Json point_to_json(const Point& point);
Point point_from_json(const Json& json);

/// "static", "dynamic,16" split into a schedule and a chunk; `field` names the option in errors.
void parse_schedule(const std::string& text, const std::string& field, ExecutionConfig& execution);

/// "serial", "openmp:dynamic,16".
ExecutionConfig parse_execution(const std::string& text, const std::string& field);

/// "1920x1080"; both sides in 1 .. 65536.
std::pair<int, int> parse_size(const std::string& text, const std::string& field);

FillRule parse_fill(const std::string& text, const std::string& field);
NearRule parse_near(const std::string& text, const std::string& field);
Generality parse_generality(const std::string& text, const std::string& field);

/// Throws InputError naming `field` unless `word` is one of `known`.
void check_word(const std::string& word, const std::vector<std::string>& known, const std::string& field);

}  // namespace rasterbench
