// Scenes that must give the same picture, and executions that must give the same bits.
#include <fmt/format.h>

#include <algorithm>

#include "extremes/judge_case.h"
#include "kernels/kernel.h"
#include "pipeline/resolve.h"

namespace rasterbench::extremes {
namespace {

Picture draw(const DrawnCase& drawn, const JudgedScene& what) {
  const auto renderer = make_renderer(drawn.kernel, drawn.mode.name, {&what.scene, what.settings, {}});
  renderer->draw();
  return picture_of(*renderer, what.settings);
}

/// Where a change takes a pixel, or -1 where it leaves the image.
std::int64_t moved_pixel(const Change& change, int x, int y, int width, int height) {
  if (change.name == "mirrored") x = width - 1 - x;
  if (change.name == "shifted") {
    x += static_cast<int>(change.x);
    y += static_cast<int>(change.y);
  }
  return x >= 0 && x < width && y >= 0 && y < height ? std::int64_t{y} * width + x : -1;
}

/// Per pixel whether the mode's bound leaves it open; in an exact mode none.
std::vector<std::uint8_t> open_pixels(JudgedScene& what, const ModeInfo& mode) {
  if (!mode.has_screen_triangles || !mode.numbers.bounded) return {};
  return what.judge.prediction(mode).reasons;
}

/// Mirrored or shifted corners are rounded in other places: pixels may differ where the bound of either
/// picture leaves them open.
Finding judge_moved(const DrawnCase& drawn, const Picture& before, const Picture& after) {
  Finding finding;
  const Change& change = *drawn.one.must.same_as;
  const auto open_before = open_pixels(drawn.base, drawn.mode);
  const auto open_after = open_pixels(*drawn.changed, drawn.mode);
  std::int64_t ties = 0, errors = 0, first_error = -1;
  for (int y = 0; y < before.height; ++y)
    for (int x = 0; x < before.width; ++x) {
      const std::int64_t from = std::int64_t{y} * before.width + x;
      const std::int64_t to = moved_pixel(change, x, y, before.width, before.height);
      const auto f = static_cast<std::size_t>(from), t = static_cast<std::size_t>(to);
      if (to < 0 || before.ids[f] == after.ids[t]) continue;
      const bool open = !open_before.empty() && (open_before[f] != 0 || open_after[t] != 0);
      ++(open ? ties : errors);
      if (!open && first_error < 0) first_error = from;
    }
  if (ties > 0) finding.worsen(Verdict::kWithinBound, {});
  if (errors > 0)
    finding.worsen(wrong_in(drawn.mode), fmt::format("{} pixels differ when {}, {} first", errors,
                                                     change.name, pixel_name(first_error, before.width)));
  return finding;
}

/// The same depths and ids to the bit. Colours: the same, but of a triangle and its reverse at most one is
/// lit.
Finding judge_unmoved(const DrawnCase& drawn, const Picture& before, const Picture& after) {
  Finding finding;
  const std::string& change = drawn.one.must.same_as->name;
  const std::uint32_t black = pack_rgba({0, 0, 0});
  std::int64_t differing = 0, lit_twice = 0, first = -1;
  for (std::size_t i = 0; i < before.ids.size(); ++i) {
    const bool colours_agree = change == "reversed" || before.colours[i] == after.colours[i];
    const bool same = before.ids[i] == after.ids[i] && before.values[i] == after.values[i] && colours_agree;
    differing += !same;
    if (!same && first < 0) first = static_cast<std::int64_t>(i);
    lit_twice +=
        change == "reversed" && before.ids[i] >= 0 && before.colours[i] != black && after.colours[i] != black;
  }
  if (lit_twice > 0)
    finding.worsen(Verdict::kWrong,
                   fmt::format("{} pixels of a triangle and of its reverse are both lit", lit_twice));
  if (differing > 0)
    finding.worsen(
        wrong_in(drawn.mode),
        fmt::format("{} pixels differ when {}, {} first: triangle {} at {:.9g}, then {} at {:.9g}", differing,
                    change, pixel_name(first, before.width), before.ids[static_cast<std::size_t>(first)],
                    before.values[static_cast<std::size_t>(first)],
                    after.ids[static_cast<std::size_t>(first)],
                    after.values[static_cast<std::size_t>(first)]));
  return finding;
}

}  // namespace

Finding judge_change(const DrawnCase& drawn, const Picture& picture) {
  const Picture after = draw(drawn, *drawn.changed);
  const std::string& change = drawn.one.must.same_as->name;
  return change == "mirrored" || change == "shifted" ? judge_moved(drawn, picture, after)
                                                     : judge_unmoved(drawn, picture, after);
}

Finding judge_executions(const DrawnCase& drawn, const Picture& specification) {
  Finding finding;
  const auto check = [&](RendererSetup setup, std::string_view how) {
    setup.scene = &drawn.base.scene;
    const auto renderer = make_renderer(drawn.kernel, drawn.mode.name, setup);
    for (int frame = 0; frame < 2; ++frame) renderer->draw();  // the second meets what the first left behind
    const auto differing = differing_pixels(picture_of(*renderer, setup.settings), specification);
    if (differing > 0)
      finding.worsen(Verdict::kWrong, fmt::format("{} pixels differ with {}", differing, how));
  };
  const RendererSetup plain{nullptr, drawn.base.settings, {}};
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    RendererSetup setup = plain;
    setup.permutation_seed = seed;
    check(setup, "the screen triangles permuted");
  }
  for (const int threads : {1, 2, 5}) {  // more than the machine may have, too
    RendererSetup setup = plain;
    setup.execution = {.backend = "openmp", .schedule = "dynamic", .chunk = {}, .threads = threads};
    check(setup, fmt::format("{} threads", threads));
  }
  for (const int tile : {1, 5, 32, kMaxImageSide}) {
    RendererSetup setup = plain;
    setup.settings.tile = tile;
    check(setup, fmt::format("tiles of {} pixels", tile));
  }
  for (const Isa isa : all_isas()) {
    if (!is_supported(isa)) continue;
    RendererSetup setup = plain;
    setup.settings.geometry.isa = isa;
    check(setup, to_string(isa));
  }
  for (const TechniqueInfo& technique : technique_infos()) {
    RendererSetup setup = plain;
    setup.settings.techniques.*technique.switched = false;
    check(setup, "techniques " + to_string(setup.settings.techniques));
  }
  for (const Schedule& schedule : schedules()) {
    RendererSetup setup = plain;
    setup.execution = {.backend = schedule.backend,
                       .schedule = schedule.name,
                       .chunk = {},
                       .threads = schedule.backend == "serial" ? 1 : 2};
    check(setup, to_string(setup.execution));
    if (schedule.chunk.empty()) continue;
    setup.execution.chunk = 3;
    check(setup, to_string(setup.execution));
  }
  return finding;
}

