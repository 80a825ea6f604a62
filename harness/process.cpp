#include "harness/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>

extern char** environ;

namespace rasterbench {

std::atomic<bool> interrupted{false};

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupted = true; };  // no SA_RESTART: a waiting poll returns
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);  // writing to a dead child is an error code, not a death
}

Process::Process(const std::vector<std::string>& arguments,
                 const std::map<std::string, std::string>& variables) {
  // Everything that allocates happens before fork: between fork and exec only async-signal-safe calls are
  // allowed.
  std::vector<std::string> environment;
  for (char** variable = environ; *variable; ++variable) {
    const std::string text(*variable);
    if (!variables.contains(text.substr(0, text.find('=')))) environment.push_back(text);
  }
  for (const auto& [name, value] : variables)
    if (!value.empty()) environment.push_back(name + "=" + value);
  std::vector<std::string> words{"/proc/self/exe"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv, envp;
  for (std::string& word : words) argv.push_back(word.data());
  for (std::string& variable : environment) envp.push_back(variable.data());
  argv.push_back(nullptr);
  envp.push_back(nullptr);

  int request[2], answer[2];
  if (pipe2(request, O_CLOEXEC) != 0 || pipe2(answer, O_CLOEXEC) != 0)
    throw ProcessError(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ < 0) throw ProcessError(fmt::format("cannot start a runner process: {}", std::strerror(errno)));
  if (pid_ == 0) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(127);
    // A batch system sends TERM to all processes of a job: what it stops is the coordinator's decision, and a
    // runner that died of it would be taken for a point that failed.
    signal(SIGTERM, SIG_IGN);
    dup2(request[0], STDIN_FILENO);
    dup2(answer[1], STDOUT_FILENO);
    execve(argv[0], argv.data(), envp.data());
    _exit(127);
  }
  close(request[0]);
  close(answer[1]);
  to_child_ = request[1];
  from_child_ = answer[0];
}

Process::~Process() {
  if (alive()) kill_and_reap();
  if (to_child_ >= 0) close(to_child_);
  if (from_child_ >= 0) close(from_child_);
}

void Process::kill_and_reap() {
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

std::string Process::how_it_died() {
  int status = 0;
  // The pipe closes a moment before the process is gone.
  waitpid(pid_, &status, 0);
  pid_ = -1;
  if (WIFSIGNALED(status))
    return fmt::format("runner process died of signal {} ({})", WTERMSIG(status),
                       strsignal(WTERMSIG(status)));
  return fmt::format("runner process ended with exit code {}", WEXITSTATUS(status));
}

std::string Process::read_line(double timeout_seconds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_seconds);
  for (;;) {
    if (const std::size_t end = pending_.find('\n'); end != std::string::npos) {
      std::string line = pending_.substr(0, end);
      pending_.erase(0, end + 1);
      return line;
    }
    const auto left =
        std::chrono::duration<double, std::milli>(deadline - std::chrono::steady_clock::now()).count();
    pollfd ready{from_child_, POLLIN, 0};
    const int count = left <= 0 ? 0 : poll(&ready, 1, static_cast<int>(std::min(left, 1e9)) + 1);
    if (interrupted) {
      kill_and_reap();
      throw Interrupted("interrupted");
    }
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) {
      kill_and_reap();
      throw ProcessError(
          fmt::format("no answer within {:.0f} s: the runner process was ended", timeout_seconds));
    }
    char block[65536];
    const ssize_t n = read(from_child_, block, sizeof block);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw ProcessError(how_it_died());
    pending_.append(block, static_cast<std::size_t>(n));
  }
}

Json Process::ask(const Json& request, double timeout_seconds) {
  if (interrupted) throw Interrupted("interrupted");
  const std::string line = dump(request) + "\n";
  for (std::size_t written = 0; written < line.size();) {
    const ssize_t n = write(to_child_, line.data() + written, line.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw ProcessError(how_it_died());
    written += static_cast<std::size_t>(n);
  }
  const std::string text = read_line(timeout_seconds);
  const Json answer = Json::parse(text, nullptr, false);
  if (answer.is_discarded()) {  // whatever it says next would be the answer to another question
    kill_and_reap();
    throw ProcessError("runner process answered: " + text.substr(0, 200));
  }
  if (answer.contains("error")) throw ProcessError(answer.at("error").get<std::string>());
  return answer;
}

double Process::cpu_seconds() const {
  clockid_t clock{};
  timespec used{};
  if (!alive() || clock_getcpuclockid(pid_, &clock) != 0 || clock_gettime(clock, &used) != 0) return 0;
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

void Process::pause() {
  if (alive() && !paused_) kill(pid_, SIGSTOP);
  paused_ = true;
}

void Process::resume() {
  if (alive() && paused_) kill(pid_, SIGCONT);
  paused_ = false;
}

}  // namespace rasterbench
