// The frames of a point that are drawn to be counted, and never timed.
#pragma once

#include <string>

#include "harness/point.h"
#include "machine/hardware_counters.h"

namespace rasterbench {

/// What one frame of a point did.
struct CountedFrames {
  FrameReport report;       ///< of a frame whose renderer counts; its times are not those of a frame
  std::string picture;      ///< picture_hash() of it
  HardwareReport hardware;  ///< of another one: a warm frame of the code that is timed
};

/// Draws both. The renderer of each is made afresh.
CountedFrames count_frames(const Point& point, const Scene& scene);

/// The objects of records.md: work.counted, and hardware.
Json work_counters_json(const WorkCounters& counters);
Json hardware_json(const HardwareReport& report);

}  // namespace rasterbench
