// The two checks that every point passes before it is timed: it equals the scalar specification of its mode
// bit for bit, and the independent double renderer's picture within the mode's bound.
#pragma once

#include <memory>

#include "harness/point.h"
#include "reference/double_renderer.h"
#include "reference/specification.h"

namespace rasterbench {

/// The hash of what `renderer` drew last, colours and depths: ties a timed frame to the verified one.
std::string picture_hash(const Renderer& renderer);

/// Judges points. Keeps the expected pictures of the last (scene, size, mode, fill, near), which points are
/// sorted by.
class Verifier {
 public:
  /// {"verify": as in records.md, "work": as in records.md, "frame_ms": one frame, "threads_observed": n,
  /// "failure": text or null}. Draws with the point's own kernel and execution: once as it is timed, once
  /// with the screen triangles permuted.
  Json judge(const Point& point, const Scene& scene);

 private:
  struct Expected {
    std::string key;
    Picture specification;
    IdImage truth;
  };
  const Expected& expected(const Point& point, const Scene& scene);

  Expected expected_;
};

}  // namespace rasterbench
