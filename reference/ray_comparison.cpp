// Where a picture and one by ray casting disagree, and whether rounding explains it.
//
// The float32 ray. u = 2^-24. Origin o and direction d are rounded once, o' = o + do and d' = d + dd with
// |do| <= u |o| and |dd| <= u, since |d| = 1; o lies kRaySlack * near_extent in front of the near plane.
//
// Embree's edge tests are signs of volumes: U = (r1 x r2) . d for the corners r1, r2 of an edge, taken
// relative to the origin. Write C for the largest |r| and e for the perimeter.
//   fast (Moeller & Trumbore 1997, two edges against one corner): U = e2 . (c x d) with c = r0. Rounding of
//     c, of the cross product and of the dot product: 6u |e2| |c|. Of e2: u |e2| |c x d|, where |c x d|, the
//     distance of the ray from the corner, is at most C. The third volume is den - U - V, where den is a sum
//     of products of two edges and an edge is at most 2C.
//   robust (Pluecker): U = (e x (r1 + r2)) . d with rounded r: a corner moved by u |r|, which shifts U by u C
//     times the distance of the other corner from the ray, at most e for a ray that meets the triangle; then
//     the products, 6u |e| 2C, on twice the volume; and volumes down to -2u den are accepted on purpose.
// The rounded ray itself: (do x d) . e2 + (c x dd) . e2, at most u (|o| + C) |e2|. Together, with the boxes
// of the hierarchy, whose planes are moved by no more than 9 u max(|o|, C), less than
//   E = kRoundings * u * (C + |o|) * e.
// A triangle is surely met if all volumes have one sign and exceed E, surely missed if two exceed E with
// opposite signs. The distance t = (n . c) / (n . d), n = e1 x e2, has by the same count an error of
//   Et = 2 kRoundings * u * (C + |o|) |e1| |e2| / |n . d|.
// It matters at the ends of the ray only, and where it exceeds the slack with which Embree goes on looking
// behind the best hit: the order of hits is found in double (SampleRays::position), with the error of t but
// for 2^-53 in the place of u.
//
// What the rays may do follows from this, what the other picture may do from its Footprint. A disagreement is
// explained if each of the two is allowed to do what it did in view of the other's triangle.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "base/error.h"
#include "reference/embree.h"
#include "reference/footprint.h"
#include "reference/ray_scene.h"

namespace rasterbench {
namespace {

using reference::Footprint;

constexpr double kFloatUnit = 0x1p-24;
constexpr double kDoubleToFloat = 0x1p-29;  // unit roundoff of double over that of float
constexpr int kRoundings = 16;

// A triangle and a float32 ray.
struct Meeting {
  bool may = false, must = false;
  double position = 0, position_error = 0;  // as in SampleRays, in double
  double distance_error = 0;                // of Embree's distance, world units
};

class Rays {
 public:
  explicit Rays(const Camera& camera) : rays_(camera), lead_(kRaySlack * rays_.near_extent()) {}

  SampleRay through(int x, int y) const { return rays_.row(y).at(x); }

  Meeting meet(const Triangle& t, const SampleRay& ray) const {
    const Vec3d start = ray.origin - lead_ * ray.direction;
    const std::array corners = {to_double(t.a), to_double(t.b), to_double(t.c)};
    double reach = length(start), perimeter = 0;
    for (const Vec3d& c : corners) reach = std::max(reach, length(c - start) + length(start));
    const std::array edges = {corners[1] - corners[0], corners[2] - corners[1], corners[0] - corners[2]};
    for (const Vec3d& e : edges) perimeter += length(e);
    const double error = kRoundings * kFloatUnit * reach * perimeter;
    const auto [low, high] = std::ranges::minmax(volumes(t, ray));

    Meeting meeting;
    meeting.position = rays_.position(t, ray);
    const double slope = std::abs(dot(cross(edges[0], edges[2]), ray.direction));
    meeting.distance_error =
        2 * kRoundings * kFloatUnit * reach * length(edges[0]) * length(edges[2]) / slope;
    meeting.position_error = kDoubleToFloat * meeting.distance_error / ray.length;
    const double p = meeting.position, slack = meeting.position_error;
    meeting.may = (low >= -error || high <= error) && !(p < -slack) && !(p > 1 + slack);
    const double begin = -lead_ / ray.length, end = 1 + kRaySlack;
    const double of_float = meeting.distance_error / ray.length;
    meeting.must = (low > error || high < -error) && p > slack && p < 1 - slack && p - of_float > begin &&
                   p + of_float < end;
    return meeting;
  }

  // Whether the rays may show `seen` although they meet `hidden` as well: it is not nearer, or Embree's
  // distance to it may be beyond where the search ended.
  bool may_hide(const Meeting& seen, const Meeting& hidden, const SampleRay& ray) const {
    if (!(hidden.position + hidden.position_error < seen.position - seen.position_error)) return true;
    const double gap = (seen.position - hidden.position) * ray.length;
    return hidden.distance_error > gap + kRaySlack * seen.position * ray.length + lead_;
  }

  // Distance of a sample from the nearest edge's line on the screen, pixels.
  double edge_distance(const Triangle& t, int x, int y) const {
    // The volumes are affine in the sample but for the length of the direction, which changes slowly.
    const auto here = volumes(t, through(x, y)), right = volumes(t, through(x + 1, y)),
               down = volumes(t, through(x, y + 1));
    double nearest = INFINITY;
    for (std::size_t i = 0; i < 3; ++i)
      nearest = std::min(nearest, std::abs(here[i]) / std::hypot(right[i] - here[i], down[i] - here[i]));
    return nearest;
  }

