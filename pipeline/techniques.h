// Techniques: what makes a frame fast and never changes its picture. Each is a switch, so that a study can
// add them one at a time and compare strategies that have the same ones.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace rasterbench {

/// Which techniques a frame uses, or which ones a kernel has.
struct Techniques {
  bool fragments = true;      ///< tiny triangles are sampled where they are transformed
  bool blocks = true;         ///< large triangles are tested and drawn by blocks of 16 x 16 pixels
  bool front_to_back = true;  ///< a tile draws in order of depth and leaves out what is hidden
  bool streaming = true;      ///< colours and depths bypass the caches on their way to memory
  bool huge_pages = true;     ///< buffers lie in pages of 2 MiB where the system has them

  bool operator==(const Techniques&) const = default;
};

inline constexpr Techniques kNoTechniques{false, false, false, false, false};
/// Those of the stages around a staged kernel (pipeline/frame_renderer.h).
inline constexpr Techniques kFrameTechniques{false, false, false, true, true};

struct TechniqueInfo {
  std::string_view name;
  std::string_view meaning;    ///< one line
  bool Techniques::*switched;  ///< the switch
};

/// Every technique, in the order in which to_string() names them.
std::span<const TechniqueInfo> technique_infos();

/// The techniques that both have.
Techniques common_techniques(const Techniques& a, const Techniques& b);

/// "all", "none", names joined by '+' ("streaming+huge_pages"), or all but some ("all-fragments"). Throws
/// InputError naming `field`, with a did-you-mean.
Techniques parse_techniques(const std::string& text, const std::string& field);

/// The one text for each set, which parse_techniques() reads: "all", "none", "all-NAME" where one is missing,
/// or the names joined by '+'.
std::string to_string(const Techniques& techniques);

}  // namespace rasterbench
