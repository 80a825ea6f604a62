// Where and how deep a kernel may draw a triangle if its screen vertices, edge functions and depths carry no
// more than the rounding errors of its numeric mode.
//
// Error bounds as in: Nicholas J. Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002,
// section 3.1. With unit roundoff u, n roundings change a result by a factor within 1 +- gamma_n, where
// gamma_n = n u / (1 - n u).
//
// The model of a kernel: clip coordinates in double; clip at the near plane and at the guard band; project;
// round the vertices (vertex_unit), snap; fan into pieces; bounding box and edge functions (b-a)x(p-a)
// (edge_unit); depth d0 + gy dy + gx dx (depth_unit), clamped to the depths of the piece; round to float.
// Nothing is assumed about the order of vertices or the choice of the fan. What another program's pipeline
// does otherwise is said by PictureBound.
#include "reference/footprint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace rasterbench::reference {
namespace {

constexpr double kDoubleUnit = 0x1p-53;
constexpr double kOutputUnit = 0x1p-24;  // pictures hold depths as floats

constexpr double gamma(int n, double unit) { return n * unit / (1 - n * unit); }

// Geometry of the kernel and of this file: an affine row 4, the viewport 4, a cut 4 at each of up to 5
// planes, the division and the offset 3, hence 31 roundings each.
double geometry_error(const PictureBound& bound) { return gamma(64, bound.geometry_unit); }
// An edge function: two differences and a product in each term, and their difference. Twice that, because the
// bound is taken at the exact vertices instead of the rounded ones.
constexpr int kEdgeRoundings = 8;
// A numerator or the area of a gradient: two differences and a product in each term, and their difference;
// and the division, or a reciprocal and a product.
constexpr int kGradientRoundings = 6;
// The plane at a point: a difference, a product and two sums.
constexpr int kPlaneRoundings = 5;

// A computed value and the size of what it was summed from: its error is at most geometry_error() * size.
struct Sum {
  double value, size;
};

Sum affine(const AffineRow& row, const Vec3& p) {
  const double x = row.x * double{p.x}, y = row.y * double{p.y}, z = row.z * double{p.z};
  return {x + y + z + row.w, std::abs(x) + std::abs(y) + std::abs(z) + std::abs(row.w)};
}

Sum combine(double a, const Sum& p, double b, const Sum& q) {
  return {a * p.value + b * q.value, std::abs(a) * p.size + std::abs(b) * q.size};
}

// A corner in pixels and homogeneous.
struct Corner {
  Sum x, y, z, w, near;
};

Corner corner_in_pixels(const Camera& camera, const Vec3& p) {
  const double width = camera.viewport.width, height = camera.viewport.height;
  const double inset = camera.viewport.sampling == Sampling::kCorner ? 1.0 : 0.0;
  const Sum w = affine(camera.w, p);
  return {.x = combine(0.5 * (width - inset), affine(camera.x, p), 0.5 * width, w),
          .y = combine(-0.5 * (height - inset), affine(camera.y, p), 0.5 * height, w),
          .z = affine(camera.z, p),
          .w = w,
          .near = affine(camera.near_distance, p)};
}

// Barycentric weights of the corners. The vertices of a clipped triangle are kept as weights, so that the
// error of each follows from the corners that it really depends on, however far away the others are.
using Weights = std::array<double, 3>;

Sum weighted(const Weights& k, const Sum& a, const Sum& b, const Sum& c) {
  return {k[0] * a.value + k[1] * b.value + k[2] * c.value, k[0] * a.size + k[1] * b.size + k[2] * c.size};
}

// Sutherland, Hodgman 1974: the part of a convex polygon where the values, interpolated from the corners, are
// >= 0.
std::vector<Weights> clipped(const std::vector<Weights>& polygon, const std::array<double, 3>& values) {
  std::vector<Weights> result;
  const auto at = [&](const Weights& k) { return k[0] * values[0] + k[1] * values[1] + k[2] * values[2]; };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Weights &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double fa = at(a), fb = at(b);
    if (fa >= 0) result.push_back(a);
    if ((fa >= 0) == (fb >= 0)) continue;
    // Both shares from the values, rather than one as 1 - the other: it may be tiny and matter all the same.
    const double s = fb / (fb - fa), t = fa / (fa - fb);
    result.push_back({s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]});
  }
  return result;
}

