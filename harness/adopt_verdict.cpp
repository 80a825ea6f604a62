#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "harness/adopt.h"
#include "reference/accuracy.h"
#include "scene/image.h"

namespace rasterbench {
namespace {

/// So many distinct pictures are judged and kept; a program with a race may draw another one in every run.
constexpr std::size_t kMostPictures = 12;
constexpr std::size_t kFirstPixels = 10;

std::string pixels_text(std::int64_t count) {
  return fmt::format("{} pixel{}", count, count == 1 ? "" : "s");
}
std::string threads_text(int count) { return fmt::format("{} thread{}", count, count == 1 ? "" : "s"); }
std::string runs_text(std::size_t count) { return fmt::format("{} run{}", count, count == 1 ? "" : "s"); }

std::string hex_of(std::uint32_t colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", colour & 0xff, colour >> 8 & 0xff, colour >> 16 & 0xff);
}

Json counts_json(const PictureFindings& findings) {
  Json counts = Json::object();
  for (int i = 0; i < kFindings; ++i) {
    const auto finding = static_cast<PixelFinding>(i);
    counts[words_of(finding).name] = findings.of(finding);
  }
  return counts;
}

/// "12 pixels at an edge, within the rounding of float32; 3 pixels ..." of the findings that `select` takes.
template <class Select>
std::string counted_text(const PictureFindings& findings, Select select) {
  std::string text;
  for (int i = 0; i < kFindings; ++i) {
    const auto finding = static_cast<PixelFinding>(i);
    if (findings.of(finding) == 0 || !select(finding)) continue;
    std::string meaning = words_of(finding).meaning;
    if (meaning.starts_with("WRONG: ")) meaning.erase(0, 7);
    text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", pixels_text(findings.of(finding)), meaning);
  }
  return text;
}

/// What to look for, after the kind of wrong pixel that there is most of.
std::string advice(const PictureFindings& findings, const WholePicture& whole) {
  if (!whole.transformed.empty())
    return fmt::format("The whole picture is {}: with that undone, {} differ.", whole.transformed,
                       pixels_text(whole.differing));
  PixelFinding most = PixelFinding::kHidden;
  for (const PixelFinding finding :
       {PixelFinding::kMissing, PixelFinding::kOutside, PixelFinding::kUnwritten, PixelFinding::kColour})
    if (findings.of(finding) > findings.of(most)) most = finding;
  switch (most) {
    case PixelFinding::kHidden:
      return "Look at the depth test: a triangle that lies behind another one was kept (is the smaller depth "
             "nearer, is "
             "the buffer cleared to the far plane, is d interpolated after the division by -w?).";
    case PixelFinding::kMissing:
      return "Look for triangles or pixels that are left out: boxes that end one pixel early, back faces "
             "that are "
             "culled (the contract draws them, black), triangles that cross the near plane.";
    case PixelFinding::kOutside:
      return "Look at the inside test (all three edge functions must have the same sign; two of them accept "
             "points beyond the third edge) and at where it is asked: at the centre of a pixel, (column + "
             "0.5, "
             "row + 0.5).";
    case PixelFinding::kUnwritten:
      return "Look for pixels that are never written: the picture must be filled with the background first.";
    default:
      return "Look at the shading: n = (AB x AC)/|AB x AC|, s = max(0, -n.L) with L = (-1,-1,-1)/sqrt(3), "
             "and each "
             "channel is trunc(s C) of the object's colour.";
  }
}

}  // namespace

void AdoptVerdict::add(const JudgedRun& run, const std::vector<std::uint32_t>& pixels) {
  runs_.push_back(run);
  runs_.back().result.output.clear();  // what matters of it is in `problem`
  if (run.outcome != "ok") return;
  const bool is_new = !pictures_.contains(run.picture);
  Drawn& drawn = pictures_[run.picture];
  ++drawn.runs;
  if (!is_new) return;
  drawn.number = pictures_.size() - 1;
  drawn.findings = judge_.judge(pixels);
  if (pictures_.size() <= kMostPictures)
    drawn.pixels = pixels;
  else
    drawn.findings.pixels = {};
}

bool AdoptVerdict::is_correct() const {
  return !runs_.empty() &&
         std::all_of(runs_.begin(), runs_.end(), [](const JudgedRun& run) { return run.outcome == "ok"; }) &&
         std::none_of(pictures_.begin(), pictures_.end(),
                      [&](const auto& entry) { return is_wrong(entry.second); });
}

/// Of those that are kept.
const AdoptVerdict::Drawn& AdoptVerdict::worst() const {
  const Drawn* found = nullptr;
  for (const auto& [hash, drawn] : pictures_) {
    if (drawn.pixels.empty()) continue;
    const auto rank = [](const Drawn& d) { return std::pair(d.findings.wrong(), d.findings.differ()); };
    if (found == nullptr || rank(drawn) > rank(*found) ||
        (rank(drawn) == rank(*found) && drawn.number < found->number))
      found = &drawn;
  }
  return *found;
}

std::int64_t AdoptVerdict::unstable_pixels() const {
  std::int64_t unstable = 0;
  const std::size_t size = judge_.truth().size();
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint32_t* first = nullptr;
    bool differs = false;
    for (const auto& [hash, drawn] : pictures_) {
      if (drawn.pixels.empty()) continue;
      differs = differs || (first != nullptr && drawn.pixels[i] != *first);
      if (first == nullptr) first = &drawn.pixels[i];
    }
    unstable += differs;
  }
  return unstable;
}

