#include "advice/report.h"

#include <fmt/format.h>

#include <cmath>

namespace rasterbench {
namespace {

double percent(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0;
}

/// JSON has no infinities: what has no finite value is null.
Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(); }

std::string scene_text(const Advice& a) {
  const SceneFacts& f = a.facts;
  const GeometryCounts& c = f.counts;
  const auto line = [](const char* name, const std::string& value) {
    return fmt::format("  {:<14} {}\n", name, value);
  };
  std::string text = "scene\n";
  text +=
      line("triangles", fmt::format("{}: {} drawn, {} off the screen, {} beyond far, {} in front of near, {} "
                                    "without area, {} not finite",
                                    f.triangles, c.drawn, c.off_screen, c.beyond_far, c.behind_near,
                                    c.zero_area, c.non_finite));
  text += line("cut", fmt::format("{} at the near plane ({:.2g} %), {} at the guard band ({:.2g} %)",
                                  c.near_clipped, percent(c.near_clipped, c.drawn), c.guard_clipped,
                                  percent(c.guard_clipped, c.drawn)));
  if (c.pieces > 0) {
    text += line("extent", fmt::format("x {:.6g} .. {:.6g} px, y {:.6g} .. {:.6g} px", f.low_x, f.high_x,
                                       f.low_y, f.high_y));
    text += line("edges",
                 fmt::format("shortest {:.3g}, median {:.3g}, longest {:.4g} px; {:.3g} % of the triangles "
                             "within less than a pixel",
                             f.edge_length.least, f.edge_length.median, f.edge_length.largest,
                             percent(f.subpixel, c.pieces)));
  }
  if (f.covered_pixels == 0) return text + line("picture", "background only");
  text += line("depth",
               fmt::format("{:.4g} .. {:.4g} world units from the camera are seen; near {:.4g}, far {:.4g}",
                           f.nearest, f.farthest, a.camera.near_plane, a.camera.far_plane));
  text += line("layers", fmt::format("{:.3g} on average over {} covered pixels, at most {}", f.mean_layers,
                                     f.covered_pixels, f.most_layers));
  text += line("depth gaps",
               fmt::format("{} exact ties; of the others the smallest is {:.3g}, 1 % are below {:.3g}, "
                           "the median is {:.3g} (of d)",
                           f.depth_ties, f.depth_gap.least, f.depth_gap.first_percent, f.depth_gap.median));
  return text +
         line("edge margins",
              fmt::format("{} samples on an edge; of the others the smallest is {:.3g} px, 1 % are below "
                          "{:.3g} px",
                          f.on_edge, f.edge_margin.least, f.edge_margin.first_percent));
}

std::string verdict_words(const ModeVerdict& v) {
  switch (v.standing) {
    case Standing::kSuffices:
      return "suffices";
    case Standing::kUnavailable:
      return fmt::format("unavailable: {}", v.mode->unavailable);
    case Standing::kUnbounded:
      return fmt::format("found {} wrong here; nothing is promised", v.found);
    case Standing::kCastsRays:
      return "casts rays: margins on the screen say nothing of it";
    default:
      return std::string(to_string(v.standing));
  }
}

std::string modes_text(const Advice& a, bool explain) {
  std::string text = fmt::format(
      "\nmodes: pixels of {} that can be wrong by the mode's bound, and that its specification gets wrong;\n"
      "depth error in world units along the view axis, by the bound and found\n"
      "  {:<23} {:>9} {:>8} {:>10} {:>10}  {}\n",
      a.settings.pixels(), "mode", "can be", "found", "depth", "found", "verdict");
  const auto count = [](std::int64_t n) { return n < 0 ? std::string("-") : fmt::format("{}", n); };
  for (const ModeVerdict& v : a.verdicts) {
    const bool has_bound = v.predicted >= 0, was_drawn = v.found >= 0;
    text +=
        fmt::format("  {:<23} {:>9} {:>8} {:>10} {:>10}  {}{}\n", v.mode->name, count(v.predicted),
                    count(v.found), has_bound ? fmt::format("{:.2e}", v.depth_bound) : "-",
                    was_drawn ? fmt::format("{:.2e}", v.found_depth_error) : "-", verdict_words(v),
                    v.beyond_bound > 0 ? fmt::format("; DEFECT: {} beyond its bound", v.beyond_bound) : "");
    if (explain && v.predicted > 0)
      text += fmt::format("      {} near an edge, {} near another depth: {}\n", v.by_edge, v.by_depth,
                          v.mode->bound);
  }
  return text;
}

std::string interval_text(const std::optional<std::pair<double, double>>& interval, const char* unit) {
  return interval ? fmt::format("[{:.3f}, {:.3f}]{}", interval->first, interval->second, unit)
                  : std::string("no interval below 6 rounds");
}

std::string measured_text(const Advice& a, bool explain) {
  std::size_t failed = 0;
  for (const Measurement& m : a.measurements.all) failed += !m.conforms;
  std::string text =
      fmt::format("\nmeasured: {} configurations verified and tried", a.measurements.all.size() - failed);
  if (failed > 0) text += fmt::format(", {} FAILED their verification", failed);
  if (a.measurements.no_time > 0)
    text += fmt::format(", {} left out for lack of time", a.measurements.no_time);
  if (a.measurements.hopeless > 0)
    text += fmt::format(", {} left out because their kernel was far behind", a.measurements.hopeless);
  text += "\n";
  for (const Measurement& m : a.measurements.all)
    if (explain || !m.conforms)
      text += fmt::format("  {:<50} {}\n", name_of(m.candidate),
                          m.conforms ? fmt::format("{:.3f} ms, fastest of a few frames", m.trial_ms)
                                     : "FAILED: draws another picture than its specification");
  if (!a.recommendation) return text;
  text += fmt::format("finalists: {} rounds of fresh frames in random order\n",
                      a.recommendation->finalists.front().measurement->rounds_ms.size());
  for (const Ranked& r : a.recommendation->finalists) {
    text += fmt::format("  {:<50} {:.3f} ms {}", name_of(r.measurement->candidate), r.median_ms,
                        interval_text(r.interval_ms, " ms"));
    if (r.slower_by) text += ", " + interval_text(r.slower_by, " times the fastest's");
    text += &r == &a.recommendation->finalists.front() ? ""
            : r.is_distinguishable                     ? ""
                                                       : ": not distinguishable";
    text += "\n";
  }
  return text;
}

std::string recommendation_text(const Advice& a) {
  const Ranked& chosen = a.chosen();
  const ModeVerdict& v = *chosen.measurement->candidate.verdict;
  std::string text =
      fmt::format("\nrecommended: {} on {} threads, {:.3f} ms\n", name_of(chosen.measurement->candidate),
                  chosen.measurement->candidate.execution.threads, chosen.median_ms);
  text += fmt::format("  wrong pixels: {} allowed, {} possible by its bound (a proof), {} found\n",
                      a.tolerance.wrong_pixels, v.predicted, v.found);
  text +=
      fmt::format("  depth error:  {} allowed, {:.2e} possible by its bound, {:.2e} found (world units)\n",
                  a.tolerance.depth_error ? fmt::format("{:.2e}", *a.tolerance.depth_error) : "any",
                  v.depth_bound, v.found_depth_error);
  std::string equals;
  for (const Ranked& r : a.recommendation->finalists)
    if (&r != &chosen && (&r == &a.recommendation->finalists.front() || !r.is_distinguishable))
      equals += fmt::format("{}{}", equals.empty() ? "" : "; ", name_of(r.measurement->candidate));
  if (!equals.empty())
    text += fmt::format(
        "  as fast, as far as these rounds can tell: {}\n"
        "  (of these the one that can get the fewest pixels wrong is recommended)\n",
        equals);
  const EndToEndVerdict& e = a.end_to_end;
  text += fmt::format(
      "  not part of the proof: against the picture of the file's own numbers, the rounding of the vertices\n"
      "  included, {} pixels differ ({} beyond what roundings explain), {} are undecidable\n",
      e.wrong(), e.errors, e.ambiguous);
  return text + "  " + a.command() + "\n";
}

std::string nothing_text(const Advice& a) {
  const ModeVerdict* nearest = nearest_to(a.tolerance, a.verdicts);
  if (nearest == nullptr) return "\nno mode of this build promises anything\n";
  return fmt::format(
      "\nno mode keeps this tolerance by its bound; the nearest is {}: {} pixels can be wrong ({} allowed), "
      "depth\n"
      "within {:.2e} world units ({} allowed); found here: {} wrong, {:.2e}\n",
      nearest->mode->name, nearest->predicted, a.tolerance.wrong_pixels, nearest->depth_bound,
      a.tolerance.depth_error ? fmt::format("{:.2e}", *a.tolerance.depth_error) : "any", nearest->found,
      nearest->found_depth_error);
}

Json spread_json(const Spread& s) {
  return {{"least", finite(s.least)},
          {"first_percent", finite(s.first_percent)},
          {"median", finite(s.median)},
          {"largest", finite(s.largest)}};
}

Json scene_json(const SceneFacts& f) {
  const GeometryCounts& c = f.counts;
  Json json;
  json["triangles"] = f.triangles;
  json["drawn"] = c.drawn;
  json["rejected"] = {{"non_finite", c.non_finite},
                      {"zero_area", c.zero_area},
                      {"behind_near", c.behind_near},
                      {"beyond_far", c.beyond_far},
                      {"off_screen", c.off_screen}};
  json["near_clipped"] = c.near_clipped;
  json["guard_clipped"] = c.guard_clipped;
  json["screen_triangles"] = c.pieces;
  json["subpixel"] = f.subpixel;
  json["extent_px"] = {{"x", {finite(f.low_x), finite(f.high_x)}},
                       {"y", {finite(f.low_y), finite(f.high_y)}}};
  json["edge_px"] = spread_json(f.edge_length);
  json["covered_pixels"] = f.covered_pixels;
  json["seen_world"] = {f.nearest, f.farthest};
  json["mean_layers"] = f.mean_layers;
  json["most_layers"] = f.most_layers;
  json["depth_ties"] = f.depth_ties;
  json["depth_gap"] = spread_json(f.depth_gap);
  json["samples_on_edges"] = f.on_edge;
  json["edge_margin_px"] = spread_json(f.edge_margin);
  return json;
}

Json mode_json(const ModeVerdict& v) {
  Json json;
  json["name"] = v.mode->name;
  json["suffices"] = v.standing == Standing::kSuffices;
  json["standing"] = to_string(v.standing);
  json["predicted"] = v.predicted >= 0 ? Json(v.predicted) : Json();
  json["predicted_by_edge"] = v.by_edge;
  json["predicted_by_depth"] = v.by_depth;
  json["depth_bound_world"] = v.predicted >= 0 ? finite(v.depth_bound) : Json();
  json["found"] = v.found >= 0 ? Json(v.found) : Json();
  json["beyond_bound"] = v.beyond_bound;
  json["found_depth_error_world"] = v.found >= 0 ? Json(v.found_depth_error) : Json();
  json["bound"] = v.mode->bound;
  return json;
}

Json candidate_json(const Candidate& c) {
  return {{"kernel", c.kernel},
          {"numeric", c.verdict->mode->name},
          {"execution", to_string(c.execution)},
          {"threads", c.execution.threads}};
}

Json interval_json(const std::optional<std::pair<double, double>>& interval) {
  return interval ? Json{interval->first, interval->second} : Json();
}

Json ranked_json(const Ranked& r) {
  Json json = candidate_json(r.measurement->candidate);
  json["median_ms"] = r.median_ms;
  json["interval_ms"] = interval_json(r.interval_ms);
  json["times_the_fastest"] = interval_json(r.slower_by);
  json["distinguishable"] = r.is_distinguishable;
  json["rounds_ms"] = r.measurement->rounds_ms;
  return json;
}

}  // namespace