 private:
  // Of the edges; relative to the point of the ray that is nearest to a corner, so that little cancels.
  static std::array<double, 3> volumes(const Triangle& t, const SampleRay& ray) {
    const Vec3d& d = ray.direction;
    const Vec3d point = ray.origin + dot(to_double(t.a) - ray.origin, d) * d;
    const Vec3d a = to_double(t.a) - point, b = to_double(t.b) - point, c = to_double(t.c) - point;
    return {dot(cross(a, b), d), dot(cross(b, c), d), dot(cross(c, a), d)};
  }

  SampleRays rays_;
  double lead_;
};

class Explainer {
 public:
  Explainer(std::span<const Triangle> triangles, const Camera& camera, const ModeBound& bound)
      : triangles_(triangles), camera_(camera), bound_(bound), rays_(camera), cache_(1 << 12) {}

  const Rays& rays() const { return rays_; }

  // `drawn` with depth d against `met`, which differ; -1 is the background.
  PixelVerdict explain(std::int32_t drawn, double depth, std::int32_t met, int x, int y) {
    const double sx = x + 0.5, sy = y + 0.5;
    const SampleRay ray = rays_.through(x, y);
    bool certain = true;  // as far as edges go
    Meeting of_drawn, of_met;
    if (drawn >= 0) {
      of_drawn = rays_.meet(triangle(drawn), ray);
      if (!footprint(drawn).may_cover(sx, sy)) return PixelVerdict::kError;
      certain = of_drawn.must && footprint(drawn).must_cover(sx, sy);
    }
    if (met >= 0) {
      of_met = rays_.meet(triangle(met), ray);
      if (!of_met.may) return PixelVerdict::kError;
      const bool surely_covers = footprint(met).must_cover(sx, sy);
      certain = certain && of_met.must && surely_covers;
      // The picture may pass over `met` by its edges, or because it is not nearer: 1 is the background's.
      if (surely_covers && !(depth <= footprint(met).depths(sx, sy).high + bound_.depth_step))
        return PixelVerdict::kError;
    }
    // And so may the rays over `drawn`.
    if (of_drawn.must && (met < 0 || !rays_.may_hide(of_met, of_drawn, ray))) return PixelVerdict::kError;
    return certain ? PixelVerdict::kDepthTie : PixelVerdict::kEdgeTie;
  }

  double edge_distance(std::int32_t drawn, std::int32_t met, int x, int y) const {
    double nearest = INFINITY;
    for (const std::int32_t id : {drawn, met})
      if (id >= 0) nearest = std::min(nearest, rays_.edge_distance(triangle(id), x, y));
    return nearest;
  }

 private:
  const Triangle& triangle(std::int32_t id) const { return triangles_[static_cast<std::size_t>(id)]; }

  // Neighbouring pixels ask for the same triangles.
  const Footprint& footprint(std::int32_t id) {
    Footprint& slot = cache_[static_cast<std::size_t>(id) % cache_.size()];
    if (slot.id() != id) slot = Footprint(triangle(id), id, camera_, NearRule::kClip, bound_);
    return slot;
  }

  std::span<const Triangle> triangles_;
  Camera camera_;
  ModeBound bound_;
  Rays rays_;
  std::vector<Footprint> cache_;
};

}  // namespace

RayComparison compare_with_rays(const RayCastPicture& rays, std::span<const std::int32_t> ids,
                                std::span<const double> depths, std::span<const Triangle> triangles,
                                const Camera& camera, const ModeBound& bound) {
  const std::size_t width = static_cast<std::size_t>(rays.picture.width);
  const std::size_t pixels = width * static_cast<std::size_t>(rays.picture.height);
  if (ids.size() != pixels || depths.size() != pixels || rays.picture.ids.size() != pixels ||
      rays.picture.depths.size() != pixels)
    throw Error("pictures of different sizes are compared");
  RayComparison result{.pixels = static_cast<std::int64_t>(pixels),
                       .verdicts = std::vector<PixelVerdict>(pixels, PixelVerdict::kIdentical)};
  Explainer explainer(triangles, camera, bound);
  const auto exists = [&](std::int32_t id) {
    return id >= -1 && id < static_cast<std::int64_t>(triangles.size());
  };
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const std::int32_t drawn = ids[pixel], met = rays.picture.ids[pixel];
    if (drawn == met) {
      ++result.identical;
      result.max_depth_difference =
          std::max(result.max_depth_difference, std::abs(depths[pixel] - rays.picture.depths[pixel]));
      continue;
    }
    const int x = static_cast<int>(pixel % width), y = static_cast<int>(pixel / width);
    const PixelVerdict verdict = exists(drawn) && exists(met)
                                     ? explainer.explain(drawn, depths[pixel], met, x, y)
                                     : PixelVerdict::kError;
    result.verdicts[pixel] = verdict;
    if (verdict == PixelVerdict::kEdgeTie) {
      ++result.edge_ties;
      result.max_edge_distance =
          std::max(result.max_edge_distance, explainer.edge_distance(drawn, met, x, y));
    }
    if (verdict == PixelVerdict::kDepthTie) ++result.depth_ties;
    if (verdict == PixelVerdict::kError && result.errors++ == 0)
      result.worst_pixel = static_cast<std::int64_t>(pixel);
  }
  return result;
}

}  // namespace rasterbench
