// Relations of whole frames: every kernel draws the bits of the specification (Invariant 0), and what a
// change of the world must not change.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <utility>

#include "fuzz/pictures.h"
#include "kernels/kernel.h"
#include "reference/specification.h"
#include "scene/generator.h"

namespace rasterbench::fuzz {
namespace {

Picture drawn(const FuzzCase& fuzz_case, const Subject& subject) {
  return render_specification(scene_of(fuzz_case), subject.info.name, settings_of(fuzz_case));
}

/// The first pixel where ids or depths differ, and in words; colours, if they are `compared`.
std::string difference(const Picture& a, const Picture& b, bool colours) {
  for (std::size_t i = 0; i < a.ids.size(); ++i) {
    const auto width = static_cast<std::size_t>(a.width);
    const std::string pixel = fmt::format("pixel ({}, {})", i % width, i / width);
    if (a.ids[i] != b.ids[i]) return fmt::format("{} is owned by {} and by {}", pixel, a.ids[i], b.ids[i]);
    if (std::bit_cast<std::uint32_t>(a.depths[i]) != std::bit_cast<std::uint32_t>(b.depths[i]))
      return fmt::format("{} is of depth {:a} and {:a}", pixel, a.depths[i], b.depths[i]);
    if (colours && a.colours[i] != b.colours[i])
      return fmt::format("{} has colour {:08x} and {:08x}", pixel, a.colours[i], b.colours[i]);
  }
  return {};
}

/// Any backend, schedule, chunk and number of threads.
ExecutionConfig any_execution(Random& random) {
  const auto all = schedules();
  const Schedule& schedule = all[random.bits() % all.size()];
  ExecutionConfig execution{schedule.backend, schedule.name, {}, 1};
  const std::uint64_t choices = random.bits();
  if (schedule.backend != "serial") execution.threads = 1 + static_cast<int>(choices % 3);
  if (!schedule.chunk.empty() && choices >> 8 & 1)
    execution.chunk = 1 + static_cast<int>((choices >> 16) % 9);
  return execution;
}

/// One that this CPU has.
Isa any_isa(Random& random) {
  const Isa isa = all_isas()[random.bits() % all_isas().size()];
  return is_supported(isa) ? isa : Isa::kBaseline;
}

Verdict kernel_relation(const FuzzCase& fuzz_case, const Subject& subject,
                        std::span<const std::string> kernels) {
  const Scene scene = scene_of(fuzz_case);
  FrameSettings settings = settings_of(fuzz_case);
  Random random(fuzz_case.seed);
  settings.tie = random.bits() % 4 == 0 ? TieRule::kLast : TieRule::kFirst;
  const Picture expected = render_specification(scene, subject.info.name, settings);
  Verdict verdict = kNotApplicable;
  constexpr std::size_t kFew = 3;  // of many, a third is asked: more cases find more than more kernels
  for (const std::string& kernel : kernels) {
    if (kernels.size() > kFew && random.bits() % 3 != 0) continue;
    const ExecutionConfig execution = any_execution(random);
    constexpr int kTiles[] = {64, 8, 1, 13, 1000};
    settings.tile = kTiles[random.bits() % std::size(kTiles)];
    const std::uint64_t choice = random.bits(), permutation = choice % 2 == 0 ? 0 : choice;
    settings.generality = random.bits() % 4 == 0 ? Generality::kFull : Generality::kMinimal;
    settings.geometry.isa = any_isa(random);
    if (!find_kernel(kernel).variant(subject.info.name).make) continue;
    verdict = kHolds;
    const auto renderer =
        make_renderer(kernel, subject.info.name, {&scene, settings, execution, permutation});
    // The second frame meets what the first left in the kernel's memory.
    for (int frame = 0; frame < 2; ++frame) {
      renderer->draw();
      const std::string differs = difference(expected, picture_of(*renderer, settings), true);
      if (!differs.empty())
        return judged(
            fmt::format("{}, {} on {} thread(s), tile {}, {}, {}, frame {}: {}", kernel, to_string(execution),
                        execution.threads, settings.tile, to_string(settings.geometry.isa),
                        permutation ? "permuted" : "in order", frame, differs),
            true);
    }
  }
  return verdict;
}

/// Clipped triangles too: a triangle has the same pieces however it is given. Colours turn with the winding.
Verdict turn_world(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  FuzzCase turned = fuzz_case;
  Random random(fuzz_case.seed);
  for (Triangle& t : turned.triangles) {
    const std::uint64_t choice = random.bits();
    if (choice & 1) t = {t.b, t.c, t.a};
    if (choice & 2) t = {t.c, t.a, t.b};
    if (choice & 4) std::swap(t.b, t.c);
  }
  return judged(difference(drawn(fuzz_case, subject), drawn(turned, subject), false),
                subject.info.numbers.bounded);
}

/// World and camera enlarged by a power of two: no significand changes, not even a denormal's. Not applied
/// where a coordinate would overflow.
Verdict scale(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  constexpr std::uint64_t kLargest = 12;
  const int exponent = 1 + static_cast<int>(Random(fuzz_case.seed).bits() % kLargest);
  FuzzCase scaled = fuzz_case;
  for (Triangle& t : scaled.triangles)
    for (Vec3* p : {&t.a, &t.b, &t.c})
      for (float* v : {&p->x, &p->y, &p->z}) {
        if (std::isfinite(*v) && !std::isfinite(std::ldexp(*v, exponent))) return kNotApplicable;
        *v = std::ldexp(*v, exponent);
      }
  SceneParameters& p = scaled.parameters;
  for (double* v : {&p.camera.x, &p.camera.y, &p.camera.z, &p.near_plane, &p.far_plane})
    *v = std::ldexp(*v, exponent);
  return judged(difference(drawn(fuzz_case, subject), drawn(scaled, subject), true), true);
}

/// The list of triangles back to front, and the tie rule too: the same winners, ties included.
Verdict reverse(const FuzzCase& fuzz_case, const Subject& subject, std::span<const std::string>) {
  FuzzCase reversed = fuzz_case;
  std::reverse(reversed.triangles.begin(), reversed.triangles.end());
  FrameSettings settings = settings_of(reversed);
  settings.tie = TieRule::kLast;
  Picture picture = render_specification(scene_of(reversed), subject.info.name, settings);
  const auto last = static_cast<std::int32_t>(fuzz_case.triangles.size()) - 1;
  for (std::int32_t& id : picture.ids)
    if (id >= 0) id = last - id;
  return judged(difference(drawn(fuzz_case, subject), picture, true), true);
}

constexpr Relation kRelations[] = {
    {"kernels", "every kernel, execution, tile size and order draws the bits of the specification",
     Space::kWorld, kernel_relation},
    {"turn_world", "the order and winding of a world triangle's corners change neither ids nor depths",
     Space::kWorld, turn_world},
    {"scale", "world and camera scaled by a power of two: the same picture", Space::kWorld, scale},
    {"reverse", "triangles in reverse, and the last to win ties: the same owners", Space::kWorld, reverse},
};

}  // namespace

std::span<const Relation> frame_relations() { return kRelations; }

}  // namespace rasterbench::fuzz
