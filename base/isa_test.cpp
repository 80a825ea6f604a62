// Names of instruction sets, and which of them this CPU has.
#include "base/isa.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace rasterbench {
namespace {

TEST(Isa, NamesAreReadBack) {
  for (const Isa isa : all_isas()) EXPECT_EQ(parse_isa(std::string(to_string(isa)), "--isa"), isa);
  EXPECT_EQ(parse_isa("best", "--isa"), best_isa());
  try {
    parse_isa("avx3", "--isa");
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--isa: unknown instruction set 'avx3'; did you mean 'avx2'?"),
              std::string::npos)
        << error.what();
  }
}

TEST(Isa, TheBestIsTheWidestOfThisCpu) {
  EXPECT_TRUE(is_supported(Isa::kBaseline));
  EXPECT_TRUE(is_supported(best_isa()));
  for (const Isa isa : all_isas()) {
    EXPECT_TRUE(isa <= best_isa() || !is_supported(isa)) << to_string(isa);
  }
#if defined(__x86_64__)
  EXPECT_EQ(is_supported(Isa::kAvx2), __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"));
#endif
}

}  // namespace
}  // namespace rasterbench
