#include "harness/verdict_json.h"

#include <fmt/format.h>

#include <cmath>

#include "base/error.h"
#include "pipeline/resolve.h"

namespace rasterbench {
namespace {

/// JSON has no infinities: what has no finite value is null.
Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json oracle_json(const Accuracy& a, const OracleEffort& effort) {
  Json json;
  json["renderer"] = "exact arithmetic on the mode's own screen vertices";
  json["pixels"] = a.pixels;
  json["wrong"] = a.wrong;
  json["false_positives"] = a.false_positives;
  json["false_negatives"] = a.false_negatives;
  json["exact_ties"] = a.exact_ties;
  json["edge"] = a.edge;
  json["depth"] = a.depth;
  json["unexplained"] = a.unexplained;
  json["depth_out_of_bound"] = a.depth_out_of_bound;
  json["unbounded"] = a.unbounded;
  json["predicted"] = a.predicted;
  json["worst_distance_px"] = finite(a.worst_distance);
  json["max_depth_error_steps"] = finite(a.max_depth_error_steps);
  json["max_depth_error_world"] = finite(a.max_depth_error_world);
  json["silhouette_hausdorff_px"] = finite(a.silhouette_hausdorff);
  json["colours_changed"] = a.colours_changed;
  json["colours_changed_8"] = a.colours_changed_8;
  json["psnr_db"] = finite(a.psnr);
  json["ssim"] = a.ssim;
  json["within_bound"] = a.within_bound();
  json["coverage_fallbacks"] = effort.coverage_fallbacks;
  json["depth_fallbacks"] = effort.depth_fallbacks;
  json["seconds"] = effort.seconds;
  return json;
}

Json end_to_end_json(const EndToEndVerdict& v, const EndToEndTruth& truth) {
  Json json;
  json["renderer"] = "intervals from the file's values: double, then multiprecision";
  json["pixels"] = v.pixels;
  json["identical"] = v.identical;
  json["wrong"] = v.wrong();
  json["ambiguous"] = v.ambiguous;
  json["edge_ties"] = v.edge_ties;
  json["depth_ties"] = v.depth_ties;
  json["unbounded"] = v.unbounded;
  json["errors"] = v.errors;
  json["max_depth_error_steps"] = finite(v.max_depth_error_steps);
  json["multiprecision_pixels"] = truth.by_multiprecision;
  json["seconds"] = truth.seconds;
  return json;
}

std::string place(std::int64_t pixel, int width) {
  return fmt::format("x={} y={}", pixel % width, pixel / width);
}

Json rays_json(const RayComparison& c, const RayCastPicture& rays, int width) {
  Json json;
  json["version"] = embree_version();
  json["identical"] = c.identical;
  json["edge_ties"] = c.edge_ties;
  json["depth_ties"] = c.depth_ties;
  json["errors"] = c.errors;
  json["first_error"] = c.errors > 0 ? Json(place(c.worst_pixel, width)) : Json();
  json["max_depth_difference"] = finite(c.max_depth_difference);
  json["build_ms"] = rays.build_seconds * 1e3;
  json["trace_ms"] = rays.trace_seconds * 1e3;
  return json;
}

}  // namespace

Json judge_picture(Judge& judge, const Picture& picture, const ModeInfo& mode) {
  const FrameSettings& settings = judge.settings();
  Json json;
  std::string failure;

  Accuracy accuracy;
  if (mode.has_screen_triangles) {
    accuracy = judge.against_oracle(picture, mode);
    json["oracle"] = oracle_json(accuracy, judge.oracle(mode).effort);
    if (accuracy.unexplained > 0)
      failure = fmt::format("{} pixels differ from the exact oracle beyond the bound of {}, the worst at {}",
                            accuracy.unexplained, mode.name, place(accuracy.worst_pixel, settings.width));
    else if (!accuracy.within_bound())
      failure = fmt::format("{} pixels have a depth beyond the bound of {}", accuracy.depth_out_of_bound,
                            mode.name);
    if (mode.numbers.snap > 0) {
      const Accuracy snapped = judge.against_snapped_oracle(picture, mode);
      json["oracle"]["wrong_on_snapped"] = snapped.wrong;
      json["oracle"]["edge_on_snapped"] = snapped.edge + snapped.unexplained;
      if (failure.empty() && snapped.edge + snapped.unexplained > 0)
        failure = fmt::format(
            "{} pixels differ from the exact oracle on the snapped vertices of {}, which it "
            "promises to draw exactly",
            snapped.edge + snapped.unexplained, mode.name);
    }
  } else {
    json["oracle"] = nullptr;
  }

  const EndToEndVerdict end_to_end =
      judge.against_truth(picture, mode, mode.has_screen_triangles ? &accuracy : nullptr);
  json["end_to_end"] = end_to_end_json(end_to_end, judge.truth());
  if (failure.empty() && end_to_end.errors > 0)
    failure =
        fmt::format("{} pixels differ from the end-to-end truth and nothing explains it, the first at {}",
                    end_to_end.errors, place(end_to_end.worst_pixel, settings.width));

  if (has_embree()) {
    for (const bool robust : {false, true})
      json[robust ? "embree_robust" : "embree"] =
          rays_json(judge.against_rays(picture, mode, robust), judge.rays(robust), settings.width);
  } else {
    json["embree"] = json["embree_robust"] = {{"skipped", embree_version()}};
  }
  json["bound"] = {{"bounded", mode.numbers.bounded}, {"text", mode.bound}, {"source", mode.bound_source}};
  json["failure"] = failure.empty() ? Json() : Json(failure);
  return json;
}

Json peer_json(const LlvmpipeVersion& version) {
  return {{"renderer", version.renderer}, {"version", version.version}};
}

Json judge_peer_picture(Judge& judge, const Picture& picture) {
  const Scene& scene = judge.scene();
  const EndToEndTruth& truth = judge.truth();
  const Comparison comparison =
      compare_with_double(truth.truth, picture.ids, picture.depths, scene.model.triangles, judge.camera(),
                          judge.settings().geometry.near_rule, llvmpipe_bound());
  EndToEndVerdict verdict{.pixels = comparison.pixels,
                          .identical = comparison.identical,
                          .edge_ties = comparison.edge_ties,
                          .depth_ties = comparison.depth_ties,
                          .errors = comparison.errors,
                          .max_depth_error_steps = comparison.max_depth_error_steps,
                          .worst_pixel = comparison.worst_pixel};
  for (std::size_t i = 0; i < truth.decided.size(); ++i) {
    if (truth.decided[i] != DecidedBy::kAmbiguous) continue;
    const PixelVerdict of_pixel = comparison.verdicts[i];
    --(of_pixel == PixelVerdict::kIdentical  ? verdict.identical
       : of_pixel == PixelVerdict::kEdgeTie  ? verdict.edge_ties
       : of_pixel == PixelVerdict::kDepthTie ? verdict.depth_ties
                                             : verdict.errors);
    ++verdict.ambiguous;
  }
  std::int64_t other_colours = 0;
  for (std::size_t i = 0; i < picture.ids.size(); ++i) {
    const std::int32_t id = picture.ids[i];
    if (id >= std::ssize(scene.model.triangles)) continue;  // an error already
    other_colours +=
        picture.colours[i] !=
        (id < 0 ? pack_rgba(scene.parameters.background)
                : shade_flat(scene.model.triangles[static_cast<std::size_t>(id)], scene.parameters.object));
  }
  Json json;
  for (const char* name : kVerdicts) json[name] = nullptr;
  json["end_to_end"] = end_to_end_json(verdict, truth);
  json["bound"] = {{"bounded", true}, {"text", kLlvmpipeBoundText}, {"source", kLlvmpipeBoundSource}};
  json["failure"] = nullptr;
  if (verdict.errors > 0)
    json["failure"] =
        fmt::format("{} pixels differ from the end-to-end truth beyond the bound of {}, one at {}",
                    verdict.errors, kLlvmpipe, place(verdict.worst_pixel, judge.settings().width));
  else if (other_colours > 0)
    json["failure"] = fmt::format("{} pixels have another colour than their triangle", other_colours);
  return json;
}

}  // namespace rasterbench
