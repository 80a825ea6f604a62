// Preloaded into a program (LD_PRELOAD), this library stands between it and its OpenMP runtime, counts what
// it asks for and hands everything on: libgomp's interface as gcc calls it (libgomp.h, libgomp_g.h), and of
// LLVM's the entry points of loops (kmp.h). At the end it appends "name count" lines to the file
// RASTERBENCH_OPENMP_PROBE. Such a run is never timed.
//
// Uses the C library alone: the program may be C.
#include <dlfcn.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

namespace {

enum Counter {
  kRuntime,
  kStatic,
  kDynamic,
  kGuided,
  kAuto,
  kRegions,
  kCriticals,
  kLocks,
  kBarriers,
  kCounters
};
const char* const kNames[kCounters] = {"loops_runtime", "loops_static", "loops_dynamic",
                                       "loops_guided",  "loops_auto",   "regions",
                                       "criticals",     "locks",        "barriers"};
long counts[kCounters];

void count(Counter counter) { __atomic_fetch_add(&counts[counter], 1, __ATOMIC_RELAXED); }

/// The runtime's own function, looked up once. One that is not there cannot have been called.
void* next(void*& slot, const char* name) {
  void* function = __atomic_load_n(&slot, __ATOMIC_RELAXED);
  if (function == nullptr) {
    function = dlsym(RTLD_NEXT, name);
    if (function == nullptr) abort();
    __atomic_store_n(&slot, function, __ATOMIC_RELAXED);
  }
  return function;
}

/// The kinds of a loop that is told its schedule as a number: GFS_* of libgomp.h.
void count_gomp(long schedule) {
  const Counter kinds[] = {kRuntime, kStatic, kDynamic, kGuided, kAuto};
  const long kind = schedule & 0x7fffffff;
  if (kind < 5) count(kinds[kind]);
}

/// The same of LLVM: enum sched_type of kmp.h, without the bits for monotonic and nonmonotonic.
void count_kmp(int schedule) {
  switch (schedule & ~(3 << 29)) {
    case 33:
    case 34:
      return count(kStatic);
    case 35:
      return count(kDynamic);
    case 36:
      return count(kGuided);
    case 37:
      return count(kRuntime);
    case 38:
      return count(kAuto);
    default:
      return;
  }
}

[[gnu::destructor]] void report() {
  const char* path = getenv("RASTERBENCH_OPENMP_PROBE");
  if (path == nullptr) return;
  char text[512];
  int size = 0;
  for (int i = 0; i < kCounters; ++i)
    size += snprintf(text + size, sizeof text - static_cast<size_t>(size), "%s %ld\n", kNames[i], counts[i]);
  const int file = open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (file < 0) return;  // no report: the caller says that there is none
  if (write(file, text, static_cast<size_t>(size)) < 0) perror("rasterbench_openmp_probe");
  close(file);
}

using Body = void (*)(void*);
using Ull = unsigned long long;

}  // namespace

