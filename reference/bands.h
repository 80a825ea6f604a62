// How the oracle divides its work: bands of rows, each with the triangles that can reach it. Has nothing in
// common with the kernels' tiles and executions, which it judges.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "base/buffer.h"
#include "base/function_ref.h"
#include "numeric/screen.h"

namespace rasterbench::reference {

/// Calls work(band) for 0 <= band < count, each once, on `threads` threads in no particular order. An
/// exception stops the bands that have not begun and is thrown on.
void for_each_band(int count, int threads, FunctionRef<void(int)> work);

/// The rows of an image, kRows at a time, and for each band the triangles whose corners' extent in y comes
/// within `reach` pixels of it, in the order of their indices. Left out are those that draw nothing: id < 0
/// or a corner that is not finite.
class Bands {
 public:
  static constexpr int kRows = 32;

  template <class Real>
  Bands(std::span<const ScreenTriangle<Real>> triangles, int height, double reach)
      : height_(height), first_(static_cast<std::size_t>(count()) + 1) {
    const auto for_each_entry = [&](auto&& visit) {
      for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto& t = triangles[i];
        if (t.id < 0 || !is_finite(t)) continue;
        const auto [low, high] = std::minmax({double{t.y[0]}, double{t.y[1]}, double{t.y[2]}});
        // Samples are half a pixel below the top of their row.
        const double first = std::max(0.0, std::floor(low - reach - 0.5));
        const double last = std::min(height_ - 1.0, std::ceil(high + reach - 0.5));
        if (first > last) continue;
        for (int band = static_cast<int>(first) / kRows; band <= static_cast<int>(last) / kRows; ++band)
          visit(static_cast<std::size_t>(band), static_cast<std::int32_t>(i));
      }
    };
    for_each_entry([&](std::size_t band, std::int32_t) { ++first_[band + 1]; });
    for (std::size_t band = 1; band < first_.size(); ++band) first_[band] += first_[band - 1];
    checked_bytes(first_.back(), sizeof(std::int32_t), "the oracle's lists of triangles");
    entries_.resize(first_.back());
    std::vector<std::size_t> end(first_.begin(), first_.end() - 1);
    for_each_entry([&](std::size_t band, std::int32_t i) { entries_[end[band]++] = i; });
  }

  int count() const { return (height_ + kRows - 1) / kRows; }
  int first_row(int band) const { return band * kRows; }
  int end_row(int band) const { return std::min(height_, (band + 1) * kRows); }

  /// Indices of triangles, ascending.
  std::span<const std::int32_t> triangles(int band) const {
    const auto b = static_cast<std::size_t>(band);
    return std::span(entries_).subspan(first_[b], first_[b + 1] - first_[b]);
  }

 private:
  template <class Real>
  static bool is_finite(const ScreenTriangle<Real>& t) {
    return std::all_of(t.x, t.x + 3, [](Real v) { return std::isfinite(v); }) &&
           std::all_of(t.y, t.y + 3, [](Real v) { return std::isfinite(v); }) &&
           std::all_of(t.d, t.d + 3, [](Real v) { return std::isfinite(v); });
  }

  int height_;
  std::vector<std::size_t> first_;  // of each band's entries, and the end
  std::vector<std::int32_t> entries_;
};

}  // namespace rasterbench::reference
