#include "experiments/studies/study.hpp"

#include <algorithm>
#include <set>

#include "experiments/studies/edge_study.hpp"
#include "experiments/studies/edit_study.hpp"
#include "experiments/studies/error_time_study.hpp"
#include "experiments/studies/ladder_study.hpp"
#include "experiments/studies/layer_study.hpp"
#include "experiments/studies/leave_out_study.hpp"
#include "experiments/studies/light_study.hpp"
#include "experiments/studies/maps_study.hpp"
#include "experiments/studies/objects_study.hpp"
#include "experiments/studies/protocol_study.hpp"
#include "experiments/studies/study_keys.hpp"
#include "experiments/studies/target_study.hpp"
#include "experiments/studies/training_study.hpp"
#include "experiments/studies/truth_study.hpp"
#include "experiments/studies/uncertainty_study.hpp"
#include "experiments/studies/user_study.hpp"
#include "experiments/training/schema.hpp"
#include "host/cl/tile.hpp"
#include "host/io/files.hpp"

namespace clerestory {

namespace {

/// A kind of study: its keys beside those of all, and what runs it.
struct StudyKind {
  std::string name;
  std::vector<void (*)(Schema&)> keys;
  std::string (*run)(const Config& config, const std::vector<std::string>& command);
  bool repeats = true;  // with study.seeds; else once, or by a key of its own
};
/// The list of studies: a new one is a line here. Trainings have a list of their own (training_study.hpp).
const std::vector<StudyKind>& kinds() {
  static const std::vector<StudyKind> all{
      {"layer", {add_layer_keys, add_method_keys, add_light_keys, add_thickness_keys}, run_layer_study},
      {"truth", {add_truth_keys, add_thickness_keys}, run_truth_study, false},
      {"edges", {add_edge_keys, add_method_keys, add_maps_keys}, run_edge_study, false},
      {"edit", {add_edit_keys, add_method_keys, add_light_keys}, run_edit_study, false},
      {"light", {add_method_keys, add_light_keys, add_maps_keys, add_incident_keys}, run_light_study},
      {"uncertainty",
       {add_uncertainty_keys, add_method_keys, add_light_keys, add_maps_keys, add_incident_keys},
       run_uncertainty_study},
      {"ladder", {add_ladder_keys, add_method_keys, add_light_keys, add_maps_keys}, run_ladder_study, false},
      {"user", {add_user_keys, add_method_keys, add_light_keys, add_maps_keys}, run_user_study},
      {"target", {add_target_keys, add_method_keys, add_light_keys}, run_target_study},
      {"error_time", {add_error_time_keys, add_method_keys, add_light_keys, add_maps_keys}, run_error_time_study},
      {"maps", {add_method_keys, add_rival_keys, add_maps_keys}, run_maps_study, false},
      {"objects",
       {add_objects_keys, add_method_keys, add_rival_keys, add_light_keys, add_maps_keys},
       run_objects_study,
       false},
      {"protocol", {add_protocol_keys, add_method_keys, add_rival_keys, add_maps_keys}, run_protocol_study, false},
      {"leave_out", {add_leave_out_keys, add_method_keys, add_light_keys, add_maps_keys}, run_leave_out_study}};
  return all;
}
const StudyKind& kind_named(const std::string& name) {
  return *std::ranges::find(kinds(), name, &StudyKind::name);  // study.kind lets no other name pass
}

void add_run_keys(Schema& schema) {
  schema.section("run", "Where results go.")
      .text("run.root", "runs", "Folder of run directories")
      .aside()
      .text("run.experiment", "study", "First part of the run directory")
      .aside()
      .text("run.variant", "main", "Second part")
      .aside()
      .integer("run.seed", 0, "Seed in the directory's name")
      .aside()
      .text("run.device", "", "OpenCL device; empty: the default")
      .aside()
      .text("run.gemm", "auto", "Who multiplies in nets", gemm_choices())
      .aside();
}

/// What all kinds but trainings have.
void add_common_keys(Schema& schema) {
  std::vector<std::string> names{"training"};
  for (const StudyKind& kind : kinds()) names.push_back(kind.name);
  schema.section("study", "What is compared.")
      .text("study.kind", "layer", "Which study", names)
      .integer("study.seeds", 3, "Repetitions with other seeds", {1, 1000});
  schema.section("data", "Generated rooms of a list, one view each.")
      .integer("data.rooms", 6, "Rooms", {1, 1000})
      .integer("data.width", 160, "Pixels", {16, 4096})
      .integer("data.height", 120, "Pixels", {16, 4096})
      .integer("data.spp", 64, "Samples a pixel of the pictures", {1, 65536})
      .text("data.list", "experiments/rooms/judged.txt", "List of rooms (experiments/rooms)")
      .integer("data.seed", 0, "Which of them: 0 the first, else so many drawn from the list by this seed");
}

}  // namespace

Schema study_schema(const std::string& kind) {
  if (kind == "training") return training_study_schema();
  Schema schema;
  add_run_keys(schema), add_common_keys(schema);
  for (const auto add_keys : kind_named(kind).keys) add_keys(schema);
  return schema;
}

namespace {

/// Of every kind.
Schema all_keys() {
  Schema all;
  all.include(training_schema());
  add_common_keys(all), add_ablation_keys(all);
  std::set<void (*)(Schema&)> keys;
  for (const StudyKind& kind : kinds()) keys.insert(kind.keys.begin(), kind.keys.end());
  for (const auto add_keys : keys) add_keys(all);
  return all;
}

/// Throws usage_error for a config without study.kind that has keys of a training.
std::string named_kind(const Config& config, const std::filesystem::path& path) {
  std::string kind = config.text("study.kind");
  if (config.origin("study.kind") != "default") return kind;
  const Schema own = study_schema(kind);
  for (const auto& [key, entry] : config.entries())
    if (entry.origin != "default" && own.find(key) == nullptr)
      throw usage_error("is no study but a training", path.string(), "no study.kind",
                        "a study; `clerestory train` takes this one");
  return kind;
}

}  // namespace

bool is_study(const std::filesystem::path& config) {
  try {
    return load_config(config, all_keys(), {}).origin("study.kind") != "default";
  } catch (const Error&) {
    return false;  // a config of neither kind
  }
}

std::string study_kind(const std::filesystem::path& config, const std::vector<std::string>& words) {
  const Schema all = all_keys();
  for (const std::string& word : words)
    if (word.starts_with("study.kind=") && expand_sweep({word}).size() > 1)
      throw usage_error("studies of several kinds are not swept together", "study.kind", word, "one kind");
  try {
    return named_kind(load_config(config, all, expand_sweep(words)[0]), config);
  } catch (const Error&) {  // of all kinds' keys; the config's own kind says it better
    const std::string kind = named_kind(load_config(config, all, {}), config);
    load_config(config, study_schema(kind), expand_sweep(words)[0]);
    throw;
  }
}

Config study_config(const std::filesystem::path& config, const std::vector<std::string>& words) {
  const std::string kind = study_kind(config, words);
  return load_config(config, study_schema(kind), expand_sweep(words)[0]);
}

std::string study_hash(const std::filesystem::path& config, const std::vector<std::string>& words, bool many) {
  const std::string kind = study_kind(config, words);
  if (kind == "training") return training_study_hash(config, words);
  return many ? sweep_hash(config, study_schema(kind), words, {}) : config_hash(study_config(config, words));
}

std::string run_study(const Config& config, const std::vector<std::string>& command) {
  const std::string& kind = config.text("study.kind");
  if (kind == "training")
    throw usage_error("a study of trainings has keys of its own", config.where("study.kind"), kind,
                      "a config of trainings by itself");
  const StudyKind& study = kind_named(kind);
  if (const std::string& origin = config.origin("study.seeds"); !study.repeats && origin != "default")
    throw usage_error("a study of kind " + kind + " is not repeated by it", "study.seeds (" + origin + ")",
                      fmt::format("{}", config.integer("study.seeds")), "nothing, or a key of the kind's own");
  return study.run(config, command);
}

RunTables study_tables(const std::filesystem::path& run) {
  const std::string ending = ".table.json";
  RunTables tables;
  // A sweep's lie in the folder itself.
  const bool sweep = !std::filesystem::is_directory(run / "artifacts");
  for (const auto& entry : std::filesystem::directory_iterator(sweep ? run : run / "artifacts"))
    if (const std::string name = entry.path().filename().string(); name.ends_with(ending))
      tables[name.substr(0, name.size() - ending.size())] =
          table_from_json(read_file(entry.path(), std::uint64_t{64} << 20), entry.path().string());
  return tables;
}

}  // namespace clerestory