void AdoptVerdict::add_run_problems(Json& problems) const {
  const std::pair<const char*, const char*> kinds[] = {
      {"hung", "The program did not end"},
      {"crashed", "The program was killed by a signal"},
      {"failed", "The program failed"},
      {"no_picture", "The program wrote no picture"},
      {"bad_picture", "The program's picture cannot be read"}};
  for (const auto& [kind, head] : kinds) {
    std::map<int, std::pair<std::size_t, std::size_t>> by_threads;  // failed, all
    std::string first;
    for (const JudgedRun& run : runs_) {
      auto& [failed, all] = by_threads[run.setting.threads];
      ++all;
      if (run.outcome != kind) continue;
      ++failed;
      if (first.empty()) first = run.problem;
    }
    if (first.empty()) continue;
    std::string where;
    for (const auto& [threads, counts] : by_threads)
      if (counts.first > 0)
        where += fmt::format("{}{} of {} with {}", where.empty() ? "" : ", ", counts.first,
                             runs_text(counts.second), threads_text(threads));
    std::string text = fmt::format("{}: {} ({}).", head, first, where);
    const auto& alone = by_threads[1];
    if (alone.second > 0 && alone.first == 0)
      text += " It never happened with one thread: look for what threads share.";
    problems.push_back({{"kind", kind}, {"text", text}});
  }
}

