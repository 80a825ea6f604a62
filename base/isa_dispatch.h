// From an instruction set to the function that Highway compiled for it. For files that vectorise with Highway
// only.
#pragma once

#include <hwy/targets.h>

#include <cstddef>
#include <cstdint>

#include "base/isa.h"

namespace rasterbench {

static_assert(HWY_STATIC_TARGET == HWY_SCALAR, "the baseline is one lane: link rasterbench_highway");

/// Highway's bit for an instruction set; 0 for kBaseline, which is no code of Highway's.
constexpr std::int64_t highway_target(Isa isa) {
  switch (isa) {
    case Isa::kBaseline:
      return 0;
    case Isa::kSse4:
      return HWY_SSE4;
    case Isa::kAvx2:
      return HWY_AVX2;
    case Isa::kAvx512:
      return HWY_AVX3;
  }
  return 0;
}

/// The index of an instruction set in the tables that HWY_EXPORT makes, in the translation unit that asks.
/// Highway's own choice is one for the whole process; here it belongs to the caller.
inline std::size_t dispatch_index(Isa isa) {
  hwy::ChosenTarget chosen;
  chosen.Update(highway_target(isa));
  return chosen.GetIndex();
}

}  // namespace rasterbench

/// Calls the variant of `function`, which HWY_EXPORT has named, for an instruction set other than kBaseline.
#define RASTERBENCH_DISPATCH(function, isa) \
  (*(HWY_DISPATCH_TABLE(function)[::rasterbench::dispatch_index(isa)]))

/// A pointer to the variant of `function` for an instruction set; for kBaseline to the one of the static
/// target, which compiles for a single lane.
#define RASTERBENCH_VARIANT(function, isa) \
  ((isa) == ::rasterbench::Isa::kBaseline  \
       ? HWY_STATIC_DISPATCH(function)     \
       : HWY_DISPATCH_TABLE(function)[::rasterbench::dispatch_index(isa)])
