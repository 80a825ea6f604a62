#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

#include "base/buffer.h"
#include "base/error.h"
#include "reference/accuracy.h"

// stb's code is static functions: it is not written for our warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_easy_font.h>
#pragma GCC diagnostic pop

namespace rasterbench {
namespace {

constexpr std::uint32_t opaque(std::uint32_t r, std::uint32_t g, std::uint32_t b) {
  return r | g << 8 | b << 16 | 0xff000000u;
}

constexpr std::uint32_t kPaper = opaque(255, 255, 255);
constexpr std::uint32_t kInk = opaque(20, 20, 20);

/// How a class is shown. Colours of Okabe & Ito, Color universal design, 2008; the later ones are drawn over
/// the earlier ones.
struct ClassStyle {
  PixelClass kind;
  std::uint32_t colour;
  const char* label;
  std::int64_t Accuracy::*count;
};
constexpr std::array kStyles = {
    ClassStyle{PixelClass::kExactTie, opaque(86, 180, 233), "exact tie", &Accuracy::exact_ties},
    ClassStyle{PixelClass::kDepth, opaque(0, 158, 115), "depth, within the bound", &Accuracy::depth},
    ClassStyle{PixelClass::kEdge, opaque(230, 159, 0), "edge, within the bound", &Accuracy::edge},
    ClassStyle{PixelClass::kUnbounded, opaque(204, 121, 167), "wrong, no bound stated", &Accuracy::unbounded},
    ClassStyle{PixelClass::kUnexplained, opaque(213, 94, 0), "BEYOND THE BOUND", &Accuracy::unexplained}};

class Canvas {
 public:
  explicit Canvas(DifferenceImage& image) : image_(image) {}

  /// x0 <= x < x1, y0 <= y < y1, cut to the image.
  void fill(int x0, int y0, int x1, int y1, std::uint32_t colour) {
    for (int y = std::max(0, y0); y < std::min(y1, image_.height); ++y)
      for (int x = std::max(0, x0); x < std::min(x1, image_.width); ++x)
        image_.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) +
                      static_cast<std::size_t>(x)] = colour;
  }

  /// `text` in ink with its top left corner at (x, y), each unit of the font `scale` pixels.
  void write(int x, int y, std::string text, int scale) {
    struct Vertex {
      float x, y, z;
      unsigned char colour[4];
    };
    // stb_easy_font.h: about 270 bytes a character, and what does not fit is left out.
    std::vector<Vertex> vertices(text.size() * 40 + 40);
    const int quads = stb_easy_font_print(0, 0, text.data(), nullptr, vertices.data(),
                                          static_cast<int>(vertices.size() * sizeof(Vertex)));
    for (std::size_t q = 0; q < static_cast<std::size_t>(quads); ++q) {
      const Vertex &low = vertices[4 * q], &high = vertices[4 * q + 2];
      const auto at = [&](float v) { return static_cast<int>(v) * scale; };
      fill(x + at(low.x), y + at(low.y), x + at(high.x), y + at(high.y), kInk);
    }
  }

 private:
  DifferenceImage& image_;
};

int text_width(std::string text, int scale) { return stb_easy_font_width(text.data()) * scale; }

/// One piece of the legend: a swatch and a text, or a text alone.
struct LegendItem {
  std::string text;
  const ClassStyle* style;
};

/// Items in lines that fit into the picture's width, all sizes in units of `scale` pixels.
class Legend {
 public:
  Legend(const Accuracy& accuracy, int width, int scale) : scale_(scale) {
    const std::string of = std::to_string(accuracy.wrong) + " of " + std::to_string(accuracy.pixels);
    place({accuracy.wrong == 0 ? "every pixel has its exact owner" : of + " pixels wrong", nullptr}, width);
    for (const ClassStyle& style : kStyles) {
      const std::int64_t count = accuracy.*style.count;
      if (count > 0) place({std::string(style.label) + ": " + std::to_string(count), &style}, width);
    }
  }

  int height() const { return y_ + kLine * scale_; }

  void draw(Canvas& canvas, int top) const {
    for (const Placed& p : placed_) {
      int x = p.x;
      if (p.item.style != nullptr) {
        canvas.fill(x, top + p.y, x + kSwatch * scale_, top + p.y + kSwatch * scale_, p.item.style->colour);
        x += (kSwatch + kSpace) * scale_;
      }
      canvas.write(x, top + p.y + scale_, p.item.text, scale_);
    }
  }

 private:
  static constexpr int kMargin = 4, kSwatch = 9, kSpace = 4, kGap = 14, kLine = 14;
  struct Placed {
    LegendItem item;
    int x, y;
  };

  void place(LegendItem item, int width) {
    const int size =
        (item.style != nullptr ? (kSwatch + kSpace) * scale_ : 0) + text_width(item.text, scale_);
    if (!placed_.empty() && x_ + size > width - kMargin * scale_) {
      x_ = kMargin * scale_;
      y_ += kLine * scale_;
    }
    placed_.push_back({std::move(item), x_, y_});
    x_ += size + kGap * scale_;
  }

  int scale_;
  int x_ = kMargin * scale_, y_ = kMargin * scale_;
  std::vector<Placed> placed_;
};

/// Grey, lighter and flatter than the picture, so that the classes' colours stand out.
std::uint32_t faded(std::uint32_t rgba) {
  // Luma of ITU-R BT.601.
  const std::uint32_t luma =
      (299 * (rgba & 0xff) + 587 * (rgba >> 8 & 0xff) + 114 * (rgba >> 16 & 0xff)) / 1000;
  const std::uint32_t grey = 96 + luma * 9 / 16;
  return opaque(grey, grey, grey);
}

}  // namespace

DifferenceImage difference_image(const Accuracy& accuracy, std::span<const std::uint32_t> colours, int width,
                                 int height) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (accuracy.classes.size() != pixels || colours.size() != pixels)
    throw Error("the classes and the picture to draw them over have different sizes");
  const int scale = std::clamp(width / 900, 1, 6);
  const int reach = std::max(1, width / 900);  // a wrong pixel is shown as 2 reach + 1 pixels on a side
  const Legend legend(accuracy, width, scale);
  DifferenceImage image{.width = width, .height = height + legend.height()};
  const std::size_t size = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  checked_bytes(size, sizeof(std::uint32_t), "the difference image");
  image.pixels.assign(size, kPaper);
  std::transform(colours.begin(), colours.end(), image.pixels.begin(), faded);

  Canvas canvas(image);
  for (const ClassStyle& style : kStyles) {
    const int r = style.kind == PixelClass::kUnexplained ? 2 * reach : reach;
    for (std::size_t i = 0; i < pixels; ++i) {
      if (accuracy.classes[i] != style.kind) continue;
      const int x = static_cast<int>(i % static_cast<std::size_t>(width));
      const int y = static_cast<int>(i / static_cast<std::size_t>(width));
      canvas.fill(x - r, y - r, x + r + 1, std::min(height, y + r + 1), style.colour);
    }
  }
  legend.draw(canvas, height);
  return image;
}

}  // namespace rasterbench
