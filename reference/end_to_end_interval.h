// Interval arithmetic on MPFR numbers: every operation rounds its lower end down and its upper end up, so
// that an interval always holds the exact result (Moore, Kearfott, Cloud, Introduction to Interval Analysis,
// SIAM 2009, chapter 2).
#pragma once

#include <mpfr.h>

#include <algorithm>
#include <boost/multiprecision/gmp.hpp>
#include <utility>

namespace rasterbench::end_to_end {

using Integer = boost::multiprecision::mpz_int;

/// The sign of a number, as far as it is known.
enum class Sign : signed char { kNegative = -1, kZero = 0, kPositive = 1, kUnknown = 2 };

inline Sign sign_of(const Integer& value) { return static_cast<Sign>(value.sign()); }

/// The sign of the product of a number and one with sign `factor`.
inline Sign operator*(Sign sign, Sign factor) {
  if (sign == Sign::kZero || factor == Sign::kZero) return Sign::kZero;
  if (sign == Sign::kUnknown || factor == Sign::kUnknown) return Sign::kUnknown;
  return sign == factor ? Sign::kPositive : Sign::kNegative;
}

/// A floating-point number of any precision.
class Float {
 public:
  explicit Float(mpfr_prec_t bits) { mpfr_init2(value_, bits); }
  Float(const Float& other) : Float(other.bits()) { mpfr_set(value_, other.value_, MPFR_RNDN); }
  Float& operator=(Float other) {
    mpfr_swap(value_, other.value_);
    return *this;
  }
  ~Float() { mpfr_clear(value_); }

  mpfr_ptr get() { return value_; }
  mpfr_srcptr get() const { return value_; }
  mpfr_prec_t bits() const { return mpfr_get_prec(value_); }

 private:
  mpfr_t value_;
};

/// The numbers from `low` to `high`.
struct Interval {
  Float low, high;

  explicit Interval(mpfr_prec_t bits) : low(bits), high(bits) {}
  Interval(const Integer& value, mpfr_prec_t bits) : Interval(bits) {
    mpfr_set_z(low.get(), value.backend().data(), MPFR_RNDD);
    mpfr_set_z(high.get(), value.backend().data(), MPFR_RNDU);
  }
  mpfr_prec_t bits() const { return low.bits(); }

  Sign sign() const {
    if (mpfr_sgn(low.get()) > 0) return Sign::kPositive;
    if (mpfr_sgn(high.get()) < 0) return Sign::kNegative;
    return mpfr_zero_p(low.get()) && mpfr_zero_p(high.get()) ? Sign::kZero : Sign::kUnknown;
  }
};

inline Interval operator+(const Interval& a, const Interval& b) {
  Interval sum(a.bits());
  mpfr_add(sum.low.get(), a.low.get(), b.low.get(), MPFR_RNDD);
  mpfr_add(sum.high.get(), a.high.get(), b.high.get(), MPFR_RNDU);
  return sum;
}

inline Interval operator-(const Interval& a, const Interval& b) {
  Interval difference(a.bits());
  mpfr_sub(difference.low.get(), a.low.get(), b.high.get(), MPFR_RNDD);
  mpfr_sub(difference.high.get(), a.high.get(), b.low.get(), MPFR_RNDU);
  return difference;
}

/// The hull of an operation's results on the four pairs of ends.
template <class Operation>
Interval hull_of_ends(const Interval& a, const Interval& b, Operation operation) {
  Interval hull(a.bits());
  Float result(a.bits());
  operation(hull.low.get(), a.low.get(), b.low.get(), MPFR_RNDD);
  operation(hull.high.get(), a.low.get(), b.low.get(), MPFR_RNDU);
  for (const auto& [x, y] : {std::pair(&a.low, &b.high), {&a.high, &b.low}, {&a.high, &b.high}}) {
    operation(result.get(), x->get(), y->get(), MPFR_RNDD);
    mpfr_min(hull.low.get(), hull.low.get(), result.get(), MPFR_RNDD);
    operation(result.get(), x->get(), y->get(), MPFR_RNDU);
    mpfr_max(hull.high.get(), hull.high.get(), result.get(), MPFR_RNDU);
  }
  return hull;
}

inline Interval operator*(const Interval& a, const Interval& b) { return hull_of_ends(a, b, mpfr_mul); }

/// Precondition: b does not hold 0.
inline Interval operator/(const Interval& a, const Interval& b) { return hull_of_ends(a, b, mpfr_div); }

/// Precondition: value >= 0.
inline Interval square_root(const Integer& value, mpfr_prec_t bits) {
  Interval root(value, bits);
  mpfr_sqrt(root.low.get(), root.low.get(), MPFR_RNDD);
  mpfr_sqrt(root.high.get(), root.high.get(), MPFR_RNDU);
  return root;
}

/// tan(angle / 2). Precondition: 0 < angle < pi.
inline Interval tangent_of_half(double angle, mpfr_prec_t bits) {
  Float half(64);  // holds a double and its half exactly
  mpfr_set_d(half.get(), angle, MPFR_RNDN);
  mpfr_div_2ui(half.get(), half.get(), 1, MPFR_RNDN);
  Interval tangent(bits);
  mpfr_tan(tangent.low.get(), half.get(), MPFR_RNDD);
  mpfr_tan(tangent.high.get(), half.get(), MPFR_RNDU);
  return tangent;
}

}  // namespace rasterbench::end_to_end
