#include "harness/point.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "base/error.h"
#include "base/suggest.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

/// A whole decimal number in [low, high].
int parse_integer(std::string_view text, int low, int high, const std::string& field,
                  const std::string& what) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < low || value > high)
    throw InputError({.field = field},
                     fmt::format("{} '{}' is not a whole number from {} to {}", what, text, low, high));
  return value;
}

constexpr int kMaxChunk = 1 << 30;

bool has_tiles(const Point& point) { return !is_peer(point) && find_kernel(point.kernel).info().has_tiles; }

/// Whether the frame has loops that are compiled for each instruction set: those of the geometry stage.
bool is_vectorised(const Point& point) {
  const ModeInfo* mode = is_peer(point) ? nullptr : find_mode(point.numeric);
  return mode != nullptr && mode->has_screen_triangles;
}

/// Every technique that could make a difference to the point.
Techniques possible_techniques(const Point& point) {
  if (is_peer(point)) return kNoTechniques;
  Techniques techniques = find_kernel(point.kernel).info().techniques;
  if (point.isa == Isa::kBaseline) techniques.streaming = false;  // its stores are vectors'
  return techniques;
}

}  // namespace

Techniques techniques_of(const Point& point) {
  return common_techniques(point.techniques, possible_techniques(point));
}

SceneReference parse_scene_reference(const std::string& text) {
  const auto at = text.find('@');
  SceneReference scene;
  scene.name = scene.model = text.substr(0, at);
  if (at != std::string::npos) scene.parameters = text.substr(at + 1);
  if (const std::filesystem::path model(scene.model);
      model.has_extension() && scene.model.find(':') == std::string::npos) {
    scene.name = model.stem().string();
    const std::string view = std::filesystem::path(scene.parameters).stem().string();
    if (!view.empty() && view != scene.name) scene.name += "@" + view;
  }
  return scene;
}

