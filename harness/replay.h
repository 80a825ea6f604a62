// Sleep replay: the traced costs of a loop's iterations become sleeps in the real runtime, on any number of
// threads, since sleeping threads need no CPU. It shows whether the rules by which analysis/schedule_model.py
// predicts are those of the runtime.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "execution/execution.h"

namespace rasterbench {

/// What a costs.json says of a loop (`rasterbench trace --costs`).
struct CostsFile {
  std::string unit, kernel, numeric;
  std::vector<double> microseconds;  ///< of each iteration
};

/// Throws InputError that names the file and the field.
CostsFile read_costs(const std::string& path);

/// No sleep is shorter: below, the timer's own lateness would be measured.
inline constexpr double kShortestSleep = 200e-6;  // seconds

/// Seconds to sleep in each iteration: cost times scale, at least kShortestSleep.
std::vector<double> sleeps_of(const CostsFile& costs, double scale);

/// A loop as the runtime ran it.
struct Replay {
  double seconds = 0;           ///< from its start to its end
  std::vector<double> started;  ///< seconds from the loop's start to that of each iteration
  std::vector<double> slept;    ///< seconds of each iteration: its sleep and its lateness
  std::vector<int> workers;     ///< who ran each iteration
};

/// Sleeps `sleeps[i]` seconds in iteration i of a loop of `execution`. Throws Error where the clock fails.
Replay replay(Execution& execution, std::span<const double> sleeps);

/// First iterations of the chunks that an OpenMP runtime ("libgomp" or "libomp") hands out, in order, with n
/// behind them: the rules of iter.c and kmp_dispatch.cpp. Empty where there is none: other backends, auto,
/// other runtimes.
std::vector<std::int64_t> chunk_borders(const ExecutionConfig& config, const std::string& runtime,
                                        std::int64_t n);

/// Seconds of a loop of these iterations if threads never disturb each other and a chunk costs nothing;
/// `borders` are chunk_borders. Static chunks go round-robin, others to the thread that is free first.
double simulated_seconds(const ExecutionConfig& config, std::span<const std::int64_t> borders,
                         std::span<const double> seconds);

/// The first iteration that contradicts `borders`, however the threads were delayed: one whose worker is not
/// that of the iteration before within its chunk, or in a static schedule not the chunk's own. Empty: none.
std::optional<std::int64_t> contradiction(const ExecutionConfig& config,
                                          std::span<const std::int64_t> borders,
                                          std::span<const int> workers);

/// Whether contradiction() can find one: in a static schedule every chunk has its own worker, in others it
/// takes a chunk of several iterations.
bool can_be_contradicted(const ExecutionConfig& config, std::span<const std::int64_t> borders);

/// The first iteration of a chunk that was handed out against the order of `borders`, however the threads
/// were delayed: its worker asked for it (at the end of its chunk before, or the loop's start) when one that
/// comes later in that order had already started. Empty: none, or a static schedule, which has no such order.
std::optional<std::int64_t> order_contradiction(const ExecutionConfig& config,
                                                std::span<const std::int64_t> borders, const Replay& run);

}  // namespace rasterbench
