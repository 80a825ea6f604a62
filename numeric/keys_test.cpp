// Keys: encodings of depths, their order, and what comes back out of them.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "numeric/modes.h"
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
using ReversedKeys = PackedFloatKeys<DepthFunction::kReversed>;
using InverseWKeys = PackedFloatKeys<DepthFunction::kInverseW>;
using KeyTypes = testing::Types<PackedKeys, ReversedKeys, InverseWKeys, UnormKeys<16>, UnormKeys<24>,
                                UnormKeys<32>, WideKeys>;
TYPED_TEST_SUITE(KeyOrder, KeyTypes);

constexpr std::uint32_t kLastRank = static_cast<std::uint32_t>(kMaxTriangles) - 1;

/// Depth values from the near to the far plane, the nearest first, all told apart by a double.
template <class Keys>
std::vector<double> ascending_depths() {
  constexpr double kNear = Keys::kDepthFunction == DepthFunction::kInverseW ? -1e4 : -1;
  constexpr double kFar = far_value(Keys::kDepthFunction);
  std::vector<double> depths;
  Random random(2);
  for (int i = 0; i < 20000; ++i) {
    // Spread by their distance from the far plane, where depths crowd.
    const double share = i % 2 == 0 ? random.uniform() : std::pow(10.0, random.uniform(-14, 0));
    depths.push_back(kFar + (kNear - kFar) * share);
  }
  depths.push_back(kNear);
  std::sort(depths.begin(), depths.end());
  return depths;
}

TYPED_TEST(KeyOrder, IsMonotoneInDepth) {
  using Keys = TypeParam;
  const auto depths = ascending_depths<Keys>();
  int different = 0;
  for (std::size_t i = 1; i < depths.size(); ++i) {
    const auto nearer = Keys::key(depths[i - 1], 7), farther = Keys::key(depths[i], 7);
    ASSERT_LE(nearer, farther) << depths[i - 1] << " " << depths[i];
    ASSERT_LE(Keys::value(nearer), Keys::value(farther));
    if (nearer == farther) continue;
    ++different;
    // Depth decides before rank.
    ASSERT_LT(Keys::key(depths[i - 1], kLastRank), Keys::key(depths[i], 0));
  }
  EXPECT_GT(different, 1000);
}

TYPED_TEST(KeyOrder, OfEqualDepthsTheSmallestRankWins) {
  using Keys = TypeParam;
  constexpr double kDepth = Keys::kDepthFunction == DepthFunction::kInverseW ? -1.5 : -0.5;
  EXPECT_LT(Keys::key(kDepth, 6), Keys::key(kDepth, 7));
  EXPECT_EQ(Keys::key(kDepth, 7), Keys::key(kDepth, 7));
  EXPECT_LT(Keys::key(kDepth, 0), Keys::key(kDepth, kLastRank));
}

TYPED_TEST(KeyOrder, TheFarPlaneIsNotDrawnAndEverythingNearerThatTheFormatTellsApartIs) {
  using Keys = TypeParam;
  constexpr double kFar = far_value(Keys::kDepthFunction);
  EXPECT_LT(Keys::kClear, Keys::key(kFar, 0));
  EXPECT_LT(Keys::kClear, Keys::key(kFar + 0.25, 0));
  int merged = 0;
  for (const double depth : ascending_depths<Keys>()) {
    // A depth that rounds to the far plane's is not drawn; no other one is lost.
    const bool is_far = Keys::value(Keys::key(depth, 0)) == kFar;
    ASSERT_EQ(Keys::key(depth, kLastRank) < Keys::kClear, !is_far) << depth;
    ASSERT_EQ(Keys::key(depth, 0) < Keys::kClear, !is_far) << depth;
    merged += is_far;
  }
  // Only the formats that crowd at the far plane lose any: float32 from 1 - 2^-25 on.
  EXPECT_EQ(merged > 0, !(std::is_same_v<Keys, WideKeys> || std::is_same_v<Keys, ReversedKeys>)) << merged;
}

