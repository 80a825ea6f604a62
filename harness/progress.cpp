#include "harness/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace rasterbench {
namespace {

constexpr int kBarWidth = 30;
constexpr int kDetailWidth = 60;

}  // namespace

Progress::Progress() : terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { clear(); }

void Progress::clear() {
  if (bar_shown_) fmt::print(stderr, "\r\033[K");
  bar_shown_ = false;
}

void Progress::show(const std::string& phase, double done, double total, const std::string& detail) {
  using namespace std::chrono_literals;
  const auto now = std::chrono::steady_clock::now();
  const bool new_phase = phase != phase_;
  if (!new_phase && now - last_ < (terminal_ ? 100ms : 10s)) return;
  phase_ = phase;
  last_ = now;
  const double share = total > 0 ? std::clamp(done / total, 0.0, 1.0) : 0;
  if (!terminal_) {
    fmt::print(stderr, "{}: {:.0f} % {}\n", phase, share * 100, detail);
    return;
  }
  const int filled = static_cast<int>(share * kBarWidth);
  fmt::print(stderr, "\r\033[K{} [{:#>{}}{:.>{}}] {:3.0f} % {}", phase, "", filled, "", kBarWidth - filled,
             share * 100, detail.substr(0, kDetailWidth));
  std::fflush(stderr);
  bar_shown_ = true;
}

void Progress::note(const std::string& line) {
  clear();
  fmt::print(stderr, "{}\n", line);
}

}  // namespace rasterbench
