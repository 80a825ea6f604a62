// Structural similarity against values that follow from its definition.
#include "reference/similarity.h"

#include <gtest/gtest.h>

#include <vector>

namespace rasterbench {
namespace {

constexpr std::uint32_t grey(std::uint32_t level) { return 0xff000000u | level << 16 | level << 8 | level; }

TEST(StructuralSimilarity, OfEqualPicturesIsOne) {
  const std::vector<std::uint32_t> picture{grey(1), grey(100), grey(7), grey(255), grey(0), grey(31)};
  EXPECT_EQ(structural_similarity(picture, picture, 3, 2), 1);
  EXPECT_EQ(structural_similarity(picture, picture, 6, 1), 1);
}

TEST(StructuralSimilarity, OfFlatPicturesIsTheLuminanceTerm) {
  // Without variance: (2ab + c1) / (a^2 + b^2 + c1).
  const std::vector<std::uint32_t> a(20 * 15, grey(100)), b(20 * 15, grey(50));
  constexpr double kC1 = 2.55 * 2.55;
  EXPECT_NEAR(structural_similarity(a, b, 20, 15), (2 * 5000 + kC1) / (10000 + 2500 + kC1), 1e-9);
}

TEST(StructuralSimilarity, CountsTheWindowsRoundADifference) {
  // One pixel in a large flat picture: 11 x 11 windows change, and the rest of the picture does not.
  const auto lost = [](int width, int height, int x, int y) {
    const auto pixels = static_cast<std::size_t>(width * height);
    const std::vector<std::uint32_t> a(pixels, grey(128));
    std::vector<std::uint32_t> b = a;
    b[static_cast<std::size_t>(y * width + x)] = grey(0);
    return (1 - structural_similarity(a, b, width, height)) * width * height;
  };
  EXPECT_GT(lost(40, 40, 20, 20), 30);
  EXPECT_LT(lost(40, 40, 20, 20), 121);
  EXPECT_NEAR(lost(40, 40, 20, 20), lost(80, 30, 12, 11), 1e-9);
  EXPECT_LT(lost(40, 40, 0, 0), lost(40, 40, 20, 20));  // fewer windows at the corner
}

TEST(StructuralSimilarity, OfAnInvertedTextureIsNegative) {
  std::vector<std::uint32_t> a, b;
  for (int i = 0; i < 32 * 32; ++i) {
    const bool is_light = (i + i / 32) % 2 == 0;
    a.push_back(grey(is_light ? 200 : 50));
    b.push_back(grey(is_light ? 50 : 200));
  }
  EXPECT_LT(structural_similarity(a, b, 32, 32), -0.9);
}

}  // namespace
}  // namespace rasterbench
