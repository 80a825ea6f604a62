// Compiled once for each instruction set by Highway and chosen at run time, so that a build for any x86-64
// CPU measures what this one can do: a loop of 16-byte loads does not reach the rate of many machines.
#include "machine/loops.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "machine/loops.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file again for each instruction set.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Words = hn::CappedTag<std::uint64_t, 8>;  // at most 64 bytes, so that eight of them divide a block
using Doubles = hn::CappedTag<double, 8>;

std::uint64_t SumWords(const std::uint64_t* HWY_RESTRICT words, std::size_t count) {
  const Words d;
  const std::size_t n = hn::Lanes(d);
  auto s0 = hn::Zero(d), s1 = s0, s2 = s0, s3 = s0, s4 = s0, s5 = s0, s6 = s0, s7 = s0;
  for (std::size_t i = 0; i < count; i += 8 * n) {
    s0 = hn::Add(s0, hn::Load(d, words + i));
    s1 = hn::Add(s1, hn::Load(d, words + i + n));
    s2 = hn::Add(s2, hn::Load(d, words + i + 2 * n));
    s3 = hn::Add(s3, hn::Load(d, words + i + 3 * n));
    s4 = hn::Add(s4, hn::Load(d, words + i + 4 * n));
    s5 = hn::Add(s5, hn::Load(d, words + i + 5 * n));
    s6 = hn::Add(s6, hn::Load(d, words + i + 6 * n));
    s7 = hn::Add(s7, hn::Load(d, words + i + 7 * n));
  }
  const auto low = hn::Add(hn::Add(s0, s1), hn::Add(s2, s3));
  const auto high = hn::Add(hn::Add(s4, s5), hn::Add(s6, s7));
  // Lane by lane: GCC reduces 512-bit vectors in signed integers, whose overflow is undefined.
  HWY_ALIGN std::uint64_t lanes[8];
  hn::Store(hn::Add(low, high), d, lanes);
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < n; ++i) sum += lanes[i];
  return sum;
}

void StoreWords(std::uint64_t* HWY_RESTRICT words, std::size_t count, std::uint64_t value) {
  const Words d;
  const std::size_t n = hn::Lanes(d);
  const auto v = hn::Set(d, value);
  for (std::size_t i = 0; i < count; i += 4 * n) {
    hn::Store(v, d, words + i);
    hn::Store(v, d, words + i + n);
    hn::Store(v, d, words + i + 2 * n);
    hn::Store(v, d, words + i + 3 * n);
  }
}

void StreamWords(std::uint64_t* HWY_RESTRICT words, std::size_t count, std::uint64_t value) {
  const Words d;
  const std::size_t n = hn::Lanes(d);
  const auto v = hn::Set(d, value);
  for (std::size_t i = 0; i < count; i += 4 * n) {
    hn::Stream(v, d, words + i);
    hn::Stream(v, d, words + i + n);
    hn::Stream(v, d, words + i + 2 * n);
    hn::Stream(v, d, words + i + 3 * n);
  }
  hwy::FlushStream();
}

void Triad(double* HWY_RESTRICT a, const double* HWY_RESTRICT b, const double* HWY_RESTRICT c, double scale,
           std::size_t count) {
  const Doubles d;
  const std::size_t n = hn::Lanes(d);
  const auto s = hn::Set(d, scale);
  for (std::size_t i = 0; i < count; i += 2 * n) {
    hn::Store(hn::MulAdd(s, hn::Load(d, c + i), hn::Load(d, b + i)), d, a + i);
    hn::Store(hn::MulAdd(s, hn::Load(d, c + i + n), hn::Load(d, b + i + n)), d, a + i + n);
  }
}

const char* Instructions() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace rasterbench {

HWY_EXPORT(SumWords);
HWY_EXPORT(StoreWords);
HWY_EXPORT(StreamWords);
HWY_EXPORT(Triad);
HWY_EXPORT(Instructions);

std::uint64_t sum_words(const std::uint64_t* words, std::size_t count) {
  return HWY_DYNAMIC_DISPATCH(SumWords)(words, count);
}
void store_words(std::uint64_t* words, std::size_t count, std::uint64_t value) {
  HWY_DYNAMIC_DISPATCH(StoreWords)(words, count, value);
}
void stream_words(std::uint64_t* words, std::size_t count, std::uint64_t value) {
  HWY_DYNAMIC_DISPATCH(StreamWords)(words, count, value);
}
void triad(double* a, const double* b, const double* c, double scale, std::size_t count) {
  HWY_DYNAMIC_DISPATCH(Triad)(a, b, c, scale, count);
}
const char* loop_instructions() { return HWY_DYNAMIC_DISPATCH(Instructions)(); }

}  // namespace rasterbench
#endif
