#include "scene/parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string_view>

#include "base/error.h"
#include "scene/image.h"
#include "scene/input_file.h"

namespace rasterbench {
namespace {

constexpr std::size_t kMaxFileBytes = 65536;  // 14 numbers: what is longer is some other file

/// A token as an error may quote it: on one line, printable and short, whatever file was given.
std::string quoted(std::string_view token) {
  constexpr std::size_t kLongest = 40;
  std::string text(token.substr(0, kLongest));
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  return "'" + text + (token.size() > kLongest ? "...'" : "'");
}

/// The tokens of a scene parameter file, each with its line.
class Tokens {
 public:
  Tokens(std::string file, std::string_view text) : file_(std::move(file)), rest_(text) {}

  const FieldLines& lines() const { return lines_; }

  double number(const std::string& field) {
    const std::string_view token = next(field);
    double value = 0;
    const std::errc error = parse(token, value);
    if (error == std::errc::result_out_of_range)
      fail(field, quoted(token) + " is out of the range of a double");
    if (error != std::errc()) fail(field, quoted(token) + " is not a number");
    if (!std::isfinite(value)) fail(field, quoted(token) + " is not finite");
    return value;
  }

  int integer(const std::string& field, int minimum, int maximum) {
    const std::string_view token = next(field);
    int value = 0;
    if (parse(token, value) != std::errc() || value < minimum || value > maximum)
      fail(field, fmt::format("{} is not an integer in {}..{}", quoted(token), minimum, maximum));
    return value;
  }

  void end() {
    skip_space();
    if (!rest_.empty()) throw InputError(place(line_, ""), quoted(token()) + " after the last field, far");
  }

 private:
  static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

  Place place(std::int64_t line, const std::string& field) const {
    return {.file = file_, .line = line, .field = field};
  }

  [[noreturn]] void fail(const std::string& field, const std::string& message) const {
    throw InputError(place(lines_.at(field), field), message);
  }

  void skip_space() {
    for (; !rest_.empty() && is_space(rest_.front()); rest_.remove_prefix(1))
      if (rest_.front() == '\n') ++line_;
  }

  std::string_view token() const {
    return rest_.substr(
        0, static_cast<std::size_t>(std::find_if(rest_.begin(), rest_.end(), is_space) - rest_.begin()));
  }

  std::string_view next(const std::string& field) {
    skip_space();
    lines_[field] = line_;
    if (rest_.empty()) fail(field, "missing: the file ends here");
    const std::string_view word = token();
    rest_.remove_prefix(word.size());
    return word;
  }

  /// from_chars on the whole token, and with the leading '+' that scanf accepts.
  template <class T>
  static std::errc parse(std::string_view token, T& value) {
    if (token.size() > 1 && token[0] == '+' && token[1] != '-') token.remove_prefix(1);
    const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
    if (error == std::errc() && end != token.data() + token.size()) return std::errc::invalid_argument;
    return error;
  }