std::string dump(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

FrameSettings Point::settings() const {
  FrameSettings settings{.width = width, .height = height, .fill = fill};
  settings.geometry.near_rule = near_rule;
  settings.tile = tile;
  settings.generality = generality;
  settings.geometry.isa = isa;
  settings.techniques = techniques_of(*this);
  return settings;
}

bool is_peer(const Point& point) {
  return std::find(kPeers.begin(), kPeers.end(), point.kernel) != kPeers.end();
}

Point peer_point(const std::string& peer, const SceneReference& scene, int width, int height, int threads) {
  Point point;
  point.scene = scene;
  point.width = width;
  point.height = height;
  point.kernel = point.numeric = point.execution.backend = peer;
  point.fill = FillRule::kTopLeft;
  point.execution.threads = threads;
  point.environment.llvmpipe_threads = threads;
  return point;
}

std::string point_name(const Point& p) {
  std::string name =
      fmt::format("{}/{}x{}/{}/{}/{}/{}/{}/{}", p.scene.name, p.width, p.height, p.kernel, p.numeric,
                  kFillRules[p.fill == FillRule::kTopLeft], kNearRules[p.near_rule == NearRule::kOff],
                  to_string(p.execution), p.execution.threads);
  const Environment normal;
  if (p.environment.binding != normal.binding) name += "/binding:" + p.environment.binding;
  if (p.environment.wait_policy != normal.wait_policy) name += "/wait:" + p.environment.wait_policy;
  if (p.environment.runtime != normal.runtime) name += "/runtime:" + p.environment.runtime;
  if (has_tiles(p) && p.tile != 64) name += fmt::format("/tile:{}", p.tile);
  if (p.cache != "warm") name += "/cache:" + p.cache;
  if (p.generality != Generality::kMinimal) name += "/generality:full";
  if (is_vectorised(p) && p.isa != best_isa()) name += fmt::format("/isa:{}", to_string(p.isa));
  if (const Techniques techniques = techniques_of(p); techniques != possible_techniques(p))
    name += "/techniques:" + to_string(techniques);
  return name;
}

Json point_config(const Point& p) {
  Json config;
  config["scene"] = p.scene.name;
  config["size"] = {p.width, p.height};
  config["kernel"] = p.kernel;
  config["numeric"] = p.numeric;
  config["fill"] = kFillRules[p.fill == FillRule::kTopLeft];
  config["near"] = kNearRules[p.near_rule == NearRule::kOff];
  config["backend"] = p.execution.backend;
  config["schedule"] = p.execution.schedule.empty() ? Json() : Json(p.execution.schedule);
  config["chunk"] = p.execution.chunk ? Json(*p.execution.chunk) : Json();
  config["threads"] = p.execution.threads;
  config["binding"] = p.environment.binding;
  config["wait_policy"] = p.environment.wait_policy;
  config["runtime"] = p.environment.runtime;
  config["tile"] = has_tiles(p) ? Json(p.tile) : Json();
  config["isa"] = is_peer(p) ? "jit" : to_string(is_vectorised(p) ? p.isa : Isa::kBaseline);
  config["output"] = "rgba8+f32";
  config["cache"] = p.cache;
  config["generality"] = kGeneralities[p.generality == Generality::kFull];
  config["techniques"] = is_peer(p) ? Json() : Json(to_string(techniques_of(p)));
  return config;
}

Json point_to_json(const Point& p) {
  Json json = point_config(p);
  json["tile"] = p.tile;
  json["model"] = p.scene.model;
  json["parameters"] = p.scene.parameters;
  return json;
}

Point point_from_json(const Json& json) {
  Point p;
  p.scene = {.name = json.at("scene"), .model = json.at("model"), .parameters = json.at("parameters")};
  p.width = json.at("size").at(0);
  p.height = json.at("size").at(1);
  p.kernel = json.at("kernel");
  p.numeric = json.at("numeric");
  p.fill = parse_fill(json.at("fill"), "fill");
  p.near_rule = parse_near(json.at("near"), "near");
  p.execution.backend = json.at("backend");
  if (!json.at("schedule").is_null()) p.execution.schedule = json.at("schedule");
  if (!json.at("chunk").is_null()) p.execution.chunk = json.at("chunk").get<int>();
  p.execution.threads = json.at("threads");
  p.environment = {json.at("binding"), json.at("wait_policy"), json.at("runtime"),
                   is_peer(p) ? p.execution.threads : 0};
  p.tile = json.at("tile");
  p.cache = json.at("cache");
  p.generality = parse_generality(json.at("generality"), "generality");
  p.techniques = is_peer(p) ? Techniques{} : parse_techniques(json.at("techniques"), "techniques");
  p.isa = is_vectorised(p) ? parse_isa(json.at("isa"), "isa") : Isa::kBaseline;
  return p;
}

void parse_schedule(const std::string& text, const std::string& field, ExecutionConfig& execution) {
  const auto comma = text.find(',');
  execution.schedule = text.substr(0, comma);
  execution.chunk.reset();
  if (comma != std::string::npos)
    execution.chunk = parse_integer(std::string_view(text).substr(comma + 1), 1, kMaxChunk, field, "chunk");
}

ExecutionConfig parse_execution(const std::string& text, const std::string& field) {
  ExecutionConfig execution;
  const auto colon = text.find(':');
  execution.backend = text.substr(0, colon);
  if (colon != std::string::npos) parse_schedule(text.substr(colon + 1), field, execution);
  return execution;
}

std::pair<int, int> parse_size(const std::string& text, const std::string& field) {
  const auto x = text.find('x');
  if (x == std::string::npos)
    throw InputError({.field = field}, fmt::format("'{}' is not a size such as 1920x1080", text));
  const std::string_view view(text);
  return {parse_integer(view.substr(0, x), 1, kMaxImageSide, field, "width"),
          parse_integer(view.substr(x + 1), 1, kMaxImageSide, field, "height")};
}

void check_word(const std::string& word, const std::vector<std::string>& known, const std::string& field) {
  if (std::find(known.begin(), known.end(), word) == known.end())
    throw InputError({.field = field}, unknown_name("value", word, known));
}

FillRule parse_fill(const std::string& text, const std::string& field) {
  check_word(text, kFillRules, field);
  return text == "closed" ? FillRule::kClosed : FillRule::kTopLeft;
}

NearRule parse_near(const std::string& text, const std::string& field) {
  check_word(text, kNearRules, field);
  return text == "clip" ? NearRule::kClip : NearRule::kOff;
}

Generality parse_generality(const std::string& text, const std::string& field) {
  check_word(text, kGeneralities, field);
  return text == "full" ? Generality::kFull : Generality::kMinimal;
}

}  // namespace rasterbench
