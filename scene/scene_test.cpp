#include "scene/scene.h"

#include <gtest/gtest.h>

#include "scene/dat.h"
#include "scene/test_folder.h"

namespace rasterbench {
namespace {

/// Runs a test inside a folder of its own, so that bare names are looked up there.
class OpenScene : public testing::Test {
 protected:
  OpenScene() : old_(std::filesystem::current_path()) { std::filesystem::current_path(folder_ / ""); }
  ~OpenScene() override { std::filesystem::current_path(old_); }

  void write_one_triangle(const std::string& name) {
    write_dat({.name = {}, .triangles = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}}, folder_ / name);
  }

  TestFolder folder_;

 private:
  std::filesystem::path old_;
};

std::string open_error(const std::string& model, const std::string& scene_file = "") {
  return input_error([&] { open_scene(model, scene_file); });
}

TEST_F(OpenScene, AFile) {
  write_one_triangle("x.dat");
  const Scene scene = open_scene("x.dat", "");
  EXPECT_EQ(scene.model.name, "x.dat");
  EXPECT_EQ(scene.model.triangles.size(), 1u);
  EXPECT_NEAR(scene.parameters.far_plane - scene.parameters.near_plane, 2.04, 1e-9) << "framed";
  write_one_triangle("X.DAT");
  EXPECT_EQ(open_scene("X.DAT", "").model.triangles.size(), 1u);
}

TEST_F(OpenScene, AGenerator) {
  const Scene scene = open_scene("confetti:triangles=10,size=2.5", "");
  EXPECT_EQ(scene.model.name, "confetti:triangles=10,size=2.5");
  EXPECT_EQ(scene.model.triangles.size(), 10u);
  EXPECT_EQ(scene.parameters.camera.z, 4);
}

TEST_F(OpenScene, TheFilesParametersWin) {
  folder_.file("p.txt", "1 2 3 4 5 6 7 8 9 10 20 1 2 3");
  write_one_triangle("x.dat");
  EXPECT_EQ(open_scene("x.dat", "p.txt").parameters.camera.x, 7);
  EXPECT_EQ(open_scene("layers", "p.txt").parameters.width, 20);
  EXPECT_EQ(open_error("layers", "no.txt"), "no.txt: cannot open: No such file or directory");
}

TEST_F(OpenScene, AFolderDoesNotHideAGenerator) {
  std::filesystem::create_directory("teapot");
  EXPECT_GT(open_scene("teapot:triangles=100", "").model.triangles.size(), 0u);
  EXPECT_GT(open_scene("teapot", "").model.triangles.size(), 0u);
  EXPECT_EQ(open_error("./teapot"), "./teapot: cannot read: Is a directory");
}

TEST_F(OpenScene, WhatCannotBeOpened) {
  EXPECT_EQ(open_error("no.dat"), "no.dat: cannot open: No such file or directory");
  EXPECT_EQ(open_error("a/teapot"), "a/teapot: cannot open: No such file or directory");
  EXPECT_EQ(open_error(""), "MODEL: the name is empty");
  EXPECT_EQ(open_error("teapto:triangles=5"),
            "unknown generator 'teapto'; did you mean 'teapot'? (and there is no file 'teapto:triangles=5')");
  EXPECT_EQ(open_error("zzzzzzzzz"),
            "unknown generator 'zzzzzzzzz'; known: confetti, layers, teapot, terrain (and there is no file "
            "'zzzzzzzzz')");
  EXPECT_EQ(open_error("teapot:size=5"), "teapot:size=5: unknown key 'size'; known: triangles");
}

TEST_F(OpenScene, OtherFormats) {
  for (const char* name : {"x.obj", "x.PLY", "x.dat.xz", "model"}) folder_.file(name, "something");
  EXPECT_EQ(open_error("x.obj"), "x.obj: '.obj' files are not supported yet; supported: .dat");
  EXPECT_EQ(open_error("x.PLY"), "x.PLY: '.ply' files are not supported yet; supported: .dat");
  EXPECT_EQ(open_error("x.dat.xz"), "x.dat.xz: compressed files are not read; try xz -dk on it first");
  EXPECT_EQ(open_error("model"), "model: has no extension that says its format; supported: .dat");
  EXPECT_EQ(open_error("no.obj"), "no.obj: cannot open: No such file or directory");
}

TEST(SceneHash, IsOfTrianglesAndParametersButNotOfSizeAndName) {
  Scene scene;
  scene.model.triangles = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  const std::string hash = scene_hash(scene);
  EXPECT_EQ(hash, "206218b05e9f5f648b1a8214d4206784") << "the same on every machine";

  Scene same = scene;
  same.model.name = "another";
  same.parameters.width = same.parameters.height = 7;
  EXPECT_EQ(scene_hash(same), hash);

  const auto differs = [&](auto&& change) {
    Scene other = scene;
    change(other);
    return scene_hash(other) != hash;
  };
  EXPECT_TRUE(differs([](Scene& s) { s.model.triangles[0].b.y = 1e-30f; }));
  EXPECT_TRUE(differs([](Scene& s) { s.model.triangles.push_back({}); }));
  EXPECT_TRUE(differs([](Scene& s) { s.model.triangles.clear(); }));
  EXPECT_TRUE(differs([](Scene& s) { s.parameters.object.r ^= 1; }));
  EXPECT_TRUE(differs([](Scene& s) { s.parameters.background.b ^= 1; }));
  EXPECT_TRUE(differs([](Scene& s) { s.parameters.camera.y += 1; }));
  EXPECT_TRUE(differs([](Scene& s) { s.parameters.theta += 1e-9; }));
  EXPECT_TRUE(differs([](Scene& s) { s.parameters.near_plane /= 2; }));
  EXPECT_TRUE(differs([](Scene& s) { s.parameters.far_plane *= 2; }));
}

}  // namespace
}  // namespace rasterbench