double distance(double x, double y, const Vertex& v) { return std::hypot(x - v.x, y - v.y); }

// Where a point lies relative to an edge a, b.
struct EdgeView {
  double length;
  double outside;  // distance to the edge's line, positive on the outside
  double error;    // how far the line may have moved there
  double start;    // what the error of the edge function is proportional to, px
};

// Of (b-a)x(p-a): the distance to the farther end. Of A x + B y + C, by Cauchy & Schwarz: the distances of p
// and of an end from the image's origin. Of additions: up to 64 pixels farther away, and 64 more roundings of
// sums up to 64 pixels larger, in units of kEdgeRoundings roundings.
double edge_start(EdgeForm form, const Vertex& a, const Vertex& b, double x, double y) {
  const double cross = std::max(distance(x, y, a), distance(x, y, b));
  if (form == EdgeForm::kPlane)
    return std::hypot(x, y) + std::max(std::hypot(a.x, a.y), std::hypot(b.x, b.y));
  if (form == EdgeForm::kIncremental) return (1 + 64.0 / kEdgeRoundings) * (cross + 128);
  return cross;
}

// With a and b moved by at most ea and eb, and p = a + t (b - a) + s n, (b'-a')x(p-a') differs from L s by at
// most L (|1-t| ea + |t| eb) + |s| (ea + eb) + ea eb: expand the product. Hence it has the sign of s where
// |s| exceeds `error`.
EdgeView view_of(const Polygon& polygon, std::size_t i, double x, double y, EdgeForm form) {
  const Vertex &a = polygon.vertices[i], &b = polygon.vertices[polygon.next(i)];
  const double ux = b.x - a.x, uy = b.y - a.y, vx = x - a.x, vy = y - a.y;
  const double length = std::hypot(ux, uy);
  EdgeView view{.length = length,
                .outside = -(ux * vy - uy * vx) / length * polygon.orientation,
                .error = INFINITY,
                .start = edge_start(form, a, b, x, y) + polygon.reach};
  if (polygon.orientation == 0) view.outside = std::abs(ux * vy - uy * vx) / length;
  const double room = length - (a.reach + b.reach);
  if (room > 0) {
    const double t = (ux * vx + uy * vy) / (length * length);
    view.error = (length * (std::abs(1 - t) * a.reach + std::abs(t) * b.reach) + a.reach * b.reach) / room;
  }
  return view;
}

void finish(Polygon& polygon, const PictureBound& bound) {
  const auto& v = polygon.vertices;
  double area = 0;
  for (std::size_t i = 0; i < v.size(); ++i) {
    const Vertex &a = v[i], &b = v[polygon.next(i)];
    polygon.reach = std::max(polygon.reach, a.reach);
    polygon.perimeter += distance(a.x, a.y, b);
    polygon.x_min = std::min(polygon.x_min, a.x), polygon.x_max = std::max(polygon.x_max, a.x);
    polygon.y_min = std::min(polygon.y_min, a.y), polygon.y_max = std::max(polygon.y_max, a.y);
    area += (a.x - v[0].x) * (b.y - v[0].y) - (b.x - v[0].x) * (a.y - v[0].y);
    polygon.is_bounded = polygon.is_bounded && a.reach < kGuardBand && std::isfinite(a.d);
  }
  polygon.orientation = area > 0 ? 1 : area < 0 ? -1 : 0;
  polygon.firm.assign(v.size(), polygon.orientation != 0);
  for (std::size_t i = 0; i < v.size(); ++i) {
    for (std::size_t k = 0; k < v.size(); ++k) {
      if (k == i || k == polygon.next(i)) continue;
      const EdgeView view = view_of(polygon, i, v[k].x, v[k].y, bound.edge_form);
      // The kernel computes the area from any two sides, which may be longer than this one.
      const double area_error = gamma(kEdgeRoundings, bound.edge_unit) * view.start * polygon.perimeter;
      const double error = view.error + 2 * v[k].reach + area_error / view.length;
      if (!(-view.outside > error)) polygon.firm[i] = false;
    }
  }
}

