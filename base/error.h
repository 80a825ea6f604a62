// Errors: one hierarchy, turned into one line on stderr and an exit code at main.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

namespace rasterbench {

/// The root of everything that rasterbench throws on purpose. main prints what() on one line and exits with
/// exit_code().
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  virtual int exit_code() const { return 1; }
};

/// Where in an input an error was found: what is empty is not printed.
struct Place {
  std::string file = {};                  ///< path, option ("--size") or environment variable
  std::optional<std::int64_t> line = {};  ///< 1-based line of a text file
  std::optional<std::int64_t> byte = {};  ///< 0-based offset into a binary file
  std::string field = {};                 ///< name of the value, e.g. "theta"
};

/// Bad input or usage (a file, an option, the environment): exit code 2.
/// what() reads "FILE:LINE: FIELD: message", or "FILE: byte N: FIELD: message".
class InputError : public Error {
 public:
  InputError(const Place& place, const std::string& message);
  explicit InputError(const std::string& message) : Error(message) {}
  int exit_code() const override { return 2; }
};

}  // namespace rasterbench
