// Memory bandwidth as threads of this suite get it: read, write, streaming write and triad.
#pragma once

#include <cstddef>
#include <vector>

#include "machine/floor.h"

namespace rasterbench {

/// Which loops are measured.
enum class BandwidthLoops {
  kFloor,  ///< read and streaming write: what a floor is made of
  kAll,    ///< plain write and triad as well
};

/// What was measured: rates in bytes per second, one a repetition. Bytes are those that the program asks for:
/// the lines that an ordinary store reads first are not counted (STREAM's rule).
struct Bandwidth {
  int threads = 0;
  WorkingSet set;           ///< rounded up to whole blocks of the loops, three a thread
  bool huge_pages = false;  ///< the system took the advice to back the buffers by huge pages
  std::vector<double> read, write, streaming_write, triad;  ///< write and triad empty with kFloor
};

/// How often a measurement is repeated: until both are reached.
struct Repetitions {
  int least = 1;
  double seconds = 0;  ///< of wall time; no repetition begins later
};

/// Measures on buffers of the set's sizes, dealt evenly to the threads of a Team, each of which is the first
/// to touch its part. Repetitions take the loops in turn, after one untimed round; a small part is gone
/// through several times per repetition. The triad's arrays are
/// thirds of each thread's parts of both buffers. Throws InputError where memory does not suffice,
/// Error where the threads cannot be had.
Bandwidth measure_bandwidth(const WorkingSet& set, int threads, const Repetitions& repetitions,
                            BandwidthLoops loops);

/// Bytes of the outermost level of cache, all of its instances together; 0 where the system does not say.
std::size_t last_level_cache_bytes();

/// A set that no cache holds: four last-level caches read and as many written (STREAM's run rules), or where
/// that is more than a quarter of the memory available, an eighth of that each.
WorkingSet beyond_cache_set(std::size_t cache_bytes, std::size_t available_bytes);

}  // namespace rasterbench
