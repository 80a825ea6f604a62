// Page-aligned arrays whose pages are touched first by whoever writes them first (design, Invariant 4).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

namespace rasterbench {

/// Bytes of memory that this process could still use (MemAvailable and the cgroup's limit).
std::size_t available_memory();

/// count * size, checked. Throws InputError "WHAT needs ... GiB, ... GiB are available" when it overflows or
/// when the machine does not have that much, so that a huge image is refused instead of killing the process
/// half-way.
std::size_t checked_bytes(std::size_t count, std::size_t size, const std::string& what);

/// How large the pages of a buffer may be.
enum class Pages : bool {
  kSmall,  ///< as the system has them for everyone
  kHuge,   ///< 2 MiB where the system grants them: far fewer misses of the TLB where accesses jump about
};

/// Anonymous pages straight from the kernel: zero, and placed on the NUMA node of the thread that touches
/// them first.
void* map_pages(std::size_t bytes, const std::string& what, Pages size = Pages::kSmall);
void unmap_pages(void* pages, std::size_t bytes) noexcept;

/// A fixed-size array of T without initialisation beyond zero pages. T must be trivial.
template <class T>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  Buffer() = default;
  /// `what` names the array in the error when it does not fit.
  Buffer(std::size_t size, const std::string& what, Pages pages = Pages::kSmall) : size_(size) {
    if (size_ > 0) data_ = static_cast<T*>(map_pages(checked_bytes(size_, sizeof(T), what), what, pages));
  }
  Buffer(Buffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  Buffer& operator=(Buffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer() {
    if (data_) unmap_pages(data_, size_ * sizeof(T));
  }

  /// Makes room for `size` elements; what was there is lost when it has to grow.
  void require(std::size_t size, const std::string& what) {
    if (size > size_) *this = Buffer(size, what);
  }

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return size_ * sizeof(T); }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  std::span<T> span() { return {data_, size_}; }
  std::span<const T> span() const { return {data_, size_}; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace rasterbench