void AdoptVerdict::add_picture_problems(Json& problems, Json& notes, Json& judgement) const {
  std::map<int, std::set<std::string>> by_threads;
  std::map<int, std::size_t> runs_of;
  std::size_t wrong_runs = 0, pictures_runs = 0, alone_wrong = 0;
  for (const JudgedRun& run : runs_) {
    if (run.outcome != "ok") continue;
    by_threads[run.setting.threads].insert(run.picture);
    ++runs_of[run.setting.threads];
    ++pictures_runs;
    const bool wrong = is_wrong(pictures_.at(run.picture));
    wrong_runs += wrong;
    alone_wrong += wrong && run.setting.threads == 1;
  }
  const Drawn& bad = worst();
  const bool alone_differs = by_threads[1].size() > 1;
  const bool is_stable = pictures_.size() == 1;
  std::string race_threads;
  for (const auto& [threads, hashes] : by_threads)
    if (threads > 1 && hashes.size() > 1)
      race_threads += fmt::format("{}{} different pictures in {} with {}", race_threads.empty() ? "" : ", ",
                                  hashes.size(), runs_text(runs_of[threads]), threads_text(threads));
  judgement["unstable_pixels"] = is_stable ? 0 : unstable_pixels();
  const std::string wrong =
      counted_text(bad.findings, [](PixelFinding f) { return rasterbench::is_wrong(f); });

  if (!is_stable) {
    std::string kind, text;
    if (alone_differs) {
      kind = "not_reproducible";
      text = fmt::format(
          "The picture differs between runs with OMP_NUM_THREADS=1 already ({} pictures in {}): memory "
          "that is read before it is written, a random number, or threads that OpenMP does not count.",
          by_threads[1].size(), runs_text(runs_of[1]));
    } else if (!race_threads.empty()) {
      kind = "race";
      text = fmt::format(
          "The same run gives different pictures: {}; with one thread always the same ({} in all differ). "
          "That "
          "is a data race: two threads read and write the same pixel at the same time, and one of the "
          "two updates is lost.",
          race_threads, pixels_text(judgement["unstable_pixels"].get<std::int64_t>()));
    } else {
      kind = "depends_on_threads";
      text = fmt::format(
          "The picture depends on the number of threads ({} pictures, the same in every run of one "
          "number): look at how the work is divided, and for a race that is seldom seen.",
          pictures_.size());
    }
    if (wrong_runs > 0) {
      if (kind == "race")
        text +=
            " Test and write of the depth must be one step (a critical section, a lock or an atomic minimum "
            "for the "
            "pixel), or each pixel must belong to one thread.";
      text += fmt::format(" {} of {} drew a wrong picture; the worst has {}.", wrong_runs,
                          runs_text(pictures_runs), wrong);
      problems.push_back({{"kind", kind}, {"text", text}});
    } else {
      notes.push_back(
          text +
          " Here all of these pictures are right within rounding (triangles at equal depths), so it "
          "is no error by the contract; but nothing that depends on luck is tested by one run.");
    }
  }
  if (wrong_runs > 0 && (is_stable || alone_wrong > 0))
    problems.push_back({{"kind", "wrong_pixels"},
                        {"text", fmt::format("{} wrong, whatever rounding does. {}. {}",
                                             pixels_text(bad.findings.wrong()) +
                                                 (bad.findings.wrong() == 1 ? " is" : " are"),
                                             wrong, advice(bad.findings, judge_.whole(bad.pixels)))}});
}

