#include "experiments/studies/study.hpp"

#include "experiments/studies/balls_study.hpp"
#include "experiments/studies/edit_study.hpp"
#include "experiments/studies/layer_study.hpp"
#include "experiments/studies/training_study.hpp"
#include "experiments/studies/truth_study.hpp"
#include "experiments/training/schema.hpp"
#include "host/io/files.hpp"

namespace clerestory {

namespace {

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
      .aside();
}

void add_study_keys(Schema& schema) {
  schema.section("study", "What is compared.")
      .text("study.kind", "layer", "Which study", {"layer", "truth", "balls", "edit", "training"})
      .integers("study.spp", {4, 16, 64, 256}, "Samples a pixel of the Monte Carlo rows", {2, 65536})
      .integer("study.truth_spp", 16384, "Samples a pixel of the truth", {2, 1048576})
      .integer("study.seeds", 3, "Repetitions with other seeds", {1, 1000})
      .real("study.glossy_below", 0.35, "Roughness below which a pixel counts as glossy", {0, 1})
      .text("study.light", "image", "Who answers for radiance", {"image", "constant", "panorama"});
  schema.section("truth", "The layer under true light against the tracer (kind truth).")
      .integer("truth.batches", 16, "Independent estimates of each picture", {2, 1000})
      .integer("truth.layer_spp", 512, "Samples a pixel of one of the layer's", {2, 65536})
      .integer("truth.picture_spp", 1024, "Samples a pixel of one of the tracer's", {1, 65536})
      .real("truth.level", 0.9975, "Share of values that chance leaves inside the limits", {0.5, 0.9999})
      .integer("truth.light_spp", 64, "Samples a pixel in the comparison of lights", {2, 65536});
  schema.section("balls", "Balls put into rooms (kind balls).")
      .integer("balls.spp", 256, "Samples a pixel", {2, 65536});
  schema.section("edit", "Materials replaced in rooms (kind edit).")
      .integer("edit.spp", 64, "Samples a pixel", {2, 65536})
      .integer("edit.seeds", 3, "Repetitions with other seeds", {1, 1000})
      .integer("edit.bounces", 2, "Bounces of light that follow the edit", {1, 8});
  schema.section("data", "Generated rooms, one view each.")
      .integer("data.rooms", 6, "Rooms", {1, 1000})
      .integer("data.width", 160, "Pixels", {16, 4096})
      .integer("data.height", 120, "Pixels", {16, 4096})
      .integer("data.spp", 64, "Samples a pixel of the pictures", {1, 65536})
      .integer("data.seed", 9000, "Seed of the rooms");
}

}  // namespace

Schema study_schema() {
  Schema schema;
  add_run_keys(schema), add_study_keys(schema);
  return schema;
}

std::string study_kind(const std::filesystem::path& config, const std::vector<std::string>& words) {
  Schema all;  // of every kind
  all.include(training_schema());
  add_study_keys(all), add_ablation_keys(all);
  return load_config(config, all, expand_sweep(words)[0]).text("study.kind");
}

std::string run_study(const Config& config, const std::vector<std::string>& command) {
  const std::string& kind = config.text("study.kind");
  if (kind == "truth") return run_truth_study(config, command);
  if (kind == "balls") return run_balls_study(config, command);
  if (kind == "edit") return run_edit_study(config, command);
  return run_layer_study(config, command);
}

RunTables study_tables(const std::filesystem::path& run) {
  const std::string ending = ".table.json";
  RunTables tables;
  for (const auto& entry : std::filesystem::directory_iterator(run / "artifacts"))
    if (const std::string name = entry.path().filename().string(); name.ends_with(ending))
      tables[name.substr(0, name.size() - ending.size())] =
          table_from_json(read_file(entry.path(), std::uint64_t{64} << 20), entry.path().string());
  return tables;
}

}  // namespace clerestory
