// Which instruction sets this program was compiled to need, and which of them the CPU lacks.
#pragma once

#include <cstdint>

namespace rasterbench {

/// An instruction set, as a bit of a mask.
enum CpuFeature : std::uint32_t {
  kSse3 = 1u << 0,
  kSsse3 = 1u << 1,
  kSse41 = 1u << 2,
  kSse42 = 1u << 3,
  kPopcnt = 1u << 4,
  kAvx = 1u << 5,
  kAvx2 = 1u << 6,
  kBmi = 1u << 7,
  kBmi2 = 1u << 8,
  kFma = 1u << 9,
  kAvx512f = 1u << 10,
  kAvx512vl = 1u << 11,
  kAvx512bw = 1u << 12,
  kAvx512dq = 1u << 13,
  kAvx512cd = 1u << 14,
  kAvx512vbmi = 1u << 15,
  kAvx512vbmi2 = 1u << 16,
  kAvx512vnni = 1u << 17,
  kAvx512bitalg = 1u << 18,
  kAvx512vpopcntdq = 1u << 19,
  kAvx512ifma = 1u << 20,
  kGfni = 1u << 21,
  kLzcnt = 1u << 22,
  kMovbe = 1u << 23,
  kF16c = 1u << 24,
  kAvxvnni = 1u << 25,
  kXop = 1u << 26,
  kFma4 = 1u << 27,
  kSse4a = 1u << 28,
  kAvx512bf16 = 1u << 29,
  kAdx = 1u << 30,
};

/// What the kernels' files were compiled to need. Constant data of a file that is compiled like them.
extern const std::uint32_t compiled_features;

/// Name of the first feature in `needed` that is not in `present`, or null.
const char* first_missing(std::uint32_t needed, std::uint32_t present);

/// The features of this CPU.
std::uint32_t present_features();

}  // namespace rasterbench
