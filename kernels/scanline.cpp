// scanline: bands of rows in parallel; within a band each triangle is drawn by walking its edges from row to
// row.
//
// The classic way (Wylie, Romney, Evans & Erdahl, Half-tone perspective drawings by computer, 1967): a row's
// span is found from where the edges cross it, so that no sample outside the triangle is tested but the few
// at the ends. The crossing is only a guess here, carried from row to row by the edge's slope; the ends are
// then fixed with the mode's own edge tests, which are monotone along a row. So the bits are those of the
// specification, and a wrong guess costs steps, not pixels.
#include <cmath>

#include "kernels/bins.h"
#include "kernels/fragments.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

/// Where one edge lets a row begin or end. Pixels that pass its test are [boundary, inf) or (-inf, boundary).
template <MonotoneMode Mode>
class EdgeWalk {
 public:
  EdgeWalk(const typename Mode::Prepared& triangle, int edge, const PixelBox& box)
      : triangle_(triangle), edge_(edge), left_(static_cast<double>(triangle.dy[edge]) < 0), guess_(box.x0) {
    const double dy = static_cast<double>(triangle.dy[edge]);
    slope_ = dy == 0 ? 0 : std::clamp(static_cast<double>(triangle.dx[edge]) / dy, -kSteepest, kSteepest);
  }

  /// Narrows [x0, x1) to the pixels of row y that pass.
  void narrow(std::int32_t y, std::int32_t& x0, std::int32_t& x1) {
    if (x0 >= x1) return;
    if (static_cast<double>(triangle_.dy[edge_]) == 0) {  // level: all of the row or nothing
      if (!Mode::inside_edge(triangle_, edge_, x0, y)) x1 = x0;
      return;
    }
    const auto probe = static_cast<std::int32_t>(std::clamp<double>(guess_, x0, x1 - 1));
    const std::int32_t boundary = fix(probe, y, x0, x1);
    guess_ = boundary + slope_;
    if (left_)
      x0 = boundary;
    else
      x1 = boundary;
  }

 private:
  static constexpr double kSteepest = 1 << 20;  // pixels per row; a level edge has no finite slope

  /// True where x is on the far side of the boundary: inside for a left edge, outside for a right one.
  bool beyond(std::int32_t x, std::int32_t y) const {
    return Mode::inside_edge(triangle_, edge_, x, y) == left_;
  }

  /// The first x in [x0, x1) that is beyond, or x1: doubling steps from `probe` until it is enclosed, then
  /// halving.
  std::int32_t fix(std::int32_t probe, std::int32_t y, std::int32_t x0, std::int32_t x1) const {
    std::int32_t low = x0, high = x1;  // before low nothing is beyond, from high on everything is
    bool below_known = false, above_known = false;
    std::int32_t step = 1;  // at most twice the image's width
    while (low < high) {
      if (beyond(probe, y)) {
        high = probe;
        above_known = true;
      } else {
        low = probe + 1;
        below_known = true;
      }
      if (below_known && above_known) {
        probe = low + (high - low) / 2;
        continue;
      }
      probe = above_known ? std::max(low, high - step) : std::min(high - 1, low + step - 1);
      step *= 2;
    }
    return low;
  }

  const typename Mode::Prepared& triangle_;
  int edge_;
  bool left_;
  double guess_;
  double slope_ = 0;
};

constexpr int kBandRows = 16;

struct Scanline {
  static constexpr KernelInfo kInfo{.name = "scanline",
                                    .parallel_unit = "a band of 16 rows",
                                    .synchronisation = "none: an iteration owns its rows",
                                    .work = "T + heights of all boxes + covered pixels",
                                    .unit = LoopUnit::kRow,
                                    .rows = kBandRows,
                                    .needs = "needs edge tests that split a row once, to search its spans"};

  template <MonotoneMode Mode>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) {
      bins_.build(in, in.settings.width, kBandRows, execution);
      execution.loop(bins_.cells(), [&](std::int64_t band, int) {
        const PixelBox bounds = bins_.box(band);
        bins_.for_each_triangle(
            band, [&](const auto& triangle) { walk(triangle, intersect(triangle.box, bounds), out); });
      });
    }

    std::size_t bytes() const { return bins_.bytes(); }
    void count(WorkCounters& counters) const { bins_.count(counters); }

   private:
    static void walk(const typename Mode::Prepared& triangle, const PixelBox& box, Visibility<Mode>& out) {
      EdgeWalk<Mode> edges[3] = {{triangle, 0, box}, {triangle, 1, box}, {triangle, 2, box}};
      for (std::int32_t y = box.y0; y < box.y1; ++y) {
        std::int32_t x0 = box.x0, x1 = box.x1;
        for (EdgeWalk<Mode>& edge : edges) edge.narrow(y, x0, x1);
        auto* row = out.row(y);
        for (std::int32_t x = x0; x < x1; ++x)
          keep_nearest(row[x], Mode::key(Mode::depth(triangle, x, y), triangle.rank));
      }
    }

    Bins<Mode> bins_;
  };
};

const KernelRegistration<Scanline> kRegistration;

}  // namespace
}  // namespace rasterbench
