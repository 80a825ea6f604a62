#include "pipeline/geometry.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "base/error.h"
#include "pipeline/corner.h"
#include "pipeline/geometry_lanes.h"

namespace rasterbench {
namespace {

/// A triangle cut by five planes has at most eight corners. Rounding can make a sliver slightly non-convex
/// and cost one corner more; where even that did not fit, the corner is dropped, which moves the sliver by
/// less than its own rounding.
constexpr std::size_t kMaxCorners = 10;

template <class Element>
struct ShortList {
  std::array<Element, kMaxCorners> elements;
  std::size_t size = 0;
  void add(const Element& element) {
    if (size < kMaxCorners) elements[size++] = element;
  }
  auto begin() { return elements.begin(); }
  auto begin() const { return elements.begin(); }
  auto end() { return elements.begin() + static_cast<std::ptrdiff_t>(size); }
  auto end() const { return elements.begin() + static_cast<std::ptrdiff_t>(size); }
};
using Polygon = ShortList<Corner>;
using ScreenPolygon = ShortList<ScreenPoint>;  // convex

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
  for (std::size_t i = 0; i < polygon.size; ++i) {
    const Corner& from = polygon.elements[i];
    const Corner& to = polygon.elements[(i + 1) % polygon.size];
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

/// Twice the signed area; negative for front faces, since y points down. Of the whole polygon: a corner that
/// lies on a plane that cuts it is there twice, so that its first three may have none.
double signed_area2(const ScreenPolygon& polygon) {
  const auto& p = polygon.elements;
  double sum = 0;
  for (std::size_t i = 2; i < polygon.size; ++i)
    sum += (p[i - 1].x - p[0].x) * (p[i].y - p[0].y) - (p[i - 1].y - p[0].y) * (p[i].x - p[0].x);
  return sum;
}

template <class Real>
ScreenTriangle<Real> piece(const ScreenPoint& a, const ScreenPoint& b, const ScreenPoint& c,
                           std::int32_t id) {
  const auto r = [](double v) { return static_cast<Real>(v); };
  return {{r(a.x), r(b.x), r(c.x)}, {r(a.y), r(b.y), r(c.y)}, {r(a.d), r(b.d), r(c.d)}, id};
}

/// The way of one triangle through the stage. Every step either goes on or counts why the triangle draws
/// nothing and returns false; the last one fills `screen`. A triangle that no plane cuts, which is nearly
/// every one, stays three corners in registers: polygons of any size took twice the time.
struct Passage {
  const ScreenTransform& transform;
  const GeometryOptions& options;
  GeometryCounts& counts;
  ScreenPolygon screen = {};

  bool run(const Triangle& triangle) {
    const SceneNeeds& needs = options.needs;
    if (needs.finite_test && !is_finite(triangle)) return ++counts.non_finite, false;
    if (needs.zero_area_test && has_zero_area(triangle)) return ++counts.zero_area, false;
    const std::array corners{transform_corner(transform, triangle.a), transform_corner(transform, triangle.b),
                             transform_corner(transform, triangle.c)};
    if (reaches_before_near(corners)) {
      if (all(corners, is_before_near)) return ++counts.behind_near, false;
      return cut_and_finish(corners);
    }
    if (!lies_between_planes(corners)) return false;
    if (leaves_guard_band(corners)) return cut_and_finish(corners);
    return finish(corners, [](const ScreenPoint& p) { return p; });
  }

 private:
  template <class Corners>
  bool reaches_before_near(const Corners& corners) const {
    return options.needs.near_clip && options.near_rule == NearRule::kClip && any(corners, is_before_near);
  }

  template <class Corners>
  bool leaves_guard_band(const Corners& corners) const {
    return options.needs.guard_clip && any(corners, is_beyond_guard_band);
  }

  template <class Corners>
  bool lies_between_planes(const Corners& corners) {
    // Without the clip a corner at w <= 0 has no place on the screen; with it, only rounding can leave one.
    if (options.needs.behind_reject && any(corners, has_no_place)) return ++counts.behind_near, false;
    if (options.needs.far_reject &&
        !any(corners, [&](const Corner& c) { return is_before_far(c, transform); }))
      return ++counts.beyond_far, false;
    return true;
  }

  bool cut_and_finish(const std::array<Corner, 3>& corners) {
    Polygon polygon;
    for (const Corner& corner : corners) polygon.add(corner);
    const bool near_clipped = reaches_before_near(polygon);
    if (near_clipped) polygon = cut_at_near(polygon, transform);
    if (polygon.size < 3) return ++counts.behind_near, false;
    if (!lies_between_planes(polygon)) return false;
    const bool guard_clipped = leaves_guard_band(polygon);
    if (guard_clipped) polygon = cut_at_guard_band(polygon);
    if (polygon.size < 3) return ++counts.off_screen, false;
    // The clamp undoes the last rounding of a corner that was cut to lie on the guard band.
    const auto onto_band = [](const ScreenPoint& p) {
      return ScreenPoint{std::clamp(p.x, -kGuardBand, kGuardBand), std::clamp(p.y, -kGuardBand, kGuardBand),
                         p.d};
    };
    if (!finish(polygon, onto_band)) return false;
    counts.near_clipped += near_clipped;
    counts.guard_clipped += guard_clipped;
    return true;
  }

  template <class Corners, class TouchUp>
  bool finish(const Corners& corners, TouchUp touch_up) {
    screen.size = 0;
    for (const Corner& corner : corners) screen.elements[screen.size++] = touch_up(project(corner));
    if (options.needs.off_screen_reject && misses_image(screen, transform)) return ++counts.off_screen, false;
    if (options.cull_back_faces && signed_area2(screen) > 0) return ++counts.back_facing, false;
    ++counts.drawn;
    counts.pieces += static_cast<std::int64_t>(screen.size) - 2;
    return true;
  }
};

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

namespace {

template <class Real>
void set_slot(ScreenTriangle<Real>* slots, std::size_t i, const ScreenTriangle<Real>& triangle) {
  slots[i] = triangle;
}
template <class Real>
void set_slot(ScreenBatch<Real>* batch, std::size_t i, const ScreenTriangle<Real>& triangle) {
  batch->set(i, triangle);
}

template <class Slots, class Real>
void transform_into(std::span<const Triangle> triangles, std::int32_t first_id,
                    const ScreenTransform& transform, const GeometryOptions& options, Slots* slots,
                    std::vector<ScreenTriangle<Real>>& extra, GeometryCounts& counts) {
  counts.triangles += static_cast<std::int64_t>(triangles.size());
  Passage passage{transform, options, counts};
  const auto one_by_one = [&](std::size_t i) {
    if (!passage.run(triangles[i])) {
      set_slot(slots, i, ScreenTriangle<Real>{{}, {}, {}, -1});
      return;
    }
    const std::int32_t id = first_id + static_cast<std::int32_t>(i);
    ScreenPolygon& polygon = passage.screen;
    auto& p = polygon.elements;
    if (polygon.size > 3)
      std::rotate(polygon.begin(),
                  std::min_element(polygon.begin(), polygon.end(),
                                   [](const ScreenPoint& a, const ScreenPoint& b) {
                                     return a.x != b.x ? a.x < b.x : a.y < b.y;
                                   }),
                  polygon.end());
    set_slot(slots, i, piece<Real>(p[0], p[1], p[2], id));
    for (std::size_t k = 3; k < polygon.size; ++k) extra.push_back(piece<Real>(p[0], p[k - 1], p[k], id));
  };
  for (std::size_t first = 0; first < triangles.size(); first += kMaxLaneTriangles) {
    const std::size_t n = std::min<std::size_t>(kMaxLaneTriangles, triangles.size() - first);
    std::uint64_t left = transform_in_lanes(triangles.data() + first, static_cast<std::int64_t>(n),
                                            first_id + static_cast<std::int32_t>(first), transform, options,
                                            slots, static_cast<std::int64_t>(first), counts);
    for (; left != 0; left &= left - 1) one_by_one(first + static_cast<std::size_t>(std::countr_zero(left)));
  }
}

}  // namespace

template <class Real>
void transform_triangles(std::span<const Triangle> triangles, std::int32_t first_id,
                         const ScreenTransform& transform, const GeometryOptions& options,
                         ScreenTriangle<Real>* slots, std::vector<ScreenTriangle<Real>>& extra,
                         GeometryCounts& counts) {
  transform_into(triangles, first_id, transform, options, slots, extra, counts);
}

void transform_triangles(std::span<const Triangle> triangles, std::int32_t first_id,
                         const ScreenTransform& transform, const GeometryOptions& options,
                         ScreenBatch<float>& batch, std::vector<ScreenTriangle<float>>& extra,
                         GeometryCounts& counts) {
  transform_into(triangles, first_id, transform, options, &batch, extra, counts);
  std::fill(batch.ids + triangles.size(), std::end(batch.ids), -1);
}

template void transform_triangles(std::span<const Triangle>, std::int32_t, const ScreenTransform&,
                                  const GeometryOptions&, ScreenTriangle<float>*,
                                  std::vector<ScreenTriangle<float>>&, GeometryCounts&);
template void transform_triangles(std::span<const Triangle>, std::int32_t, const ScreenTransform&,
                                  const GeometryOptions&, ScreenTriangle<double>*,
                                  std::vector<ScreenTriangle<double>>&, GeometryCounts&);

}  // namespace rasterbench