  std::string file_;
  std::string_view rest_;
  std::int64_t line_ = 1;
  FieldLines lines_;
};

std::string read_text(const std::filesystem::path& path) {
  InputFile file(path);
  std::string text(kMaxFileBytes + 1, '\0');
  text.resize(file.read(text.data(), text.size()));
  if (text.size() > kMaxFileBytes)
    throw InputError({.file = path.string()},
                     fmt::format("longer than {} bytes: not a scene parameter file", kMaxFileBytes));
  return text;
}

Rgb read_rgb(Tokens& tokens, const std::string& what) {
  Rgb colour;
  colour.r = static_cast<std::uint8_t>(tokens.integer(what + " red", 0, 255));
  colour.g = static_cast<std::uint8_t>(tokens.integer(what + " green", 0, 255));
  colour.b = static_cast<std::uint8_t>(tokens.integer(what + " blue", 0, 255));
  return colour;
}

}  // namespace

SceneParameters read_scene_parameters(const std::filesystem::path& path) {
  const std::string text = read_text(path);
  Tokens tokens(path.string(), text);
  SceneParameters p;
  p.object = read_rgb(tokens, "object");
  p.background = read_rgb(tokens, "background");
  p.camera.x = tokens.number("camera x");
  p.camera.y = tokens.number("camera y");
  p.camera.z = tokens.number("camera z");
  p.height = tokens.integer("height", 1, kMaxImageSide);
  p.width = tokens.integer("width", 1, kMaxImageSide);
  p.theta = tokens.number("theta");
  p.near_plane = tokens.number("near");
  p.far_plane = tokens.number("far");
  tokens.end();
  check_scene_parameters(p, path.string(), tokens.lines());
  return p;
}

void check_scene_parameters(const SceneParameters& parameters, const std::string& file,
                            const FieldLines& lines) {
  const SceneParameters& p = parameters;
  const auto require = [&](bool good, const char* field, const std::string& message) {
    if (good) return;
    Place place{.file = file, .field = field};
    if (const auto line = lines.find(field); line != lines.end()) place.line = line->second;
    throw InputError(place, message);
  };
  const auto require_finite = [&](double value, const char* field) {
    require(std::isfinite(value), field, fmt::format("{} is not finite", value));
  };
  const auto require_side = [&](int value, const char* field) {
    require(value >= 1 && value <= kMaxImageSide, field,
            fmt::format("{} is not in 1..{}", value, kMaxImageSide));
  };
  require_finite(p.camera.x, "camera x");
  require_finite(p.camera.y, "camera y");
  require_finite(p.camera.z, "camera z");
  const double distance = std::hypot(p.camera.x, p.camera.y, p.camera.z);
  require(distance > 0, "camera x", "the camera is at the origin, which it should look at");
  require(std::isnormal(distance), "camera x",
          fmt::format("the camera's distance from the origin, {}, is out of range", distance));
  require_side(p.height, "height");
  require_side(p.width, "width");

  require_finite(p.theta, "theta");
  const bool in_range = p.theta > 0 && p.theta < std::numbers::pi;
  require(in_range, "theta",
          fmt::format("{} is not in (0, pi) radians{}", p.theta,
                      p.theta > std::numbers::pi && p.theta <= 180 ? "; degrees?" : ""));
  require(std::isfinite(1 / std::tan(p.theta / 2)), "theta", fmt::format("{} is too small", p.theta));

  require_finite(p.near_plane, "near");
  require_finite(p.far_plane, "far");
  require(p.near_plane > 0, "near", fmt::format("{} is not above 0", p.near_plane));
  require(p.near_plane < p.far_plane, "near",
          fmt::format("{} is not below far, {}", p.near_plane, p.far_plane));
  require(std::isnormal(2 * p.near_plane * p.far_plane), "far",
          fmt::format("near * far, {} * {}, is out of the range of a double", p.near_plane, p.far_plane));
}

void write_scene_parameters(const SceneParameters& parameters, const std::filesystem::path& path) {
  const SceneParameters& p = parameters;
  check_scene_parameters(p, path.string());
  write_file(path,
             fmt::format("{} {} {}\n{} {} {}\n{} {} {}\n{} {}\n{}\n{} {}\n", p.object.r, p.object.g,
                         p.object.b, p.background.r, p.background.g, p.background.b, p.camera.x, p.camera.y,
                         p.camera.z, p.height, p.width, p.theta, p.near_plane, p.far_plane));
}

SceneParameters framing_parameters(const Model& model) {
  double radius = 0;
  for (const Triangle& triangle : model.triangles) {
    for (const Vec3& corner : {triangle.a, triangle.b, triangle.c}) {
      const double r = std::hypot(double{corner.x}, double{corner.y}, double{corner.z});
      if (std::isfinite(r)) radius = std::max(radius, r);
    }
  }
  SceneParameters p;
  if (radius == 0) return p;
  constexpr double kMargin = 1.02;
  radius *= kMargin;
  const double half_angle = std::atan(std::tan(p.theta / 2) * std::min(1.0, double(p.width) / p.height));
  const double distance = radius / std::sin(half_angle);
  const double scale = distance / std::hypot(p.camera.x, p.camera.y, p.camera.z);
  p.camera = {p.camera.x * scale, p.camera.y * scale, p.camera.z * scale};
  p.near_plane = distance - radius;
  p.far_plane = distance + radius;
  return p;
}

Camera make_camera(const SceneParameters& parameters) {
  return look_at_origin(parameters.camera, parameters.theta, parameters.near_plane, parameters.far_plane,
                        {.width = parameters.width, .height = parameters.height});
}

}  // namespace rasterbench
