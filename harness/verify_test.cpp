#include "harness/verify.h"

#include <gtest/gtest.h>

#include "harness/verdict_json.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

Json judge(const std::string& kernel, const std::string& mode = "f32") {
  const Scene scene = generate("teapot:triangles=2000");
  Point point;
  point.scene.name = "teapot";
  point.width = 64;
  point.height = 36;
  point.kernel = kernel;
  point.numeric = mode;
  return Verifier().judge(point, scene);
}

TEST(Verifier, PassesAKernelThatConforms) {
  const Json answer = judge("scanline", "fixed_8");
  EXPECT_TRUE(answer.at("failure").is_null()) << answer.dump();
  EXPECT_TRUE(answer.at("verify").at("conforms").get<bool>());
  EXPECT_TRUE(answer.at("verify").at("oracle").at("within_bound").get<bool>());
  EXPECT_GT(answer.at("work").at("fragments_tested"), answer.at("work").at("fragments_covered"));
  EXPECT_GE(answer.at("work").at("fragments_covered"), answer.at("work").at("covered_pixels"));
  EXPECT_EQ(answer.at("picture"), judge("tile_parallel", "fixed_8").at("picture"));
}

TEST(Verifier, FailsTheCanaries) {
  for (const char* canary : {"null", "stale"}) {
    const Json answer = judge(canary);
    EXPECT_FALSE(answer.at("verify").at("conforms").get<bool>()) << canary;
    EXPECT_NE(answer.at("failure").get<std::string>().find("pixels differ from the specification"),
              std::string::npos);
  }
}

/// What is said of a peer that has drawn `spoilt(picture)`; the picture is that of a mode that is well within
/// a peer's bound.
template <class Spoil>
Json judged_peer(Spoil spoil) {
  const Scene scene = generate("teapot:triangles=2000");
  const FrameSettings settings{.width = 64, .height = 36, .fill = FillRule::kTopLeft};
  Picture picture = render_specification(scene, "fixed_8", settings);
  spoil(picture);
  Judge judge(scene, settings, 1);
  return judge_peer_picture(judge, picture);
}

TEST(Verifier, PassesAPeerWithinItsBound) {
  const Json verdict = judged_peer([](Picture&) {});
  EXPECT_TRUE(verdict.at("failure").is_null()) << verdict.dump();
  EXPECT_EQ(verdict.at("end_to_end").at("errors"), 0);
  EXPECT_GT(verdict.at("end_to_end").at("identical"), 64 * 36 * 9 / 10);
  EXPECT_TRUE(verdict.at("oracle").is_null());
  EXPECT_TRUE(verdict.at("bound").at("bounded").get<bool>());
}

TEST(Verifier, FailsAPeerBeyondIt) {
  const auto failure = [](auto spoil) {
    return judged_peer(spoil).at("failure").template get<std::string>();
  };
  const std::size_t middle = 18 * 64 + 32;
  EXPECT_NE(
      failure([&](Picture& p) { p.ids[middle] = -1; }).find("1 pixels differ from the end-to-end truth"),
      std::string::npos);
  EXPECT_NE(failure([&](Picture& p) { p.depths[middle] += 0x1p-8f; }).find("at x=32 y=18"),
            std::string::npos);
  EXPECT_NE(failure([&](Picture& p) { p.ids[middle] = 1 << 20; }).find("end-to-end truth"),
            std::string::npos);
  EXPECT_NE(failure([&](Picture& p) { p.colours[middle] ^= 1; }).find("another colour than their triangle"),
            std::string::npos);
}

}  // namespace
}  // namespace rasterbench
