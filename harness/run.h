// The state of a running study: what the journal says of every point, and the records made from it.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/journal.h"
#include "harness/study.h"
#include "machine/topology.h"

namespace rasterbench {

/// One sample as the runner answered it, with where in the run it was taken.
struct Sample {
  int block = 0;
  int launch = 0;
  double ms = 0;
  Json answer;
};

/// What is known of one planned point.
struct PointState {
  const PlannedPoint* planned = nullptr;
  std::string id;       ///< hash of every axis, the scene's content and the build
  std::string skip;     ///< reason, or empty
  std::string failure;  ///< reason, or empty
  Json judgement;       ///< Verifier::judge, or null
  int frames = 1;       ///< per sample
  double spent_ms = 0;  ///< in timed frames
  std::vector<Sample> samples;
  std::string stop;  ///< why sampling stopped, or empty

  bool open() const { return skip.empty() && failure.empty() && stop.empty(); }
  bool timed() const { return skip.empty() && failure.empty(); }
  std::vector<double> times_ms() const;
};

/// The states of a study's points, in their order.
std::vector<PointState> initial_states(const Study& study, const std::string& build);

/// What a family measures, as a hash: the ids of its points and how the study samples them. Equal on every
/// machine that plans for the same CPUs and instruction set. Throws InputError where `study` does not have
/// the whole of one family and nothing else.
std::string family_id(const Study& study, const std::vector<PointState>& states);

/// What --resume compares: the build, the plan (ids of all points) and how it is sampled.
Json start_event(const Study& study, const std::vector<PointState>& states, const std::string& build);

/// Applies the events of a journal. Throws InputError if its start event differs from `start`.
void replay(const std::vector<Json>& events, const Json& start, const std::filesystem::path& file,
            std::vector<PointState>& states);

/// Applies one event to the state that it names; the same code for a running study and a replayed one.
void apply_event(const Json& event, PointState& state);

/// One line of records.jsonl. `floor_ms` is that of the point, if it has one; `topology` is the machine's.
Json make_record(const PointState& state, const Study& study, std::optional<double> floor_ms,
                 const Topology& topology, const std::string& context_id);

/// Why a point is sampled no more ("target", "max_samples", "point_seconds"), or empty. `times_ms` are its
/// samples, `spent_ms` its time in timed frames. Precondition: at least one sample.
std::string stop_reason(const SamplingPlan& plan, std::span<const double> times_ms, double spent_ms);

/// Frames that make one sample of a point with warm caches: more than one where a frame is so short that a
/// sample would be all clock and start-up. `frame_ms` is the time of one.
int frames_per_sample(double frame_ms);

/// A table for the terminal: name, median, interval, samples, or the reason why there is none.
std::string summary_table(const std::vector<PointState>& states);

}  // namespace rasterbench
