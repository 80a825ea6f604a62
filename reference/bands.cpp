#include "reference/bands.h"

#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

namespace rasterbench::reference {

void for_each_band(int count, int threads, FunctionRef<void(int)> work) {
  std::atomic<int> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto take_bands = [&] {
    for (int band = next++; band < count; band = next++) {
      try {
        work(band);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::jthread> others;
  for (int i = 1; i < std::min(threads, count); ++i) others.emplace_back(take_bands);
  take_bands();
  others.clear();  // joins
  if (failure) std::rethrow_exception(failure);
}

}  // namespace rasterbench::reference