std::int64_t enclosed_background(const Picture& picture) {
  const auto width = static_cast<std::int64_t>(picture.width),
             height = static_cast<std::int64_t>(picture.height);
  std::vector<bool> reached(picture.ids.size());
  std::vector<std::int64_t> open;
  const auto reach = [&](std::int64_t x, std::int64_t y) {
    if (x < 0 || x >= width || y < 0 || y >= height) return;
    const auto i = static_cast<std::size_t>(y * width + x);
    if (reached[i] || picture.ids[i] >= 0) return;
    reached[i] = true;
    open.push_back(y * width + x);
  };
  for (std::int64_t x = 0; x < width; ++x)
    for (const std::int64_t y : {std::int64_t{0}, height - 1}) reach(x, y);
  for (std::int64_t y = 0; y < height; ++y)
    for (const std::int64_t x : {std::int64_t{0}, width - 1}) reach(x, y);
  while (!open.empty()) {
    const std::int64_t x = open.back() % width, y = open.back() / width;
    open.pop_back();
    reach(x - 1, y);
    reach(x + 1, y);
    reach(x, y - 1);
    reach(x, y + 1);
  }
  std::int64_t enclosed = 0;
  for (std::size_t i = 0; i < picture.ids.size(); ++i) enclosed += picture.ids[i] < 0 && !reached[i];
  return enclosed;
}

}  // namespace rasterbench::extremes
