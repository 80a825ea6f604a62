// Binning (sort-middle): which triangles touch which cell of a grid over the image.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "execution/execution.h"
#include "kernels/kernel.h"

namespace rasterbench {

/// Set-up triangles and, per cell, the indices of those whose box touches it. Kept between frames to reuse
/// its memory.
///
/// Two parallel passes over the same blocks of triangles: count per (block, cell), prefix sum, fill. No
/// atomics, and the order within a cell is the triangles' order whatever thread ran what.
template <NumericMode Mode>
class Bins {
 public:
  /// Bins `in` into cells of cell_width x cell_height pixels.
  void build(const StagedTriangles<Mode>& in, int cell_width, int cell_height, Execution& execution) {
    cell_width_ = cell_width;
    cell_height_ = cell_height;
    columns_ = (in.settings.width + cell_width - 1) / cell_width;
    rows_ = (in.settings.height + cell_height - 1) / cell_height;
    width_ = in.settings.width;
    height_ = in.settings.height;
    const std::int64_t cells = std::int64_t{columns_} * rows_;
    // Enough blocks to balance any number of threads that a machine has, few enough that the counters stay
    // small.
    const std::int64_t blocks =
        std::clamp<std::int64_t>(std::min(in.size() / 64, (std::int64_t{1} << 22) / cells), 1, 256);
    const auto block_begin = [&](std::int64_t block) { return in.size() * block / blocks; };
    prepared_.require(static_cast<std::size_t>(in.size()), "the array of prepared triangles");
    cursors_.require(static_cast<std::size_t>(blocks * cells), "the counters of the bins");

    execution.uniform_loop(blocks, [&](std::int64_t block, int) {
      std::int64_t* counts = cursors_.data() + block * cells;
      std::fill_n(counts, cells, 0);
      for (std::int64_t i = block_begin(block); i < block_begin(block + 1); ++i) {
        prepared_[static_cast<std::size_t>(i)] = in.prepare(i);
        for_each_cell(prepared_[static_cast<std::size_t>(i)].box, [&](std::int64_t cell) { ++counts[cell]; });
      }
    });

    // Exclusive prefix sum in the order (cell, block): a count becomes the place of the block's first entry
    // in the cell.
    begin_.resize(static_cast<std::size_t>(cells) + 1);
    std::int64_t total = 0;
    for (std::int64_t cell = 0; cell < cells; ++cell) {
      begin_[static_cast<std::size_t>(cell)] = total;
      for (std::int64_t block = 0; block < blocks; ++block) {
        std::int64_t& cursor = cursors_[static_cast<std::size_t>(block * cells + cell)];
        total += std::exchange(cursor, total);
      }
    }
    begin_.back() = total;

    entries_.require(static_cast<std::size_t>(total), "the entries of the bins");
    execution.uniform_loop(blocks, [&](std::int64_t block, int) {
      std::int64_t* cursors = cursors_.data() + block * cells;
      for (std::int64_t i = block_begin(block); i < block_begin(block + 1); ++i)
        for_each_cell(prepared_[static_cast<std::size_t>(i)].box, [&](std::int64_t cell) {
          entries_[static_cast<std::size_t>(cursors[cell]++)] = static_cast<std::uint32_t>(i);
        });
    });
  }

  std::size_t bytes() const {
    return prepared_.bytes() + cursors_.bytes() + begin_.size() * sizeof(begin_[0]) + entries_.bytes();
  }

  std::int64_t cells() const { return std::int64_t{columns_} * rows_; }

  /// Pixels of a cell, cut to the image.
  PixelBox box(std::int64_t cell) const {
    const auto column = static_cast<std::int32_t>(cell % columns_),
               row = static_cast<std::int32_t>(cell / columns_);
    return {column * cell_width_, row * cell_height_, std::min((column + 1) * cell_width_, width_),
            std::min((row + 1) * cell_height_, height_)};
  }

  /// Calls visit(prepared) for each triangle whose box touches `cell`, in their order.
  template <class Visit>
  void for_each_triangle(std::int64_t cell, Visit visit) const {
    const auto first = begin_[static_cast<std::size_t>(cell)],
               last = begin_[static_cast<std::size_t>(cell) + 1];
    for (auto e = first; e < last; ++e) visit(prepared_[entries_[static_cast<std::size_t>(e)]]);
  }

 private:
  template <class Visit>
  void for_each_cell(const PixelBox& box, Visit visit) const {
    if (box.empty()) return;
    for (std::int64_t row = box.y0 / cell_height_; row <= (box.y1 - 1) / cell_height_; ++row)
      for (std::int64_t column = box.x0 / cell_width_; column <= (box.x1 - 1) / cell_width_; ++column)
        visit(row * columns_ + column);
  }

  int cell_width_ = 1, cell_height_ = 1, columns_ = 0, rows_ = 0, width_ = 0, height_ = 0;
  Buffer<typename Mode::Prepared> prepared_;
  Buffer<std::int64_t> cursors_;     // blocks x cells
  std::vector<std::int64_t> begin_;  // cells + 1
  Buffer<std::uint32_t> entries_;    // indices into prepared_
};

}  // namespace rasterbench