// Whether the kernel may find (x, y) covered by a piece. It only does so inside the bounding box of its
// vertices and, but for the error of its edge functions, inside their convex hull, which lies within `reach`
// of the polygon. Along a firm edge the hull ends at the moved edge itself. Where an edge is not firm, the
// kernel may see the triangle reversed, and a point is accepted that the errors of all edges together (hence
// perimeter / length) hide from this one.
bool may_be_inside(const Polygon& polygon, double x, double y, const PictureBound& bound) {
  if (polygon.vertices.size() < 3) return false;
  if (!polygon.is_bounded) return true;
  const double r = polygon.reach;
  if (!(x >= polygon.x_min - r && x <= polygon.x_max + r && y >= polygon.y_min - r && y <= polygon.y_max + r))
    return false;
  const double edge_error = gamma(kEdgeRoundings, bound.edge_unit);
  for (std::size_t i = 0; i < polygon.vertices.size(); ++i) {
    const EdgeView view = view_of(polygon, i, x, y, bound.edge_form);
    if (view.length <= 4 * r) continue;  // may point anywhere
    const double tolerance = polygon.firm[i] ? std::min(view.error, r) + edge_error * view.start
                                             : r + edge_error * view.start * polygon.perimeter / view.length;
    if (view.outside > tolerance) return false;
  }
  return true;
}

// Whether the kernel has to find (x, y) covered. While the vertices move to where the kernel has them, no
// edge passes over the point, either because its line does not or because its points move by less than their
// distance to it; so the outline still winds round the point, and the pieces share their inner edges exactly.
bool must_be_inside(const Polygon& polygon, double x, double y, const PictureBound& bound) {
  if (polygon.vertices.size() < 3 || !polygon.is_bounded || polygon.orientation == 0) return false;
  const double edge_error = gamma(kEdgeRoundings, bound.edge_unit);
  for (std::size_t i = 0; i < polygon.vertices.size(); ++i) {
    const EdgeView view = view_of(polygon, i, x, y, bound.edge_form);
    if (view.length == 0) continue;
    if (!(-view.outside > std::min(view.error, polygon.reach) + edge_error * view.start)) return false;
  }
  return true;
}

