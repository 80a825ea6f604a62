// What is found of one stress case in one numeric mode.
#pragma once

#include <cstdint>
#include <string>

namespace rasterbench::extremes {

/// From the best to the worst. A case's verdict is the worst of all that it asks for.
enum class Verdict : std::uint8_t {
  kNotCarried,   ///< no verdict: the kernel cannot carry the mode
  kEqual,        ///< what exact arithmetic says, pixel for pixel
  kRefused,      ///< refused, or warned of, as it must be
  kWithinBound,  ///< pixels differ, each within the mode's stated bound
  kReported,     ///< wrong, and said so: the mode promises nothing, or rounded corners lose the picture
  kWrong,        ///< what must not happen
};

/// More than this share of the drawn pixels wrong: a mode has broken down.
inline constexpr double kBrokenShare = 1e-3;

struct Finding {
  Verdict verdict = Verdict::kEqual;
  std::string explanation;  ///< of a verdict from kReported on: the first thing of that sort that was found
  std::string note;         ///< what was left out: a judge that this build has not
  std::int64_t pixels = 0;  ///< of the images
  std::int64_t drawn = 0;   ///< pixels that are not background
  std::int64_t wrong = 0;   ///< the most pixels that differ from a judge's picture

  /// Keeps the worse of two verdicts, and the explanation that goes with it.
  void worsen(Verdict other, const std::string& why) {
    if (other <= verdict) return;
    verdict = other;
    explanation = why;
  }
  void merge(const Finding& other) {
    worsen(other.verdict, other.explanation);
    if (note.empty()) note = other.note;
    pixels += other.pixels;
    drawn += other.drawn;
    wrong = wrong > other.wrong ? wrong : other.wrong;
  }
};

}  // namespace rasterbench::extremes
