// The catalogue of stress cases (extremes/catalogue.toml): data, with what must happen in each case.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "numeric/screen.h"
#include "scene/parameters.h"

namespace rasterbench::extremes {

/// A named family of triangles with its numbers, every key present (constructions.h).
struct Construction {
  std::string name;
  std::map<std::string, double> values;
};

/// A model file by what its header claims and what it holds.
struct ModelFile {
  std::int32_t claimed = 0;    ///< T of the header
  std::int64_t triangles = 0;  ///< that follow
  std::int64_t extra_bytes = 0;
};

/// What a case draws: exactly one of these is given.
struct CaseInput {
  std::vector<std::array<double, 9>> world;   ///< corners x y z, rounded to float32 once
  std::vector<std::array<double, 9>> screen;  ///< corners x y in pixels and the view depth w
  std::string generator;                      ///< a MODEL specification
  std::optional<Construction> construct;
  std::optional<ModelFile> model_file;  ///< read through scene/dat.h
  std::string parameter_file;           ///< text, read through scene/parameters.h
};

/// Another scene that must give the same picture (scenes.h says how each is made and compared).
struct Change {
  std::string name;
  double x = 0, y = 0;  ///< whole pixels of "shifted"
  double factor = 1;    ///< of "scaled": a power of two
};

/// A pixel and its owner, -1 = background.
struct ExpectedPixel {
  int x = 0, y = 0;
  std::int32_t id = -1;
};

/// What must happen. Empty members ask for nothing.
struct Must {
  bool match_oracle = false, match_truth = false, match_rays = false;
  bool equal = false;  ///< every bounded mode equals the oracle, not only within its bound
  std::optional<std::int64_t> pixels;
  std::vector<ExpectedPixel> owners;
  std::map<std::string, std::int64_t> counts;  ///< names of GeometryCounts' members
  bool nothing_tested = false;                 ///< no sample at all is tested
  std::optional<Change> same_as;
  bool every_execution = false;
  bool no_background_inside = false;
  /// Gaps and overlaps are counted: none in modes with exact edges, nor in the named ones.
  std::optional<std::vector<std::string>> watertight;
  std::vector<std::string> survivors;                 ///< modes in which few pixels may differ from the truth
  std::map<std::string, std::int64_t> wrong_at_most;  ///< pixels against the truth, by mode
  std::vector<std::string> error, warning;            ///< parts of the one line
  std::vector<std::string> refusal_or_room;           ///< parts of the error where memory does not suffice

  /// Whether reading the input is all that there is to a case.
  bool is_about_reading() const { return !error.empty() || !warning.empty(); }
};

struct Case {
  int number = 0;    ///< of the table of accuracy.md, section 5; from 46 on: beyond it
  std::string name;  ///< snake_case
  std::string what;  ///< one line
  CaseInput input;
  SceneParameters parameters;  ///< with the size of the image
  std::vector<FillRule> fills;
  NearRule near_rule = NearRule::kClip;
  Must must;
};

/// The catalogue that is part of the program.
std::string_view built_in_catalogue();

/// Reads a catalogue; `file` is named in errors. Strict: an unknown key, a value out of range or a case that
/// asks for nothing is an InputError with its line.
std::vector<Case> read_catalogue(std::string_view text, const std::string& file);

/// The same from a file. Throws InputError where it cannot be read.
std::vector<Case> read_catalogue_file(const std::filesystem::path& path);

}  // namespace rasterbench::extremes