// On one piece of a triangle. If the kernel covers the point, it is a convex combination of the kernel's
// vertices, and the exact plane through these differs there from the exact plane of the triangle by the slack
// of the vertices and by gradient * reach. The rest is rounding of the gradient (numerator and area cancel,
// hence the sizes of their products), amplified by the distance to the vertex that the plane starts from,
// which may be any. `least` is the smallest area that the kernel may have found; where the errors reach the
// area itself, only the clamp bounds the depth.
DepthRange depth_on_piece(const Polygon& piece, double x, double y, const PictureBound& bound) {
  const auto& v = piece.vertices;
  // The kernel's roundings, and this function's.
  const double gradient_error = gamma(kGradientRoundings, bound.depth_unit + kDoubleUnit);
  const double plane_error = gamma(kPlaneRoundings, bound.depth_unit + kDoubleUnit);
  const double slack = std::max({v[0].slack, v[1].slack, v[2].slack});
  const auto [d_min, d_max] = std::minmax({v[0].d, v[1].d, v[2].d});
  const double output = kOutputUnit * std::max({1.0, std::abs(d_min), std::abs(d_max)});
  const double dr = 2 * piece.reach, ds = 2 * slack, room = slack + output;
  double depth = 0, rounding = 0, movement = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vertex &a = v[i], &b = v[(i + 1) % 3], &c = v[(i + 2) % 3];
    const double x1 = b.x - a.x, y1 = b.y - a.y, d1 = b.d - a.d, x2 = c.x - a.x, y2 = c.y - a.y,
                 d2 = c.d - a.d;
    const double ax1 = std::abs(x1), ay1 = std::abs(y1), ad1 = std::abs(d1);
    const double ax2 = std::abs(x2), ay2 = std::abs(y2), ad2 = std::abs(d2);
    const double area = x1 * y2 - x2 * y1, gx = (d1 * y2 - d2 * y1) / area, gy = (d2 * x1 - d1 * x2) / area;
    const double products = (ax1 + dr) * (ay2 + dr) + (ax2 + dr) * (ay1 + dr);
    const double least = std::abs(area) - dr * (ax1 + ay1 + ax2 + ay2 + 2 * dr) - gradient_error * products;
    if (!(least > 0.5 * std::abs(area)))
      return bound.depth_from_origin ? DepthRange{-1, 1} : DepthRange{d_min - room, d_max + room};
    // A numerator: the size of its products, the largest quotient, and the error of the quotient.
    const double x_products = (ad1 + ds) * (ay2 + dr) + (ad2 + ds) * (ay1 + dr);
    const double y_products = (ad1 + ds) * (ax2 + dr) + (ad2 + ds) * (ax1 + dr);
    const double gx_most = (std::abs(gx * area) + dr * (ad1 + ad2) + ds * (ay1 + ay2 + 2 * dr)) / least;
    const double gy_most = (std::abs(gy * area) + dr * (ad1 + ad2) + ds * (ax1 + ax2 + 2 * dr)) / least;
    const double gx_error =
        gradient_error * (x_products + gx_most * products) / least + bound.reciprocal_error * gx_most;
    const double gy_error =
        gradient_error * (y_products + gy_most * products) / least + bound.reciprocal_error * gy_most;
    const double dx = std::abs(x - a.x) + piece.reach, dy = std::abs(y - a.y) + piece.reach;
    // From the origin there and back: d0 = d - (gx x + gy y) at a corner, in window depths (d + 1) / 2.
    const double size = bound.depth_from_origin
                            ? 1 + gx_most * (dx + 2 * std::abs(a.x)) + gy_most * (dy + 2 * std::abs(a.y))
                            : gx_most * dx + gy_most * dy;
    rounding =
        std::max(rounding, gx_error * dx + gy_error * dy + plane_error * (std::abs(a.d) + slack + size));
    movement = std::hypot(gx, gy) * (piece.reach + gamma(kEdgeRoundings, bound.edge_unit) * piece.perimeter);
    depth = a.d + gy * (y - a.y) + gx * (x - a.x);
  }
  const double tolerance = rounding + movement + slack + output;
  if (bound.depth_from_origin) return {std::max(depth - tolerance, -1.0), std::min(depth + tolerance, 1.0)};
  return {std::clamp(depth - tolerance, d_min - room, d_max - room),
          std::clamp(depth + tolerance, d_min + room, d_max + room)};
}

bool is_finite(const Vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

bool is_same(const Vec3& a, const Vec3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

// Whether the kernel may compute a zero cross product.
bool may_lack_world_area(const Triangle& t) {
  const Weights u = {double{t.b.x} - t.a.x, double{t.b.y} - t.a.y, double{t.b.z} - t.a.z};
  const Weights v = {double{t.c.x} - t.a.x, double{t.c.y} - t.a.y, double{t.c.z} - t.a.z};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const double p = u[j] * v[k], q = u[k] * v[j];
    if (std::abs(p - q) > gamma(8, kDoubleUnit) * (std::abs(p) + std::abs(q))) return false;
  }
  return true;
}

// The visible part of a triangle, with the near plane moved by near_side (+-1) times the error of the
// distance to it.
Polygon visible_part(const std::array<Corner, 3>& corners, double near_side, NearRule near_rule,
                     const PictureBound& bound) {
  const Corner &a = corners[0], &b = corners[1], &c = corners[2];
  std::vector<Weights> weights = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const double geometry = geometry_error(bound);
  const auto clip = [&](auto value) { weights = clipped(weights, {value(a), value(b), value(c)}); };
  if (near_rule == NearRule::kClip)
    clip([&](const Corner& p) { return p.near.value + near_side * geometry * p.near.size; });
  clip([](const Corner& p) { return kGuardBand * p.w.value + p.x.value; });
  clip([](const Corner& p) { return kGuardBand * p.w.value - p.x.value; });
  clip([](const Corner& p) { return kGuardBand * p.w.value + p.y.value; });
  clip([](const Corner& p) { return kGuardBand * p.w.value - p.y.value; });
  Polygon polygon;
  for (const Weights& k : weights) {
    const Sum x = weighted(k, a.x, b.x, c.x), y = weighted(k, a.y, b.y, c.y);
    const Sum z = weighted(k, a.z, b.z, c.z), w = weighted(k, a.w, b.w, c.w);
    Vertex v{.x = x.value / w.value, .y = y.value / w.value, .d = z.value / w.value, .reach = 0, .slack = 0};
    const auto error = [&](double quotient, const Sum& numerator) {
      return geometry * ((numerator.size + std::abs(quotient) * w.size) / w.value + std::abs(quotient));
    };
    v.reach = std::hypot(error(v.x, x) + bound.vertex_unit * std::abs(v.x) + bound.snap,
                         error(v.y, y) + bound.vertex_unit * std::abs(v.y) + bound.snap);
    // The kernel may cut at the guard band after the division, in pixels.
    if (std::max({k[0], k[1], k[2]}) < 1) v.reach += geometry * kGuardBand;
    v.slack = error(v.d, z) + bound.vertex_unit * std::max(1.0, std::abs(v.d)) + bound.corner_depth_error;
    // A w that may be zero: the vertex may be anywhere.
    if (!(w.value > 2 * geometry * w.size)) v.reach = INFINITY;
    polygon.vertices.push_back(v);
  }
  finish(polygon, bound);
  return polygon;
}

}  // namespace

