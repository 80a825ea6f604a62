// The list of modes and what it says of each.
#include "numeric/modes.h"

#include <gtest/gtest.h>

#include <array>
#include <set>
#include <string>
#include <vector>
#if defined(__x86_64__)
#include <cpuid.h>
#endif

#include "base/error.h"

namespace rasterbench {
namespace {

TEST(Modes, AreFoundByName) {
  std::vector<std::string_view> names;
  for (const ModeInfo& info : mode_infos()) names.push_back(info.name);
  EXPECT_EQ(names, (std::vector<std::string_view>{"f32",
                                                  "f32_plane",
                                                  "f32_incremental",
                                                  "two_product",
                                                  "f64",
                                                  "fixed_4",
                                                  "fixed_8",
                                                  "fixed_12",
                                                  "filtered",
                                                  "exact",
                                                  "filtered-f64",
                                                  "filtered-f64r",
                                                  "filtered-unorm16",
                                                  "filtered-unorm24",
                                                  "filtered-unorm32",
                                                  "filtered-reversed_f32",
                                                  "filtered-inverse_w",
                                                  "fixed_8-unorm24",
                                                  "f32-rcp",
                                                  "f32-rcp_newton",
                                                  "f32-fma",
                                                  "f32_plane-fma",
                                                  "two_product-fma",
                                                  "f32-fastmath",
                                                  "two_product-fastmath",
                                                  "ray_cast"}));
  for (const ModeInfo& info : mode_infos()) EXPECT_EQ(find_mode(info.name), &info);
  EXPECT_EQ(find_mode("f3"), nullptr);
  EXPECT_EQ(find_mode(""), nullptr);
}

TEST(Modes, OnlyThoseWithAWordAsKeyAreForAtomics) {
  std::set<std::string_view> without;
  for_each_mode([&]<NumericMode Mode>() {
    if (!PackedKeyMode<Mode>) without.insert(Mode::kInfo.name);
  });
  EXPECT_EQ(without, (std::set<std::string_view>{"f64", "exact", "filtered-f64"}));
}

TEST(Modes, OnlyMonotoneOnesAreForScanlines) {
  std::set<std::string_view> not_monotone;
  for_each_mode([&]<NumericMode Mode>() {
    if (!MonotoneMode<Mode>) not_monotone.insert(Mode::kInfo.name);
  });
  EXPECT_EQ(not_monotone,
            (std::set<std::string_view>{"f32_incremental", "two_product", "f32-fma", "f32_plane-fma",
                                        "two_product-fma", "f32-fastmath", "two_product-fastmath"}));
}

TEST(Modes, StateWhatTheyPromise) {
  for_each_mode([]<NumericMode Mode>() {
    const ModeInfo& info = Mode::kInfo;
    SCOPED_TRACE(info.name);
    for (const auto text : {info.vertices, info.edges, info.depth, info.bound, info.bound_source})
      EXPECT_FALSE(text.empty());
    EXPECT_EQ(info.depth_function, Mode::kDepthFunction);
    EXPECT_EQ(info.numbers.vertex_unit, (std::is_same_v<typename Mode::Real, float> ? 0x1p-24 : 0x1p-53));
    EXPECT_EQ(info.numbers.bounded, info.bound != "unbounded");
    EXPECT_EQ(info.numbers.edge_unit == 0, info.numbers.edge_form == EdgeForm::kExact);
    EXPECT_EQ(info.numbers.depth_step > 0, info.name.find("unorm") != std::string_view::npos);
    EXPECT_EQ(info.numbers.exact_winner, info.name == "exact");
    // What the CPU approximates, or the compiler rearranges, is not the same everywhere.
    const bool approximates = info.name.find("rcp") != std::string_view::npos ||
                              info.name.find("fastmath") != std::string_view::npos;
    EXPECT_EQ(info.same_on_every_cpu, !approximates);
  });
}

TEST(Modes, AnUnknownOneIsAnErrorWithASuggestion) {
  const auto message = [](std::string_view name) -> std::string {
    try {
      available_mode(name, "numeric");
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(message("filterd"), "numeric: unknown numeric mode 'filterd'; did you mean 'filtered'?");
  EXPECT_EQ(message("filtered"), "no error");
  // One that this CPU cannot run says why.
  for (const ModeInfo& info : mode_infos()) {
    if (info.unavailable.empty()) continue;
    EXPECT_EQ(message(info.name),
              "numeric: " + std::string(info.name) + ": " + std::string(info.unavailable));
  }
}

#if defined(__x86_64__)
TEST(Modes, WithFusedMultiplyAddsNeedACpuThatHasThem) {
  unsigned eax = 0, ebx = 0, ecx = 0, edx = 0;
  ASSERT_TRUE(__get_cpuid(1, &eax, &ebx, &ecx, &edx));
  const bool has_fma = (ecx & bit_FMA) != 0 && (ecx & bit_OSXSAVE) != 0;
  for (const std::string_view name : {"f32-fma", "f32_plane-fma", "two_product-fma"})
    EXPECT_EQ(find_mode(name)->unavailable, has_fma ? "" : "this CPU has no fused multiply-add") << name;
  EXPECT_EQ(find_mode("f32")->unavailable, "");
}
#endif

TEST(PixelBoxes, Intersect) {
  const PixelBox a{0, 0, 10, 8}, b{5, -3, 20, 4};
  const PixelBox both = intersect(a, b);
  EXPECT_EQ((std::array{both.x0, both.y0, both.x1, both.y1}), (std::array{5, 0, 10, 4}));
  EXPECT_FALSE(both.empty());
  EXPECT_TRUE(both.contains(5, 0));
  EXPECT_TRUE(both.contains(9, 3));
  EXPECT_FALSE(both.contains(10, 3));
  EXPECT_FALSE(both.contains(9, 4));
  EXPECT_TRUE(intersect(a, {10, 0, 12, 8}).empty());
  EXPECT_TRUE(PixelBox{}.empty());
}

}  // namespace
}  // namespace rasterbench
