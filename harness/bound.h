// Which bound holds for a point, by stated thresholds.
#pragma once

#include <optional>
#include <string>

namespace rasterbench {

/// Where the time of a frame goes, in milliseconds: medians.
struct PointCosts {
  double frame = 0;
  double clear = 0, geometry = 0, raster = 0, resolve = 0;  ///< stages
  double raster_imbalance = 0;  ///< longest minus mean busy time of the threads in the raster stage
  double raster_serial =
      0;  ///< of the raster stage, beyond the longest busy time: serial parts, barriers, starts
  std::optional<double> floor;      ///< of the frame (machine/floor.h)
  std::optional<double> own_bytes;  ///< in which the bytes that the stages go through pass (WorkCounters)
  std::optional<double> ipc;        ///< instructions per cycle
};

/// At most this many times its floor, a frame is bound by memory bandwidth.
inline constexpr double kNearFloor = 1.5;
/// From this share of a frame on, imbalance and serial parts are what bounds it.
inline constexpr double kLostShare = 0.2;
/// From this share of a frame on, the geometry stage is what bounds it.
inline constexpr double kGeometryShare = 0.5;

struct Bound {
  std::string name;  ///< "memory bandwidth", "imbalance", "serial part", "geometry" or "instructions"
  std::string text;  ///< why, with the numbers and the threshold
  std::string measures = {};  ///< what every threshold was compared with
};

/// The first that holds, in this order: memory bandwidth, imbalance or serial part, geometry; instructions of
/// the longest stage otherwise. costs.frame > 0.
Bound find_bound(const PointCosts& costs);

}  // namespace rasterbench
