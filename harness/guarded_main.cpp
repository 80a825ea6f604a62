#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

#include "base/error.h"
#include "harness/commands.h"

namespace rasterbench {
namespace {

int report(const char* program, std::string message, int exit_code) {
  std::replace(message.begin(), message.end(), '\n', ' ');  // one line, whatever a library says
  fmt::print(stderr, "{}: {}\n", program, message);
  return exit_code;
}

}  // namespace

int guarded_main(const char* program, const std::function<int()>& body) {
  try {
    const int exit_code = body();
    // A full disk under a redirected stdout shows only here.
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      throw Error(std::string("stdout cannot be written: ") + std::strerror(errno));
    return exit_code;
  } catch (const Error& error) {
    return report(program, error.what(), error.exit_code());
  } catch (const std::bad_alloc&) {
    return report(program, "out of memory", 2);
  } catch (const std::exception& error) {
    return report(program, error.what(), 1);
  }
}

}  // namespace rasterbench
