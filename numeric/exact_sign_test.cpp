// Exact signs of sums and orientations, against whole numbers of any size.
#include "numeric/exact_sign.h"

#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "numeric/exact_testing.h"

namespace rasterbench {
namespace {

int sign_of(const Big& value) { return value.sign(); }

/// Sign of the exact sum, in units of the last bit of the smallest double.
int exact_sign(const std::array<double, 6>& terms) {
  Big sum = 0;
  for (const double term : terms) {
    int exponent = 0;
    const double fraction = std::frexp(term, &exponent);
    sum += Big(static_cast<std::int64_t>(std::ldexp(fraction, 53))) << (exponent - 53 + 1126);
  }
  return sign_of(sum);
}

int exact_orientation_sign(float ax, float ay, float bx, float by, float px, float py) {
  return sign_of(cross<Big>({big(ax), big(ay)}, {big(bx), big(by)}, {big(px), big(py)}));
}

/// Doubles of all sizes that products of float32 numbers have.
double any_size(Random& random) {
  return std::ldexp(random.uniform(-1, 1), static_cast<int>(random.bits() % 500) - 280);
}

TEST(ExactSignOfSum, OfTermsOfAllSizes) {
  Random random(61);
  int zero = 0, cancelled = 0;
  for (int i = 0; i < 20000; ++i) {
    std::array<double, 6> terms;
    for (double& term : terms) term = any_size(random);
    if (i % 4 == 1) {
      // Pairs that cancel but for a tiny rest, in any order.
      terms[3] = -terms[0];
      terms[4] = -terms[1];
      terms[5] = i % 8 == 1 ? -terms[2] : -std::nextafter(terms[2], 1.0);
    }
    if (i % 4 == 2) {
      // Three terms whose rounded sum is far from their sum: large, small, minus large.
      terms = {terms[0], std::ldexp(terms[0], -60), -terms[0], std::ldexp(terms[0], -110), 0, 0};
      if (i % 8 == 2) terms[3] = -std::ldexp(terms[0], -60);
    }
    for (std::size_t k = 5; k > 0; --k) std::swap(terms[k], terms[random.bits() % (k + 1)]);
    const int expected = exact_sign(terms);
    ASSERT_EQ(exact_sign_of_sum(terms), expected) << i;
    zero += expected == 0;
    double rounded = 0;
    for (const double term : terms) rounded += term;
    cancelled += (rounded > 0) - (rounded < 0) != expected;
  }
  EXPECT_GT(zero, 2000);
  EXPECT_GT(cancelled, 1000);  // plain summation gets these wrong
}

TEST(ExactSignOfSum, AtTheEndsOfTheRange) {
  const double tiny = std::numeric_limits<double>::denorm_min(), huge = 0x1p255;
  EXPECT_EQ(exact_sign_of_sum({}), 0);
  EXPECT_EQ(exact_sign_of_sum({-0.0, 0.0, -0.0, 0.0, 0.0, 0.0}), 0);
  EXPECT_EQ(exact_sign_of_sum({tiny, 0, 0, 0, 0, 0}), 1);
  EXPECT_EQ(exact_sign_of_sum({tiny, -tiny, tiny, -tiny, -tiny, 0}), -1);
  EXPECT_EQ(exact_sign_of_sum({huge, -huge, 0x1p-298, 0, 0, 0}), 1);
  EXPECT_EQ(exact_sign_of_sum({huge, 0x1p-298, -huge, -0x1p-298, 0, 0}), 0);
  EXPECT_EQ(exact_sign_of_sum({huge, -0x1p-298, -huge, 0x1p-298, 0, -0x1p-298}), -1);
}

TEST(ExactOrientation, OfRandomAndNearlyCollinearPoints) {
  Random random(62);
  int zero = 0;
  const auto f = [](double v) { return static_cast<float>(v); };
  for (int i = 0; i < 40000; ++i) {
    const double size = std::pow(10.0, random.uniform(-40, 18));
    const auto coordinate = [&] { return f(size * random.uniform(-1, 1)); };
    float ax = coordinate(), ay = coordinate(), bx = coordinate(), by = coordinate();
    float px = coordinate(), py = coordinate();
    if (i % 2 == 0) {
      // On the line but for the rounding of float32, or for one step of it.
      const double t = random.uniform(-1, 2);
      px = f(ax + t * (double{bx} - ax));
      py = f(ay + t * (double{by} - ay));
      if (i % 4 == 0) py = std::nextafter(py, py + 1);
    }
    if (i % 8 == 3) {  // small whole numbers: often exactly collinear
      for (float* v : {&ax, &ay, &bx, &by, &px, &py}) *v = static_cast<float>(random.bits() % 8);
    }
    const int expected = exact_orientation_sign(ax, ay, bx, by, px, py);
    ASSERT_EQ(exact_orientation(ax, ay, bx, by, px, py), expected) << i;
    ASSERT_EQ(exact_orientation(bx, by, ax, ay, px, py), -expected) << i;
    zero += expected == 0;
  }
  EXPECT_GT(zero, 300);
}

TEST(ExactOrientation, OfBitPatternsFromDenormalsTo1e38) {
  Random random(63);
  int denormal = 0;
  for (int i = 0; i < 40000; ++i) {
    std::array<float, 6> v;
    for (float& c : v) {
      do c = std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
      while (!std::isfinite(c));
      // Half of them are denormal, and some of those with few bits, so that they cancel.
      if (random.bits() % 2 == 0)
        c = std::copysign(std::ldexp(static_cast<float>(random.bits() % (i % 2 == 0 ? 4 : 1 << 20)), -149),
                          c);
      denormal += c != 0 && std::abs(c) < std::numeric_limits<float>::min();
    }
    ASSERT_EQ(exact_orientation(v[0], v[1], v[2], v[3], v[4], v[5]),
              exact_orientation_sign(v[0], v[1], v[2], v[3], v[4], v[5]))
        << i;
  }
  EXPECT_GT(denormal, 50000);
}

TEST(ExactOrientation, ZeroHasNoSign) {
  EXPECT_EQ(exact_orientation(-0.0f, 0.0f, 1, 1, 2, 2), 0);
  EXPECT_EQ(exact_orientation(0.0f, -0.0f, 1, 0, 1, 1), 1);
  EXPECT_EQ(exact_orientation(-0.0f, -0.0f, 1, 0, 1, -1), -1);
  // f64 alone is not exact (accuracy.md, section 4): here (b-a) rounds to (1, 1).
  EXPECT_EQ(exact_orientation(-1e-20f, 0, 1, 1, 0.5f, 0.5f), -1);
  EXPECT_EQ((double{1} - -1e-20) * 0.5 - (0.5 - -1e-20) * 1, 0);
}

}  // namespace
}  // namespace rasterbench
