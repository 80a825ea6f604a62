#include "adopt/read_ppm.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string_view>
#include <system_error>

#include "base/error.h"
#include "scene/input_file.h"

namespace rasterbench {
namespace {

constexpr std::size_t kMostHeader = 4096;  // bytes, comments included

/// The numbers of a header: white space and comments between them (netpbm, ppm(5)).
class Header {
 public:
  explicit Header(std::string_view text) : text_(text) {}

  /// The next number; none where there is no number or one of more than 9 digits.
  std::optional<int> number() {
    for (; at_ < text_.size(); ++at_) {
      if (text_[at_] == '#')
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
      else if (!is_space(text_[at_]))
        break;
    }
    int value = 0;
    const std::size_t begin = at_;
    for (; at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9'; ++at_) {
      if (at_ - begin == 9) return std::nullopt;
      value = 10 * value + (text_[at_] - '0');
    }
    if (at_ == begin) return std::nullopt;
    return value;
  }
  /// The one white space after the last number.
  bool skip_space() { return at_ < text_.size() && is_space(text_[at_++]); }
  std::size_t at() const { return at_; }

 private:
  static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
  std::string_view text_;
  std::size_t at_ = 2;  // after the magic number
};

PpmFile refused(std::string problem) { return {.problem = std::move(problem)}; }

}  // namespace

PpmFile read_ppm(const std::filesystem::path& path, int width, int height) try {
  // Asked before it is opened: a pipe without a writer would hold whoever opens it.
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    return refused("is no plain file");
  InputFile file(path);
  if (file.size() == 0) return refused("is empty");
  std::string head(kMostHeader, '\0');
  head.resize(file.read(head.data(), head.size()));
  if (head.starts_with("P3"))
    return refused("is a PPM in ASCII (P3); the contract asks for a binary one (P6)");
  if (!head.starts_with("P6")) return refused("does not begin with P6: it is no binary PPM");
  Header header(head);
  const auto claimed_width = header.number(), claimed_height = header.number(), largest = header.number();
  if (!claimed_width || !claimed_height || !largest || !header.skip_space())
    return refused("has a header without width, height and largest value");
  if (*claimed_width == height && *claimed_height == width && width != height)
    return refused(
        fmt::format("is {} x {} pixels, the scene asks for {} x {}: width and height are swapped (the "
                    "scene file has the height first)",
                    *claimed_width, *claimed_height, width, height));
  if (*claimed_width != width || *claimed_height != height)
    return refused(fmt::format("is {} x {} pixels, the scene asks for {} x {}", *claimed_width,
                               *claimed_height, width, height));
  if (*largest != 255)
    return refused(fmt::format("has {} as its largest value, the contract asks for 255", *largest));

  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::uint64_t needed = header.at() + 3 * std::uint64_t{pixels};
  if (file.size() < needed)
    return refused(fmt::format("ends after {} of {} bytes: it is cut off", file.size(), needed));
  std::string bytes = head.substr(header.at());
  const std::size_t have = std::min(bytes.size(), 3 * pixels);
  bytes.resize(3 * pixels);
  if (file.read(bytes.data() + have, bytes.size() - have) != bytes.size() - have)
    return refused("was cut off while it was read");
  PpmFile picture;
  picture.pixels.reserve(pixels);
  const auto byte = [&](std::size_t i) { return std::uint32_t{static_cast<unsigned char>(bytes[i])}; };
  for (std::size_t i = 0; i < 3 * pixels; i += 3)
    picture.pixels.push_back(byte(i) | byte(i + 1) << 8 | byte(i + 2) << 16 | 0xff000000u);
  if (file.size() > needed)
    picture.note = fmt::format("{} bytes follow the last pixel", file.size() - needed);
  return picture;
} catch (const InputError& error) {
  return refused(fmt::format("cannot be read: {}", error.what()));
}

}  // namespace rasterbench