std::string Advice::command() const {
  return command_line(chosen().measurement->candidate, model, scene_file, settings);
}

std::string advice_text(const Advice& a, bool explain) {
  std::string text = fmt::format("{} at {}x{}: at most {} wrong pixels", a.model, a.settings.width,
                                 a.settings.height, a.tolerance.wrong_pixels);
  if (a.tolerance.depth_error)
    text += fmt::format(", depth within {:.3g} world units", *a.tolerance.depth_error);
  text += "\n" + scene_text(a);
  if (explain) text += "\ngeometry stage\n" + to_string(explain_needs(a.facts.needs, a.camera));
  text += modes_text(a, explain);
  if (!a.recommendation && a.measurements.all.empty()) return text + nothing_text(a);
  text += measured_text(a, explain);
  return a.recommendation ? text + recommendation_text(a) : text;
}

Json advice_json(const Advice& a) {
  Json json;
  json["model"] = a.model;
  json["parameters"] = a.scene_file.empty() ? Json() : Json(a.scene_file);
  json["size"] = {a.settings.width, a.settings.height};
  json["tolerance"] = {
      {"wrong_pixels", a.tolerance.wrong_pixels},
      {"depth_error_world", a.tolerance.depth_error ? Json(*a.tolerance.depth_error) : Json()}};
  json["scene"] = scene_json(a.facts);
  for (const NeedStatement& s : explain_needs(a.facts.needs, a.camera))
    json["needs"].push_back({{"test", s.test}, {"kept", s.kept}, {"reason", s.reason}});
  for (const ModeVerdict& v : a.verdicts) json["modes"].push_back(mode_json(v));
  json["tried"] = Json::array();
  for (const Measurement& m : a.measurements.all) {
    Json tried = candidate_json(m.candidate);
    tried["conforms"] = m.conforms;
    tried["trial_ms"] = m.conforms ? Json(m.trial_ms) : Json();
    json["tried"].push_back(std::move(tried));
  }
  json["not_tried"] = {{"no_time", a.measurements.no_time}, {"hopeless", a.measurements.hopeless}};
  json["finalists"] = Json::array();
  json["recommendation"] = nullptr;
  json["nearest"] = nullptr;
  if (a.recommendation) {
    for (const Ranked& r : a.recommendation->finalists) json["finalists"].push_back(ranked_json(r));
    Json& recommended = json["recommendation"] = candidate_json(a.chosen().measurement->candidate);
    const ModeVerdict& v = *a.chosen().measurement->candidate.verdict;
    recommended["median_ms"] = a.chosen().median_ms;
    recommended["predicted"] = v.predicted;
    recommended["found"] = v.found;
    recommended["depth_bound_world"] = finite(v.depth_bound);
    recommended["found_depth_error_world"] = v.found_depth_error;
    recommended["end_to_end"] = {{"wrong", a.end_to_end.wrong()},
                                 {"errors", a.end_to_end.errors},
                                 {"ambiguous", a.end_to_end.ambiguous}};
    recommended["command"] = a.command();
  } else if (const ModeVerdict* nearest = nearest_to(a.tolerance, a.verdicts)) {
    json["nearest"] = mode_json(*nearest);
  }
  return json;
}

}  // namespace rasterbench
