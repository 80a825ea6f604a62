// This work is based on: Marc Olano, Trey Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates,
// Graphics Hardware 1997.
//
// A corner is (X, Y, z, w) with X/w and Y/w in pixels. Seen from the sample p = (x, y), the corners are
// (X - x w, Y - y w), and e_i = the cross product of the two corners other than i is corner i's share of the
// point of the triangle that p shows: the point is sum e_i V_i / sum e_i. It lies in the triangle if the e_i
// agree in sign, and in front of the camera if its w is positive; no division by a corner's w, hence nothing
// to clip. Taking the corners relative to each sample costs a few multiplications, and keeps the error of an
// edge at rounding of the corners however small the triangle is; two triangles that share an edge get exactly
// opposite values, hence neither gaps nor overlaps.
#include "reference/double_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "base/buffer.h"

namespace rasterbench {
namespace {

struct Corner {
  double x, y, z, w, near;
};

using Corners = std::array<Corner, 3>;

double affine(const AffineRow& row, const Vec3& p) {
  return row.x * double{p.x} + row.y * double{p.y} + row.z * double{p.z} + row.w;
}

// Both samplings put the middle of the picture at (W/2, H/2); they differ in how far the view's edges are
// from it.
Corner corner_in_pixels(const Camera& camera, const Vec3& p) {
  const double width = camera.viewport.width, height = camera.viewport.height;
  const double inset = camera.viewport.sampling == Sampling::kCorner ? 1.0 : 0.0;
  const double w = affine(camera.w, p);
  return {.x = 0.5 * ((width - inset) * affine(camera.x, p) + width * w),
          .y = 0.5 * (height * w - (height - inset) * affine(camera.y, p)),
          .z = affine(camera.z, p),
          .w = w,
          .near = affine(camera.near_distance, p)};
}

bool is_finite(const Vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

bool has_world_area(const Triangle& t) {
  const double ux = double{t.b.x} - t.a.x, uy = double{t.b.y} - t.a.y, uz = double{t.b.z} - t.a.z;
  const double vx = double{t.c.x} - t.a.x, vy = double{t.c.y} - t.a.y, vz = double{t.c.z} - t.a.z;
  return uy * vz - uz * vy != 0 || uz * vx - ux * vz != 0 || ux * vy - uy * vx != 0;
}

template <class Predicate>
bool all(const Corners& v, Predicate predicate) {
  return predicate(v[0]) && predicate(v[1]) && predicate(v[2]);
}

// All corners on the wrong side of one plane: so is every point of the triangle.
bool is_outside(const Corners& v, double width, double height, NearRule near_rule) {
  if (near_rule == NearRule::kClip && all(v, [](const Corner& c) { return c.near < 0; })) return true;
  return all(v, [](const Corner& c) { return c.w <= 0; }) ||
         all(v, [](const Corner& c) { return c.x < 0; }) || all(v, [](const Corner& c) { return c.y < 0; }) ||
         all(v, [=](const Corner& c) { return c.x > width * c.w; }) ||
         all(v, [=](const Corner& c) { return c.y > height * c.w; });
}

// Samples first .. last of a row or column.
struct Span {
  int first, last;
};

// The samples j + 0.5 in [low, high], and one more on either side against rounding. NaN limits nothing.
Span narrowed(Span span, double low, double high) {
  low = std::floor(low - 1.5);
  high = std::ceil(high + 0.5);
  if (low > span.last || high < span.first) return {0, -1};
  if (low > span.first) span.first = static_cast<int>(low);
  if (high < span.last) span.last = static_cast<int>(high);
  return span;
}

// One row's view of a triangle: y[i] = Y_i - y w_i.
struct Row {
  double centre;
  std::array<double, 3> y;
};

// The columns in which all sign * e_i >= 0. On a row, e_i = c - x m. An edge is allowed a negative value of
// the size of its rounding error, so that no sample is lost where c and m cancel; what remains is tested
// sample by sample.
Span columns(const Corners& v, const Row& row, double sign, Span span) {
  constexpr double kSlack = 0x1p-49;  // above gamma_5 (Higham, 3.1) of the two products and their sum
  const double reach = span.last + 1;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const double c1 = v[j].x * row.y[k], c2 = v[k].x * row.y[j];
    const double m1 = v[j].w * row.y[k], m2 = v[k].w * row.y[j];
    const double slack = kSlack * (std::abs(c1) + std::abs(c2) + reach * (std::abs(m1) + std::abs(m2)));
    const double c = sign * (c1 - c2) + slack, m = sign * (m1 - m2);
    if (m > 0) span = narrowed(span, -INFINITY, c / m);
    if (m < 0) span = narrowed(span, c / m, INFINITY);
    if (m == 0 && c < 0) return {0, -1};
  }
  return span;
}

// The sign of det(V_0, V_1, V_2), which the shares e_i of visible points have. The corners are taken relative
// to a point near the triangle, because the determinant of a small triangle far from the origin would be all
// rounding.
double orientation(const Corners& v, const Viewport& viewport) {
  double x = 0.5 * viewport.width, y = 0.5 * viewport.height;
  if (all(v, [](const Corner& c) { return c.w > 0; })) {
    x = std::clamp(v[0].x / v[0].w, 0.0, double(viewport.width));
    y = std::clamp(v[0].y / v[0].w, 0.0, double(viewport.height));
  }
  double determinant = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Corner &a = v[(i + 1) % 3], &b = v[(i + 2) % 3];
    determinant += v[i].w * ((a.x - x * a.w) * (b.y - y * b.w) - (b.x - x * b.w) * (a.y - y * a.w));
  }
  return determinant > 0 ? 1 : determinant < 0 ? -1 : 0;
}

// Whether a sample exactly on the edge opposite corner i belongs to the triangle: sign * e_i grows to its
// inside, which is to the right of a left edge and below a top edge.
bool is_top_left(const Corners& v, const Row& row, double x, double sign, std::size_t i) {
  const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
  const double right = -sign * (v[j].w * row.y[k] - v[k].w * row.y[j]);
  const double down = sign * (v[j].w * (v[k].x - x * v[k].w) - v[k].w * (v[j].x - x * v[j].w));
  return right > 0 || (right == 0 && down > 0);
}

class Renderer {
 public:
  Renderer(IdImage& image, FillRule fill, NearRule near_rule)
      : image_(image), fill_(fill), near_rule_(near_rule) {}

