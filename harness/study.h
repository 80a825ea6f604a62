// Studies: a TOML file that spans points.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <regex>
#include <string>
#include <vector>

#include "harness/point.h"
#include "harness/weak.h"

namespace rasterbench {

/// When a point has been sampled enough (measuring.md: stopping).
struct SamplingPlan {
  double target = 0.02;  ///< stop when half the 95 % interval is within this share of the median
  int min_samples = 7;   ///< at least 6, below which there is no 95 % interval
  int max_samples = 40;
  double point_seconds = 10;  ///< time that the frames of one point may take
  double frame_seconds = 0;   ///< a point with slower frames is verified and skipped; 0: none is
  double time_limit = 0;      ///< seconds for the whole study; 0: none
  int launches = 1;           ///< processes per environment, in turn by block
};

/// A planned point, or one that the study asked for but that cannot or will not run.
struct PlannedPoint {
  Point point;
  std::string name;
  std::string skip;        ///< the reason, or empty
  std::size_t family = 0;  ///< of Study::families, from 0: see read_study()
  /// Names of points that are sampled in every block that this one is: its base in weak scaling, and those
  /// that a hypothesis compares it with.
  std::vector<std::string> partners = {};
};

/// What a study claims before it runs: that one point is faster than another by a stated effect. Several
/// points of a side stand for the fastest of them.
struct Hypothesis {
  std::string claim;
  double by = 0;  ///< least effect: time of slower / time of faster is at least 1 + by
  std::vector<std::string> faster, slower;  ///< names of points, whatever the filter and the shard
  std::string untested;  ///< why this machine, or what the command line replaced, lets it select nothing
};

struct Study {
  std::string name;
  std::string question;
  std::string file;
  std::string text;  ///< the whole file
  std::uint64_t seed = 1;
  SamplingPlan sampling;
  std::vector<PlannedPoint> points;
  std::size_t families = 0;  ///< of the whole study, whatever the shard
  std::vector<Hypothesis> hypotheses;
  std::vector<WeakSeries> weak;
  std::map<std::string, Scene> scenes;        ///< by SceneReference::name
  std::map<std::string, std::string> hashes;  ///< scene_hash, by the same name
};

/// What the command line adds to or takes from a study file.
struct StudyOptions {
  std::vector<std::string> scenes;  ///< "MODEL[@SCENE.txt]": in place of the study's
  std::vector<std::string> sizes;   ///< "WxH": in place of the study's
  std::optional<std::regex> filter;
  bool filter_excludes = false;  ///< keep what does not match
  int shard = 1, shards = 1;     ///< this process runs shard 1 .. shards
  std::optional<double> time_limit;
  bool oversubscribe = false;
  std::optional<int> cpus;  ///< plan for this many CPUs: what "max" means, in place of this process's
  std::optional<Isa> isa;   ///< plan for this instruction set: what "best" means, in place of this CPU's
};

/// Reads a study file and spans its points: the cross product of each [[sweep]], duplicates dropped. Opens
/// every scene. Unknown keys, names and values are InputErrors that name file, line and key, with a
/// did-you-mean. Paths of models in the file are relative to it.
///
/// Points are parted into families, and shards hold whole ones, so that a speedup never compares two
/// machines: a family is a comparison, bases included, with all instruction sets (where there is a literal
/// program, all of its trade; where there is a peer, all of its scene and size). Families that a hypothesis
/// or weak scaling compares are one.
Study read_study(const std::filesystem::path& file, const StudyOptions& options);

/// What `point` is compared with: equal for points that differ only in strategy, execution and environment.
std::string comparison_of(const Point& point);

/// comparison_of() without the numeric mode: what the literal program is the base of.
std::string trade_of(const Point& point);

/// The literal program of the course text: its formula, serially, without any structure but boxes. The base
/// of the trade between speed and accuracy, sampled along with every point of its scene and size.
bool is_literal_program(const Point& point);

/// Equal for points that differ only in threads: the others are one curve over them.
std::string curve_of(const Point& point);

/// The study files that come with the program: those in `studies/` of the source tree it was built from, if
/// it is there.
std::vector<std::filesystem::path> known_studies();

}  // namespace rasterbench
