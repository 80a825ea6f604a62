// graphics MODEL.dat SCENE.txt [IMAGE.ppm]: the course contract, with rasterbench's code.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "base/error.h"
#include "build_info.h"
#include "harness/commands.h"

namespace {

int run(int argc, char** argv) {
  using namespace rasterbench;
  CLI::App app("graphics: draw MODEL.dat as SCENE.txt says", "graphics");
  app.set_version_flag("--version",
                       fmt::format("graphics {} ({})", build_info::kVersion, build_info::kCommit));
  Drawing drawing;
  drawing.quiet = true;
  app.add_option("MODEL", drawing.model, "model (.dat)")->required();
  app.add_option("SCENE", drawing.scene_file, "scene parameters")->required();
  app.add_option("IMAGE", drawing.image,
                 "IMAGE.ppm (default: the model's name, ending in .ppm, in the current folder)");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    throw InputError(std::string(error.what()) + "; see --help");
  }
  if (drawing.image.empty()) drawing.image = std::filesystem::path(drawing.model).stem().string() + ".ppm";
  draw(drawing, {});
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return rasterbench::guarded_main("graphics", [&] { return run(argc, argv); });
}
