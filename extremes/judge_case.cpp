#include "extremes/judge_case.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "extremes/constructions.h"
#include "kernels/kernel.h"

namespace rasterbench::extremes {
namespace {

bool is_exact_in_coverage(const ModeInfo& mode) {
  return mode.numbers.edge_form == EdgeForm::kExact && mode.numbers.snap == 0;
}

std::int64_t first_of_class(const Accuracy& accuracy, PixelClass wanted) {
  const auto found = std::find(accuracy.classes.begin(), accuracy.classes.end(), wanted);
  return found == accuracy.classes.end() ? -1 : found - accuracy.classes.begin();
}

std::string against_oracle_text(const Picture& picture, const OracleImage& oracle, std::int64_t pixel) {
  if (pixel < 0) return {};
  const auto i = static_cast<std::size_t>(pixel);
  return fmt::format(
      "{}: triangle {} at {:.9g}, exactly {} at {:.9g}; edge within {:.3g} px, next depth {:.3g}",
      pixel_name(pixel, picture.width), picture.ids[i], picture.values[i], oracle.ids[i], oracle.values[i],
      oracle.edge_margin[i], oracle.depth_gap[i]);
}

std::int64_t drawn_pixels(const std::vector<std::int32_t>& ids) {
  return std::count_if(ids.begin(), ids.end(), [](std::int32_t id) { return id >= 0; });
}

Finding judge_by_oracle(const DrawnCase& drawn, const Picture& picture, const Accuracy& accuracy) {
  Finding finding;
  Judge& judge = drawn.base.judge;
  const ModeInfo& mode = drawn.mode;
  const OracleImage& oracle = judge.oracle(mode);
  finding.wrong = accuracy.wrong;
  const auto story = [&](PixelClass of) {
    return against_oracle_text(picture, oracle, first_of_class(accuracy, of));
  };
  if (accuracy.unexplained > 0)
    finding.worsen(Verdict::kWrong, fmt::format("{} pixels beyond the bound; {}", accuracy.unexplained,
                                                story(PixelClass::kUnexplained)));
  if (accuracy.depth_out_of_bound > 0)
    finding.worsen(Verdict::kWrong, fmt::format("{} depths of the right triangle beyond the bound",
                                                accuracy.depth_out_of_bound));
  if (accuracy.unbounded > 0)
    finding.worsen(Verdict::kReported,
                   fmt::format("{} of {} drawn pixels wrong", accuracy.unbounded, drawn_pixels(oracle.ids)));
  if (accuracy.wrong > 0) finding.worsen(Verdict::kWithinBound, {});
  if (is_exact_in_coverage(mode) && accuracy.edge > 0)
    finding.worsen(Verdict::kWrong, fmt::format("{} pixels of wrong coverage in a mode without any; {}",
                                                accuracy.edge, story(PixelClass::kEdge)));
  if (mode.numbers.exact_winner && accuracy.wrong > 0)
    finding.worsen(Verdict::kWrong, fmt::format("{} wrong pixels in an exact mode", accuracy.wrong));
  if (drawn.one.must.equal && accuracy.wrong > 0)
    finding.worsen(wrong_in(mode),
                   fmt::format("{} wrong pixels where every mode can be exact; {}", accuracy.wrong,
                               against_oracle_text(picture, oracle, accuracy.worst_pixel)));

  if (mode.numbers.snap > 0) {
    const Accuracy snapped = judge.against_snapped_oracle(picture, mode);
    if (snapped.edge + snapped.unexplained > 0)
      finding.worsen(
          Verdict::kWrong,
          fmt::format("{} pixels of wrong coverage on the snapped corners, {} first",
                      snapped.edge + snapped.unexplained, pixel_name(snapped.worst_pixel, picture.width)));
  }
  if (mode.numbers.bounded) {
    const Prediction prediction = judge.prediction(mode);
    for (std::size_t i = 0; i < prediction.reasons.size(); ++i)
      if (accuracy.classes[i] != PixelClass::kSame && prediction.reasons[i] == 0) {
        finding.worsen(Verdict::kWrong,
                       "wrong where the bound rules it out; " +
                           against_oracle_text(picture, oracle, static_cast<std::int64_t>(i)));
        break;
      }
  }
  return finding;
}

/// `accuracy`: against the oracle; null for rays.
Finding judge_by_truth(const DrawnCase& drawn, const Picture& picture, const Accuracy* accuracy) {
  Finding finding;
  Judge& judge = drawn.base.judge;
  const ModeInfo& mode = drawn.mode;
  const Must& must = drawn.one.must;
  const EndToEndVerdict verdict = judge.against_truth(picture, mode, accuracy);
  finding.wrong = verdict.wrong();
  const std::int64_t drawn_in_truth = drawn_pixels(judge.truth().truth.ids);
  if (verdict.errors > 0) {
    const auto i = static_cast<std::size_t>(verdict.worst_pixel);
    finding.worsen(
        Verdict::kWrong,
        fmt::format("{} pixels of the end-to-end truth unexplained; {}: triangle {} at {:.9g}, in truth "
                    "{} at {:.9g}",
                    verdict.errors, pixel_name(verdict.worst_pixel, picture.width), picture.ids[i],
                    picture.depths[i], judge.truth().truth.ids[i], judge.truth().truth.depths[i]));
  }
  const bool broken =
      static_cast<double>(verdict.wrong()) > kBrokenShare * static_cast<double>(drawn_in_truth);
  const std::string share =
      fmt::format("{} of {} drawn pixels differ from the end-to-end truth", verdict.wrong(), drawn_in_truth);
  if (verdict.unbounded > 0) finding.worsen(Verdict::kReported, share);
  if (broken) {
    const bool must_survive =
        std::find(must.survivors.begin(), must.survivors.end(), mode.name) != must.survivors.end();
    finding.worsen(must_survive ? Verdict::kWrong : Verdict::kReported,
                   share + (must_survive ? ": this mode must survive" : ": lost to rounding"));
  }
  if (const auto most = must.wrong_at_most.find(std::string(mode.name)); most != must.wrong_at_most.end())
    if (verdict.wrong() > most->second)
      finding.worsen(Verdict::kWrong, share + fmt::format(", {} are allowed", most->second));
  if (verdict.wrong() > 0) finding.worsen(Verdict::kWithinBound, {});
  return finding;
}

/// By the oracle and by the truth, as the case asks for. Rays have no screen triangles that an oracle could
/// be asked about: the truth judges them instead.
Finding judge_by_exact_answers(const DrawnCase& drawn, const Picture& picture) {
  const Must& must = drawn.one.must;
  const bool by_oracle = must.match_oracle || must.pixels;
  if (!drawn.mode.has_screen_triangles)
    return by_oracle || must.match_truth ? judge_by_truth(drawn, picture, nullptr) : Finding{};
  Finding finding;
  if (!by_oracle && !must.match_truth) return finding;
  const Accuracy accuracy = drawn.base.judge.against_oracle(picture, drawn.mode);
  if (by_oracle) finding.merge(judge_by_oracle(drawn, picture, accuracy));
  if (must.match_truth) finding.merge(judge_by_truth(drawn, picture, &accuracy));
  return finding;
}

/// Two float32 methods disagree at edges and at near ties; what counts is what neither bound explains.
Finding judge_by_rays(const DrawnCase& drawn, const Picture& picture) {
  Finding finding;
  if (!has_embree()) {
    finding.note = "not matched with rays: " + embree_version();
    return finding;
  }
  const RayComparison rays = drawn.base.judge.against_rays(picture, drawn.mode);
  if (rays.errors > 0)
    finding.worsen(
        wrong_in(drawn.mode),
        fmt::format("{} pixels differ from the ray cast unexplained, {}: triangle {}, by ray {}", rays.errors,
                    pixel_name(rays.worst_pixel, picture.width),
                    picture.ids[static_cast<std::size_t>(rays.worst_pixel)],
                    drawn.base.judge.rays(false).picture.ids[static_cast<std::size_t>(rays.worst_pixel)]));
  return finding;
}

/// What the case says of the picture itself. The number of pixels is asked of the oracle, which the mode is
/// then judged by: so neither can be wrong unseen.
Finding judge_contents(const DrawnCase& drawn, const Picture& picture, const GeometryCounts& counts) {
  Finding finding;
  const Must& must = drawn.one.must;
  const ModeInfo& mode = drawn.mode;
  if (must.pixels && mode.has_screen_triangles) {
    const std::int64_t exactly = drawn_pixels(drawn.base.judge.oracle(mode).ids);
    if (exactly != *must.pixels)
      finding.worsen(Verdict::kWrong, fmt::format("the oracle has {} pixels, not {}", exactly, *must.pixels));
  }
  for (const ExpectedPixel& expected : must.owners) {
    const std::int64_t pixel = std::int64_t{expected.y} * picture.width + expected.x;
    const std::int32_t id = picture.ids[static_cast<std::size_t>(pixel)];
    if (id != expected.id)
      finding.worsen(wrong_in(mode), fmt::format("{}: triangle {}, not {}", pixel_name(pixel, picture.width),
                                                 id, expected.id));
  }
  const std::map<std::string, std::int64_t> counted{{"non_finite", counts.non_finite},
                                                    {"zero_area", counts.zero_area},
                                                    {"behind_near", counts.behind_near},
                                                    {"beyond_far", counts.beyond_far},
                                                    {"off_screen", counts.off_screen}};
  for (const auto& [name, count] : must.counts)
    if (mode.has_screen_triangles && counted.at(name) != count)
      finding.worsen(Verdict::kWrong,
                     fmt::format("{} is counted as {}, not {}", name, counted.at(name), count));
  if (must.no_background_inside) {
    const std::int64_t holes = enclosed_background(picture);
    if (holes > 0) finding.worsen(wrong_in(mode), fmt::format("{} background pixels inside", holes));
  }
  return finding;
}

}  // namespace

Verdict wrong_in(const ModeInfo& mode) {
  return mode.numbers.bounded && mode.has_screen_triangles ? Verdict::kWrong : Verdict::kReported;
}

std::string pixel_name(std::int64_t index, int width) {
  return fmt::format("pixel {},{}", index % width, index / width);
}

CaseJudge::CaseJudge(const Case& one, int threads) : one_(one) {
  const Scene scene = open_case(one_);
  for (const FillRule fill : one_.fills) {
    FrameSettings settings{.width = scene.parameters.width, .height = scene.parameters.height, .fill = fill};
    settings.geometry.near_rule = one_.near_rule;
    settings.geometry.isa = best_isa();
    base_.push_back(std::make_unique<JudgedScene>(scene, settings, threads));
    if (one_.must.same_as)
      changed_.push_back(
          std::make_unique<JudgedScene>(changed_scene(one_, *one_.must.same_as), settings, threads));
  }
}

Finding CaseJudge::judge(const ModeInfo& mode, std::string_view kernel) {
  Finding finding;
  finding.verdict = Verdict::kNotCarried;
  if (!find_kernel(kernel).variant(mode.name).make) return finding;
  for (std::size_t i = 0; i < base_.size(); ++i) {
    // Rays know neither the top-left rule nor pictures without the near plane.
    if (!mode.has_screen_triangles &&
        (one_.fills[i] == FillRule::kTopLeft || one_.near_rule == NearRule::kOff))
      continue;
    const DrawnCase drawn{one_, *base_[i], changed_.empty() ? nullptr : changed_[i].get(), mode, kernel};
    Finding with_fill = judge_drawn(drawn);
    if (!with_fill.explanation.empty())
      with_fill.explanation =
          (one_.fills[i] == FillRule::kClosed ? "closed: " : "top-left: ") + with_fill.explanation;
    finding.merge(with_fill);
  }
  return finding;
}

namespace {

/// A kernel that throws has drawn nothing: as it must be for images that do not fit into memory, said so by
/// ray casting beyond its limits, and wrong otherwise.
Finding judge_refusal(const DrawnCase& drawn, const std::string& line) {
  Finding finding;
  const std::vector<std::string>& parts = drawn.one.must.refusal_or_room;
  for (const std::string& part : parts)
    if (line.find(part) == std::string::npos)
      finding.worsen(Verdict::kWrong, fmt::format("'{}' is not in the error: {}", part, line));
  finding.worsen(parts.empty() ? wrong_in(drawn.mode) : Verdict::kRefused, "refused: " + line);
  return finding;
}

/// A picture in the case's mode, and everything that needs its screen triangles.
Finding judge_by_specification(const DrawnCase& drawn, const Picture& picture) {
  Finding finding;
  const Must& must = drawn.one.must;
  const JudgedScene& base = drawn.base;
  const Picture specification = render_specification(base.scene, drawn.mode.name, base.settings);
  if (const auto differing = differing_pixels(picture, specification); differing > 0)
    finding.worsen(Verdict::kWrong, fmt::format("{} pixels of {} differ from the specification of {}",
                                                differing, drawn.kernel, drawn.mode.name));
  if (must.nothing_tested && specification.samples_tested > 0)
    finding.worsen(wrong_in(drawn.mode),
                   fmt::format("{} samples tested for nothing", specification.samples_tested));
  if (must.every_execution) finding.merge(judge_executions(drawn, specification));
  return finding;
}

}  // namespace

Finding CaseJudge::judge_drawn(const DrawnCase& drawn) {
  const Must& must = one_.must;
  const JudgedScene& base = drawn.base;
  Picture picture;
  GeometryCounts counts;
  try {
    const auto renderer = make_renderer(drawn.kernel, drawn.mode.name, {&base.scene, base.settings, {}});
    if (!must.refusal_or_room.empty()) return {};  // memory suffices: nothing of that size is drawn here
    renderer->draw();
    counts = renderer->draw().counts;  // the second frame meets what the first left behind
    picture = picture_of(*renderer, base.settings);
  } catch (const Error& error) {
    return judge_refusal(drawn, error.what());
  }

  Finding finding;
  finding.pixels = static_cast<std::int64_t>(picture.ids.size());
  finding.drawn = drawn_pixels(picture.ids);
  if (drawn.mode.has_screen_triangles) finding.merge(judge_by_specification(drawn, picture));
  finding.merge(judge_by_exact_answers(drawn, picture));
  finding.merge(judge_contents(drawn, picture, counts));
  if (must.match_rays) finding.merge(judge_by_rays(drawn, picture));
  if (drawn.changed) finding.merge(judge_change(drawn, picture));
  return finding;
}

}  // namespace rasterbench::extremes
