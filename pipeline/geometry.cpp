#include "pipeline/geometry.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "base/error.h"

namespace rasterbench {
namespace {

/// A corner in homogeneous pixel coordinates.
struct Corner {
  double x, y, z, w;     // x / w and y / w in pixels, z / w the depth
  double near_distance;  // >= 0 behind the near plane, where things are visible
};

/// A triangle cut by five planes has at most eight corners. Rounding can make a sliver slightly non-convex
/// and cost one corner more; where even that did not fit, the corner is dropped, which moves the sliver by
/// less than its own rounding.
constexpr int kMaxCorners = 10;

struct Polygon {
  std::array<Corner, kMaxCorners> corners;
  int size = 0;
  void add(const Corner& corner) {
    if (size < kMaxCorners) corners[static_cast<std::size_t>(size++)] = corner;
  }
};

double apply(const AffineRow& row, const Vec3& p) {
  return row.x * double{p.x} + row.y * double{p.y} + row.z * double{p.z} + row.w;
}

Corner transform_corner(const ScreenTransform& t, const Vec3& p) {
  return {apply(t.x, p), apply(t.y, p), apply(t.z, p), apply(t.w, p), apply(t.near_distance, p)};
}

bool is_finite(const Vec3& p) {
  // By the bits, so that it also holds where a compiler was told that there are no NaNs.
  const auto finite = [](float f) { return (std::bit_cast<std::uint32_t>(f) & 0x7f800000u) != 0x7f800000u; };
  return finite(p.x) && finite(p.y) && finite(p.z);
}

bool has_zero_area(const Triangle& t) {
  const double ux = double{t.b.x} - t.a.x, uy = double{t.b.y} - t.a.y, uz = double{t.b.z} - t.a.z;
  const double vx = double{t.c.x} - t.a.x, vy = double{t.c.y} - t.a.y, vz = double{t.c.z} - t.a.z;
  return uy * vz == uz * vy && uz * vx == ux * vz && ux * vy == uy * vx;
}

/// As a weighted sum, not a + t (b - a): that loses what the outside corner says where the inside one is much
/// farther away.
Corner interpolate(const Corner& inside, const Corner& outside, double at_inside, double at_outside) {
  const double of_inside = at_outside / (at_outside - at_inside),
               of_outside = at_inside / (at_inside - at_outside);
  const auto mix = [=](double a, double b) { return of_inside * a + of_outside * b; };
  return {mix(inside.x, outside.x), mix(inside.y, outside.y), mix(inside.z, outside.z),
          mix(inside.w, outside.w), mix(inside.near_distance, outside.near_distance)};
}

/// Keeps the part of `polygon` where `distance` (affine in the corner) is not negative; `on_plane` touches up
/// new corners.
template <class Distance, class OnPlane>
Polygon cut(const Polygon& polygon, Distance distance, OnPlane on_plane) {
  Polygon kept;
  for (int i = 0; i < polygon.size; ++i) {
    const Corner& from = polygon.corners[static_cast<std::size_t>(i)];
    const Corner& to = polygon.corners[static_cast<std::size_t>((i + 1) % polygon.size)];
    const double at_from = distance(from), at_to = distance(to);
    if (at_from >= 0) kept.add(from);
    if ((at_from >= 0) == (at_to >= 0)) continue;
    Corner corner =
        at_from >= 0 ? interpolate(from, to, at_from, at_to) : interpolate(to, from, at_to, at_from);
    on_plane(corner);
    kept.add(corner);
  }
  return kept;
}

Polygon cut_at_near(const Polygon& polygon, const ScreenTransform& t) {
  return cut(
      polygon, [](const Corner& c) { return c.near_distance; },
      [&t](Corner& c) {
        if (t.near_w > 0) c.w = t.near_w;  // between two huge corners rounding would leave nothing of it
        c.near_distance = 0;
        c.z = t.near_depth * c.w;  // d = -1 exactly
      });
}

bool beyond_guard_band(const Corner& c) {
  return std::abs(c.x) > kGuardBand * c.w || std::abs(c.y) > kGuardBand * c.w;
}

Polygon cut_at_guard_band(Polygon polygon) {
  const auto leave = [](Corner&) {};
  polygon = cut(
      polygon, [](const Corner& c) { return kGuardBand * c.w + c.x; }, leave);
  polygon = cut(
      polygon, [](const Corner& c) { return kGuardBand * c.w - c.x; }, leave);
  polygon = cut(
      polygon, [](const Corner& c) { return kGuardBand * c.w + c.y; }, leave);
  return cut(
      polygon, [](const Corner& c) { return kGuardBand * c.w - c.y; }, leave);
}

struct ScreenPoint {
  double x, y, d;
};

/// A convex polygon on the screen.
struct ScreenPolygon {
  std::array<ScreenPoint, kMaxCorners> points;
  int size = 0;
};

ScreenPolygon project(const Polygon& polygon) {
  ScreenPolygon screen;
  screen.size = polygon.size;
  for (std::size_t i = 0; i < static_cast<std::size_t>(polygon.size); ++i) {
    const Corner& c = polygon.corners[i];
    // The clamp undoes the last rounding of a corner that was cut to lie on the guard band.
    screen.points[i] = {std::clamp(c.x / c.w, -kGuardBand, kGuardBand),
                        std::clamp(c.y / c.w, -kGuardBand, kGuardBand), c.z / c.w};
  }
  return screen;
}

/// Twice the signed area; negative for front faces, since y points down. Of the whole polygon: a corner that
/// lies on a plane that cuts it is there twice, so that its first three may have none.
double signed_area2(const ScreenPolygon& p) {
  const ScreenPoint& a = p.points[0];
  double sum = 0;
  for (std::size_t i = 2; i < static_cast<std::size_t>(p.size); ++i) {
    const ScreenPoint &b = p.points[i - 1], &c = p.points[i];
    sum += (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  }
  return sum;
}

template <class Real>
ScreenTriangle<Real> piece(const ScreenPoint& a, const ScreenPoint& b, const ScreenPoint& c,
                           std::int32_t id) {
  const auto r = [](double v) { return static_cast<Real>(v); };
  return {{r(a.x), r(b.x), r(c.x)}, {r(a.y), r(b.y), r(c.y)}, {r(a.d), r(b.d), r(c.d)}, id};
}

/// The way of one triangle through the stage: either counts why it draws nothing and returns false, or fills
/// `screen`.
bool to_screen(const Triangle& triangle, const ScreenTransform& transform, const GeometryOptions& options,
               ScreenPolygon& screen, GeometryCounts& counts) {
  if (!is_finite(triangle.a) || !is_finite(triangle.b) || !is_finite(triangle.c))
    return ++counts.non_finite, false;
  if (has_zero_area(triangle)) return ++counts.zero_area, false;

  Polygon polygon;
  for (const Vec3& p : {triangle.a, triangle.b, triangle.c}) polygon.add(transform_corner(transform, p));
  const auto any = [&](auto test) {
    return std::any_of(polygon.corners.begin(), polygon.corners.begin() + polygon.size, test);
  };

  bool near_clipped = false, guard_clipped = false;
  if (options.near_rule == NearRule::kClip && any([](const Corner& c) { return c.near_distance < 0; })) {
    polygon = cut_at_near(polygon, transform);
    near_clipped = true;
  }
  // Without the clip a corner at w <= 0 has no place on the screen; with it, only rounding can leave one.
  if (polygon.size < 3 || any([](const Corner& c) { return !(c.w > 0); })) return ++counts.behind_near, false;
  if (!any([&](const Corner& c) { return c.z < transform.far_depth * c.w; }))
    return ++counts.beyond_far, false;
  if (any(beyond_guard_band)) {
    polygon = cut_at_guard_band(polygon);
    guard_clipped = true;
    if (polygon.size < 3) return ++counts.off_screen, false;
  }

  screen = project(polygon);
  double low_x = screen.points[0].x, high_x = low_x, low_y = screen.points[0].y, high_y = low_y;
  for (std::size_t i = 1; i < static_cast<std::size_t>(screen.size); ++i) {
    low_x = std::min(low_x, screen.points[i].x);
    high_x = std::max(high_x, screen.points[i].x);
    low_y = std::min(low_y, screen.points[i].y);
    high_y = std::max(high_y, screen.points[i].y);
  }
  if (high_x < 0 || low_x > transform.width || high_y < 0 || low_y > transform.height)
    return ++counts.off_screen, false;
  if (options.cull_back_faces && signed_area2(screen) > 0) return ++counts.back_facing, false;

  counts.near_clipped += near_clipped;
  counts.guard_clipped += guard_clipped;
  ++counts.drawn;
  counts.pieces += screen.size - 2;
  return true;
}

}  // namespace

ScreenTransform make_screen_transform(const Camera& camera, DepthFunction function) {
  if (function == DepthFunction::kInverseW && !camera.perspective)
    throw Error("1/w is no depth of a camera without perspective: it is the same everywhere");
  const Viewport& viewport = camera.viewport;
  const double width = viewport.width, height = viewport.height;
  const bool centre = viewport.sampling == Sampling::kCentre;
  // x_px = (x/w + 1) span/2 + offset; y likewise with y up in clip space and down on the screen.
  const double span_x = centre ? width : width - 1, span_y = centre ? height : height - 1;
  const double offset = centre ? 0.0 : 0.5;
  const auto combine = [](double a, const AffineRow& p, double b, const AffineRow& q) {
    return AffineRow{a * p.x + b * q.x, a * p.y + b * q.y, a * p.z + b * q.z, a * p.w + b * q.w};
  };
  return {combine(span_x / 2, camera.x, span_x / 2 + offset, camera.w),
          combine(-span_y / 2, camera.y, span_y / 2 + offset, camera.w),
          function == DepthFunction::kNdc        ? camera.z
          : function == DepthFunction::kReversed ? camera.reversed_z
                                                 : AffineRow{0, 0, 0, -camera.far_plane},
          camera.w,
          camera.near_distance,
          camera.near_w,
          function == DepthFunction::kInverseW ? -camera.far_plane / camera.near_plane : -1,
          far_value(function),
          width,
          height};
}

DepthMap depth_map(const Camera& camera, DepthFunction function) {
  if (function == DepthFunction::kNdc) return {0, 1};
  if (function == DepthFunction::kReversed) return {1, 2};  // reversed z is (1 - d) / 2
  const double n = camera.near_plane, f = camera.far_plane;
  return {(f + n) / (f - n), 2 * n / (f - n)};  // d = ((f + n) w - 2 n f) / ((f - n) w)
}

GeometryCounts& GeometryCounts::operator+=(const GeometryCounts& other) {
  triangles += other.triangles;
  non_finite += other.non_finite;
  zero_area += other.zero_area;
  behind_near += other.behind_near;
  beyond_far += other.beyond_far;
  off_screen += other.off_screen;
  back_facing += other.back_facing;
  drawn += other.drawn;
  near_clipped += other.near_clipped;
  guard_clipped += other.guard_clipped;
  pieces += other.pieces;
  return *this;
}

template <class Real>
void transform_triangles(std::span<const Triangle> triangles, std::int32_t first_id,
                         const ScreenTransform& transform, const GeometryOptions& options,
                         ScreenTriangle<Real>* slots, std::vector<ScreenTriangle<Real>>& extra,
                         GeometryCounts& counts) {
  counts.triangles += static_cast<std::int64_t>(triangles.size());
  ScreenPolygon screen;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (!to_screen(triangles[i], transform, options, screen, counts)) {
      slots[i] = {{}, {}, {}, -1};
      continue;
    }
    const std::int32_t id = first_id + static_cast<std::int32_t>(i);
    auto& p = screen.points;
    if (screen.size == 3) {
      slots[i] = piece<Real>(p[0], p[1], p[2], id);
      continue;
    }
    const auto end = p.begin() + screen.size;
    std::rotate(p.begin(),
                std::min_element(p.begin(), end,
                                 [](const ScreenPoint& a, const ScreenPoint& b) {
                                   return a.x != b.x ? a.x < b.x : a.y < b.y;
                                 }),
                end);
    slots[i] = piece<Real>(p[0], p[1], p[2], id);
    for (std::size_t k = 3; k < static_cast<std::size_t>(screen.size); ++k)
      extra.push_back(piece<Real>(p[0], p[k - 1], p[k], id));
  }
}

template void transform_triangles(std::span<const Triangle>, std::int32_t, const ScreenTransform&,
                                  const GeometryOptions&, ScreenTriangle<float>*,
                                  std::vector<ScreenTriangle<float>>&, GeometryCounts&);
template void transform_triangles(std::span<const Triangle>, std::int32_t, const ScreenTransform&,
                                  const GeometryOptions&, ScreenTriangle<double>*,
                                  std::vector<ScreenTriangle<double>>&, GeometryCounts&);

}  // namespace rasterbench
