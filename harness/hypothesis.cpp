#include "harness/hypothesis.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/table_reader.h"
#include "kernels/kernel.h"

namespace rasterbench {
namespace {

using Test = std::function<bool(const Point&)>;

/// One key of a selection: a point is meant if any of its values fits.
struct Condition {
  std::string key;
  std::vector<Test> any;
  bool of_machine = false;  ///< whether it depends on the machine what its values are

  bool fits(const Point& point) const {
    return std::any_of(any.begin(), any.end(), [&](const Test& test) { return test(point); });
  }
};

struct Selection {
  std::vector<Condition> conditions;
  bool best = false;
};

class SelectionReader {
 public:
  SelectionReader(const toml::table& table, const std::string& file, const PlanTarget& target,
                  const Selectable& from)
      : reader_(table, file), target_(target), from_(from) {}

  Selection read(bool may_be_best) {
    scenes_and_sizes();
    words("kernel", [](const std::string& word) {
      find_kernel(word);
      return [word](const Point& p) { return p.kernel == word; };
    });
    words("peer", [](const std::string& word) {
      check_word(word, kPeers, "peer");
      return [word](const Point& p) { return p.kernel == word; };
    });
    words("numeric", [](const std::string& word) {
      std::vector<std::string> known;
      for (const ModeInfo& mode : mode_infos()) known.emplace_back(mode.name);
      check_word(word, known, "numeric");
      return [word](const Point& p) { return p.numeric == word; };
    });
    words("fill", [](const std::string& word) {
      return [fill = parse_fill(word, "fill")](const Point& p) { return p.fill == fill; };
    });
    words("near", [](const std::string& word) {
      return [rule = parse_near(word, "near")](const Point& p) { return p.near_rule == rule; };
    });
    words("execution", [](const std::string& word) {
      const ExecutionConfig execution = parse_execution(word, "execution");
      if (!is_left_out(execution.backend)) find_schedule(execution);
      return [name = to_string(execution)](const Point& p) { return to_string(p.execution) == name; };
    });
    threads();
    environment("binding", kBindings, &Environment::binding);
    environment("wait_policy", kWaitPolicies, &Environment::wait_policy);
    environment("runtime", kRuntimes, &Environment::runtime);
    tiles();
    words("cache", [](const std::string& word) {
      check_word(word, kCaches, "cache");
      return [word](const Point& p) { return p.cache == word; };
    });
    words("generality", [](const std::string& word) {
      return [value = parse_generality(word, "generality")](const Point& p) { return p.generality == value; };
    });
    words("isa", [this](const std::string& word) {
      const Isa isa = word == "best" ? target_.best : parse_isa(word, "isa");
      return [isa](const Point& p) { return p.isa == isa; };
    });
    words("techniques", [](const std::string& word) {
      return [value = parse_techniques(word, "techniques")](const Point& p) { return p.techniques == value; };
    });
    if (may_be_best) reader_.boolean("best", selection_.best);
    reader_.reject_unknown_keys("a selection");
    return std::move(selection_);
  }

 private:
  void words(const std::string& key, const std::function<Test(const std::string&)>& parse) {
    Condition condition{key, {}, key == "isa"};
    reader_.strings(key, condition.any, parse);
    if (!condition.any.empty()) selection_.conditions.push_back(std::move(condition));
  }

  void environment(const std::string& key, const std::vector<std::string>& known,
                   std::string Environment::*value) {
    words(key, [&known, value, key](const std::string& word) {
      check_word(word, known, key);
      return [word, value](const Point& p) { return p.environment.*value == word; };
    });
  }

  /// A scene and a size of a weak sweep are known by what the file writes, since their names depend on
  /// threads.
  void scenes_and_sizes() {
    std::set<std::string> scenes;
    for (const PlannedPoint& planned : from_.points) scenes.insert(planned.point.scene.name);
    for (const WeakSeries& series : from_.weak) scenes.insert(series.scene);
    words("scene", [this, scenes](const std::string& word) {
      if (!from_.replaced) check_word(word, {scenes.begin(), scenes.end()}, "scene");
      return [&from = from_, word](const Point& p) {
        return p.scene.name == word ||
               in_series(from, p, [&](const WeakSeries& s) { return s.scene == word; });
      };
    });
    words("size", [this](const std::string& word) -> Test {
      if (word.ends_with(kTimesThreads))
        return [&from = from_, word](const Point& p) {
          return in_series(from, p, [&](const WeakSeries& s) { return s.size == word; });
        };
      return
          [size = parse_size(word, "size")](const Point& p) { return std::pair(p.width, p.height) == size; };
    });
  }

