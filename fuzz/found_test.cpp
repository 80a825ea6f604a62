// What the fuzzer has found, as it printed it: each was a bug once, and its comment says which.
#include <gtest/gtest.h>

#include "fuzz/relation.h"

namespace rasterbench::fuzz {
namespace {

// The footprint of a triangle left the error of approximate reciprocals out of the depth's gradients.
TEST(Fuzz, RaysF32RcpSeed2Case213) {
  const FuzzCase fuzz_case{.space = Space::kWorld,
                           .parameters = {.camera = {0x0p+0, 0x1p+2, 0x0p+0},
                                          .height = 1,
                                          .width = 1,
                                          .theta = 0x1.cp-1,
                                          .near_plane = 0x1p+1,
                                          .far_plane = 0x1p+3},
                           .seed = 0u,
                           .triangles = {{{-0x1.4p+1f, -0x1p+2f, -0x1p+2f},
                                          {0x1.cp+1f, 0x1.cp+1f, -0x1p+0f},
                                          {-0x1p+1f, -0x1.8p+0f, 0x1p+0f}},
                                         {{-0x1.4p+1f, -0x1p+2f, -0x1p+2f},
                                          {0x1.cp+1f, 0x1.c00004p+1f, -0x1p+0f},
                                          {-0x1p+1f, -0x1.8p+0f, 0x1p+0f}}}};
  EXPECT_EQ(violation("rays", "f32-rcp", fuzz_case), "");
}

// Kernel triangle_locks merged keys that it had never written where a triangle's pixels in a row have a hole,
// as they can in modes that are not monotone.
TEST(Fuzz, KernelsTwoProductFmaSeed7Case2447) {
  const FuzzCase fuzz_case{
      .space = Space::kWorld,
      .parameters = {.camera = {0x0p+0, 0x1p+0, 0x1p+0},
                     .height = 6,
                     .width = 7,
                     .theta = 0x1p+0,
                     .near_plane = 0x1p+0,
                     .far_plane = 0x1p+1},
      .seed = 1u,
      .triangles = {
          {{0x0p+0f, -0x1p+0f, 0x0p+0f}, {0x0p+0f, 0x0p+0f, 0x0p+0f}, {0x1p+0f, 0x0p+0f, -0x1p-1f}}}};
  EXPECT_EQ(violation("kernels", "two_product-fma", fuzz_case, {"triangle_locks"}), "");
}

}  // namespace
}  // namespace rasterbench::fuzz
