// The checks that every point passes before it is timed: it equals the scalar specification of its mode bit
// for bit, and nothing contradicts the mode's bound: not the exact oracle, not the end-to-end truth.
#pragma once

#include <deque>
#include <memory>
#include <string>

#include "harness/point.h"
#include "reference/judge.h"
#include "reference/specification.h"

namespace rasterbench {

/// The hash of what `renderer` drew last, colours and depths: ties a timed frame to the verified one.
std::string picture_hash(const Renderer& renderer);

/// What a kernel drew beside the specification of its mode.
struct Conformance {
  std::int64_t differing = 0;  ///< pixels, the most of all frames
  FrameReport report;          ///< of the last frame
  std::size_t bytes = 0;       ///< of all buffers of the renderer
  std::string picture;         ///< picture_hash() of the last frame
};

/// Draws with the screen triangles permuted and in order, two frames each: the second frame meets what the
/// first left in the strategy's memory, as every timed frame does.
Conformance check_conformance(const std::string& kernel, const std::string& mode, RendererSetup setup,
                              const Picture& specification);

/// Judges points. Keeps what the last ones were compared with: points are sorted by it.
class Verifier {
 public:
  /// {"verify": as in records.md, "work" and "hardware": as in records.md, "frame_ms": one frame,
  /// "threads_observed": n, "failure": text or null}. Draws with the point's own kernel and execution: once
  /// as it is timed, once with the screen triangles permuted. The verdicts on accuracy are those on the
  /// specification's picture, which a point that conforms has drawn to the bit. A peer has no specification:
  /// its own picture is judged. A program that cannot judge draws the frames
  /// and leaves every verdict open (null). Throws InputError where a peer cannot draw the point on this
  /// machine.
  Json judge(const Point& point, const Scene& scene);

 private:
  Json judge_peer(const Point& point, const Scene& scene);
  static Json time_unjudged(const Point& point, const Scene& scene);
  struct Expected {
    std::string key;
    Picture specification;
    Json verdicts;
  };
  const Expected& expected(const Point& point, const Scene& scene);
  Judge& judge_of(const Point& point, const Scene& scene);

  Expected expected_;
  std::deque<std::pair<std::string, std::unique_ptr<Judge>>> judges_;  // the last few; the newest in front
};

}  // namespace rasterbench
