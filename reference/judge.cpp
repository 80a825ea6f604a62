#include "reference/judge.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "pipeline/resolve.h"

namespace rasterbench {
namespace {

bool is_double(const ModeInfo& mode) { return mode.numbers.vertex_unit == 0x1p-53; }

/// The rounding of a corner's depth value, in units of d: where the far plane is hardly farther than the near
/// one, 1/w hardly changes between them.
double corner_depth_error(const Camera& camera, const ModeInfo& mode) {
  if (mode.depth_function == DepthFunction::kNdc) return 0;
  const double largest =
      mode.depth_function == DepthFunction::kReversed ? 1 : camera.far_plane / camera.near_plane;
  constexpr double kDivision = 0x1p-47;  // of doubles, before it is rounded to the vertex format
  return depth_map(camera, mode.depth_function).scale * largest * (mode.numbers.vertex_unit + kDivision);
}

/// Corners on a grid of 2 * snap pixels, ties to even: what fixed-point modes promise to draw exactly.
std::vector<ScreenTriangle<float>> snapped(std::vector<ScreenTriangle<float>> triangles, double snap) {
  const auto on_grid = [&](float v) {
    return static_cast<float>(std::nearbyint(double{v} / (2 * snap)) * (2 * snap));
  };
  for (auto& t : triangles)
    for (int i = 0; i < 3; ++i) {
      t.x[i] = on_grid(t.x[i]);
      t.y[i] = on_grid(t.y[i]);
    }
  return triangles;
}

JudgedPicture judged(const Picture& picture) { return {picture.ids, picture.values, picture.colours}; }

}  // namespace

std::vector<std::uint32_t> shade_owners(std::span<const std::int32_t> ids, const Scene& scene) {
  std::vector<std::uint32_t> colours;
  colours.reserve(ids.size());
  for (const std::int32_t id : ids)
    colours.push_back(
        id < 0 ? pack_rgba(scene.parameters.background)
               : shade_flat(scene.model.triangles[static_cast<std::size_t>(id)], scene.parameters.object));
  return colours;
}

bool can_judge() {
#ifdef __FAST_MATH__
  return false;
#else
  return true;
#endif
}

Judge::Judge(const Scene& scene, const FrameSettings& settings, int threads)
    : scene_(scene), settings_(settings), camera_(sized_camera(scene, settings)), threads_(threads) {
  if (!can_judge())
    throw InputError(
        "this program was compiled with -ffast-math, its oracle is not exact: judge with another build");
  settings_.geometry.isa = Isa::kBaseline;  // nothing vectorised takes part in a judgement
}
Judge::~Judge() = default;

template <class Real>
OracleInput<Real> Judge::input(const ModeInfo& mode) {
  return {screen<Real>(mode).triangles, settings_.width, settings_.height, settings_.fill, settings_.tie,
          mode.depth_function};
}

template <class Real>
Judge::Screen<Real>& Judge::screen(const ModeInfo& mode) {
  auto& slot = std::get<Screens<Real>>(screens_)[mode.depth_function];
  if (slot) return *slot;
  slot = std::make_unique<Screen<Real>>();
  const auto& triangles = scene_.model.triangles;
  std::vector<ScreenTriangle<Real>> extra;
  GeometryCounts counts;
  slot->triangles.resize(triangles.size());
  transform_triangles<Real>(triangles, 0, make_screen_transform(camera_, mode.depth_function),
                            settings_.geometry, slot->triangles.data(), extra, counts);
  slot->triangles.insert(slot->triangles.end(), extra.begin(), extra.end());
  slot->oracle = exact_owners(input<Real>(mode), threads_);
  slot->colours = shade_owners(slot->oracle.ids, scene_);
  return *slot;
}

// For with_screen() in other files.
template OracleInput<float> Judge::input(const ModeInfo&);
template OracleInput<double> Judge::input(const ModeInfo&);
template Judge::Screen<float>& Judge::screen(const ModeInfo&);
template Judge::Screen<double>& Judge::screen(const ModeInfo&);

const OracleImage& Judge::oracle(const ModeInfo& mode) {
  return is_double(mode) ? screen<double>(mode).oracle : screen<float>(mode).oracle;
}

const std::vector<std::uint32_t>& Judge::oracle_colours(const ModeInfo& mode) {
  return is_double(mode) ? screen<double>(mode).colours : screen<float>(mode).colours;
}

Accuracy Judge::against_oracle(const Picture& picture, const ModeInfo& mode) {
  return with_screen(mode, [&](const auto& input, const auto& screen) {
    return measure_accuracy(judged(picture), input, screen.oracle, screen.colours, camera_, mode.numbers,
                            threads_);
  });
}

Accuracy Judge::against_snapped_oracle(const Picture& picture, const ModeInfo& mode) {
  const auto triangles = snapped(screen<float>(mode).triangles, mode.numbers.snap);
  OracleInput<float> on_grid = input<float>(mode);
  on_grid.triangles = triangles;
  const OracleImage oracle = exact_owners(on_grid, threads_);
  ModeBound bound = mode.numbers;
  bound.snap = 0;
  return measure_accuracy(judged(picture), on_grid, oracle, shade_owners(oracle.ids, scene_), camera_, bound,
                          threads_);
}

Prediction Judge::prediction(const ModeInfo& mode) {
  return with_screen(mode, [&](const auto& input, const auto& screen) {
    return predict_wrong(input, screen.oracle, mode.numbers, threads_);
  });
}

const EndToEndTruth& Judge::truth() {
  if (settings_.tie != TieRule::kFirst || settings_.geometry.cull_back_faces)
    throw Error("the end-to-end truth knows no other tie rule and no culling");
  if (!truth_)
    truth_ = render_end_to_end(scene_, settings_.width, settings_.height, settings_.fill,
                               settings_.geometry.near_rule, threads_);
  return *truth_;
}

const RayCastPicture& Judge::rays(bool robust) {
  const auto found = rays_.find(robust);
  if (found != rays_.end()) return found->second;
  return rays_.emplace(robust, ray_cast(scene_.model.triangles, camera_, robust, threads_)).first->second;
}

const Comparison& Judge::oracle_against_truth(const ModeInfo& mode) {
  const std::pair key{mode.depth_function, is_double(mode)};
  if (const auto found = geometry_.find(key); found != geometry_.end()) return found->second;
  const OracleImage& exact = oracle(mode);
  const DepthMap map = depth_map(camera_, mode.depth_function);
  std::vector<float> depths(exact.values.size());
  std::transform(exact.values.begin(), exact.values.end(), exact.ids.begin(), depths.begin(),
                 [&](double value, std::int32_t id) {
                   return id < 0 ? 1.0f : static_cast<float>(map.offset + map.scale * value);
                 });
  // Exact arithmetic on rounded vertices: what is left of the footprint's tolerance is the vertices' own.
  PictureBound vertices(ModeBound{
      .vertex_unit = mode.numbers.vertex_unit, .edge_unit = 0, .gradient_unit = 0, .depth_unit = 0});
  vertices.corner_depth_error = corner_depth_error(camera_, mode);
  return geometry_[key] = compare_with_double(truth().truth, exact.ids, depths, scene_.model.triangles,
                                              camera_, settings_.geometry.near_rule, vertices);
}

EndToEndVerdict Judge::against_truth(const Picture& picture, const ModeInfo& mode, const Accuracy* accuracy) {
  const EndToEndTruth& truth = this->truth();
  EndToEndVerdict verdict;
  verdict.pixels = static_cast<std::int64_t>(picture.ids.size());
  // Rays are classified by their own bound, everything else by its way: vertices first, then the mode.
  const Comparison* geometry = mode.has_screen_triangles ? &oracle_against_truth(mode) : nullptr;
  RayComparison of_rays;
  if (geometry == nullptr) {
    const RayCastPicture cast{.picture = {picture.width, picture.height, picture.ids, picture.values}};
    of_rays = compare_with_rays(cast, truth.truth.ids, truth.truth.depths, scene_.model.triangles, camera_,
                                F64::kInfo.numbers);
  }
  for (std::size_t i = 0; i < picture.ids.size(); ++i) {
    if (truth.decided[i] == DecidedBy::kAmbiguous) {
      ++verdict.ambiguous;
    } else if (picture.ids[i] == truth.truth.ids[i]) {
      ++verdict.identical;
      const double error = std::abs(double{picture.depths[i]} - truth.truth.depths[i]) * 0x1p24;
      verdict.max_depth_error_steps = std::max(verdict.max_depth_error_steps, error);
    } else {
      PixelVerdict reason = PixelVerdict::kError;
      bool unbounded = false;
      if (geometry == nullptr) {
        reason = of_rays.verdicts[i];
        // A cast depth that is rounded onto the far plane is not drawn.
        const bool is_lost = picture.ids[i] < 0 && 1 - truth.truth.depths[i] <= 2 * mode.numbers.depth_unit;
        if (reason == PixelVerdict::kError && is_lost) reason = PixelVerdict::kDepthTie;
      } else if (accuracy->classes[i] == PixelClass::kSame) {
        reason = geometry->verdicts[i];
      } else if (geometry->verdicts[i] != PixelVerdict::kError) {
        const PixelClass of_mode = accuracy->classes[i];
        unbounded = of_mode == PixelClass::kUnbounded;
        if (of_mode == PixelClass::kEdge) reason = PixelVerdict::kEdgeTie;
        if (of_mode == PixelClass::kDepth || of_mode == PixelClass::kExactTie)
          reason = PixelVerdict::kDepthTie;
      }
      if (unbounded) {
        ++verdict.unbounded;
      } else if (reason == PixelVerdict::kEdgeTie) {
        ++verdict.edge_ties;
      } else if (reason == PixelVerdict::kDepthTie) {
        ++verdict.depth_ties;
      } else if (verdict.errors++ == 0) {
        verdict.worst_pixel = static_cast<std::int64_t>(i);
      }
    }
  }
  return verdict;
}

RayComparison Judge::against_rays(const Picture& picture, const ModeInfo& mode, bool robust) {
  const DepthMap map = depth_map(camera_, mode.depth_function);
  std::vector<double> depths(picture.values.size());
  std::transform(picture.values.begin(), picture.values.end(), picture.ids.begin(), depths.begin(),
                 [&](double value, std::int32_t id) { return id < 0 ? 1 : map.offset + map.scale * value; });
  return compare_with_rays(rays(robust), picture.ids, depths, scene_.model.triangles, camera_, mode.numbers);
}

}  // namespace rasterbench
