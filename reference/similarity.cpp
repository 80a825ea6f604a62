#include "reference/similarity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace rasterbench {
namespace {

constexpr int kReach = 5;  // pixels from the centre of a window to its side
constexpr double kSigma = 1.5;
constexpr double kC1 = (0.01 * 255) * (0.01 * 255), kC2 = (0.03 * 255) * (0.03 * 255);

double luma(std::uint32_t colour) {
  return 0.299 * (colour & 0xff) + 0.587 * (colour >> 8 & 0xff) + 0.114 * (colour >> 16 & 0xff);
}

std::array<double, 2 * kReach + 1> gaussian() {
  std::array<double, 2 * kReach + 1> weights;
  for (int i = -kReach; i <= kReach; ++i)
    weights[static_cast<std::size_t>(i + kReach)] = std::exp(-i * i / (2 * kSigma * kSigma));
  return weights;
}

struct Images {
  std::span<const std::uint32_t> a, b;
  int width, height;

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// Of the window centred on pixel (x, y).
double local_similarity(const Images& images, int x, int y) {
  static const auto weights = gaussian();
  double sum = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (int v = std::max(y - kReach, 0); v <= std::min(y + kReach, images.height - 1); ++v)
    for (int u = std::max(x - kReach, 0); u <= std::min(x + kReach, images.width - 1); ++u) {
      const double weight = weights[static_cast<std::size_t>(u - x + kReach)] *
                            weights[static_cast<std::size_t>(v - y + kReach)];
      const double of_a = luma(images.a[images.index(u, v)]), of_b = luma(images.b[images.index(u, v)]);
      sum += weight;
      a += weight * of_a;
      b += weight * of_b;
      aa += weight * of_a * of_a;
      bb += weight * of_b * of_b;
      ab += weight * of_a * of_b;
    }
  a /= sum, b /= sum;
  const double variance_a = aa / sum - a * a, variance_b = bb / sum - b * b, covariance = ab / sum - a * b;
  return (2 * a * b + kC1) * (2 * covariance + kC2) /
         ((a * a + b * b + kC1) * (variance_a + variance_b + kC2));
}

}  // namespace

double structural_similarity(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b, int width,
                             int height) {
  const Images images{a, b, width, height};
  // A window in which nothing differs scores 1: only the others are computed.
  std::vector<char> differs(a.size(), 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (a[images.index(x, y)] == b[images.index(x, y)]) continue;
      for (int v = std::max(y - kReach, 0); v <= std::min(y + kReach, height - 1); ++v)
        std::fill(differs.begin() + static_cast<std::ptrdiff_t>(images.index(std::max(x - kReach, 0), v)),
                  differs.begin() +
                      static_cast<std::ptrdiff_t>(images.index(std::min(x + kReach, width - 1), v) + 1),
                  1);
    }
  double lost = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (differs[images.index(x, y)]) lost += 1 - local_similarity(images, x, y);
  return 1 - lost / static_cast<double>(a.size());
}

}  // namespace rasterbench
