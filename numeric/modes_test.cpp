// The list of modes, and the order of keys.
#include "numeric/modes.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "scene/generator.h"

namespace rasterbench {
namespace {

template <class Float>
class Encoding : public testing::Test {};
using Floats = testing::Types<float, double>;
TYPED_TEST_SUITE(Encoding, Floats);

/// Strictly ascending, but for -0 and +0, which are neighbours.
template <class Float>
std::vector<Float> ascending_floats() {
  using Limits = std::numeric_limits<Float>;
  const Float tiny = Limits::denorm_min(), below_one = std::nextafter(Float{1}, Float{0});
  return {-Limits::infinity(),
          Limits::lowest(),
          -2,
          -1,
          -below_one,
          -Float{0.5},
          -1e-7f,
          -Limits::min(),
          -2 * tiny,
          -tiny,
          -Float{0},
          Float{0},
          tiny,
          2 * tiny,
          Limits::min(),
          1e-7f,
          Float{0.5},
          below_one,
          1,
          std::nextafter(Float{1}, Float{2}),
          2,
          Limits::max(),
          Limits::infinity()};
}

TYPED_TEST(Encoding, IsStrictlyMonotoneButForTheTwoZeros) {
  const auto floats = ascending_floats<TypeParam>();
  for (std::size_t i = 0; i < floats.size(); ++i)
    for (std::size_t j = 0; j < floats.size(); ++j) {
      EXPECT_EQ(encode(floats[i]) < encode(floats[j]), floats[i] < floats[j])
          << floats[i] << " " << floats[j];
      EXPECT_EQ(encode(floats[i]) == encode(floats[j]), floats[i] == floats[j])
          << floats[i] << " " << floats[j];
    }
}

TYPED_TEST(Encoding, OrdersRandomBitPatterns) {
  using Code = decltype(encode(TypeParam{}));
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const auto a = std::bit_cast<TypeParam>(static_cast<Code>(random.bits()));
    // A neighbour of a as often as something unrelated: the codes of neighbours differ in the lowest bits.
    const auto b = i % 2 == 0 ? std::nextafter(a, TypeParam{0})
                              : std::bit_cast<TypeParam>(static_cast<Code>(random.bits()));
    if (std::isnan(a) || std::isnan(b)) continue;
    ASSERT_EQ(encode(a) < encode(b), a < b) << a << " " << b;
  }
}

TYPED_TEST(Encoding, DecodeIsTheInverse) {
  for (const TypeParam value : ascending_floats<TypeParam>()) {
    EXPECT_EQ(decode(encode(value)), value);
    if (value != 0) {
      EXPECT_EQ(std::signbit(decode(encode(value))), std::signbit(value));
    }
  }
  EXPECT_FALSE(std::signbit(decode(encode(-TypeParam{0}))));  // -0 counts as +0
}

template <class Keys>
class KeyOrder : public testing::Test {};
using KeyTypes = testing::Types<PackedKeys, WideKeys>;
TYPED_TEST_SUITE(KeyOrder, KeyTypes);

template <class Keys>
using DepthOf = std::conditional_t<std::is_same_v<Keys, WideKeys>, double, float>;

constexpr std::uint32_t kLastRank = static_cast<std::uint32_t>(kMaxTriangles) - 1;

TYPED_TEST(KeyOrder, DepthDecidesFirstThenRank) {
  using Keys = TypeParam;
  const auto closer = std::nextafter(DepthOf<Keys>{0.5}, DepthOf<Keys>{0});
  EXPECT_LT(Keys::key(closer, kLastRank), Keys::key(0.5, 0));
  EXPECT_LT(Keys::key(0.5, 6), Keys::key(0.5, 7));
  EXPECT_EQ(Keys::key(0.5, 7), Keys::key(0.5, 7));
  EXPECT_LT(Keys::key(-0.5, kLastRank), Keys::key(-0.25, 0));
  EXPECT_LT(Keys::key(-0.25, kLastRank), Keys::key(0.25, 0));
  // A pixel at depth zero belongs to the smallest rank, whatever the sign of the zero.
  EXPECT_LT(Keys::key(0.0f, 1), Keys::key(-0.0f, 2));
  EXPECT_LT(Keys::key(-0.0f, 1), Keys::key(0.0f, 2));
}

TYPED_TEST(KeyOrder, DepthOneIsNotDrawnAndEverythingBelowIs) {
  using Keys = TypeParam;
  const DepthOf<Keys> one = 1;
  EXPECT_LT(Keys::kClear, Keys::key(one, 0));
  EXPECT_LT(Keys::key(std::nextafter(one, DepthOf<Keys>{0}), kLastRank), Keys::kClear);
  EXPECT_LT(Keys::key(-one, kLastRank), Keys::kClear);
}

TYPED_TEST(KeyOrder, KeepsDepthAndRank) {
  using Keys = TypeParam;
  for (const float depth : {-1.0f, -0.3f, 0.0f, 1e-42f, 0.75f, std::nextafter(1.0f, 0.0f)})
    for (const std::uint32_t rank : {0u, 1u, kLastRank}) {
      EXPECT_EQ(Keys::output_depth(Keys::key(depth, rank)), depth);
      EXPECT_EQ(Keys::rank(Keys::key(depth, rank)), rank);
    }
  EXPECT_EQ(Keys::output_depth(Keys::kClear), 1.0f);
  EXPECT_GT(Keys::rank(Keys::kClear), kLastRank);  // no triangle's: resolve tells the background by it
}

TEST(Modes, AreFoundByName) {
  std::vector<std::string_view> names;
  for (const ModeInfo& info : mode_infos()) names.push_back(info.name);
  EXPECT_EQ(names, (std::vector<std::string_view>{"f32", "f64", "fixed_8"}));
  for (const ModeInfo& info : mode_infos()) EXPECT_EQ(find_mode(info.name), &info);
  EXPECT_EQ(find_mode("f3"), nullptr);
  EXPECT_EQ(find_mode(""), nullptr);
}

TEST(Modes, OnlyThoseWithAWordAsKeyAreForAtomics) {
  EXPECT_TRUE(PackedKeyMode<F32>);
  EXPECT_TRUE(PackedKeyMode<Fixed8>);
  EXPECT_FALSE(PackedKeyMode<F64>);
}

TEST(PixelBoxes, Intersect) {
  const PixelBox a{0, 0, 10, 8}, b{5, -3, 20, 4};
  const PixelBox both = intersect(a, b);
  EXPECT_EQ((std::array{both.x0, both.y0, both.x1, both.y1}), (std::array{5, 0, 10, 4}));
  EXPECT_FALSE(both.empty());
  EXPECT_TRUE(both.contains(5, 0));
  EXPECT_TRUE(both.contains(9, 3));
  EXPECT_FALSE(both.contains(10, 3));
  EXPECT_FALSE(both.contains(9, 4));
  EXPECT_TRUE(intersect(a, {10, 0, 12, 8}).empty());
  EXPECT_TRUE(PixelBox{}.empty());
}

}  // namespace
}  // namespace rasterbench
