#include "reference/silhouette.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace rasterbench {
namespace {

using Border = std::vector<bool>;

Border border_of(std::span<const std::int32_t> ids, std::size_t width, std::size_t height) {
  Border border(ids.size());
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t i = y * width + x;
      border[i] = ids[i] >= 0 && ((x > 0 && ids[i - 1] < 0) || (x + 1 < width && ids[i + 1] < 0) ||
                                  (y > 0 && ids[i - width] < 0) || (y + 1 < height && ids[i + width] < 0));
    }
  return border;
}

/// Rows from each pixel to the nearest one of `border` in its column; `none` or more where there is none.
std::vector<std::int32_t> column_distances(const Border& border, std::size_t width, std::size_t height,
                                           std::int32_t none) {
  std::vector<std::int32_t> rows(border.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i] = border[i] ? 0 : i < width ? none : rows[i - width] + 1;
  for (std::size_t i = width * (height - 1); i-- > 0;) rows[i] = std::min(rows[i], rows[i + width] + 1);
  return rows;
}

/// The lower envelope of the parabolas (x - i)^2 + heights[i]: the squared distance along a row.
class Envelope {
 public:
  explicit Envelope(std::size_t size) : centres_(size), starts_(size) {}

  /// `distances` along the columns, `none` or more where there is nothing.
  void build(std::span<const std::int32_t> distances, std::int32_t none) {
    count_ = cursor_ = 0;
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (distances[i] >= none) continue;
      const double rows = distances[i];
      const Parabola next{static_cast<double>(i), rows * rows};
      double start = -INFINITY;
      while (count_ > 0) {
        start = crossing(centres_[count_ - 1], next);
        if (start > starts_[count_ - 1]) break;
        start = -INFINITY;
        --count_;
      }
      centres_[count_] = next;
      starts_[count_++] = start;
    }
  }

  /// Squared distance at x; infinite where the envelope is empty. After build(), x must only grow.
  double at(double x) {
    if (count_ == 0) return INFINITY;
    while (cursor_ + 1 < count_ && starts_[cursor_ + 1] < x) ++cursor_;
    const Parabola& p = centres_[cursor_];
    return (x - p.centre) * (x - p.centre) + p.height;
  }

 private:
  struct Parabola {
    double centre, height;
  };
  static double crossing(const Parabola& left, const Parabola& right) {
    return ((right.height + right.centre * right.centre) - (left.height + left.centre * left.centre)) /
           (2 * (right.centre - left.centre));
  }

  std::vector<Parabola> centres_;
  std::vector<double> starts_;  // from where on each parabola is the lowest
  std::size_t count_ = 0, cursor_ = 0;
};

/// Largest distance from a pixel of `from` to the nearest one of `to`.
double directed_distance(const Border& from, const Border& to, std::size_t width, std::size_t height) {
  const auto none = static_cast<std::int32_t>(height);
  const std::vector<std::int32_t> rows = column_distances(to, width, height, none);
  Envelope envelope(width);
  double farthest = 0;
  for (std::size_t y = 0; y < height; ++y) {
    bool is_built = false;
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t i = y * width + x;
      if (!from[i] || to[i]) continue;
      if (!is_built) envelope.build(std::span(rows).subspan(y * width, width), none);
      is_built = true;
      farthest = std::max(farthest, envelope.at(static_cast<double>(x)));
    }
  }
  return std::sqrt(farthest);
}

}  // namespace

double silhouette_distance(std::span<const std::int32_t> ids_a, std::span<const std::int32_t> ids_b,
                           int width, int height) {
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  const Border a = border_of(ids_a, w, h), b = border_of(ids_b, w, h);
  if (a == b) return 0;
  return std::max(directed_distance(a, b, w, h), directed_distance(b, a, w, h));
}

}  // namespace rasterbench
