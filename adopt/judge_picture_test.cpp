// Pictures whose every pixel is known by hand, spoiled in known ways.
#include "adopt/judge_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pipeline/resolve.h"
#include "reference/specification.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

constexpr int kSide = 8;
constexpr std::uint32_t kBackground = 0xff281c14u;

/// A camera on the Z axis that sees 8 x 8 world units at z = 0, one to a pixel: x_px = 4 + x, y_px = 4 - y
/// there. A large triangle, tilted, over the lower left half, and before it a small one, tilted otherwise.
Scene two_layers() {
  Scene scene;
  scene.parameters.object = {200, 150, 100};
  scene.parameters.background = {0x14, 0x1c, 0x28};
  scene.parameters.camera = {0, 0, 16};
  scene.parameters.theta = 2 * std::atan(0.25);
  scene.parameters.near_plane = 8;
  scene.parameters.far_plane = 24;
  scene.parameters.width = scene.parameters.height = kSide;
  scene.model.triangles = {{{-3.75f, -3.75f, 0}, {3.6f, -3.75f, 0}, {-3.75f, 3.6f, 0}},
                           {{-2.25f, -2.25f, 1}, {-0.25f, -2.25f, 1}, {-2.25f, -0.25f, 1.5f}}};
  return scene;
}

FrameSettings square(int side = kSide) {
  FrameSettings settings;
  settings.width = settings.height = side;
  return settings;
}

struct Judged {
  Scene scene = two_layers();
  PictureJudge judge{scene, square(), 2};
  std::vector<std::uint32_t> colours = judge.truth();

  std::size_t first_of(std::int32_t id) const {
    const auto& owners = judge.owners();
    return static_cast<std::size_t>(std::find(owners.begin(), owners.end(), id) - owners.begin());
  }
  /// What a picture is found to be whose pixel `i` has this colour.
  PixelFinding with(std::size_t i, std::uint32_t colour) {
    colours[i] = colour;
    const PictureFindings findings = judge.judge(colours);
    EXPECT_EQ(findings.of(PixelFinding::kSame), kSide * kSide - 1);
    EXPECT_EQ(findings.differ(), 1);
    EXPECT_EQ(findings.wrong(), is_wrong(findings.pixels[i]) ? 1 : 0);
    return findings.pixels[i];
  }
};

TEST(JudgePicture, TruthIsTheSame) {
  Judged j;
  const PictureFindings findings = j.judge.judge(j.colours);
  EXPECT_EQ(findings.of(PixelFinding::kSame), kSide * kSide);
  EXPECT_EQ(findings.wrong(), 0);
  EXPECT_EQ(j.judge.nearest(j.colours).front().differing, 0);
  ASSERT_LT(j.first_of(1), j.colours.size());
}

TEST(JudgePicture, EachKindOfWrongPixel) {
  const std::uint32_t behind = [] {
    const Judged j;
    return j.colours[j.first_of(0)];
  }();
  const Judged known;
  const std::uint32_t before = known.colours[known.first_of(1)];
  ASSERT_NE(behind, before);
  EXPECT_EQ(Judged().with(known.first_of(1), behind), PixelFinding::kHidden);
  EXPECT_EQ(Judged().with(known.first_of(1), kBackground), PixelFinding::kMissing);
  EXPECT_EQ(Judged().with(known.first_of(0), 0xff000000u), PixelFinding::kUnwritten);
  EXPECT_EQ(Judged().with(known.first_of(0), 0xff00ff00u), PixelFinding::kColour);
  EXPECT_EQ(Judged().with(known.first_of(1) + 2, before), PixelFinding::kOutside);
  EXPECT_EQ(Judged().with(known.first_of(0), behind + 0x010001u), PixelFinding::kShade);
}

TEST(JudgePicture, SamplesOnAnEdgeFollowAFillRule) {
  Scene scene = two_layers();
  // Its left edge, and its upper one, run through samples; top-left owns both, so the right and the lower one
  // do not.
  scene.model.triangles = {{{-2.5f, 2.5f, 0}, {-2.5f, -2.5f, 0}, {2.5f, 2.5f, 0}}};
  PictureJudge closed(scene, square(), 1);
  FrameSettings top_left = square();
  top_left.fill = FillRule::kTopLeft;
  const PictureFindings findings = closed.judge(render_specification(scene, "f64", top_left).colours);
  EXPECT_GT(findings.of(PixelFinding::kFillRule), 3);  // the diagonal
  EXPECT_EQ(findings.of(PixelFinding::kFillRule), findings.differ());
  EXPECT_EQ(findings.wrong(), 0);
}

TEST(JudgePicture, ModesAreWithinTheirRounding) {
  const Scene scene = generate("terrain:triangles=20000,seed=3");
  PictureJudge judge(scene, square(256), 2);
  for (const char* mode : {"f32", "f64", "f32_plane", "two_product"}) {
    const std::vector<std::uint32_t> colours = render_specification(scene, mode, square(256)).colours;
    EXPECT_EQ(judge.judge(colours).wrong(), 0) << mode;
    EXPECT_EQ(judge.nearest(colours).front().differing, 0) << mode;
  }
  // Snapped to 1/16 px: farther than any rounding of float32.
  EXPECT_GT(judge.judge(render_specification(scene, "fixed_4", square(256)).colours).wrong(), 0);
}

TEST(JudgePicture, SimpleMistakesOfTheWholePicture) {
  Judged j;
  std::vector<std::uint32_t> flipped;
  for (int y = kSide - 1; y >= 0; --y)
    flipped.insert(flipped.end(), j.colours.begin() + y * kSide, j.colours.begin() + (y + 1) * kSide);
  EXPECT_EQ(j.judge.whole(flipped).transformed, "upside down");
  EXPECT_EQ(j.judge.whole(flipped).differing, 0);
  EXPECT_EQ(j.judge.whole(j.colours).transformed, "");
}

TEST(JudgePicture, LargeDifferencesAreSampled) {
  const Scene scene = two_layers();
  PictureJudge judge(scene, square(256), 2);
  const std::vector<std::uint32_t> green(judge.truth().size(), 0xff00ff00u);
  const PictureFindings findings = judge.judge(green);
  EXPECT_EQ(findings.wrong(), 256 * 256);
  EXPECT_LE(findings.of(PixelFinding::kColour), kMostExamined);
  EXPECT_GT(findings.of(PixelFinding::kColour), kMostExamined / 2);
}

}  // namespace
}  // namespace rasterbench
