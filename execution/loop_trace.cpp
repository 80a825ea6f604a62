#include "execution/loop_trace.h"

#include <algorithm>
#include <chrono>

namespace rasterbench {
namespace {

class Traced final : public Execution {
 public:
  explicit Traced(std::unique_ptr<Execution> inner)
      : Execution(inner->config()), inner_(std::move(inner)), trace_(*config().trace) {
    const bool has_chunks =
        config().backend == "openmp" &&
        (config().schedule == "dynamic" || (config().schedule == "static" && config().chunk));
    trace_.cut_at_multiples(has_chunks ? config().chunk.value_or(1) : 0);
  }

  void run_loop(std::int64_t n, LoopBody body) override {
    inner_->reset_tally();
    if (config().schedule == "guided" && openmp_runtime() == "libgomp")
      trace_.cut_at(libgomp_guided_begins(n, threads(), config().chunk.value_or(1)));
    trace_.begin_loop(n, threads());
    if (trace_.detail() == LoopTrace::Detail::kLoops)
      inner_->loop(n, body);
    else
      inner_->loop(n, [&](std::int64_t i, int worker) {
        const double begin = LoopTrace::now();
        body(i, worker);
        trace_.add(worker, i, begin, LoopTrace::now());
      });
    trace_.end_loop();
    add_tally();
  }

  void uniform_loop(std::int64_t n, LoopBody body) override {
    inner_->reset_tally();
    inner_->uniform_loop(n, body);
    add_tally();
  }

 private:
  void add_tally() {
    for (int worker = 0; worker < threads(); ++worker)
      tally_of(worker) += inner_->tally()[static_cast<std::size_t>(worker)];
  }

  std::unique_ptr<Execution> inner_;
  LoopTrace& trace_;
};

}  // namespace

std::unique_ptr<Execution> make_traced(std::unique_ptr<Execution> inner) {
  return std::make_unique<Traced>(std::move(inner));
}

std::vector<std::int64_t> libgomp_guided_begins(std::int64_t n, int threads, std::int64_t chunk) {
  std::vector<std::int64_t> begins;
  for (std::int64_t at = 0; at < n; at += std::max((n - at + threads - 1) / threads, chunk))
    begins.push_back(at);
  return begins;
}

void LoopTrace::clear() {
  loops_.clear();
  for (Worker& worker : workers_) worker.chunks.clear();
  std::fill(iteration_seconds_.begin(), iteration_seconds_.end(), 0.0);
}

std::vector<std::vector<TracedChunk>> LoopTrace::chunks() const {
  std::vector<std::vector<TracedChunk>> all;
  for (const Worker& worker : workers_) all.push_back(worker.chunks);
  return all;
}

bool LoopTrace::loops_alike() const {
  return std::all_of(loops_.begin(), loops_.end(),
                     [&](const TracedLoop& loop) { return loop.iterations == loops_.front().iterations; });
}

void LoopTrace::begin_loop(std::int64_t n, int workers) {
  workers_.resize(static_cast<std::size_t>(workers));
  for (Worker& worker : workers_) worker.cut = true;
  if (detail_ == Detail::kIterations && iteration_seconds_.size() < static_cast<std::size_t>(n))
    iteration_seconds_.resize(static_cast<std::size_t>(n));
  loops_.push_back({.iterations = n});
  loops_.back().begin = now();
}

void LoopTrace::end_loop() { loops_.back().end = now(); }

void LoopTrace::begin_chunk(int worker) { workers_[static_cast<std::size_t>(worker)].cut = true; }

void LoopTrace::add(int worker, std::int64_t iteration, double begin, double end) {
  if (detail_ == Detail::kIterations) {
    iteration_seconds_[static_cast<std::size_t>(iteration)] += end - begin;
    return;
  }
  Worker& of = workers_[static_cast<std::size_t>(worker)];
  const bool begins = multiple_ > 0 ? iteration % multiple_ == 0
                                    : std::binary_search(begins_.begin(), begins_.end(), iteration);
  if (!of.cut && !begins && of.chunks.back().last + 1 == iteration) {
    of.chunks.back().last = iteration;
    of.chunks.back().end = end;
    return;
  }
  of.cut = false;
  of.chunks.push_back({.loop = static_cast<std::int64_t>(loops_.size()) - 1,
                       .first = iteration,
                       .last = iteration,
                       .begin = begin,
                       .end = end});
}

double LoopTrace::now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double LoopTrace::stamp_seconds() {
  std::vector<double> pairs(10001);
  for (double& pair : pairs) {
    const double begin = now();
    pair = now() - begin;
  }
  std::nth_element(pairs.begin(), pairs.begin() + 5000, pairs.end());
  return pairs[5000];
}

}  // namespace rasterbench
