#include "extremes/catalogue.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>

#include "base/table_reader.h"
#include "extremes/constructions.h"
#include "numeric/modes.h"

namespace rasterbench::extremes {
namespace {

constexpr std::int64_t kMostPixels = std::int64_t{kMaxImageSide} * kMaxImageSide;

/// Numbers of a corner list: each finite value has to fit a float32.
std::vector<std::array<double, 9>> read_triangles(TableReader& reader, const std::string& key) {
  std::vector<std::array<double, 9>> triangles;
  reader.each_element(key, [&](const toml::node& node) {
    const std::vector<double> row = reader.exact_numbers(node, key, 9);
    std::array<double, 9> corners{};
    std::copy(row.begin(), row.end(), corners.begin());
    for (const double v : row)
      if (std::isfinite(v) && std::abs(v) > double{std::numeric_limits<float>::max()})
        reader.fail(node, key, fmt::format("{} does not fit a float32", v));
    triangles.push_back(corners);
  });
  return triangles;
}

Construction read_construction(TableReader& reader) {
  Construction construct;
  reader.text("name", construct.name);
  const ConstructionKind* kind = nullptr;
  try {
    kind = &find_construction(construct.name);
  } catch (const InputError& error) {
    reader.fail("name", error.what());
  }
  for (const GeneratorKey& key : kind->keys) {
    double value = key.default_value;
    reader.exact_number(key.name, value);
    if (!(value >= key.minimum && value <= key.maximum) || (key.integer && value != std::floor(value)))
      reader.fail(key.name, fmt::format("{} is not a {} from {:g} to {:g}", value,
                                        key.integer ? "whole number" : "number", key.minimum, key.maximum));
    construct.values[key.name] = value;
  }
  return construct;
}

CaseInput read_input(TableReader& reader) {
  CaseInput input;
  input.world = read_triangles(reader, "world");
  input.screen = read_triangles(reader, "screen");
  reader.text("generator", input.generator);
  reader.text("parameter_file", input.parameter_file);
  reader.table("construct", "construct", [&](TableReader& r) { input.construct = read_construction(r); });
  reader.table("model_file", "model_file", [&](TableReader& r) {
    constexpr std::int64_t kMost = 1000;  // what a test may write to a disk
    ModelFile& file = input.model_file.emplace();
    r.integer("claimed", std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max(),
              file.claimed);
    r.integer("triangles", 0, kMost, file.triangles);
    r.integer("extra_bytes", 0, kMost, file.extra_bytes);
  });
  const int given = !input.world.empty() + !input.screen.empty() + !input.generator.empty() +
                    !input.parameter_file.empty() + input.construct.has_value() +
                    input.model_file.has_value();
  if (given != 1)
    reader.fail("input", fmt::format("a case has one of world, screen, generator, construct, model_file and "
                                     "parameter_file; this one has {}",
                                     given));
  return input;
}

void read_parameters(TableReader& reader, const CaseInput& input, SceneParameters& p) {
  p.width = p.height = 64;
  if (const toml::node* node = reader.find("size")) {
    const auto size = reader.exact_numbers(*node, "size", 2);
    for (const double side : size)
      if (!(side >= 1 && side <= kMaxImageSide) || side != std::floor(side))
        reader.fail(*node, "size", fmt::format("must be two whole numbers from 1 to {}", kMaxImageSide));
    p.width = static_cast<int>(size[0]);
    p.height = static_cast<int>(size[1]);
    const auto power_of_two = [](int side) { return std::has_single_bit(static_cast<unsigned>(side)); };
    if (is_on_screen(input) && !(power_of_two(p.width) && power_of_two(p.height)))
      reader.fail(*node, "size", "must be powers of two where triangles are given on the screen");
  }
  if (is_on_screen(input)) return;  // the camera is then not for the case to choose: its keys are unknown
  p.camera = {1, 2, 4};
  p.near_plane = 0.5;
  p.far_plane = 20;
  if (const toml::node* node = reader.find("camera")) {
    const auto camera = reader.exact_numbers(*node, "camera", 3);
    p.camera = {camera[0], camera[1], camera[2]};
  }
  reader.exact_number("theta", p.theta);
  reader.exact_number("near", p.near_plane);
  reader.exact_number("far", p.far_plane);
}

std::string read_mode(const TableReader& reader, const toml::node& node, const std::string& key,
                      const std::string& name) {
  if (find_mode(name)) return name;
  std::vector<std::string> known;
  for (const ModeInfo& info : mode_infos()) known.emplace_back(info.name);
  reader.fail(node, key, unknown_name("numeric mode", name, known));
}

void check_known(const TableReader& reader, const toml::node& node, const std::string& key,
                 const std::string& word, std::span<const std::string> known) {
  if (std::find(known.begin(), known.end(), word) == known.end())
    reader.fail(node, key, unknown_name("value", word, known));
}

void read_judges(TableReader& reader, Must& must) {
  static const std::vector<std::string> kJudges{"oracle", "truth", "rays"};
  reader.each_element("match", [&](const toml::node& node) {
    const std::string word = node.value_or(std::string());
    check_known(reader, node, "match", word, kJudges);
    (word == "oracle" ? must.match_oracle : word == "truth" ? must.match_truth : must.match_rays) = true;
  });
}

Must read_must(TableReader& reader, const CaseInput& input, const SceneParameters& p) {
  Must must;
  read_judges(reader, must);
  reader.boolean("equal", must.equal);
  if (const toml::node* node = reader.find("pixels"))
    must.pixels = reader.integer_of(*node, "pixels", 0, kMostPixels);
  reader.each_element("owners", [&](const toml::node& node) {
    const std::vector<double> row = reader.exact_numbers(node, "owners", 3);
    const ExpectedPixel pixel{static_cast<int>(row[0]), static_cast<int>(row[1]),
                              static_cast<std::int32_t>(row[2])};
    if (pixel.x < 0 || pixel.x >= p.width || pixel.y < 0 || pixel.y >= p.height)
      reader.fail("owners", fmt::format("pixel {},{} is not in the image", pixel.x, pixel.y));
    must.owners.push_back(pixel);
  });
  reader.table("counts", "counts", [&](TableReader& r) {
    for (const char* name : {"non_finite", "zero_area", "behind_near", "beyond_far", "off_screen"})
      if (const toml::node* node = r.find(name))
        must.counts[name] = r.integer_of(*node, name, 0, kMaxTriangles);
  });
  reader.boolean("nothing_tested", must.nothing_tested);
  reader.table("same_as", "same_as", [&](TableReader& r) {
    Change change;
    r.text("change", change.name);
    const toml::node* node = r.find("change");
    if (!node) r.fail("change", "is missing");
    check_known(r, *node, "change", change.name, change_names());
    if (needs_screen_scene(change.name) && !is_on_screen(input))
      r.fail("change", change.name + " needs triangles that are given on the screen");
    if (change.name == "shifted") {
      r.integer("x", -kMaxImageSide, kMaxImageSide, change.x);
      r.integer("y", -kMaxImageSide, kMaxImageSide, change.y);
    }
    if (change.name == "scaled") r.exact_number("factor", change.factor);
    must.same_as = change;
  });
  reader.boolean("every_execution", must.every_execution);
  reader.boolean("no_background_inside", must.no_background_inside);
  const auto read_modes = [&](const std::string& key) {
    std::vector<std::string> modes;
    reader.each_element(key, [&](const toml::node& node) {
      modes.push_back(read_mode(reader, node, key, node.value_or(std::string())));
    });
    return modes;
  };
  if (reader.find("watertight")) must.watertight = read_modes("watertight");
  must.survivors = read_modes("survivors");
  reader.table("wrong_at_most", "wrong_at_most", [&](TableReader& r) {
    r.each_key([&](const std::string& name, const toml::node& node) {
      must.wrong_at_most[read_mode(r, node, name, name)] = r.integer_of(node, name, 0, kMostPixels);
    });
  });
  reader.string_list("error", must.error);
  reader.string_list("warning", must.warning);
  reader.string_list("refusal_or_room", must.refusal_or_room);
  return must;
}

/// What is asked for has to suit the input, and something has to be asked for.
void check_must(const TableReader& reader, const Case& one) {
  const Must& must = one.must;
  const bool of_file = one.input.model_file || !one.input.parameter_file.empty();
  if (must.is_about_reading() && !of_file)
    reader.fail("must", "error and warning are what reading model_file or parameter_file says");
  if (!one.input.parameter_file.empty() && !must.is_about_reading())
    reader.fail("must", "a parameter_file is only read: error or warning is missing");
  if ((!must.survivors.empty() || !must.wrong_at_most.empty()) && !must.match_truth)
    reader.fail("must", "survivors and wrong_at_most are about the truth: match is without it");
  if (must.equal && !must.match_oracle) reader.fail("must", "equal is about the oracle: match is without it");
  if (must.same_as && must.same_as->name == "mirrored" && one.fills != std::vector{FillRule::kClosed})
    reader.fail("must", "mirrored needs fill = [\"closed\"]: top-left is another rule in a mirror");
  const bool asks = must.match_oracle || must.match_truth || must.match_rays || must.pixels ||
                    !must.owners.empty() || !must.counts.empty() || must.nothing_tested || must.same_as ||
                    must.every_execution || must.no_background_inside || must.watertight ||
                    must.is_about_reading() || !must.refusal_or_room.empty();
  if (!asks) reader.fail("must", "asks for nothing");
}

Case read_case(const toml::table& table, const std::string& file) {
  TableReader reader(table, file);
  Case one;
  reader.integer("number", 1, 999, one.number);
  reader.text("name", one.name);
  if (one.number == 0) reader.fail("number", "is missing from this [[case]]");
  if (one.name.empty()) reader.fail("name", "is missing from this [[case]]");
  reader.text("what", one.what);
  one.input = read_input(reader);
  read_parameters(reader, one.input, one.parameters);
  static const std::vector<std::string> kFills{"closed", "top-left"}, kNears{"clip", "off"};
  reader.each_element("fill", [&](const toml::node& node) {
    const std::string word = node.value_or(std::string());
    check_known(reader, node, "fill", word, kFills);
    one.fills.push_back(word == "closed" ? FillRule::kClosed : FillRule::kTopLeft);
  });
  if (one.fills.empty()) one.fills = {FillRule::kClosed, FillRule::kTopLeft};
  if (const toml::node* node = reader.find("near_rule")) {
    const std::string word = node->value_or(std::string());
    check_known(reader, *node, "near_rule", word, kNears);
    one.near_rule = word == "clip" ? NearRule::kClip : NearRule::kOff;
  }
  if (!reader.find("must")) reader.fail("must", "is missing from this [[case]]");
  reader.table("must", "must", [&](TableReader& r) { one.must = read_must(r, one.input, one.parameters); });
  reader.reject_unknown_keys("[[case]]");
  check_must(reader, one);
  return one;
}

}  // namespace

std::vector<Case> read_catalogue(std::string_view text, const std::string& file) {
  const toml::table table = parse_toml(text, file);
  TableReader reader(table, file);
  std::vector<Case> cases;
  std::set<std::string> names;
  reader.each_element("case", [&](const toml::node& node) {
    if (!node.is_table()) reader.fail(node, "case", "must be written [[case]]");
    cases.push_back(read_case(*node.as_table(), file));
    if (!names.insert(cases.back().name).second)
      reader.fail(node, "name", fmt::format("'{}' is the name of two cases", cases.back().name));
  });
  reader.reject_unknown_keys("a catalogue");
  if (cases.empty()) throw InputError({.file = file}, "has no [[case]]");
  return cases;
}

std::vector<Case> read_catalogue_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path))
    throw InputError({.file = path.string()}, "cannot be read as a catalogue");
  return read_catalogue(std::string(std::istreambuf_iterator<char>(file), {}), path.string());
}

}  // namespace rasterbench::extremes
