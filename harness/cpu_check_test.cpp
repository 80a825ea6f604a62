#include <gtest/gtest.h>

#include "harness/cpu_features.h"

namespace rasterbench {
namespace {

TEST(CpuCheck, NamesTheFirstMissingFeature) {
  EXPECT_EQ(first_missing(0, 0), nullptr);
  EXPECT_EQ(first_missing(kAvx | kAvx2, kAvx | kAvx2 | kFma), nullptr);
  EXPECT_STREQ(first_missing(kAvx | kAvx2 | kAvx512f, kAvx), "avx2");
  EXPECT_STREQ(first_missing(kGfni, ~std::uint32_t{kGfni}), "gfni");
}

TEST(CpuCheck, ThisProgramMayRunHere) { EXPECT_EQ(compiled_features & ~present_features(), 0u); }

}  // namespace
}  // namespace rasterbench
