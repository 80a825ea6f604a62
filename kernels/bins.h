// Binning (sort-middle): which triangles touch which cell of a grid over the image.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "execution/execution.h"
#include "kernels/kernel.h"

namespace rasterbench {

/// Cells of a grid over the image and, per cell, the indices of the boxes that touch it. Kept between frames
/// to reuse its memory.
///
/// Two parallel passes over the same blocks of boxes: count per (block, cell), prefix sum, fill. No atomics,
/// and the order within a cell is the order of the boxes whatever thread ran what.
class CellLists {
 public:
  /// Lists `n` boxes in cells of cell_width x cell_height pixels of an image of width x height.
  /// prepare(begin, end) is called once for each block, by the thread that then asks for its boxes; box(i) is
  /// called twice for each i < n, after that.
  template <class Prepare, class Box>
  void build(std::int64_t n, int cell_width, int cell_height, int width, int height, Execution& execution,
             Prepare prepare, Box box) {
    cell_width_ = cell_width;
    cell_height_ = cell_height;
    columns_ = (width + cell_width - 1) / cell_width;
    rows_ = (height + cell_height - 1) / cell_height;
    image_ = {0, 0, width, height};
    fill_cell_of(column_of_, width, cell_width);
    fill_cell_of(row_of_, height, cell_height);
    const std::int64_t cells = this->cells();
    // Enough blocks to balance any number of threads that a machine has, few enough that the counters stay
    // small.
    const std::int64_t blocks =
        std::clamp<std::int64_t>(std::min(n / 64, (std::int64_t{1} << 22) / cells), 1, 256);
    const auto block_begin = [&](std::int64_t block) { return n * block / blocks; };
    cursors_.require(static_cast<std::size_t>(blocks * cells), "the counters of the bins");

    execution.uniform_loop(blocks, [&](std::int64_t block, int) {
      std::int64_t* counts = cursors_.data() + block * cells;
      std::fill_n(counts, cells, 0);
      prepare(block_begin(block), block_begin(block + 1));
      for (std::int64_t i = block_begin(block); i < block_begin(block + 1); ++i)
        for_each_cell(box(i), [&](std::int64_t cell) { ++counts[cell]; });
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
        for_each_cell(box(i), [&](std::int64_t cell) {
          entries_[static_cast<std::size_t>(cursors[cell]++)] = static_cast<std::uint32_t>(i);
        });
    });
  }

  std::size_t bytes() const {
    return cursors_.bytes() + begin_.size() * sizeof(begin_[0]) + entries_.bytes() +
           (column_of_.size() + row_of_.size()) * sizeof(column_of_[0]);
  }

  std::int64_t cells() const { return std::int64_t{columns_} * rows_; }

  /// The cells, their entries and their bytes, once listed and once gone through.
  void count(WorkCounters& counters) const {
    const auto entries = begin_.back();
    counters.tiles = cells();
    counters.tiles_touched = 0;
    for (std::int64_t cell = 0; cell < cells(); ++cell)
      *counters.tiles_touched += !this->entries(cell).empty();
    counters.bin_entries = entries;
    const auto moved = static_cast<std::int64_t>(cursors_.bytes() + begin_.size() * sizeof(begin_[0])) +
                       entries * static_cast<std::int64_t>(sizeof(entries_[0]));
    counters.raster_bytes->read += moved;
    counters.raster_bytes->written += moved;
  }

  /// Pixels of a cell, cut to the image.
  PixelBox box(std::int64_t cell) const {
    const auto column = static_cast<std::int32_t>(cell % columns_),
               row = static_cast<std::int32_t>(cell / columns_);
    return intersect(image_, {column * cell_width_, row * cell_height_, (column + 1) * cell_width_,
                              (row + 1) * cell_height_});
  }

  /// The indices of the boxes that touch `cell`, in their order.
  std::span<const std::uint32_t> entries(std::int64_t cell) const {
    const auto first = begin_[static_cast<std::size_t>(cell)],
               last = begin_[static_cast<std::size_t>(cell) + 1];
    return {entries_.data() + first, static_cast<std::size_t>(last - first)};
  }

 private:
  /// The cell of each pixel, looked up in place of four divisions a box.
  static void fill_cell_of(std::vector<std::int32_t>& cells, int pixels, int pixels_of_cell) {
    cells.resize(static_cast<std::size_t>(pixels));
    for (int pixel = 0; pixel < pixels; ++pixel)
      cells[static_cast<std::size_t>(pixel)] = pixel / pixels_of_cell;
  }

  template <class Visit>
  void for_each_cell(const PixelBox& whole, Visit visit) const {
    const PixelBox box = intersect(whole, image_);
    if (box.empty()) return;
    const auto of = [](const std::vector<std::int32_t>& cells, std::int32_t pixel) {
      return cells[static_cast<std::size_t>(pixel)];
    };
    const std::int32_t last_row = of(row_of_, box.y1 - 1), last_column = of(column_of_, box.x1 - 1);
    for (std::int64_t row = of(row_of_, box.y0); row <= last_row; ++row)
      for (std::int64_t column = of(column_of_, box.x0); column <= last_column; ++column)
        visit(row * columns_ + column);
  }

  int cell_width_ = 1, cell_height_ = 1, columns_ = 0, rows_ = 0;
  PixelBox image_;
  std::vector<std::int32_t> column_of_, row_of_;  // per pixel of a row, of a column
  Buffer<std::int64_t> cursors_;                  // blocks x cells
  std::vector<std::int64_t> begin_;               // cells + 1
  Buffer<std::uint32_t> entries_;
};

/// Set-up triangles and, per cell, those whose box touches it.
template <NumericMode Mode>
class Bins {
 public:
  /// Bins `in` into cells of cell_width x cell_height pixels.
  void build(const StagedTriangles<Mode>& in, int cell_width, int cell_height, Execution& execution) {
    prepared_.require(static_cast<std::size_t>(in.size()), "the array of prepared triangles");
    lists_.build(
        in.size(), cell_width, cell_height, in.settings.width, in.settings.height, execution,
        [&](std::int64_t begin, std::int64_t end) {
          for (std::int64_t i = begin; i < end; ++i) prepared_[static_cast<std::size_t>(i)] = in.prepare(i);
        },
        [&](std::int64_t i) { return prepared_[static_cast<std::size_t>(i)].box; });
  }

  std::size_t bytes() const { return prepared_.bytes() + lists_.bytes(); }
  void count(WorkCounters& counters) const {
    lists_.count(counters);
    counters.raster_bytes->read += static_cast<std::int64_t>(prepared_.bytes());
    counters.raster_bytes->written += static_cast<std::int64_t>(prepared_.bytes());
  }
  std::int64_t cells() const { return lists_.cells(); }
  /// Pixels of a cell, cut to the image.
  PixelBox box(std::int64_t cell) const { return lists_.box(cell); }

  /// Calls visit(prepared) for each triangle whose box touches `cell`, in their order.
  template <class Visit>
  void for_each_triangle(std::int64_t cell, Visit visit) const {
    const auto entries = lists_.entries(cell);
    if constexpr (CountingMode<Mode>)
      calls_of_this_thread->entries += static_cast<std::int64_t>(entries.size());
    for (const std::uint32_t index : entries) visit(prepared_[index]);
  }

 private:
  Buffer<typename Mode::Prepared> prepared_;
  CellLists lists_;
};

}  // namespace rasterbench
