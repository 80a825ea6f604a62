#include "advice/sufficiency.h"

#include <algorithm>
#include <future>
#include <tuple>

#include "base/hash.h"

namespace rasterbench {
namespace {

template <class T>
std::string_view bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

Standing standing_of(const ModeVerdict& verdict, const Tolerance& tolerance) {
  if (verdict.predicted > tolerance.wrong_pixels) return Standing::kTooManyPixels;
  if (tolerance.depth_error && !(verdict.depth_bound <= *tolerance.depth_error))
    return Standing::kTooDeepAnError;
  return Standing::kSuffices;
}

void judge_by_bound(Judge& judge, ModeVerdict& verdict) {
  const ModeInfo& mode = *verdict.mode;
  const Prediction prediction = judge.prediction(mode);
  const OracleImage& oracle = judge.oracle(mode);
  const DepthMap map = depth_map(judge.camera(), mode.depth_function);
  double farthest_d = -1;
  for (std::size_t i = 0; i < prediction.reasons.size(); ++i) {
    verdict.by_edge += (prediction.reasons[i] & kEdgeCanFlip) != 0;
    verdict.by_depth += (prediction.reasons[i] & kDepthCanFlip) != 0;
    if (prediction.reasons[i] == 0 && oracle.ids[i] >= 0)
      farthest_d = std::max(farthest_d, map.offset + map.scale * oracle.values[i]);
  }
  verdict.predicted = prediction.pixels;
  verdict.depth_bound = depth_bound_in_world(mode, judge.camera(), prediction.max_depth_error, farthest_d);
}

/// What the mode's own picture gets wrong.
void judge_by_picture(Judge& judge, const Picture& picture, ModeVerdict& verdict) {
  const ModeInfo& mode = *verdict.mode;
  const Accuracy accuracy = judge.against_oracle(picture, mode);
  const OracleImage& oracle = judge.oracle(mode);
  const DepthMap map = depth_map(judge.camera(), mode.depth_function);
  verdict.found = accuracy.wrong;
  verdict.beyond_bound = accuracy.unexplained + accuracy.depth_out_of_bound;
  for (std::size_t i = 0; i < picture.ids.size(); ++i) {
    if (picture.ids[i] < 0 || picture.ids[i] != oracle.ids[i]) continue;
    const double exact = view_distance(judge.camera(), map.offset + map.scale * oracle.values[i]);
    const double error = std::abs(view_distance(judge.camera(), double{picture.depths[i]}) - exact);
    verdict.found_depth_error = std::max(verdict.found_depth_error, error);
  }
  verdict.fingerprint = fingerprint(picture);
}

}  // namespace

std::string_view to_string(Standing standing) {
  switch (standing) {
    case Standing::kSuffices:
      return "suffices";
    case Standing::kTooManyPixels:
      return "too many pixels";
    case Standing::kTooDeepAnError:
      return "too deep an error";
    case Standing::kUnbounded:
      return "unbounded";
    case Standing::kCastsRays:
      return "casts rays";
    case Standing::kUnavailable:
      return "unavailable";
  }
  return {};
}

std::string fingerprint(const Picture& picture) {
  return hash_bytes(hash_bytes(bytes_of(picture.ids)) + hash_bytes(bytes_of(picture.depths)) +
                    hash_bytes(bytes_of(picture.colours)));
}

double depth_bound_in_world(const ModeInfo& mode, const Camera& camera, double value_error,
                            double farthest_d) {
  const ModeBound& numbers = mode.numbers;
  const double scale = depth_map(camera, mode.depth_function).scale;
  // A depth d that is stored as float32 is handed over as it is; every other one is rounded once more: by
  // 2^-25 below 1, and as much for the arithmetic that takes it to d.
  const bool is_handed_over =
      mode.depth_function == DepthFunction::kNdc && numbers.depth_unit == 0x1p-24 && numbers.depth_step == 0;
  const double error = value_error * scale + (is_handed_over ? 0 : 0x1p-24);
  // The distance is a convex function of d, so that the same error of d weighs most at the farthest pixel,
  // and most towards the far side. The factor covers the rounding of this very line.
  return (view_distance(camera, farthest_d + error) - view_distance(camera, farthest_d)) * (1 + 0x1p-20);
}

std::vector<ModeVerdict> judge_modes(Judge& judge, const Tolerance& tolerance, int threads,
                                     const std::function<void(double, std::string_view)>& progress) {
  std::vector<ModeVerdict> verdicts;
  std::vector<std::size_t> drawn;
  for (const ModeInfo& mode : mode_infos()) {
    ModeVerdict& verdict = verdicts.emplace_back();
    verdict.mode = &mode;
    if (!mode.unavailable.empty()) continue;
    verdict.standing = !mode.has_screen_triangles ? Standing::kCastsRays : Standing::kUnbounded;
    if (mode.has_screen_triangles) drawn.push_back(verdicts.size() - 1);
  }
  // Specifications are serial: as many are drawn side by side as there are threads. The judge is not shared.
  const auto batch = static_cast<std::size_t>(std::max(threads, 1));
  for (std::size_t first = 0; first < drawn.size(); first += batch) {
    const std::size_t end = std::min(drawn.size(), first + batch);
    std::vector<std::future<Picture>> pictures;
    for (std::size_t i = first; i < end; ++i)
      pictures.push_back(std::async(std::launch::async, [&, i] {
        return render_specification(judge.scene(), verdicts[drawn[i]].mode->name, judge.settings());
      }));
    for (std::size_t i = first; i < end; ++i) {
      ModeVerdict& verdict = verdicts[drawn[i]];
      progress(static_cast<double>(i) / static_cast<double>(drawn.size()), verdict.mode->name);
      if (verdict.mode->numbers.bounded) {
        judge_by_bound(judge, verdict);
        verdict.standing = standing_of(verdict, tolerance);
      }
      judge_by_picture(judge, pictures[i - first].get(), verdict);
    }
  }
  return verdicts;
}

const ModeVerdict* nearest_to(const Tolerance& tolerance, std::span<const ModeVerdict> verdicts) {
  const auto excess = [&](const ModeVerdict& v) {
    return std::tuple(std::max<std::int64_t>(0, v.predicted - tolerance.wrong_pixels), v.depth_bound,
                      v.predicted);
  };
  const ModeVerdict* nearest = nullptr;
  for (const ModeVerdict& v : verdicts)
    if (v.predicted >= 0 && (nearest == nullptr || excess(v) < excess(*nearest))) nearest = &v;
  return nearest;
}

}  // namespace rasterbench
