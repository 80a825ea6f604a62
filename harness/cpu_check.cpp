// Compiled for any x86-64 CPU: runs before every other initialiser of the program, says in one line what the
// CPU lacks of what the rest was compiled for (the `native` preset), and ends with exit code 2 instead of
// SIGILL.
#include <unistd.h>

#include <cstring>

#include "harness/cpu_features.h"

namespace rasterbench {
namespace {

struct NamedFeature {
  std::uint32_t bit;
  const char* name;
};

constexpr NamedFeature kNames[] = {{kSse3, "sse3"},
                                   {kSsse3, "ssse3"},
                                   {kSse41, "sse4.1"},
                                   {kSse42, "sse4.2"},
                                   {kPopcnt, "popcnt"},
                                   {kAvx, "avx"},
                                   {kAvx2, "avx2"},
                                   {kBmi, "bmi"},
                                   {kBmi2, "bmi2"},
                                   {kFma, "fma"},
                                   {kAvx512f, "avx512f"},
                                   {kAvx512vl, "avx512vl"},
                                   {kAvx512bw, "avx512bw"},
                                   {kAvx512dq, "avx512dq"},
                                   {kAvx512cd, "avx512cd"},
                                   {kAvx512vbmi, "avx512vbmi"},
                                   {kAvx512vbmi2, "avx512vbmi2"},
                                   {kAvx512vnni, "avx512vnni"},
                                   {kAvx512bitalg, "avx512bitalg"},
                                   {kAvx512vpopcntdq, "avx512vpopcntdq"},
                                   {kAvx512ifma, "avx512ifma"},
                                   {kGfni, "gfni"},
                                   {kLzcnt, "lzcnt"},
                                   {kMovbe, "movbe"},
                                   {kF16c, "f16c"},
                                   {kAvxvnni, "avxvnni"},
                                   {kXop, "xop"},
                                   {kFma4, "fma4"},
                                   {kSse4a, "sse4a"},
                                   {kAvx512bf16, "avx512bf16"},
                                   {kAdx, "adx"}};

void print(const char* text) {
  // Streams are not initialised yet. A message that cannot be written has no one to tell.
  if (write(STDERR_FILENO, text, std::strlen(text)) < 0) return;
}

[[gnu::constructor(101)]] void check_cpu() {
  const char* missing = first_missing(compiled_features, present_features());
  if (!missing) return;
  print("rasterbench: this build needs a CPU with ");
  print(missing);
  print(", which this one lacks: use the release preset, or build native on this machine\n");
  _exit(2);
}

}  // namespace

const char* first_missing(std::uint32_t needed, std::uint32_t present) {
  for (const NamedFeature& feature : kNames)
    if (needed & ~present & feature.bit) return feature.name;
  return nullptr;
}

std::uint32_t present_features() {
  std::uint32_t present = 0;
#if defined(__x86_64__)
  __builtin_cpu_init();
  // __builtin_cpu_supports wants literals.
#define RASTERBENCH_ASK(bit, name) present |= __builtin_cpu_supports(name) ? bit : 0u
  RASTERBENCH_ASK(kSse3, "sse3");
  RASTERBENCH_ASK(kSsse3, "ssse3");
  RASTERBENCH_ASK(kSse41, "sse4.1");
  RASTERBENCH_ASK(kSse42, "sse4.2");
  RASTERBENCH_ASK(kPopcnt, "popcnt");
  RASTERBENCH_ASK(kAvx, "avx");
  RASTERBENCH_ASK(kAvx2, "avx2");
  RASTERBENCH_ASK(kBmi, "bmi");
  RASTERBENCH_ASK(kBmi2, "bmi2");
  RASTERBENCH_ASK(kFma, "fma");
  RASTERBENCH_ASK(kAvx512f, "avx512f");
  RASTERBENCH_ASK(kAvx512vl, "avx512vl");
  RASTERBENCH_ASK(kAvx512bw, "avx512bw");
  RASTERBENCH_ASK(kAvx512dq, "avx512dq");
  RASTERBENCH_ASK(kAvx512cd, "avx512cd");
  RASTERBENCH_ASK(kAvx512vbmi, "avx512vbmi");
  RASTERBENCH_ASK(kAvx512vbmi2, "avx512vbmi2");
  RASTERBENCH_ASK(kAvx512vnni, "avx512vnni");
  RASTERBENCH_ASK(kAvx512bitalg, "avx512bitalg");
  RASTERBENCH_ASK(kAvx512vpopcntdq, "avx512vpopcntdq");
  RASTERBENCH_ASK(kAvx512ifma, "avx512ifma");
  RASTERBENCH_ASK(kGfni, "gfni");
#ifdef __clang__
  // clang does not know these names; the native preset is built with gcc.
  present |= kLzcnt | kMovbe | kF16c | kAvxvnni | kXop | kFma4 | kSse4a | kAvx512bf16 | kAdx;
#else
  RASTERBENCH_ASK(kLzcnt, "lzcnt");
  RASTERBENCH_ASK(kMovbe, "movbe");
  RASTERBENCH_ASK(kF16c, "f16c");
  RASTERBENCH_ASK(kAvxvnni, "avxvnni");
  RASTERBENCH_ASK(kXop, "xop");
  RASTERBENCH_ASK(kFma4, "fma4");
  RASTERBENCH_ASK(kSse4a, "sse4a");
  RASTERBENCH_ASK(kAvx512bf16, "avx512bf16");
  RASTERBENCH_ASK(kAdx, "adx");
#endif
#undef RASTERBENCH_ASK
#endif
  return present;
}

}  // namespace rasterbench
