#include "harness/coordinator.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <set>

#include "base/error.h"
#include "base/hash.h"
#include "harness/context.h"
#include "harness/folder_lock.h"
#include "harness/google_benchmark.h"
#include "harness/limits.h"
#include "harness/noise.h"
#include "harness/process.h"
#include "harness/progress.h"
#include "harness/run.h"
#include "harness/runner.h"
#include "harness/statistics.h"
#include "kernels/kernel.h"
#include "scene/image.h"

namespace rasterbench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kVerifyTimeout = 3600;  // seconds: a specification of a huge picture takes its time
constexpr double kSampleTimeout = 600;
constexpr double kLimitsSeconds = 1;  // for the bandwidth of all points, unless a few repetitions take longer
constexpr double kLongestLimitSeconds = 0.1;  // for that of one working set and thread count

class Coordinator {
 public:
  Coordinator(const Study& study, const StudyOptions& study_options, const CoordinatorOptions& options)
      : study_(study), study_options_(study_options), options_(options), begin_(Clock::now()) {}

  int run() {
    const std::string build = build_id();
    states_ = initial_states(study_, build);
    const Json start = start_event(study_, states_, build);
    const auto lock = prepare_folder();
    const auto journal_path = options_.out / "journal.jsonl";
    // A journal without one complete line is that of a study that was killed before it did anything.
    const std::vector<Json> events =
        std::filesystem::exists(journal_path) ? read_journal(journal_path) : std::vector<Json>{};
    const bool resumed = !events.empty();
    if (resumed) replay(events, start, journal_path, states_);
    limits_ = replay_limits(events, journal_path);
    for (const PointState& state : states_)  // the processes of a resumed study are new ones
      for (const Sample& sample : state.samples) next_launch_ = std::max(next_launch_, sample.launch + 1);
    journal_ = std::make_unique<Journal>(journal_path);
    Json event = resumed ? Json{{"event", "resume"}} : start;
    event["at"] = utc_now();
    journal_->append(event);

    Json context = describe_context(study_, study_options_, options_.custom_context);
    verify_points();
    describe_peers(context);
    measure_limits();
    context["limits"] = limits_.to_json();
    draw_images(context);
    sample_points();
    watch_noise(last_block_, true);
    return finish(context);
  }

 private:
  /// Makes the folder and locks it, before anything in it is looked at; the lock lasts as long as what is
  /// returned.
  std::unique_ptr<FolderLock> prepare_folder() {
    auto lock = make_and_lock(options_.out);
    if (!std::filesystem::exists(options_.out / "journal.jsonl")) return lock;
    if (!options_.resume && !options_.replace)
      throw InputError({.file = options_.out.string(), .field = "--out"},
                       "holds a study already; add --resume to continue it or --replace to start afresh");
    if (options_.resume) return lock;
    // Nothing is ever deleted: the old folder takes the first free name.
    std::filesystem::path previous = options_.out.string() + ".previous";
    for (int copy = 2; std::filesystem::exists(previous); ++copy)
      previous = fmt::format("{}.previous-{}", options_.out.string(), copy);
    std::error_code error;
    std::filesystem::rename(options_.out, previous, error);  // its lock goes with it
    if (error) throw InputError({.file = options_.out.string(), .field = "--replace"}, error.message());
    return make_and_lock(options_.out);
  }

