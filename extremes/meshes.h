// Families of triangles that stress a rasterizer: on the screen (screen_scene.h) or in the world.
#pragma once

#include <cstdint>
#include <vector>

#include "extremes/screen_scene.h"

namespace rasterbench::extremes {

/// The depth w of flat meshes: far from the near and the far plane, and a power of two.
inline constexpr double kFlatW = 2;

/// A fan about the sample of the middle pixel, its rim `radius` image diagonals away and at depth rim_w, from
/// the angle `turn` (radians) on: with a radius of 1 and more, every sample lies in exactly one triangle, or
/// on an edge, or on the hub.
std::vector<ScreenCorners> fan(std::int64_t triangles, double radius, double rim_w, double turn, int width,
                               int height);

/// Squares of `cell` pixels with their corners on samples, each cut along one of its diagonals in turn,
/// beyond the image on all sides.
std::vector<ScreenCorners> lattice(int cell, int width, int height);

/// A grid of about `triangles` triangles over the whole image and beyond, each corner moved at random by up
/// to `jitter` of a cell in x and y, cut along random diagonals. `grid` > 0: corners on multiples of 1/grid
/// px.
std::vector<ScreenCorners> jittered_plane(std::int64_t triangles, double jitter, int grid, std::uint64_t seed,
                                          int width, int height);

/// A square about the image, refined towards a point in it: an edge is halved while it is longer than
/// `finest` px + `growth` x its distance from that point. Whether an edge is halved depends on the edge
/// alone, so that neighbours agree and no corner lies on another triangle's edge.
std::vector<ScreenCorners> refined_plane(double finest, double growth, int width, int height);

/// Triangles of random corners with their longest side on average half the image, all on multiples of 1/grid
/// px, at random depths: w in multiples of 1/8.
std::vector<ScreenCorners> scattered(std::int64_t count, int grid, std::uint64_t seed, int width, int height);

/// Long triangles between two random points of the image, the third corner up to `breadth` px off the line
/// through them; random depths.
std::vector<ScreenCorners> slivers(std::int64_t count, double breadth, std::uint64_t seed, int width,
                                   int height);

/// Triangles with edges of about `edge` px, each near the sample of a random pixel, so that about half of
/// them cover it however small they are; random depths.
std::vector<ScreenCorners> around_samples(std::int64_t count, double edge, std::uint64_t seed, int width,
                                          int height);

/// A closed sphere about the origin, `rings` x 2 `rings` quads.
std::vector<Triangle> sphere(int rings, double radius);

/// A grid of about `triangles` triangles in the plane y = 0, `extent` to each side of the origin, its corners
/// moved at random by up to `jitter` of a cell.
std::vector<Triangle> ground_plane(std::int64_t triangles, double extent, double jitter, std::uint64_t seed);

/// Moves camera and triangles by `distance` along the view axis, away from the origin. The camera goes on
/// looking at the origin, hence in the same direction; what the picture loses is what float32 coordinates
/// lose.
Scene translated(Scene scene, double distance);

}  // namespace rasterbench::extremes