Footprint::Footprint(const Triangle& t, std::int32_t id, const Camera& camera, NearRule near_rule,
                     const PictureBound& bound)
    : id_(id), bound_(bound) {
  if (!is_finite(t.a) || !is_finite(t.b) || !is_finite(t.c)) return;
  if (is_same(t.a, t.b) || is_same(t.b, t.c) || is_same(t.c, t.a)) return;
  const std::array<Corner, 3> corners = {corner_in_pixels(camera, t.a), corner_in_pixels(camera, t.b),
                                         corner_in_pixels(camera, t.c)};
  may_vanish_ = may_lack_world_area(t);
  if (near_rule == NearRule::kOff) {
    const double geometry = geometry_error(bound);
    for (const Corner& p : corners) {
      if (p.w.value < -geometry * p.w.size) return;
      if (p.w.value <= geometry * p.w.size) may_vanish_ = true;
    }
  }
  smallest_ = visible_part(corners, -1, near_rule, bound);
  const Polygon largest = visible_part(corners, 1, near_rule, bound);
  const auto& v = largest.vertices;
  for (std::size_t i = 0; i < v.size(); ++i)
    for (std::size_t j = i + 1; j < v.size(); ++j)
      for (std::size_t k = j + 1; k < v.size(); ++k) {
        Polygon piece;
        piece.vertices = {v[i], v[j], v[k]};
        finish(piece, bound);
        pieces_.push_back(piece);
      }
}

bool Footprint::may_cover(double x, double y) const {
  return std::any_of(pieces_.begin(), pieces_.end(),
                     [&](const Polygon& piece) { return may_be_inside(piece, x, y, bound_); });
}

bool Footprint::must_cover(double x, double y) const {
  if (may_vanish_ || !must_be_inside(smallest_, x, y, bound_)) return false;
  if (pieces_.size() == 1) return true;
  // A piece so thin that the kernel may see it reversed may be missing.
  return std::none_of(pieces_.begin(), pieces_.end(), [&](const Polygon& piece) {
    return !piece.firm[0] && !piece.firm[1] && !piece.firm[2] && may_be_inside(piece, x, y, bound_);
  });
}

DepthRange Footprint::depths(double x, double y) const {
  DepthRange here{INFINITY, -INFINITY}, anywhere = here;
  for (const Polygon& piece : pieces_) {
    if (!piece.is_bounded) return {-INFINITY, INFINITY};
    const DepthRange part = depth_on_piece(piece, x, y, bound_);
    anywhere = {std::min(anywhere.low, part.low), std::max(anywhere.high, part.high)};
    if (pieces_.size() > 1 && !may_be_inside(piece, x, y, bound_)) continue;
    here = {std::min(here.low, part.low), std::max(here.high, part.high)};
  }
  // In a gap between the tolerances of the pieces, whichever piece the kernel used extrapolates a little.
  return here.low <= here.high ? here : anywhere;
}

}  // namespace rasterbench::reference