#define FORWARD(name, ...)                                       \
  ([] {                                                          \
    static void* slot;                                           \
    return reinterpret_cast<decltype(&name)>(next(slot, #name)); \
  }())(__VA_ARGS__)

// A function per schedule and way to begin a loop, as libgomp has them.
#define LOOP_START_WITHOUT_CHUNK(name, counter)                                               \
  bool GOMP_loop_##name##_start(long a, long b, long step, long* first, long* last) {         \
    count(counter);                                                                           \
    return FORWARD(GOMP_loop_##name##_start, a, b, step, first, last);                        \
  }                                                                                           \
  bool GOMP_loop_ull_##name##_start(bool up, Ull a, Ull b, Ull step, Ull* first, Ull* last) { \
    count(counter);                                                                           \
    return FORWARD(GOMP_loop_ull_##name##_start, up, a, b, step, first, last);                \
  }
#define LOOP_START(name, counter)                                                                        \
  bool GOMP_loop_##name##_start(long a, long b, long step, long chunk, long* first, long* last) {        \
    count(counter);                                                                                      \
    return FORWARD(GOMP_loop_##name##_start, a, b, step, chunk, first, last);                            \
  }                                                                                                      \
  bool GOMP_loop_ull_##name##_start(bool up, Ull a, Ull b, Ull step, Ull chunk, Ull* first, Ull* last) { \
    count(counter);                                                                                      \
    return FORWARD(GOMP_loop_ull_##name##_start, up, a, b, step, chunk, first, last);                    \
  }
#define PARALLEL_LOOP_WITHOUT_CHUNK(name, counter)                                                   \
  void GOMP_parallel_loop_##name(Body body, void* data, unsigned threads, long a, long b, long step, \
                                 unsigned flags) {                                                   \
    count(kRegions);                                                                                 \
    count(counter);                                                                                  \
    FORWARD(GOMP_parallel_loop_##name, body, data, threads, a, b, step, flags);                      \
  }
#define PARALLEL_LOOP(name, counter)                                                                 \
  void GOMP_parallel_loop_##name(Body body, void* data, unsigned threads, long a, long b, long step, \
                                 long chunk, unsigned flags) {                                       \
    count(kRegions);                                                                                 \
    count(counter);                                                                                  \
    FORWARD(GOMP_parallel_loop_##name, body, data, threads, a, b, step, chunk, flags);               \
  }
#define KMP_DISPATCH(suffix, Number, Signed)                                                                 \
  void __kmpc_dispatch_init_##suffix(void* where, int thread, int schedule, Number a, Number b, Signed step, \
                                     Signed chunk) {                                                         \
    count_kmp(schedule);                                                                                     \
    FORWARD(__kmpc_dispatch_init_##suffix, where, thread, schedule, a, b, step, chunk);                      \
  }                                                                                                          \
  void __kmpc_for_static_init_##suffix(void* where, int thread, int schedule, int* is_last, Number* a,       \
                                       Number* b, Signed* stride, Signed step, Signed chunk) {               \
    count_kmp(schedule);                                                                                     \
    FORWARD(__kmpc_for_static_init_##suffix, where, thread, schedule, is_last, a, b, stride, step, chunk);   \
  }

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-declarations"
extern "C" {

LOOP_START_WITHOUT_CHUNK(runtime, kRuntime)
LOOP_START_WITHOUT_CHUNK(maybe_nonmonotonic_runtime, kRuntime)
LOOP_START_WITHOUT_CHUNK(nonmonotonic_runtime, kRuntime)
LOOP_START_WITHOUT_CHUNK(ordered_runtime, kRuntime)
LOOP_START(static, kStatic)
LOOP_START(dynamic, kDynamic)
LOOP_START(nonmonotonic_dynamic, kDynamic)
LOOP_START(guided, kGuided)
LOOP_START(nonmonotonic_guided, kGuided)
PARALLEL_LOOP_WITHOUT_CHUNK(runtime, kRuntime)
PARALLEL_LOOP_WITHOUT_CHUNK(maybe_nonmonotonic_runtime, kRuntime)
PARALLEL_LOOP_WITHOUT_CHUNK(nonmonotonic_runtime, kRuntime)
PARALLEL_LOOP(static, kStatic)
PARALLEL_LOOP(dynamic, kDynamic)
PARALLEL_LOOP(nonmonotonic_dynamic, kDynamic)
PARALLEL_LOOP(guided, kGuided)
PARALLEL_LOOP(nonmonotonic_guided, kGuided)

bool GOMP_loop_start(long a, long b, long step, long schedule, long chunk, long* first, long* last,
                     void* reductions, void** memory) {
  count_gomp(schedule);
  return FORWARD(GOMP_loop_start, a, b, step, schedule, chunk, first, last, reductions, memory);
}
bool GOMP_loop_ull_start(bool up, Ull a, Ull b, Ull step, long schedule, Ull chunk, Ull* first, Ull* last,
                         void* reductions, void** memory) {
  count_gomp(schedule);
  return FORWARD(GOMP_loop_ull_start, up, a, b, step, schedule, chunk, first, last, reductions, memory);
}
void GOMP_parallel(Body body, void* data, unsigned threads, unsigned flags) {
  count(kRegions);
  FORWARD(GOMP_parallel, body, data, threads, flags);
}
void GOMP_critical_start() {
  count(kCriticals);
  FORWARD(GOMP_critical_start);
}
void GOMP_critical_name_start(void** name) {
  count(kCriticals);
  FORWARD(GOMP_critical_name_start, name);
}
void GOMP_barrier() {
  count(kBarriers);
  FORWARD(GOMP_barrier);
}
void omp_set_lock(void* lock) {
  count(kLocks);
  FORWARD(omp_set_lock, lock);
}
void __kmpc_critical(void* where, int thread, void* name) {
  count(kCriticals);
  FORWARD(__kmpc_critical, where, thread, name);
}
void __kmpc_barrier(void* where, int thread) {
  count(kBarriers);
  FORWARD(__kmpc_barrier, where, thread);
}

KMP_DISPATCH(4, int, int)
KMP_DISPATCH(4u, unsigned, int)
KMP_DISPATCH(8, long, long)
KMP_DISPATCH(8u, unsigned long, long)

}  // extern "C"
#pragma GCC diagnostic pop
