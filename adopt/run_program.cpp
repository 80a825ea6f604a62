#include "adopt/run_program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>
#include <thread>

#include "base/error.h"

extern char** environ;

namespace rasterbench {
namespace {

using Clock = std::chrono::steady_clock;

/// A descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close_now(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }
  void close_now() {
    if (number_ >= 0) close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

Error system_error(const char* what) { return Error(fmt::format("{}: {}", what, std::strerror(errno))); }

/// What the user's shell says of OpenMP would be an axis that nobody sees.
constexpr const char* kShed[] = {"OMP_", "GOMP_", "KMP_", "LD_PRELOAD"};

std::vector<std::string> child_environment(const std::map<std::string, std::string>& variables) {
  std::vector<std::string> result;
  for (char** variable = environ; *variable; ++variable) {
    const std::string_view text(*variable);
    const std::string name(text.substr(0, text.find('=')));
    const bool is_shed = std::any_of(std::begin(kShed), std::end(kShed),
                                     [&](const char* prefix) { return name.starts_with(prefix); });
    if (!is_shed && !variables.contains(name)) result.emplace_back(text);
  }
  for (const auto& [name, value] : variables)
    if (!value.empty()) result.push_back(name + "=" + value);
  return result;
}

std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> result;
  for (std::string& word : words) result.push_back(word.data());
  result.push_back(nullptr);
  return result;
}

/// vfork, not fork: the page tables of a large scene are not copied, which would be in the time. The child
/// only makes system calls until exec. Where exec fails it writes the errno to `failure`, which a good exec
/// closes.
[[gnu::noinline]] pid_t start(const ProgramRun& run, char* const* argv, char* const* envp, int input,
                              int output, int failure) {
  const char* folder = run.folder.c_str();
  const pid_t parent = getpid();
  const pid_t child = vfork();
  if (child != 0) return child;
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);
  signal(SIGPIPE, SIG_DFL);  // ignored signals stay ignored through exec
  rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  if (run.max_file_bytes > 0) {
    rlimit bytes{run.max_file_bytes, run.max_file_bytes};
    setrlimit(RLIMIT_FSIZE, &bytes);
  }
  dup2(input, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  if (chdir(folder) == 0) execve(argv[0], argv, envp);
  const int error = errno;
  [[maybe_unused]] const ssize_t n = write(failure, &error, sizeof error);
  _exit(127);
}

int count_threads(pid_t pid) {
  std::error_code error;
  const std::filesystem::directory_iterator tasks(fmt::format("/proc/{}/task", pid), error);
  return error ? 0 : static_cast<int>(std::distance(begin(tasks), end(tasks)));
}

/// VmHWM of proc(5): the largest resident set so far, bytes.
std::int64_t peak_memory(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/status", pid));
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("VmHWM:")) return std::strtoll(line.c_str() + 6, nullptr, 10) * 1024;
  return 0;
}

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

/// Keeps the end of what a program says.
class Tail {
 public:
  /// Reads what is there without waiting; false at the end of the file.
  bool read_from(int descriptor) {
    char block[16384];
    for (;;) {
      const ssize_t n = read(descriptor, block, sizeof block);
      if (n < 0) return errno == EAGAIN || errno == EINTR;
      if (n == 0) return false;
      text_.append(block, static_cast<std::size_t>(n));
      if (text_.size() > 2 * kOutputBytes) text_.erase(0, text_.size() - kOutputBytes);
      if (n < static_cast<ssize_t>(sizeof block))
        return true;  // a program that never stops talking has its limit
    }
  }
  std::string take() {
    if (text_.size() > kOutputBytes) text_.erase(0, text_.size() - kOutputBytes);
    return std::move(text_);
  }

 private:
  std::string text_;
};

}  // namespace

