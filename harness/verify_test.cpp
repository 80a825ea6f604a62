#include "harness/verify.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace rasterbench
