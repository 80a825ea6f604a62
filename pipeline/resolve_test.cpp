// The resolve stage: flat shading, and keys into colours and depths.
#include "pipeline/resolve.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "numeric/coverage_testing.h"

namespace rasterbench {
namespace {

constexpr std::uint32_t rgba(std::uint32_t r, std::uint32_t g, std::uint32_t b) {
  return r | g << 8 | b << 16 | 255u << 24;
}

Triangle scaled(const Triangle& t, float factor) {
  const auto s = [factor](const Vec3& p) { return Vec3{p.x * factor, p.y * factor, p.z * factor}; };
  return {s(t.a), s(t.b), s(t.c)};
}

Triangle reversed(const Triangle& t) { return {t.c, t.b, t.a}; }

// Unit triangles whose normals (b - a) x (c - a) point along +x, +y and +z.
const Triangle kTowardsX{{0, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const Triangle kTowardsY{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}};
const Triangle kTowardsZ{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};

TEST(PackRgba, RedIsTheLowestByte) {
  EXPECT_EQ(pack_rgba({1, 2, 3}), 0xff030201u);
  EXPECT_EQ(pack_rgba({255, 0, 128}), rgba(255, 0, 128));
}

TEST(ShadeFlat, AxisAlignedFacesHaveOneOverRootThree) {
  // s = 1/sqrt(3) = 0.577350...: 255 s = 147.22, 200 s = 115.47, 76 s = 43.88, truncated to 43.
  for (const Triangle& t : {kTowardsX, kTowardsY, kTowardsZ})
    EXPECT_EQ(shade_flat(t, {255, 200, 76}), rgba(147, 115, 43));
}

TEST(ShadeFlat, BackFacesAreBlackAndOpaque) {
  for (const Triangle& t : {kTowardsX, kTowardsY, kTowardsZ})
    EXPECT_EQ(shade_flat(reversed(t), {255, 200, 76}), rgba(0, 0, 0));
}

TEST(ShadeFlat, TruncatesAndDoesNotRound) {
  // The normal (2, 1, 2)/3: s = 5/(3 sqrt(3)) = 0.9622504. 250 s = 240.56, 110 s = 105.85, 1 s = 0.96.
  const Triangle t{{0, 0, 0}, {1, 0, -1}, {0, 2, -1}};  // (1, 0, -1) x (0, 2, -1) = (2, 1, 2)
  EXPECT_EQ(shade_flat(t, {250, 110, 1}), rgba(240, 105, 0));
}

TEST(ShadeFlat, FullLightDoesNotOverflowAChannel) {
  // The normal (1, 1, 1)/sqrt(3) faces the light: s = 1, which rounding may exceed.
  const Triangle t{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::uint32_t colour = shade_flat(t, {255, 255, 255});
  EXPECT_GE(colour & 0xffu, 254u);  // 0 if 255.0000001 had wrapped
  EXPECT_EQ(colour >> 8 & 0xffu, colour & 0xffu);
}

TEST(ShadeFlat, DoesNotDependOnTheSize) {
  const Triangle unit{{0, 0, 0}, {1, 0, -1}, {0, 2, -1}};
  const Rgb white{250, 110, 40};
  for (const Triangle& t : {unit, kTowardsX, reversed(kTowardsY)})
    // Powers of two are exact; 1e30 squared is no float32, and 1e-30 squared is zero.
    for (const float factor : {0x1p100f, 0x1p-100f, 0x1p-140f, 1e30f, 1e-30f})
      EXPECT_EQ(shade_flat(scaled(t, factor), white), shade_flat(t, white)) << factor;
}

TEST(ShadeFlat, DoesNotDependOnThePlace) {
  const Triangle t{{1000, -2000, 4000}, {1001, -2000, 3999}, {1000, -1998, 3999}};
  EXPECT_EQ(shade_flat(t, {250, 110, 40}), rgba(240, 105, 38));  // as the unit one at the origin
}

template <class Mode>
class ResolveRow : public testing::Test {
 protected:
  /// Triangles 0, 1, 2 are lit 1/sqrt(3), not lit, and lit by 0.96.
  static Scene scene() {
    Scene scene;
    scene.model.triangles = {kTowardsX, reversed(kTowardsX), {{0, 0, 0}, {1, 0, -1}, {0, 2, -1}}};
    scene.parameters.object = {250, 110, 40};
    scene.parameters.background = {10, 20, 30};
    return scene;
  }
  static constexpr std::uint32_t kBackground = rgba(10, 20, 30);
  static constexpr std::uint32_t kOf[3] = {rgba(144, 63, 23), rgba(0, 0, 0), rgba(240, 105, 38)};
};
TYPED_TEST_SUITE(ResolveRow, ModeTypes, ModeNames);

/// A key of the depth d of the course contract, under the map that gives it back.
constexpr DepthMap map_of(DepthFunction function) {
  return function == DepthFunction::kNdc        ? DepthMap{0, 1}
         : function == DepthFunction::kReversed ? DepthMap{1, 2}
                                                : DepthMap{2, 1};
}

template <class Mode>
typename Mode::Key key_of(float d, std::uint32_t rank) {
  const DepthMap map = map_of(Mode::kDepthFunction);
  const double value = (d - map.offset) / map.scale;
  static const ScreenTriangle<float> any{};
  if constexpr (std::is_same_v<Mode, ExactMode>)
    return Mode::key(ExactDepth{value, 0, 0, 0, &any}, rank);
  else
    return Mode::key(static_cast<float>(value), rank);
}

TYPED_TEST(ResolveRow, MapsKeysToColoursAndDepths) {
  const auto clear = TypeParam::kClear;
  const DepthMap map = map_of(TypeParam::kDepthFunction);
  // Runs of one triangle, changes between triangles, and to and from the background.
  const std::vector keys{
      clear, key_of<TypeParam>(-1, 0),    key_of<TypeParam>(0.25f, 0), key_of<TypeParam>(0.5f, 1), clear,
      clear, key_of<TypeParam>(0.75f, 2), key_of<TypeParam>(0.5f, 0)};
  const int width = static_cast<int>(keys.size());
  const auto b = TestFixture::kBackground;
  const auto& of = TestFixture::kOf;
  const Scene scene = TestFixture::scene();
  const std::vector<float> depths{1, -1, 0.25f, 0.5f, 1, 1, 0.75f, 0.5f};
  const auto expect_depths = [&](const std::vector<float>& got) {
    for (std::size_t i = 0; i < depths.size(); ++i)
      EXPECT_NEAR(got[i], depths[i], 0.5 * TypeParam::kInfo.numbers.depth_step) << i;
  };

  std::vector<std::uint32_t> colours(keys.size());
  std::vector<float> got_depths(keys.size(), -7.0f);
  resolve_row<TypeParam>(keys.data(), width, scene, TieRule::kFirst, map, best_isa(), colours.data(),
                         got_depths.data());
  EXPECT_EQ(colours, (std::vector<std::uint32_t>{b, of[0], of[0], of[1], b, b, of[2], of[0]}));
  expect_depths(got_depths);

  // Past the caches: the same bits.
  std::vector<std::uint32_t> streamed_colours(keys.size());
  std::vector<float> streamed_depths(keys.size(), -7.0f);
  resolve_row<TypeParam>(keys.data(), width, scene, TieRule::kFirst, map, best_isa(), streamed_colours.data(),
                         streamed_depths.data(), /*streaming=*/true);
  EXPECT_EQ(streamed_colours, colours);
  EXPECT_EQ(streamed_depths, got_depths);

  // The later triangle wins ties: rank r is triangle 2 - r.
  resolve_row<TypeParam>(keys.data(), width, scene, TieRule::kLast, map, best_isa(), colours.data(),
                         got_depths.data());
  EXPECT_EQ(colours, (std::vector<std::uint32_t>{b, of[2], of[2], of[1], b, b, of[0], of[2]}));
  expect_depths(got_depths);
}

TYPED_TEST(ResolveRow, WritesNoMoreThanItsRow) {
  const std::vector keys(2, key_of<TypeParam>(0.5f, 1));
  std::array<std::uint32_t, 2> colours{7, 7};
  std::array<float, 2> depths{7, 7};
  resolve_row<TypeParam>(keys.data(), 1, TestFixture::scene(), TieRule::kFirst,
                         map_of(TypeParam::kDepthFunction), best_isa(), colours.data(), depths.data());
  EXPECT_EQ(colours, (std::array<std::uint32_t, 2>{rgba(0, 0, 0), 7}));
  EXPECT_NEAR(depths[0], 0.5, 0.5 * TypeParam::kInfo.numbers.depth_step);
  EXPECT_EQ(depths[1], 7);
}

TYPED_TEST(ResolveRow, StreamsRowsOfSeveralBlocksToTheBit) {
  std::vector<typename TypeParam::Key> keys;
  for (std::uint32_t i = 0; i < 3 * PixelRuns::kBlock + 5; ++i)
    keys.push_back(i % 7 < 2 ? TypeParam::kClear
                             : key_of<TypeParam>(static_cast<float>(i % 64) / 64, i / 5 % 3));
  const int width = static_cast<int>(keys.size());
  const Scene scene = TestFixture::scene();
  const DepthMap map = map_of(TypeParam::kDepthFunction);
  for (const std::size_t offset : {0, 1, 5}) {  // rows of an odd width begin anywhere
    std::vector<std::uint32_t> colours[2];
    std::vector<float> depths[2];
    for (const bool streaming : {false, true}) {
      colours[streaming].assign(keys.size() + offset + 1, 7);
      depths[streaming].assign(keys.size() + offset + 1, 7);
      resolve_row<TypeParam>(keys.data(), width, scene, TieRule::kFirst, map, best_isa(),
                             colours[streaming].data() + offset, depths[streaming].data() + offset,
                             streaming);
    }
    EXPECT_EQ(colours[0], colours[1]);
    EXPECT_EQ(depths[0], depths[1]);
    EXPECT_EQ(colours[1].back(), 7u);
    EXPECT_EQ(depths[1].back(), 7.0f);
  }
}

TYPED_TEST(ResolveRow, ASceneWithoutTrianglesIsBackground) {
  Scene empty = TestFixture::scene();
  empty.model.triangles.clear();
  const std::array keys{TypeParam::kClear, TypeParam::kClear};
  for (const TieRule tie : {TieRule::kFirst, TieRule::kLast}) {
    std::array<std::uint32_t, 2> colours{};
    std::array<float, 2> depths{};
    resolve_row<TypeParam>(keys.data(), 2, empty, tie, {-5, 3}, best_isa(), colours.data(), depths.data());
    EXPECT_EQ(colours, (std::array{TestFixture::kBackground, TestFixture::kBackground}));
    EXPECT_EQ(depths, (std::array{1.0f, 1.0f}));
  }
}

TEST(SwapRank, IsItsOwnInverse) {
  EXPECT_EQ(swap_rank(TieRule::kFirst, 10, 3), 3u);
  EXPECT_EQ(swap_rank(TieRule::kLast, 10, 3), 6u);
  EXPECT_EQ(swap_rank(TieRule::kLast, 10, 0), 9u);
  EXPECT_EQ(swap_rank(TieRule::kLast, kMaxTriangles, swap_rank(TieRule::kLast, kMaxTriangles, 5)), 5u);
}

}  // namespace
}  // namespace rasterbench
