#include <fmt/format.h>

#include "harness/commands.h"
#include "scene/dat.h"
#include "scene/generator.h"
#include "scene/image.h"

namespace rasterbench {

void add_scene_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("scene", "write a generated model as a .dat file");
  const auto specification = std::make_shared<std::string>();
  const auto output = std::make_shared<std::string>();
  const auto parameters = std::make_shared<std::string>();
  command->add_option("NAME", *specification, "NAME[:KEY=VALUE,...]; see `rasterbench list scenes`")
      ->required();
  command->add_option("-o,--output", *output, "MODEL.dat")->required();
  command->add_option("--parameters", *parameters,
                      "also write the scene's camera and colours to this SCENE.txt");
  command->callback([specification, output, parameters] {
    for (const std::string& file : {*output, *parameters})
      if (!file.empty()) check_output_path(file);
    const Scene scene = generate(*specification);
    write_dat(scene.model, *output);
    if (!parameters->empty()) write_scene_parameters(scene.parameters, *parameters);
    fmt::print("wrote {}: {} triangles\n", *output, scene.model.triangles.size());
  });
}

}  // namespace rasterbench