Json AdoptVerdict::conclude(const std::filesystem::path& folder, const std::string& prefix) {
  Json judgement, problems = Json::array(), notes = Json::array();
  judgement["correct"] = is_correct();
  add_run_problems(problems);
  std::set<std::string> said;
  for (const JudgedRun& run : runs_)
    if (!run.note.empty() && said.insert(run.note).second) notes.push_back("The program " + run.note + ".");

  Json runs = Json::array();
  for (const JudgedRun& run : runs_) {
    Json entry{{"threads", run.setting.threads},
               {"schedule", run.setting.schedule.empty() ? Json() : Json(run.setting.schedule)},
               {"outcome", run.outcome},
               {"problem", run.problem.empty() ? Json() : Json(run.problem)},
               {"picture", run.picture.empty() ? Json() : Json(pictures_.at(run.picture).number)},
               {"seconds", run.result.seconds},
               {"most_threads", run.result.most_threads}};
    runs.push_back(std::move(entry));
  }

  std::int64_t memory = 0;
  for (const JudgedRun& run : runs_) memory = std::max(memory, run.result.max_rss_bytes);
  judgement["max_rss_bytes"] = memory;
  judgement["nearest"] = Json::array();
  judgement["unstable_pixels"] = 0;
  judgement["pictures"] = Json::array();
  judgement["first_pixels"] = Json::array();
  judgement["box"] = Json();
  judgement["difference"] = judgement["picture"] = Json();
  if (!pictures_.empty()) {
    add_picture_problems(problems, notes, judgement);
    std::vector<const Drawn*> ordered(pictures_.size());
    for (const auto& [hash, drawn] : pictures_) ordered[drawn.number] = &drawn;
    for (const Drawn* drawn : ordered)
      judgement["pictures"].push_back({{"runs", drawn->runs},
                                       {"differ", drawn->findings.differ()},
                                       {"wrong", drawn->findings.wrong()},
                                       {"pixels", counts_json(drawn->findings)}});
    const Drawn& shown = worst();
    for (const NearestMode& mode : judge_.nearest(ordered.front()->pixels))
      judgement["nearest"].push_back({{"numeric", mode.numeric},
                                      {"fill", mode.fill == FillRule::kClosed ? "closed" : "top-left"},
                                      {"differing", mode.differing}});
    if (shown.findings.of(PixelFinding::kFillRule) > 0)
      notes.push_back(fmt::format(
          "{} exactly on an edge follow the other fill rule than {}: a neighbour is drawn where "
          "both triangles claim the sample. {}",
          pixels_text(shown.findings.of(PixelFinding::kFillRule)), options_.fill,
          options_.fill == "closed" ? "By the contract the boundary belongs to a triangle (>= 0, not > 0)."
                                    : "By top-left a sample on an edge belongs to one of the two."));

    std::int64_t holes = 0;
    for (std::size_t i = 0; i < shown.pixels.size(); ++i)
      holes += shown.findings.pixels[i] == PixelFinding::kEdge64 && judge_.owners()[i] >= 0 &&
               shown.pixels[i] == judge_.background();
    if (holes > 0)
      notes.push_back(
          fmt::format("{} exactly on edges between triangles show the background: an inside test that leaves "
                      "out the boundary (> 0) tears neighbours apart; by the contract it is >= 0.",
                      pixels_text(holes)));

    // Where: the wrong ones, or, where there is none, those that rounding explains.
    const bool only_wrong = shown.findings.wrong() > 0;
    int x0 = width_, y0 = height_, x1 = -1, y1 = -1;
    for (std::size_t i = 0; i < shown.pixels.size(); ++i) {
      const PixelFinding finding = shown.findings.pixels[i];
      if (finding == PixelFinding::kSame || finding == PixelFinding::kAmbiguous ||
          (only_wrong && !rasterbench::is_wrong(finding)))
        continue;
      const int x = static_cast<int>(i % static_cast<std::size_t>(width_));
      const int y = static_cast<int>(i / static_cast<std::size_t>(width_));
      x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
      if (judgement["first_pixels"].size() < kFirstPixels)
        judgement["first_pixels"].push_back({{"x", x},
                                             {"y", y},
                                             {"drawn", hex_of(shown.pixels[i])},
                                             {"true", hex_of(judge_.truth()[i])},
                                             {"triangle", judge_.owners()[i]},
                                             {"finding", words_of(finding).name}});
    }
    if (x1 >= 0) {
      judgement["box"] = {x0, y0, x1 + 1, y1 + 1};
      Accuracy classes{.pixels = static_cast<std::int64_t>(shown.pixels.size())};
      for (const PixelFinding finding : shown.findings.pixels) {
        PixelClass kind = PixelClass::kSame;
        if (finding == PixelFinding::kLiteral) kind = PixelClass::kUnbounded;
        if (finding == PixelFinding::kEdge64 || finding == PixelFinding::kEdge32 ||
            finding == PixelFinding::kFillRule)
          kind = PixelClass::kEdge;
        if (finding == PixelFinding::kDepth64 || finding == PixelFinding::kDepth32) kind = PixelClass::kDepth;
        if (rasterbench::is_wrong(finding)) kind = PixelClass::kUnexplained;
        classes.classes.push_back(kind);
        classes.edge += kind == PixelClass::kEdge;
        classes.depth += kind == PixelClass::kDepth;
        classes.unbounded += kind == PixelClass::kUnbounded;
        classes.unexplained += kind == PixelClass::kUnexplained;
        classes.wrong += kind != PixelClass::kSame;
      }
      const DifferenceImage image = difference_image(classes, judge_.truth(), width_, height_);
      write_image(folder / (prefix + "difference.png"), image.pixels, image.width, image.height);
      write_image(folder / (prefix + "picture.png"), shown.pixels, width_, height_);
      judgement["difference"] = prefix + "difference.png";
      judgement["picture"] = prefix + "picture.png";
    }
  }
  judgement["problems"] = std::move(problems);
  judgement["notes"] = std::move(notes);
  judgement["runs"] = std::move(runs);
  return judgement;
}

}  // namespace rasterbench
