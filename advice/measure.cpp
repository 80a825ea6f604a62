#include "advice/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "kernels/kernel.h"
#include "reference/specification.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

constexpr int kTrialFrames = 3;       // the fastest counts: what disturbs one frame only makes it slower
constexpr double kLongTrialMs = 100;  // of frames as long as this, one is enough
constexpr std::size_t kModes = 4;     // that are tried under every kernel and execution
constexpr double kTrialShare = 0.5;   // of the time, for everything before the final rounds
constexpr double kHopeless = 3;  // times the fastest: a kernel's other modes and executions are not tried
constexpr std::size_t kFinalists = 4;  // at most, and none that was slower than the fastest by more than half
constexpr double kFinalistShare = 1.5;
constexpr std::size_t kMostRounds = 100;
constexpr double kLeastRounds = 6;  // below, a median has no 95 % interval
/// Tried first, should the time not suffice for all: the usual winners.
constexpr std::string_view kFirstKernels[] = {"tile_parallel", "row_parallel", "scanline",
                                              "triangle_atomics"};
/// A sample is the mean of as many frames as it takes to be this long: the clock and a stray interrupt weigh
/// less.
constexpr double kShortestSampleMs = 5;
constexpr int kMostFrames = 16;

class Bench {
 public:
  Bench(const Scene& scene, const FrameSettings& settings, const MeasuringPlan& plan,
        const std::function<void(double, const std::string&)>& progress)
      : scene_(scene),
        settings_(settings),
        plan_(plan),
        progress_(progress),
        begin_(std::chrono::steady_clock::now()) {}

  Measurements run(std::span<const ModeVerdict> verdicts) {
    const std::vector<const ModeVerdict*> modes = fastest_modes(verdicts);
    for (const std::string& kernel : tried_kernels()) try_kernel(kernel, modes);
    final_rounds();
    return std::move(result_);
  }

 private:
  double elapsed() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  double share() const { return elapsed() / plan_.seconds; }

  /// The sufficient modes, timed under one kernel; the fastest few of them.
  std::vector<const ModeVerdict*> fastest_modes(std::span<const ModeVerdict> verdicts) {
    const std::string kernel(kFirstKernels[0]);
    for (const ModeVerdict& verdict : verdicts)
      if (verdict.standing == Standing::kSuffices && find_kernel(kernel).variant(verdict.mode->name).make)
        try_in_time({kernel, &verdict, tried_executions(plan_.threads).front()});
    std::vector<const ModeVerdict*> modes;
    for (const Measurement* m : conforming())
      if (modes.size() < kModes) modes.push_back(m->candidate.verdict);
    return modes;
  }

  static std::vector<std::string> tried_kernels() {
    std::vector<std::string> names(std::begin(kFirstKernels), std::end(kFirstKernels));
    for (const Kernel& kernel : kernels())
      if (const std::string name(kernel.info().name);
          !kernel.info().hidden && !kernel.info().tests_every_pixel &&
          std::find(names.begin(), names.end(), name) == names.end())
        names.push_back(name);
    return names;
  }

  void try_kernel(const std::string& kernel, std::span<const ModeVerdict* const> modes) {
    double best = std::numeric_limits<double>::infinity();  // of this kernel
    for (const ModeVerdict* verdict : modes) {
      if (!find_kernel(kernel).variant(verdict->mode->name).make) continue;
      for (const ExecutionConfig& execution : tried_executions(plan_.threads)) {
        if (std::isfinite(best) && best > kHopeless * conforming().front()->trial_ms) {
          ++result_.hopeless;
          continue;
        }
        try_in_time({kernel, verdict, execution});
        for (const Measurement* m : conforming())
          if (m->candidate.kernel == kernel) best = std::min(best, m->trial_ms);
      }
    }
  }

  /// Those with a time, the fastest first.
  std::vector<const Measurement*> conforming() const {
    std::vector<const Measurement*> ranked;
    for (const Measurement& m : result_.all)
      if (m.conforms) ranked.push_back(&m);
    std::stable_sort(ranked.begin(), ranked.end(),
                     [](const Measurement* a, const Measurement* b) { return a->trial_ms < b->trial_ms; });
    return ranked;
  }

  bool is_known(const Candidate& candidate) const {
    return std::any_of(result_.all.begin(), result_.all.end(), [&](const Measurement& m) {
      return m.candidate.kernel == candidate.kernel && m.candidate.verdict == candidate.verdict &&
             to_string(m.candidate.execution) == to_string(candidate.execution);
    });
  }