  /// The conditions outlive this reader, but not `from`.
  static bool in_series(const Selectable& from, const Point& point,
                        const std::function<bool(const WeakSeries&)>& is_meant) {
    return std::any_of(from.weak.begin(), from.weak.end(),
                       [&](const WeakSeries& series) { return is_meant(series) && series.has(point); });
  }

  void threads() {
    Condition condition{"threads", {}, true};
    reader_.each("threads", [&](const toml::node& node) {
      int threads = target_.cpus;
      if (const auto value = node.value<std::int64_t>(); node.is_integer() && *value >= 1 && *value <= 65536)
        threads = static_cast<int>(*value);
      else if (!node.is_string() || *node.value<std::string>() != "max")
        reader_.fail(node, "threads", "must be whole numbers from 1 or \"max\"");
      condition.any.push_back([threads](const Point& p) { return p.execution.threads == threads; });
    });
    if (!condition.any.empty()) selection_.conditions.push_back(std::move(condition));
  }

  void tiles() {
    Condition condition{"tile", {}, false};
    reader_.each("tile", [&](const toml::node& node) {
      const auto value = node.value<std::int64_t>();
      if (!node.is_integer() || *value < 1 || *value > kMaxImageSide)
        reader_.fail(node, "tile",
                     fmt::format("must be whole numbers of pixels from 1 to {}", kMaxImageSide));
      condition.any.push_back([tile = *value](const Point& p) { return p.tile == tile; });
    });
    if (!condition.any.empty()) selection_.conditions.push_back(std::move(condition));
  }

  TableReader reader_;
  const PlanTarget& target_;
  const Selectable& from_;
  Selection selection_;
};

/// The axes in which some of `points` differ, as words.
std::string differences(const std::vector<const PlannedPoint*>& points) {
  std::vector<std::string> keys;
  const Json first = point_config(points.front()->point);
  for (const auto& [key, value] : first.items())
    if (std::any_of(points.begin(), points.end(),
                    [&, &key = key, &value = value](const PlannedPoint* planned) {
                      return point_config(planned->point).at(key) != value;
                    }))
      keys.push_back(key == "backend" || key == "schedule" || key == "chunk" ? "execution" : key);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return fmt::format("{}", fmt::join(keys, ", "));
}

/// One [[hypothesis]] with what is needed to place errors.
class HypothesisReader {
 public:
  HypothesisReader(const toml::table& table, const std::string& file, const PlanTarget& target,
                   const Selectable& from)
      : table_(table), file_(file), target_(target), from_(from), reader_(table, file) {}

  Hypothesis read() {
    reader_.text("claim", hypothesis_.claim);
    reader_.number("by", -0.99, 1e6, hypothesis_.by);
    Selection where;
    if (const toml::table* table = selection_table("where")) where = selection(*table, false);
    const toml::table* faster = selection_table("faster");
    const toml::table* slower = selection_table("slower");
    reader_.reject_unknown_keys("[[hypothesis]]");
    if (hypothesis_.claim.empty())
      reader_.fail(table_, "claim", "is missing: say in a sentence what is expected");
    for (const char* side : {"faster", "slower"})
      if (!table_.contains(side)) reader_.fail(table_, side, "is missing from this [[hypothesis]]");
    const bool machine = select("faster", *faster, where, hypothesis_.faster);
    const bool other_machine = select("slower", *slower, where, hypothesis_.slower);
    refuse_itself(machine || other_machine);
    return std::move(hypothesis_);
  }

 private:
  const toml::table* selection_table(const std::string& key) {
    const toml::node* node = reader_.find(key);
    if (node && !node->is_table())
      reader_.fail(*node, key,
                   "must be a table of axes, such as {kernel = \"tile_parallel\", threads = \"max\"}");
    return node ? node->as_table() : nullptr;
  }

