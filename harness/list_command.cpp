#include <fmt/format.h>

#include "base/error.h"
#include "harness/commands.h"
#include "harness/process.h"
#include "harness/runner.h"
#include "harness/study.h"
#include "kernels/kernel.h"
#include "scene/generator.h"

namespace rasterbench {
namespace {

Json list_kernels() {
  Json list = Json::array();
  for (const Kernel& kernel : kernels()) {
    const KernelInfo& info = kernel.info();
    if (info.hidden) continue;
    Json numerics = Json::array(), left_out = Json::object();
    for (const Kernel::Variant& variant : kernel.variants())
      variant.make ? numerics.push_back(variant.mode)
                   : (void)(left_out[std::string(variant.mode)] = variant.reason);
    list.push_back({{"name", info.name},
                    {"parallel_unit", info.parallel_unit},
                    {"synchronisation", info.synchronisation},
                    {"work", info.work},
                    {"has_tiles", info.has_tiles},
                    {"techniques", to_string(info.techniques)},
                    {"numerics", numerics},
                    {"not_in", left_out}});
  }
  return list;
}

Json list_numerics() {
  Json list = Json::array();
  for (const ModeInfo& info : mode_infos()) {
    Json carried_by = Json::array();
    for (const Kernel& kernel : kernels())
      if (!kernel.info().hidden && kernel.variant(info.name).make) carried_by.push_back(kernel.info().name);
    Json entry{{"name", info.name},
               {"vertices", info.vertices},
               {"edges", info.edges},
               {"depth", info.depth},
               {"bound", info.bound},
               {"bound_source", info.bound_source},
               {"bounded", info.numbers.bounded},
               {"same_bits_on", info.same_on_every_cpu
                                    ? "any threads, tiles, order and CPU"
                                    : "any threads, tiles and order, on one type of CPU and compiler"},
               {"kernels", carried_by},
               {"available", info.unavailable.empty()}};
    if (!info.unavailable.empty()) entry["reason"] = info.unavailable;
    list.push_back(std::move(entry));
  }
  return list;
}

Json list_backends() {
  Json list = Json::array();
  for (const std::string& name : backends())
    list.push_back(
        {{"name", name}, {"runtime", name == "openmp" ? openmp_runtime() : name}, {"available", true}});
  if (is_left_out("tbb"))
    list.push_back(
        {{"name", "tbb"}, {"runtime", "oneTBB was not found when this was built"}, {"available", false}});
  return list;
}

/// A peer is asked in a process of its own: its libraries stay out of this one.
Json list_peers() {
  Json list = Json::array();
  for (const std::string& name : kPeers) {
    Json entry{{"name", name},
               {"what", "Mesa's OpenGL on the CPU: the same triangles, camera, flat colours and depth test"},
               {"fill", kFillRules[1]},
               {"bound", kLlvmpipeBoundText},
               {"bound_source", kLlvmpipeBoundSource},
               {"available", false}};
    if (!has_llvmpipe()) {
      entry["reason"] = llvmpipe_missing();
    } else {
      constexpr double kTimeout = 60;  // seconds
      try {
        Environment environment;
        environment.llvmpipe_threads = 1;
        const Json answer =
            Process({"runner"}, environment_variables(environment)).ask({{"op", "peer"}}, kTimeout);
        if (answer.contains("skip"))
          entry["reason"] = answer.at("skip");
        else
          entry["available"] = true, entry.update(answer);
      } catch (const ProcessError& error) {
        entry["reason"] = error.what();
      }
    }
    list.push_back(std::move(entry));
  }
  return list;
}

Json list_schedules() {
  Json list = Json::array();
  for (const Schedule& schedule : schedules())
    list.push_back(
        {{"name", schedule.name.empty() ? schedule.backend : schedule.backend + ":" + schedule.name},
         {"meaning", schedule.meaning},
         {"chunk", schedule.chunk.empty() ? Json() : Json(schedule.chunk)}});
  return list;
}

Json list_isas() {
  Json list = Json::array();
  for (const Isa isa : all_isas())
    list.push_back({{"name", to_string(isa)}, {"available", is_supported(isa)}, {"best", isa == best_isa()}});
  return list;
}

Json list_techniques() {
  Json list = Json::array();
  for (const TechniqueInfo& info : technique_infos()) {
    Json had_by = Json::array();
    for (const Kernel& kernel : kernels())
      if (!kernel.info().hidden && kernel.info().techniques.*info.switched)
        had_by.push_back(kernel.info().name);
    list.push_back({{"name", info.name}, {"meaning", info.meaning}, {"kernels", had_by}});
  }
  return list;
}

Json list_scenes() {
  Json list = Json::array();
  for (const Generator& generator : generators()) {
    Json keys = Json::array();
    for (const GeneratorKey& key : generator.keys) {
      Json entry{{"name", key.name}, {"meaning", key.meaning}};
      if (key.words.empty()) {
        entry["default"] = key.default_value;
        entry["range"] = {key.minimum, key.maximum};
      } else {
        entry["default"] = key.words.at(static_cast<std::size_t>(key.default_value));
        entry["words"] = key.words;
      }
      keys.push_back(std::move(entry));
    }
    list.push_back({{"name", generator.name}, {"meaning", generator.meaning}, {"keys", keys}});
  }
  return list;
}

Json list_studies() {
  Json list = Json::array();
  for (const auto& file : known_studies())
    list.push_back({{"name", file.stem().string()}, {"file", file.string()}});
  return list;
}

std::string shown(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float() && value.get<double>() == static_cast<double>(value.get<std::int64_t>()))
    return std::to_string(value.get<std::int64_t>());
  return value.dump();
}

/// Each entry as its name and one indented line a field; lists of entries (a generator's keys) one level
/// deeper.
void print_entries(const Json& list, int indent) {
  for (const Json& entry : list) {
    fmt::print("{:{}}{}\n", "", indent, entry.at("name").get<std::string>());
    for (const auto& [key, value] : entry.items()) {
      if (key == "name" || value.is_null() || value.empty()) continue;
      if (value.is_array() && value.front().is_object()) {
        print_entries(value, indent + 4);
      } else if (value.is_array()) {
        std::string words;
        for (const Json& word : value) words += (words.empty() ? "" : ", ") + shown(word);
        fmt::print("{:{}}{}: {}\n", "", indent + 4, key, words);
      } else if (value.is_object()) {
        for (const auto& [name, text] : value.items())
          fmt::print("{:{}}{} {}: {}\n", "", indent + 4, key, name, shown(text));
      } else {
        fmt::print("{:{}}{}: {}\n", "", indent + 4, key, shown(value));
      }
    }
  }
}

}  // namespace

void add_list_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("list", "what there is to choose from");
  const auto what = std::make_shared<std::string>();
  const auto json = std::make_shared<bool>(false);
  static const std::map<std::string, Json (*)()> kLists{
      {"kernels", list_kernels},       {"peers", list_peers},         {"numerics", list_numerics},
      {"backends", list_backends},     {"schedules", list_schedules}, {"isas", list_isas},
      {"techniques", list_techniques}, {"scenes", list_scenes},       {"studies", list_studies}};
  command
      ->add_option("WHAT", *what,
                   "kernels, peers, numerics, backends, schedules, isas, techniques, scenes or studies")
      ->required();
  command->add_flag("--json", *json, "an array of objects that have a \"name\"");
  command->callback([what, json] {
    std::vector<std::string> known;
    for (const auto& [name, list] : kLists) known.push_back(name);
    check_word(*what, known, "list");
    const Json list = kLists.at(*what)();
    if (*json)
      fmt::print("{}\n", list.dump(2));
    else
      print_entries(list, 0);
  });
}

}  // namespace rasterbench
