// The innermost loops of the bandwidth measurements, in the widest vectors of the CPU that runs them.
#pragma once

#include <cstddef>
#include <cstdint>

namespace rasterbench {

/// The loops go through memory in blocks of this many 64-bit words (or doubles): eight 64-byte vectors.
inline constexpr std::size_t kBlockWords = 64;

// Every pointer below is aligned to 64 bytes and every count is a multiple of kBlockWords.

/// The sum of `count` words modulo 2^64, in eight independent accumulators, so that loads are not waited for
/// one after another.
std::uint64_t sum_words(const std::uint64_t* words, std::size_t count);

/// Sets `count` words to `value` by ordinary stores, which read each cache line before they change it.
void store_words(std::uint64_t* words, std::size_t count, std::uint64_t value);

/// The same by non-temporal stores, which go past the caches, with a fence at the end.
void stream_words(std::uint64_t* words, std::size_t count, std::uint64_t value);

/// a[i] = b[i] + scale * c[i] by ordinary stores: the triad of McCalpin's STREAM (1995).
void triad(double* a, const double* b, const double* c, double scale, std::size_t count);

/// The instruction set that the loops run in here: Highway's name of it, as "AVX3" (AVX-512) or "AVX2".
const char* loop_instructions();

}  // namespace rasterbench
