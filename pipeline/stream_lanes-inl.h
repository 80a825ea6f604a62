// Stores past the caches. Compiled once for each instruction set: to be included after hwy/highway.h by a
// file that hwy/foreach_target.h includes again and again.
#if defined(RASTERBENCH_PIPELINE_STREAM_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef RASTERBENCH_PIPELINE_STREAM_LANES_INL_H_
#undef RASTERBENCH_PIPELINE_STREAM_LANES_INL_H_
#else
#define RASTERBENCH_PIPELINE_STREAM_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace rasterbench {
namespace HWY_NAMESPACE {
namespace {

/// Copies n elements with non-temporal stores, but what lies before the first whole vector of `to` and after
/// the last one. No other thread may read them before hwy::FlushStream().
template <class T>
HWY_INLINE void stream_row(const T* from, std::size_t n, T* to) {
  namespace hn = hwy::HWY_NAMESPACE;
  constexpr hn::ScalableTag<T> kVector;
  const std::size_t lanes = hn::Lanes(kVector);
  const std::size_t beyond = reinterpret_cast<std::uintptr_t>(to) / sizeof(T) % lanes;  // a vector's start
  std::size_t i = std::min(n, (lanes - beyond) % lanes);
  std::copy_n(from, i, to);
  for (; i + lanes <= n; i += lanes) hn::Stream(hn::LoadU(kVector, from + i), kVector, to + i);
  std::copy_n(from + i, n - i, to + i);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace rasterbench
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
