#include "machine/bandwidth.h"

#include <hwloc.h>
#include <sys/mman.h>

#include <algorithm>
#include <chrono>

#include "base/buffer.h"
#include "machine/loops.h"
#include "machine/team.h"

namespace rasterbench {
namespace {

using Word = std::uint64_t;
constexpr std::size_t kBlockBytes = kBlockWords * sizeof(Word);
// Per thread and repetition: a tenth of a millisecond or more, against which the clock and the start do not
// count.
constexpr std::size_t kLeastBytes = std::size_t{4} << 20;
// Where the system does not say how large the cache is: larger than those of most CPUs.
constexpr std::size_t kAssumedCache = std::size_t{64} << 20;
constexpr Word kPattern = 0x0123456789abcdef;  // as a double, a small normal number

/// Whole blocks, and as many for each thread as the triad has arrays.
std::size_t blocks_of(std::size_t bytes, int threads) {
  return std::max((bytes + kBlockBytes - 1) / kBlockBytes, static_cast<std::size_t>(threads) * 3);
}

/// One buffer, dealt to the threads in whole blocks.
class Part {
 public:
  Part(Word* words, std::size_t blocks, int threads)
      : words_(words), blocks_(blocks), threads_(static_cast<std::size_t>(threads)) {}

  std::size_t blocks() const { return blocks_; }
  Word* begin(int thread) const { return words_ + first(thread) * kBlockWords; }
  std::size_t blocks(int thread) const { return first(thread + 1) - first(thread); }
  std::size_t words(int thread) const { return blocks(thread) * kBlockWords; }

 private:
  std::size_t first(int thread) const { return blocks_ * static_cast<std::size_t>(thread) / threads_; }

  Word* words_;
  std::size_t blocks_, threads_;
};

class BandwidthBench {
 public:
  BandwidthBench(const WorkingSet& set, int threads)
      : team_(threads),
        read_blocks_(blocks_of(set.read_bytes, threads)),
        write_blocks_(blocks_of(set.write_bytes, threads)),
        memory_((read_blocks_ + write_blocks_) * kBlockWords, "the memory to measure bandwidth on"),
        read_(memory_.data(), read_blocks_, threads),
        write_(memory_.data() + read_blocks_ * kBlockWords, write_blocks_, threads) {
    // With small pages the address translation would be measured, too: the bound is what the memory gives.
    huge_pages_ = madvise(memory_.data(), memory_.bytes(), MADV_HUGEPAGE) == 0;
    team_.run([this](int thread) {  // the first touch
      store_words(read_.begin(thread), read_.words(thread), kPattern);
      store_words(write_.begin(thread), write_.words(thread), kPattern);
    });
  }

  Bandwidth run(const Repetitions& repetitions, BandwidthLoops loops) {
    const bool all = loops == BandwidthLoops::kAll;
    Bandwidth result;
    result.threads = team_.threads();
    result.set = {read_.blocks() * kBlockBytes, write_.blocks() * kBlockBytes};
    result.huge_pages = huge_pages_;
    const auto begin = std::chrono::steady_clock::now();
    const auto is_early = [&] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() <
             repetitions.seconds;
    };
    for (int repetition = -1; repetition < repetitions.least || is_early(); ++repetition) {
      const double read = read_rate(), streaming = write_rate(stream_words);
      const double write = all ? write_rate(store_words) : 0, triads = all ? triad_rate() : 0;
      if (repetition < 0) continue;  // untimed: threads, pages and clocks are warm after it
      result.read.push_back(read);
      result.streaming_write.push_back(streaming);
      if (!all) continue;
      result.write.push_back(write);
      result.triad.push_back(triads);
    }
    return result;
  }

 private:
  /// Bytes per second of `body`, which goes through `blocks` blocks on all threads together.
  template <class Body>
  double rate(std::size_t blocks, Body body) {
    const std::size_t bytes = blocks * kBlockBytes;
    const auto threads = static_cast<std::size_t>(team_.threads());
    const auto passes = static_cast<int>(std::max<std::size_t>(1, kLeastBytes * threads / bytes));
    return static_cast<double>(bytes) * passes / team_.run([&](int thread) {
      for (int pass = 0; pass < passes; ++pass) body(thread);
    });
  }

  double read_rate() {
    return rate(read_.blocks(), [this](int thread) { sum_words(read_.begin(thread), read_.words(thread)); });
  }

  template <class Write>
  double write_rate(Write write) {
    return rate(write_.blocks(),
                [this, write](int thread) { write(write_.begin(thread), write_.words(thread), kPattern); });
  }

  double triad_rate() {
    std::size_t blocks = 0;
    for (const Part* part : {&read_, &write_})
      for (int thread = 0; thread < team_.threads(); ++thread) blocks += part->blocks(thread) / 3 * 3;
    return rate(blocks, [this](int thread) {
      for (const Part* part : {&read_, &write_}) {
        const std::size_t words = part->blocks(thread) / 3 * kBlockWords;
        // The first third is written and never read, so that no value grows from pass to pass.
        auto* a = reinterpret_cast<double*>(part->begin(thread));
        triad(a, a + words, a + 2 * words, 3.0, words);
      }
    });
  }

  Team team_;
  std::size_t read_blocks_, write_blocks_;
  Buffer<Word> memory_;
  Part read_, write_;
  bool huge_pages_ = false;
};

}  // namespace

Bandwidth measure_bandwidth(const WorkingSet& set, int threads, const Repetitions& repetitions,
                            BandwidthLoops loops) {
  return BandwidthBench(set, threads).run(repetitions, loops);
}

std::size_t last_level_cache_bytes() {
  hwloc_topology_t topology = nullptr;
  if (hwloc_topology_init(&topology) != 0) return 0;
  std::size_t bytes = 0;
  if (hwloc_topology_load(topology) == 0)
    for (const hwloc_obj_type_t level :
         {HWLOC_OBJ_L4CACHE, HWLOC_OBJ_L3CACHE, HWLOC_OBJ_L2CACHE, HWLOC_OBJ_L1CACHE}) {
      for (hwloc_obj_t cache = hwloc_get_next_obj_by_type(topology, level, nullptr); cache;
           cache = hwloc_get_next_obj_by_type(topology, level, cache))
        bytes += cache->attr->cache.size;
      if (bytes > 0) break;
    }
  hwloc_topology_destroy(topology);
  return bytes;
}

WorkingSet beyond_cache_set(std::size_t cache_bytes, std::size_t available_bytes) {
  const std::size_t wanted = 4 * (cache_bytes > 0 ? cache_bytes : kAssumedCache);
  const std::size_t bytes = std::min(wanted, available_bytes / 8);
  return {bytes, bytes};
}

}  // namespace rasterbench