  Selection selection(const toml::table& table, bool may_be_best) const {
    return SelectionReader(table, file_, target_, from_).read(may_be_best);
  }

  /// Finds the points of a side. Returns whether a condition depends on the machine.
  bool select(const std::string& side, const toml::table& table, const Selection& where,
              std::vector<std::string>& names) {
    Selection own = selection(table, true);
    bool of_machine = false, of_pictures = false;
    for (const Condition& condition : where.conditions) {
      if (table.contains(condition.key))
        reader_.fail(table, side, fmt::format("{} is in where, too", condition.key));
      own.conditions.push_back(condition);
    }
    std::vector<const PlannedPoint*> left;
    for (const PlannedPoint& planned : from_.points) left.push_back(&planned);
    // What may be another machine's comes last, so that it is blamed only where the rest is right.
    std::stable_sort(own.conditions.begin(), own.conditions.end(),
                     [](const Condition& a, const Condition& b) { return a.of_machine < b.of_machine; });
    for (const Condition& condition : own.conditions) {
      of_machine = of_machine || condition.of_machine;
      of_pictures = of_pictures || condition.key == "scene" || condition.key == "size";
      const std::size_t before = left.size();
      std::erase_if(left, [&](const PlannedPoint* planned) { return !condition.fits(planned->point); });
      if (!left.empty()) continue;
      if (from_.replaced && of_pictures) {
        hypothesis_.untested = "--scene or --size replaces what it speaks of";
        return of_machine;
      }
      reader_.fail(
          table, side,
          fmt::format("selects no point: none of the {} that are left has this {}", before, condition.key));
    }
    if (left.size() > 1 && !own.best)
      reader_.fail(table, side,
                   fmt::format("selects {} points, such as {} and {}, which differ in {}: say which, or add "
                               "best = true to mean the fastest",
                               left.size(), left[0]->name, left[1]->name, differences(left)));
    for (const PlannedPoint* planned : left) names.push_back(planned->name);
    return of_machine;
  }

  /// A point on both sides is a mistake, unless it is so on this machine only, as 1 and "max" of one CPU.
  void refuse_itself(bool of_machine) {
    for (const std::string& name : hypothesis_.faster)
      if (std::find(hypothesis_.slower.begin(), hypothesis_.slower.end(), name) != hypothesis_.slower.end()) {
        if (!of_machine)
          reader_.fail(table_, "slower", fmt::format("selects {}, as faster does: nothing to compare", name));
        hypothesis_.untested = fmt::format("on this machine both sides are {}", name);
      }
  }

  const toml::table& table_;
  const std::string& file_;
  const PlanTarget& target_;
  const Selectable& from_;
  TableReader reader_;
  Hypothesis hypothesis_;
};

}  // namespace

std::vector<Hypothesis> read_hypotheses(const std::filesystem::path& path, const std::string& text,
                                        const PlanTarget& target, const Selectable& from) {
  const std::string file = path.string();
  const toml::table table = parse_toml(text, file);
  const toml::node* node = table.get("hypothesis");
  if (!node) return {};
  const auto must_be_tables = [&](const toml::node& wrong) {
    TableReader(table, file).fail(wrong, "hypothesis", "must be [[hypothesis]] tables, with two brackets");
  };
  if (!node->is_array()) must_be_tables(*node);
  std::vector<Hypothesis> all;
  for (const toml::node& one : *node->as_array()) {
    if (!one.is_table()) must_be_tables(one);
    all.push_back(HypothesisReader(*one.as_table(), file, target, from).read());
  }
  return all;
}

Json hypotheses_to_json(const std::vector<Hypothesis>& hypotheses) {
  Json all = Json::array();
  for (const Hypothesis& hypothesis : hypotheses)
    all.push_back({{"claim", hypothesis.claim},
                   {"by", hypothesis.by},
                   {"faster", hypothesis.faster},
                   {"slower", hypothesis.slower},
                   {"untested", hypothesis.untested.empty() ? Json() : Json(hypothesis.untested)}});
  return all;
}

}  // namespace rasterbench