  static std::unique_ptr<FolderLock> make_and_lock(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error || !std::filesystem::is_directory(folder))
      throw InputError({.file = folder.string(), .field = "--out"},
                       "cannot be made: " + (error ? error.message() : "not a folder"));
    return std::make_unique<FolderLock>(folder);
  }

  double elapsed() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }
  bool out_of_time(double needed = 0) const {
    return study_.sampling.time_limit > 0 && elapsed() + needed > study_.sampling.time_limit;
  }

  void record_event(Json event, PointState& state) {
    event["id"] = state.id;
    apply_event(event, state);
    journal_->append(event);
  }

  /// The process that runs points of `environment`, started when it is first needed.
  Process& runner(std::map<Environment, std::unique_ptr<Process>>& processes,
                  const Environment& environment) {
    auto& process = processes[environment];
    if (!process || !process->alive()) {
      if (running_ == process.get()) running_ = nullptr;
      std::vector<std::string> arguments{"runner"};
      arguments.insert(arguments.end(), options_.benchmark_flags.begin(), options_.benchmark_flags.end());
      process = std::make_unique<Process>(arguments, environment_variables(environment));
    }
    return *process;
  }

  /// Asks the environment's verifier; what goes wrong fails the point, not the study.
  template <class OnAnswer>
  void ask_verifier(PointState& state, const Json& request, OnAnswer on_answer) {
    try {
      on_answer(runner(verifiers_, state.planned->point.environment).ask(request, kVerifyTimeout));
    } catch (const InputError& error) {  // the environment cannot be had on this machine
      record_event({{"event", "skip"}, {"reason", error.what()}}, state);
    } catch (const ProcessError& error) {
      record_event({{"event", "fail"}, {"reason", error.what()}}, state);
    }
  }

  void verify_points() {
    std::vector<PointState*> unverified;
    for (PointState& state : states_)
      if (state.open() && state.judgement.is_null()) unverified.push_back(&state);
    // Grouped by what they are compared with, so that it is drawn once.
    std::stable_sort(unverified.begin(), unverified.end(), [](const PointState* a, const PointState* b) {
      const Point &p = a->planned->point, &q = b->planned->point;
      return std::pair(trade_of(p), comparison_of(p)) < std::pair(trade_of(q), comparison_of(q));
    });
    std::size_t done = 0;
    for (PointState* state : unverified) {
      progress_.show("verifying", static_cast<double>(done++), static_cast<double>(unverified.size()),
                     state->planned->name);
      ask_verifier(
          *state, {{"op", "verify"}, {"point", point_to_json(state->planned->point)}},
          [&](const Json& judgement) {
            if (judgement.contains("skip"))
              return record_event({{"event", "skip"}, {"reason", judgement.at("skip")}}, *state);
            const double frame_ms = judgement.at("frame_ms");
            const bool warm =
                state->planned->point.cache == "warm";  // only a sample's first frame would be cold
            const int frames = warm ? frames_per_sample(frame_ms) : 1;
            record_event({{"event", "verify"}, {"judgement", judgement}, {"frames", frames}}, *state);
            const double longest = study_.sampling.frame_seconds;
            if (state->failure.empty() && longest > 0 && frame_ms > longest * 1e3)
              record_event({{"event", "skip"},
                            {"reason", fmt::format("a frame takes {:.2g} s, longer than the {:g} s of "
                                                   "frame_seconds",
                                                   frame_ms / 1e3, longest)}},
                           *state);
          });
      if (!state->failure.empty()) progress_.note("FAILED " + state->planned->name + ": " + state->failure);
    }
  }

  /// The peers that were verified, each with what it says of itself.
  void describe_peers(Json& context) const {
    for (const PointState& state : states_)
      if (is_peer(state.planned->point) && state.judgement.contains("verify"))
        context["libraries"][state.planned->point.kernel] =
            fmt::format("{}; {}", state.judgement.at("verify").at("peer").at("renderer").get<std::string>(),
                        state.judgement.at("verify").at("peer").at("version").get<std::string>());
  }

  /// The bandwidth that the floors of the points follow from, in a process without bindings. What goes wrong
  /// is said and costs the floors, not the points.
  void measure_limits() {
    const std::vector<LimitKey> missing = missing_limits(states_, study_, limits_);
    // Other load comes and goes: the best of many repetitions is undisturbed where the best of a few is not.
    const double seconds = std::min(
        kLongestLimitSeconds, kLimitsSeconds / static_cast<double>(std::max<std::size_t>(missing.size(), 1)));
    std::size_t done = 0;
    for (const LimitKey& key : missing) {
      const std::string what =
          fmt::format("threads: {}, {:.2f} MB", key.threads,
                      static_cast<double>(key.set.read_bytes + key.set.write_bytes) / 1e6);
      progress_.show("bandwidth", static_cast<double>(done++), static_cast<double>(missing.size()), what);
      try {
        const Json rates = runner(verifiers_, Environment{})
                               .ask({{"op", "limit"},
                                     {"threads", key.threads},
                                     {"read_bytes", key.set.read_bytes},
                                     {"write_bytes", key.set.write_bytes},
                                     {"seconds", seconds}},
                                    kSampleTimeout);
        limits_.add(rates);
        journal_->append({{"event", "limit"}, {"rates", rates}});
        if (rates.at("read").is_string())
          progress_.note(fmt::format("no floor of {}: {}", what, rates.at("read").get<std::string>()));
      } catch (const ProcessError& error) {
        progress_.note(fmt::format("no floor of {}: {}", what, error.what()));
      }
    }
  }

  /// A picture of each scene for the report, by the first point of it that passed. A side matter: what goes
  /// wrong is said and costs the picture, not the point.
  void draw_images(Json& context) {
    Json& images = context["images"] = Json::object();
    std::set<std::string> files, tried;
    for (PointState& state : states_) {
      const std::string& scene = state.planned->point.scene.name;
      if (!state.timed() || state.judgement.is_null() || !tried.insert(scene).second) continue;
      std::string stem = scene;
      for (char& c : stem)
        if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_' && c != '.') c = '_';
      std::string file = fmt::format("images/{}.png", stem);
      for (int copy = 2; !files.insert(file).second; ++copy)
        file = fmt::format("images/{}_{}.png", stem, copy);
      try {
        std::filesystem::create_directories(options_.out / "images");
        runner(verifiers_, state.planned->point.environment)
            .ask({{"op", "image"},
                  {"point", point_to_json(state.planned->point)},
                  {"path", (options_.out / file).string()}},
                 kSampleTimeout);
        images[scene] = file;
      } catch (const ProcessError& error) {
        progress_.note(fmt::format("no picture of {}: {}", scene, error.what()));
      } catch (const std::filesystem::filesystem_error& error) {
        progress_.note(fmt::format("no picture of {}: {}", scene, error.what()));
      }
    }
    verifiers_.clear();
  }

  /// The fastest point on the serial backend of each group, once all of them have been sampled often enough
  /// to tell: base (a).
  std::map<std::string, const PointState*> fastest_serial() const {
    std::map<std::string, const PointState*> fastest;
    for (const PointState& state : states_) {
      if (!state.timed() || state.samples.empty() || state.planned->point.execution.backend != "serial")
        continue;
      const PointState*& best = fastest[comparison_of(state.planned->point)];
      if (!best || median(state.times_ms()) < median(best->times_ms())) best = &state;
    }
    return fastest;
  }

  /// Points to sample in the next block: those that have not stopped, and the bases and partners that these
  /// are compared with.
  std::vector<PointState*> next_block() {
    std::map<std::string, bool> open_comparison, open_curve, open_trade;
    std::set<std::string> partners;
    for (const PointState& state : states_)
      if (state.open()) partners.insert(state.planned->partners.begin(), state.planned->partners.end());
    for (const PointState& state : states_)
      if (state.open())
        open_comparison[comparison_of(state.planned->point)] = open_curve[curve_of(state.planned->point)] =
            open_trade[trade_of(state.planned->point)] = true;
    const auto fastest = fastest_serial();
    std::vector<PointState*> block;
    for (PointState& state : states_) {
      if (!state.timed()) continue;
      const Point& point = state.planned->point;
      const auto base = fastest.find(comparison_of(point));
      const bool is_base =
          partners.contains(state.planned->name) ||
          (base != fastest.end() && base->second == &state && open_comparison[comparison_of(point)]) ||
          (point.execution.threads == 1 && !is_peer(point) && open_curve[curve_of(point)]) ||
          (is_literal_program(point) && open_trade[trade_of(point)]);
      if (state.open() || is_base) block.push_back(&state);
    }
    return block;
  }

  void sample_points() {
    int block = 0;
    for (const PointState& state : states_)
      for (const Sample& sample : state.samples) block = std::max(block, sample.block);
    double block_seconds = 0;
    noise_.begin(block, cpu_seconds());
    for (;; ++block) {
      std::vector<PointState*> order = next_block();
      const auto is_taken = [block](const PointState* state) {
        return !state->samples.empty() && state->samples.back().block == block;
      };
      // A block that was interrupted is finished first, its bases too: pairs need both.
      const bool interrupted_block = std::any_of(order.begin(), order.end(), is_taken);
      std::erase_if(order, is_taken);
      const auto is_open = [](const PointState* state) { return state->open(); };
      if (!interrupted_block && std::none_of(order.begin(), order.end(), is_open)) return;
      if (block > 0 && out_of_time(block_seconds)) return;
      Random random(study_.seed * 1000003 + static_cast<std::uint64_t>(block));
      for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.bits() % i]);
      const auto block_begin = Clock::now();
      last_block_ = block;
      for (PointState* state : order) {
        if (block > 0 && out_of_time())
          return;  // the first block is taken whole; --resume with more time goes on
        show_sampling(block);
        take_sample(*state, block);
      }
      block_seconds = std::chrono::duration<double>(Clock::now() - block_begin).count();
      close_points();
      watch_noise(block, false);
    }
  }

  /// CPU seconds of this program's processes.
  double cpu_seconds() const {
    double seconds = own_cpu_seconds();
    for (const auto& [slot, processes] : runners_)
      for (const auto& [environment, process] : processes)
        if (process) seconds += process->cpu_seconds();  // null: it could not be started
    return seconds;
  }

  void watch_noise(int block, bool is_last) {
    if (const std::optional<Json> event = noise_.end_of_block(block, cpu_seconds(), is_last))
      journal_->append(*event);
  }

  void take_sample(PointState& state, int block) {
    const Point& point = state.planned->point;
    const int slot = block % study_.sampling.launches;
    auto& processes = runners_[slot];
    try {
      const auto& old = processes[point.environment];
      const bool restarted = old && !old->alive();
      if (restarted || !launch_of_.contains(slot)) launch_of_[slot] = next_launch_++;
      const int launch = launch_of_[slot];
      Process& process = runner(processes, point.environment);
      if (&process != running_ && running_ && running_->alive()) running_->pause();
      running_ = &process;
      process.resume();
      const Json answer = process.ask({{"op", "sample"},
                                       {"point", point_to_json(point)},
                                       {"name", state.planned->name},
                                       {"frames", state.frames}},
                                      kSampleTimeout);
      if (const int observed = answer.at("threads_observed"); observed < point.execution.threads)
        return record_event(
            {{"event", "fail"},
             {"reason", fmt::format("{} of {} threads ran", observed, point.execution.threads)}},
            state);
      if (const std::string binding = answer.value("binding", "kept"); binding != "kept")
        return record_event(
            {{"event", "fail"},
             {"reason", fmt::format("binding {} was not kept: {}", point.environment.binding, binding)}},
            state);
      const std::string& asked = point.environment.runtime;
      if (const std::string observed = answer.value("runtime_observed", asked);
          asked != "default" && observed != asked)
        return record_event({{"event", "fail"},
                             {"reason", fmt::format("{} was asked for, {} ran the loops", asked, observed)}},
                            state);
      if (answer.at("picture") != state.judgement.at("picture"))
        return record_event({{"event", "fail"}, {"reason", "a timed frame differs from the verified one"}},
                            state);
      record_event({{"event", "sample"}, {"block", block}, {"launch", launch}, {"answer", answer}}, state);
    } catch (const ProcessError& error) {
      record_event({{"event", "fail"}, {"reason", error.what()}}, state);
      progress_.note("FAILED " + state.planned->name + ": " + state.failure);
    }
  }

  void close_points() {
    const SamplingPlan& plan = study_.sampling;
    for (PointState& state : states_) {
      if (!state.open() || state.samples.empty()) continue;
      const std::string reason = stop_reason(plan, state.times_ms(), state.spent_ms);
      if (!reason.empty()) record_event({{"event", "stop"}, {"reason", reason}}, state);
    }
  }

  void show_sampling(int block) {
    std::size_t stopped = 0, timed = 0;
    for (const PointState& state : states_) {
      timed += state.timed();
      stopped += state.timed() && !state.open();
    }
    // The nearer of two ends: all blocks taken, or all time used.
    double share = static_cast<double>(block) / study_.sampling.max_samples;
    if (study_.sampling.time_limit > 0) share = std::max(share, elapsed() / study_.sampling.time_limit);
    share =
        std::max(share, static_cast<double>(stopped) / static_cast<double>(std::max<std::size_t>(timed, 1)));
    progress_.show("sampling", share, 1,
                   fmt::format("block {}, {} of {} points finished", block + 1, stopped, timed));
  }

  int finish(Json& context) {
    std::int64_t run = 0, skipped = 0, failed = 0;
    for (const PointState& state : states_) {
      const bool skip = !state.skip.empty();
      const bool ok = state.timed() && !state.samples.empty();
      ++(skip ? skipped : ok ? run : failed);
    }
    context["points"] = {{"planned", states_.size()}, {"run", run}, {"skipped", skipped}, {"failed", failed}};
    const std::vector<Json> events = read_journal(options_.out / "journal.jsonl");
    context["noise"] = summarise_noise(events, has_unbound_threads());
    const std::string id = hash_bytes(dump(context));
    Json whole;
    whole["schema"] = context.at("schema");
    whole["id"] = id;
    whole["started"] = events.front().at("at");
    whole["finished"] = utc_now();
    whole.update(context);
    std::string lines;
    std::vector<Json> records;
    const Topology topology(cpu_places());
    for (const PointState& state : states_) {
      records.push_back(make_record(state, study_, limits_.floor_of(limit_of(state, study_)), topology, id));
      lines += dump(records.back()) + "\n";
    }
    try {
      write_file(options_.out / "context.json", dump(whole, 2) + "\n");
      write_file(options_.out / "records.jsonl", lines);
      if (!options_.benchmark_out.empty())
        write_file(options_.benchmark_out,
                   google_benchmark_report(records, options_.benchmark_out_format, options_.custom_context));
    } catch (const InputError& error) {  // nothing is lost: all of it is made from the journal
      throw Error(std::string(error.what()) + "; continue with --resume");
    }
    progress_.note("");
    if (options_.benchmark_format.empty())
      fmt::print("{}\n", summary_table(states_));
    else
      fmt::print("{}", google_benchmark_report(records, options_.benchmark_format, options_.custom_context));
    fmt::print(stderr, "{} planned, {} run, {} skipped, {} failed; records in {}\n", states_.size(), run,
               skipped, failed, (options_.out / "records.jsonl").string());
    if (const std::string warning = noise_warning(context["noise"]); !warning.empty())
      fmt::print(stderr, "{}\n", warning);
    return failed == 0 ? 0 : 1;
  }

  bool has_unbound_threads() const {
    return std::any_of(states_.begin(), states_.end(), [](const PointState& state) {
      const Point& point = state.planned->point;
      return state.timed() && point.execution.threads > 1 && point.environment.binding == "none";
    });
  }

  const Study& study_;
  const StudyOptions& study_options_;
  const CoordinatorOptions& options_;
  Clock::time_point begin_;
  std::vector<PointState> states_;
  std::unique_ptr<Journal> journal_;
  Limits limits_;
  std::map<Environment, std::unique_ptr<Process>> verifiers_;
  std::map<int, std::map<Environment, std::unique_ptr<Process>>> runners_;  // by slot
  Process* running_ = nullptr;
  NoiseWatch noise_;
  int last_block_ = 0;
  std::map<int, int>
      launch_of_;  // by slot: a launch is a process, so a restarted one has a number of its own
  int next_launch_ = 0;
  Progress progress_;
};

}  // namespace

int run_study(const Study& study, const StudyOptions& study_options, const CoordinatorOptions& options) {
  if (study.points.empty()) throw InputError({.file = study.file}, "no point is left to run (filter, shard)");
  catch_interrupts();
  try {
    return Coordinator(study, study_options, options).run();
  } catch (const Interrupted&) {
    throw Interrupted(fmt::format("interrupted; what was measured is in {}: continue with --resume",
                                  (options.out / "journal.jsonl").string()));
  }
}

}  // namespace rasterbench
