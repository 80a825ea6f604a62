// triangle_private: triangles in parallel, each thread into a visibility buffer of its own; then rows are
// merged.
//
// Sort-last in the terms of Molnar et al., A sorting classification of parallel rendering (1994). Threads
// never meet while they draw; the price is memory (one buffer per thread) and a merge of what was touched.
// Rows are cleared when a thread first draws into them, so that a thread pays for the rows it uses.
#include "kernels/fragments.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

struct TrianglePrivate {
  static constexpr KernelInfo kInfo{
      .name = "triangle_private",
      .parallel_unit = "a triangle",
      .synchronisation = "none while drawing: a buffer per thread, merged by rows",
      .work = "T + B + threads P"};

  template <NumericMode Mode>
  class Strategy {
   public:
    void draw(const StagedTriangles<Mode>& in, Visibility<Mode> out, Execution& execution) {
      const auto width = static_cast<std::size_t>(out.width);
      const std::size_t height = out.keys.size() / width;
      if (layers_.empty()) {
        const auto threads = static_cast<std::size_t>(execution.threads());
        checked_bytes(out.keys.size() * threads, sizeof(Key), "a visibility buffer per thread");
        for (int worker = 0; worker < execution.threads(); ++worker)
          layers_.emplace_back(out.keys.size(), height);
      }
      for (Layer& layer : layers_) layer.next_frame();

      execution.loop(in.size(), [&](std::int64_t i, int worker) {
        Layer& layer = layers_[static_cast<std::size_t>(worker)];
        const auto triangle = in.prepare(i);
        for (std::int32_t y = triangle.box.y0; y < triangle.box.y1; ++y) {
          Key* row = layer.row(static_cast<std::size_t>(y), width);
          for_each_fragment<Mode>(triangle, {triangle.box.x0, y, triangle.box.x1, y + 1},
                                  [&](auto x, auto, const auto& key) { keep_nearest(row[x], key); });
        }
      });

      execution.uniform_loop(static_cast<std::int64_t>(height), [&](std::int64_t y, int) {
        Key* target = out.row(y);
        for (Layer& layer : layers_) {
          if (!layer.touched(static_cast<std::size_t>(y))) continue;
          const Key* row = layer.row(static_cast<std::size_t>(y), width);
          for (std::size_t x = 0; x < width; ++x) keep_nearest(target[x], row[x]);
        }
      });
    }

    std::size_t bytes() const {
      std::size_t sum = 0;
      for (const Layer& layer : layers_) sum += layer.bytes();
      return sum;
    }

    void count(WorkCounters& counters) const {
      std::int64_t keys = 0;
      for (const Layer& layer : layers_) keys += layer.touched_keys();
      counters.merges = keys;
      const auto bytes = keys * static_cast<std::int64_t>(sizeof(Key));
      counters.raster_bytes->read += bytes;
      counters.raster_bytes->written += bytes;
    }

   private:
    using Key = typename Mode::Key;

    /// One thread's buffer. A row is valid if it was touched in this frame.
    class alignas(64) Layer {
     public:
      Layer(std::size_t pixels, std::size_t rows)
          : keys_(pixels, "a thread's visibility buffer"), frame_of_(rows, 0) {}

      std::size_t bytes() const { return keys_.bytes() + frame_of_.size() * sizeof(frame_of_[0]); }
      void next_frame() { ++frame_; }
      bool touched(std::size_t y) const { return frame_of_[y] == frame_; }
      /// Keys of the rows that were touched in this frame.
      std::int64_t touched_keys() const {
        const auto rows = std::count(frame_of_.begin(), frame_of_.end(), frame_);
        return rows * static_cast<std::int64_t>(keys_.size() / frame_of_.size());
      }
      Key* row(std::size_t y, std::size_t width) {
        Key* row = keys_.data() + y * width;
        if (!touched(y)) {
          frame_of_[y] = frame_;
          std::fill_n(row, width, Mode::kClear);
        }
        return row;
      }

     private:
      Buffer<Key> keys_;
      std::vector<std::int64_t> frame_of_;
      std::int64_t frame_ = 0;
    };

    std::vector<Layer> layers_;
  };
};

const KernelRegistration<TrianglePrivate> kRegistration;

}  // namespace
}  // namespace rasterbench
