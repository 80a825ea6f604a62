// Instruction sets: which vector instructions the vectorised loops use. Chosen at run time, so that one
// binary serves every x86-64 CPU and the instruction set is an axis of a study. Never changes a picture
// (Invariant 0).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace rasterbench {

enum class Isa : std::uint8_t {
  kBaseline,  ///< what the compiler makes of scalar code for any CPU of the architecture
  kSse4,      ///< 128-bit vectors
  kAvx2,      ///< 256-bit vectors
  kAvx512,    ///< 512-bit vectors (F, BW, CD, DQ, VL)
};

/// "baseline", "sse4", "avx2", "avx512": also the order of the list.
std::string_view to_string(Isa isa);
std::span<const Isa> all_isas();

/// Whether this CPU and operating system run it. kBaseline always.
bool is_supported(Isa isa);

/// The widest that is supported.
Isa best_isa();

/// Throws InputError naming `field`, with a did-you-mean; "best" is best_isa(). Whether this CPU has it is
/// not asked.
Isa parse_isa(const std::string& text, std::string_view field);

}  // namespace rasterbench