TYPED_TEST(KeyOrder, KeepsRankAndTheClearKeyIsNoTriangles) {
  using Keys = TypeParam;
  for (const std::uint32_t rank : {0u, 1u, kLastRank}) EXPECT_EQ(Keys::rank(Keys::key(-0.75, rank)), rank);
  EXPECT_GT(Keys::rank(Keys::kClear), kLastRank);  // resolve tells the background by it
  EXPECT_EQ(Keys::value(Keys::kClear), far_value(Keys::kDepthFunction));
  EXPECT_EQ(Keys::output_depth(Keys::kClear, DepthMap{17, 4}), 1.0f);  // whatever the map
}

TYPED_TEST(KeyOrder, ComesBackWithinHalfAStep) {
  using Keys = TypeParam;
  for (const double depth : ascending_depths<Keys>()) {
    const auto key = Keys::key(depth, 3);
    if (!(key < Keys::kClear)) continue;
    double half_step = 0;  // of a double, nothing is lost
    if constexpr (requires { Keys::kMax; })
      half_step = 1.0 / Keys::kMax * (1 + 1e-6);  // a step is 2 / kMax, and dividing by it rounds
    else if constexpr (!std::is_same_v<Keys, WideKeys>)
      half_step = 0x1p-24 * std::abs(depth) + 0x1p-150;
    ASSERT_NEAR(Keys::value(key), depth, half_step);
    if (Keys::kDepthFunction == DepthFunction::kNdc) {
      ASSERT_EQ(Keys::output_depth(key, {}), static_cast<float>(Keys::value(key)));
    } else {  // the map is applied in double and rounded once
      ASSERT_EQ(Keys::output_depth(key, {3, 0.25}), static_cast<float>(3 + 0.25 * Keys::value(key)));
    }
  }
}

TEST(PackedKeyOrder, DepthOneIsNotDrawnAndEveryFloatBelowIs) {
  EXPECT_LT(PackedKeys::key(std::nextafter(1.0f, 0.0f), kLastRank), PackedKeys::kClear);
  EXPECT_LT(WideKeys::key(std::nextafter(1.0, 0.0), kLastRank), WideKeys::kClear);
  EXPECT_LT(ReversedKeys::key(-std::numeric_limits<float>::denorm_min(), kLastRank), ReversedKeys::kClear);
  EXPECT_LT(InverseWKeys::key(std::nextafter(-1.0f, -2.0f), kLastRank), InverseWKeys::kClear);
}

TEST(PackedKeyOrder, ADepthOfZeroHasNoSign) {
  EXPECT_LT(PackedKeys::key(0.0f, 1), PackedKeys::key(-0.0f, 2));
  EXPECT_LT(PackedKeys::key(-0.0f, 1), PackedKeys::key(0.0f, 2));
  EXPECT_LT(WideKeys::key(0.0, 1), WideKeys::key(-0.0, 2));
  EXPECT_LT(WideKeys::key(-0.0, 1), WideKeys::key(0.0, 2));
  EXPECT_LT(ReversedKeys::kClear, ReversedKeys::key(-0.0f, 0));  // the far plane, too
}

TEST(UnormKeyOrder, RoundsToTheNearestAndTiesToEven) {
  // 2 / 65535 is one step; the codes count from the near plane.
  const auto code = [](double steps) { return UnormKeys<16>::key(steps * 2 / 65535 - 1, 0) >> 32; };
  EXPECT_EQ(code(0), 0u);
  EXPECT_EQ(code(1), 1u);
  EXPECT_EQ(code(1.25), 1u);
  EXPECT_EQ(code(1.75), 2u);
  EXPECT_EQ(code(65534.25), 65534u);
  EXPECT_EQ(code(65535), 65535u);
  EXPECT_EQ(UnormKeys<16>::key(0, 0) >> 32, 32768u);  // 32767.5: to even
  EXPECT_EQ(UnormKeys<32>::key(0, 0) >> 32, 2147483648u);
  // Beyond the planes, as without the near clip, depths are those of the planes.
  EXPECT_EQ(UnormKeys<24>::key(-7.5, 0) >> 32, 0u);
  EXPECT_EQ(UnormKeys<24>::key(1.5, 0) >> 32, 0xffffffu);
}

}  // namespace
}  // namespace rasterbench