ProgramResult run_program(const ProgramRun& run) {
  std::vector<std::string> words = run.words, variables = child_environment(run.variables);
  const std::vector<char*> argv = pointers(words), envp = pointers(variables);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) throw system_error("cannot make a pipe");
  Descriptor reading(ends[0]), writing(ends[1]);
  // The program's own end blocks, as programs expect.
  fcntl(writing.number(), F_SETFL, 0);
  const Descriptor nothing(open("/dev/null", O_RDONLY | O_CLOEXEC));
  const Descriptor ended(eventfd(0, EFD_CLOEXEC));
  if (nothing.number() < 0 || ended.number() < 0) throw system_error("cannot open what a program needs");

  int failures[2];
  if (pipe2(failures, O_CLOEXEC | O_NONBLOCK) != 0) throw system_error("cannot make a pipe");
  const Descriptor failure(failures[0]), failing(failures[1]);

  ProgramResult result;
  const auto begin = Clock::now();
  const pid_t pid =
      start(run, argv.data(), envp.data(), nothing.number(), writing.number(), failing.number());
  if (pid < 0) throw system_error("cannot start a process");
  writing.close_now();

  // Waits where it takes no time from the program: a poll of both would need a signal handler or a pidfd.
  Clock::time_point end = begin;
  std::thread waiter([&] {
    siginfo_t information{};
    while (waitid(P_PID, static_cast<id_t>(pid), &information, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
    }
    end = Clock::now();
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t n = write(ended.number(), &one, sizeof one);
  });

  Tail output;
  bool talks = true;
  RunEnd killed = RunEnd::kExited;
  const auto deadline = begin + std::chrono::duration<double>(run.limit_seconds);
  for (;;) {
    pollfd events[2] = {{ended.number(), POLLIN, 0}, {talks ? reading.number() : -1, POLLIN, 0}};
    poll(events, 2, run.watch ? 2 : 100);
    if (events[0].revents != 0) break;
    if (events[1].revents != 0) talks = output.read_from(reading.number());
    if (run.watch) {
      result.most_threads = std::max(result.most_threads, count_threads(pid));
      result.max_rss_bytes = std::max(result.max_rss_bytes, peak_memory(pid));
    }
    if (killed != RunEnd::kExited) continue;
    if (Clock::now() >= deadline) killed = RunEnd::kTimeLimit;
    if (run.stop && run.stop()) killed = RunEnd::kStopped;
    if (killed != RunEnd::kExited) kill(-pid, SIGKILL);
  }
  waiter.join();
  kill(-pid, SIGKILL);  // what it left behind; the number is not given away before it is reaped below
  int status = 0;
  rusage usage{};
  while (wait4(pid, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  if (talks) output.read_from(reading.number());

  result.seconds = std::chrono::duration<double>(end - begin).count();
  result.cpu_seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
  result.output = output.take();
  if (int error = 0; read(failure.number(), &error, sizeof error) == sizeof error) {
    result.end = RunEnd::kNotStarted;
    result.code = error;
  } else if (killed != RunEnd::kExited && WIFSIGNALED(status)) {
    result.end = killed;
  } else if (WIFSIGNALED(status)) {
    result.end = RunEnd::kSignalled;
    result.code = WTERMSIG(status);
  } else {
    result.end = RunEnd::kExited;
    result.code = WEXITSTATUS(status);
  }
  return result;
}

std::string describe_end(const ProgramRun& run, const ProgramResult& result) {
  switch (result.end) {
    case RunEnd::kExited:
      return fmt::format("exit code {}", result.code);
    case RunEnd::kSignalled:
      return fmt::format("signal {} ({})", result.code, strsignal(result.code));
    case RunEnd::kTimeLimit:
      return fmt::format("no end within {:g} s: killed", run.limit_seconds);
    case RunEnd::kStopped:
      return "interrupted";
    case RunEnd::kNotStarted:
      return fmt::format("cannot be started: {}", std::strerror(result.code));
  }
  return "";
}

}  // namespace rasterbench