  void try_in_time(const Candidate& candidate) {
    if (is_known(candidate)) return;
    // Until there is one, whatever it takes: an answer that took too long is worth more than none.
    if (share() >= kTrialShare && !conforming().empty()) {
      ++result_.no_time;
      return;
    }
    progress_(share(), name_of(candidate));
    Measurement& m = result_.all.emplace_back(Measurement{.candidate = candidate});
    const auto renderer = make(candidate);
    m.conforms = true;
    // The second frame meets what the first left in the strategy's memory, as every timed frame does.
    for (int frame = 0; frame < 2 && m.conforms; ++frame) {
      renderer->draw();
      m.conforms = fingerprint(picture_of(*renderer, settings_)) == candidate.verdict->fingerprint;
    }
    if (!m.conforms) return;
    m.trial_ms = frame_ms(*renderer, 1);
    for (int frame = 1; frame < kTrialFrames && m.trial_ms < kLongTrialMs; ++frame)
      m.trial_ms = std::min(m.trial_ms, frame_ms(*renderer, 1));
  }

  std::unique_ptr<Renderer> make(const Candidate& candidate) const {
    return make_renderer(candidate.kernel, candidate.verdict->mode->name,
                         {&scene_, settings_, candidate.execution});
  }

  static double frame_ms(Renderer& renderer, int frames) {
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < frames; ++i) renderer.draw();
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
    return time.count() / frames;
  }

  /// Frames that make one sample of `m`.
  static int frames_of(const Measurement& m) {
    return std::clamp(static_cast<int>(std::ceil(kShortestSampleMs / m.trial_ms)), 1, kMostFrames);
  }

  /// Indices of the fastest few: fewer where the time does not suffice for rounds enough to tell them apart.
  std::vector<std::size_t> finalists() const {
    const std::vector<const Measurement*> ranked = conforming();
    const double left_ms = (plan_.seconds - elapsed()) * 1e3;
    std::vector<std::size_t> chosen;
    double round_ms = 0;
    for (const Measurement* m : ranked) {
      round_ms += m->trial_ms * (1 + frames_of(*m));  // an untimed frame first
      if (chosen.size() == kFinalists || m->trial_ms > kFinalistShare * ranked.front()->trial_ms) break;
      if (chosen.size() >= 2 && round_ms * kLeastRounds > left_ms) break;
      chosen.push_back(static_cast<std::size_t>(m - result_.all.data()));
    }
    return chosen;
  }

  void final_rounds() {
    std::vector<std::size_t> order = finalists();
    Random random(plan_.seed);
    for (std::size_t round = 0; round < kMostRounds && (round == 0 || share() < 1); ++round) {
      for (std::size_t i = order.size(); i > 1; --i)
        std::swap(order[i - 1], order[random.bits() % i]);  // Fisher & Yates
      for (const std::size_t i : order) {
        Measurement& m = result_.all[i];
        progress_(share(), name_of(m.candidate));
        // A renderer of its own for every sample, so that no layout of memory is in all of them.
        const auto renderer = make(m.candidate);
        renderer->draw();
        m.rounds_ms.push_back(frame_ms(*renderer, frames_of(m)));
      }
    }
  }

  const Scene& scene_;
  const FrameSettings& settings_;
  const MeasuringPlan& plan_;
  const std::function<void(double, const std::string&)>& progress_;
  std::chrono::steady_clock::time_point begin_;
  Measurements result_;
};

}  // namespace

std::vector<ExecutionConfig> tried_executions(int threads) {
  if (threads == 1) return {ExecutionConfig{}};  // serial
  std::vector<ExecutionConfig> tried;
  for (const auto& [backend, schedule] :
       {std::pair{"openmp", "dynamic"}, {"openmp", "static"}, {"tbb", "auto"}})
    if (!is_left_out(backend))
      tried.push_back({.backend = backend, .schedule = schedule, .chunk = {}, .threads = threads});
  return tried;
}

Measurements measure(const Scene& scene, const FrameSettings& settings, std::span<const ModeVerdict> verdicts,
                     const MeasuringPlan& plan,
                     const std::function<void(double, const std::string&)>& progress) {
  return Bench(scene, settings, plan, progress).run(verdicts);
}

std::string name_of(const Candidate& candidate) {
  return fmt::format("{} {} {}", candidate.kernel, candidate.verdict->mode->name,
                     to_string(candidate.execution));
}

}  // namespace rasterbench