  void draw(const Corners& v, const Viewport& viewport, std::int32_t id) {
    Span across{0, viewport.width - 1}, down{0, viewport.height - 1};
    if (is_outside(v, viewport.width, viewport.height, near_rule_)) return;
    if (all(v, [](const Corner& c) { return c.w > 0; })) {
      const auto [x_min, x_max] = std::minmax({v[0].x / v[0].w, v[1].x / v[1].w, v[2].x / v[2].w});
      const auto [y_min, y_max] = std::minmax({v[0].y / v[0].w, v[1].y / v[1].w, v[2].y / v[2].w});
      across = narrowed(across, x_min, x_max);
      down = narrowed(down, y_min, y_max);
    } else if (near_rule_ == NearRule::kOff) {
      return;
    }
    const double sign = orientation(v, viewport);
    if (sign == 0) return;
    constexpr int kWorthNarrowing = 8;  // solving for the ends of a row costs as much as some samples
    for (int i = down.first; i <= down.last; ++i) {
      Row row{.centre = i + 0.5, .y = {}};
      for (std::size_t k = 0; k < 3; ++k) row.y[k] = v[k].y - row.centre * v[k].w;
      const Span span = across.last - across.first < kWorthNarrowing ? across : columns(v, row, sign, across);
      for (int j = span.first; j <= span.last; ++j) draw_sample(v, row, i, j, sign, id);
    }
  }

 private:
  void draw_sample(const Corners& v, const Row& row, int i, int j, double sign, std::int32_t id) {
    const double x = j + 0.5;
    const double x0 = v[0].x - x * v[0].w, x1 = v[1].x - x * v[1].w, x2 = v[2].x - x * v[2].w;
    const double e0 = sign * (x1 * row.y[2] - x2 * row.y[1]);
    const double e1 = sign * (x2 * row.y[0] - x0 * row.y[2]);
    const double e2 = sign * (x0 * row.y[1] - x1 * row.y[0]);
    if (!(e0 >= 0 && e1 >= 0 && e2 >= 0)) return;
    if (fill_ == FillRule::kTopLeft) {
      if (e0 == 0 && !is_top_left(v, row, x, sign, 0)) return;
      if (e1 == 0 && !is_top_left(v, row, x, sign, 1)) return;
      if (e2 == 0 && !is_top_left(v, row, x, sign, 2)) return;
    }
    const double w = e0 * v[0].w + e1 * v[1].w + e2 * v[2].w;
    if (!(w > 0)) return;
    if (near_rule_ == NearRule::kClip && !(e0 * v[0].near + e1 * v[1].near + e2 * v[2].near >= 0)) return;
    const double depth = (e0 * v[0].z + e1 * v[1].z + e2 * v[2].z) / w;
    const std::size_t pixel =
        static_cast<std::size_t>(i) * static_cast<std::size_t>(image_.width) + static_cast<std::size_t>(j);
    // Strictly less than what is there, which is 1 at first: ids come in order, so the smallest one keeps a
    // tie.
    if (depth < image_.depths[pixel]) {
      image_.depths[pixel] = depth;
      image_.ids[pixel] = id;
    }
  }

  IdImage& image_;
  FillRule fill_;
  NearRule near_rule_;
};

}  // namespace

IdImage render_in_double(std::span<const Triangle> triangles, const Camera& camera, FillRule fill,
                         NearRule near_rule) {
  const Viewport& viewport = camera.viewport;
  const std::size_t pixels =
      static_cast<std::size_t>(viewport.width) * static_cast<std::size_t>(viewport.height);
  checked_bytes(pixels, sizeof(std::int32_t) + sizeof(double), "the reference picture");
  IdImage image{.width = viewport.width,
                .height = viewport.height,
                .ids = std::vector<std::int32_t>(pixels, -1),
                .depths = std::vector<double>(pixels, 1.0)};
  Renderer renderer(image, fill, near_rule);
  for (std::size_t id = 0; id < triangles.size(); ++id) {
    const Triangle& t = triangles[id];
    if (!is_finite(t.a) || !is_finite(t.b) || !is_finite(t.c) || !has_world_area(t)) continue;
    const Corners corners = {corner_in_pixels(camera, t.a), corner_in_pixels(camera, t.b),
                             corner_in_pixels(camera, t.c)};
    renderer.draw(corners, viewport, static_cast<std::int32_t>(id));
  }
  return image;
}

}  // namespace rasterbench
