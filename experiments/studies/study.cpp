#include "experiments/studies/study.hpp"

#include <algorithm>

#include "experiments/studies/edit_study.hpp"
#include "experiments/studies/ladder_study.hpp"
#include "experiments/studies/layer_study.hpp"
#include "experiments/studies/light_study.hpp"
#include "experiments/studies/training_study.hpp"
#include "experiments/studies/truth_study.hpp"
#include "experiments/studies/uncertainty_study.hpp"
#include "experiments/studies/user_study.hpp"
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
      .text("study.kind", "layer", "Which study",
            {"layer", "truth", "edit", "training", "light", "uncertainty", "ladder", "user"})
      .integers("study.spp", {4, 16, 64, 256}, "Samples a pixel of the Monte Carlo rows", {2, 65536})
      .integer("study.truth_spp", 16384, "Samples a pixel of the truth", {2, 1048576})
      .integer("study.seeds", 3, "Repetitions with other seeds", {1, 1000})
      .real("study.glossy_below", 0.35, "Roughness below which a pixel counts as glossy", {0, 1})
      .text("study.light", "image", "Who answers for radiance", {"image", "constant", "panorama"})
      .real("study.thickness", 0,
            "Metres behind a surface at which a ray passes unseen (kinds layer, truth); 0: surfaces have no back",
            {0, 100});
  schema.section("truth", "The layer under true light against the tracer (kind truth).")
      .integer("truth.batches", 16, "Independent estimates of each picture", {2, 1000})
      .integer("truth.layer_spp", 512, "Samples a pixel of one of the layer's", {2, 65536})
      .integer("truth.picture_spp", 1024, "Samples a pixel of one of the tracer's", {1, 65536})
      .real("truth.level", 0.9975, "Share of values that chance leaves inside the limits", {0.5, 0.9999})
      .integer("truth.light_spp", 64, "Samples a pixel in the comparison of lights", {2, 65536});
  schema.section("user", "What a user gets (kind user).")
      .integer("user.spp", 64, "Samples a pixel of the layer", {2, 65536})
      .integer("user.truth_spp", 1024, "Samples a pixel of the tracer's pictures that judge", {2, 65536})
      .integer("user.probes", 4, "Points in free air; fewer where there is no place for them", {0, 100})
      .integer("user.probe_spp", 64, "Paths of a texel in each of two estimates of their light", {1, 65536})
      .texts("user.lights", {"net+lamps", "net", "constant+fit", "constant+lamps", "constant", "image"},
             "Who answers, the first against the others; +lamps: lamps fitted, constant+fit: a fitted constant");
  schema.section("edit", "Materials replaced in rooms (kind edit).")
      .integer("edit.spp", 64, "Samples a pixel", {2, 65536})
      .integer("edit.seeds", 3, "Repetitions with other seeds", {1, 1000})
      .texts("edit.lights", {"image", "panorama", "constant"}, "Who answers, +lamps with lamps fitted")
      .integer("edit.bounces", 2, "Bounces of light that follow the edit", {1, 8});
  schema.section("ladder", "Links of the learned light replaced by the truth (kind ladder).")
      .integer("ladder.spp", 64, "Samples a pixel of the layer", {2, 65536})
      .integer("ladder.emission_spp", 1024, "Samples a pixel of true light from emitters", {2, 65536})
      .integer("ladder.seeds", 3, "Repetitions with other seeds", {3, 1000});
  schema.section("light", "Learned light (kinds user, ladder, light, uncertainty).")
      .text("light.weights", "", "Its weights, a folder or a file; empty: the shipped ones");
  schema.section("maps", "Predicted maps (kinds user, ladder, light, uncertainty).")
      .text("maps.weights", "", "MGNet's weights; empty: the shipped ones");
  schema.section("incident", "Light along rays (kinds light, uncertainty); study.seeds draws of rays.")
      .integer("incident.views", 3, "Views of each room", {1, 100})
      .integer("incident.points", 256, "Points of a view and draw: surfaces, and a fifth free probes", {1, 65536})
      .integer("incident.directions", 16, "Rays from each point, a multiple of 16", {16, 128})
      .integer("incident.ray_spp", 64, "Paths of the truth along a ray from a surface", {1, 65536})
      .integer("incident.probes", 2, "Free probes of a view; fewer where there is no place for them", {0, 100})
      .integer("incident.probe_spp", 64, "Paths of a texel in each of a probe's two estimates", {1, 65536})
      .real("incident.clamp", 1, "Most that one indirect contribution adds, in whites of the picture; 0: no bound",
            {0, 1e6})
      .flag("incident.clipped_picture", false, "Clamp the photograph to [0, 1], as a camera does; the truth never is");
  schema.section("uncertainty", "u against the tracer's first surfaces (kind uncertainty).")
      .integers("uncertainty.constants", {1, 3, 10, 30, 100}, "Constants of u = tanh(constant delta)", {1, 100000})
      .real("uncertainty.footprints", 1.5, "A hit is real up to so many footprints of its pixel off", {0, 1000})
      .integer("uncertainty.bins", 10, "Bins of the reliability curve", {1, 1000});
  schema.section("data", "Generated rooms of a list, one view each.")
      .text("data.maps", "true", "Maps (kinds light, uncertainty); predicted ones with depth by the predicted scale",
            {"true", "predicted"})
      .integer("data.rooms", 6, "Rooms", {1, 1000})
      .integer("data.width", 160, "Pixels", {16, 4096})
      .integer("data.height", 120, "Pixels", {16, 4096})
      .integer("data.spp", 64, "Samples a pixel of the pictures", {1, 65536})
      .text("data.list", "experiments/rooms/judged.txt", "List of rooms (experiments/rooms)")
      .integer("data.seed", 0, "Which of them: 0 the first, else so many drawn from the list by this seed");
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
  const auto kind_of = [&](const std::vector<std::string>& overrides) {
    return load_config(config, all, overrides).text("study.kind");
  };
  for (const std::string& word : words) {
    const std::vector<std::vector<std::string>> values = expand_sweep({word});
    if (values.size() < 2 || word.find("study.kind=") == std::string::npos) continue;
    const auto training = std::ranges::count(values, "training", kind_of);
    if (training > 0 && static_cast<std::size_t>(training) < values.size())
      throw usage_error("trainings are not swept with other studies", "study.kind", word,
                        "a config of trainings by itself, such as experiments/configs/ablation_hdr.toml");
  }
  return kind_of(expand_sweep(words)[0]);
}

Config study_config(const std::filesystem::path& config, const std::vector<std::string>& words) {
  const bool training = study_kind(config, words) == "training";
  return load_config(config, training ? training_study_schema() : study_schema(), expand_sweep(words)[0]);
}

std::string study_hash(const std::filesystem::path& config, const std::vector<std::string>& words, bool many) {
  if (study_kind(config, words) == "training") return training_study_hash(config, words);
  return many ? sweep_hash(config, study_schema(), words, {}) : config_hash(study_config(config, words));
}

std::string run_study(const Config& config, const std::vector<std::string>& command) {
  const std::string& kind = config.text("study.kind");
  if (kind == "training")
    throw usage_error("a study of trainings has keys of its own", "study.kind (" + config.origin("study.kind") + ")",
                      kind, "a config of trainings by itself");
  if (kind == "truth") return run_truth_study(config, command);
  if (kind == "user") return run_user_study(config, command);
  if (kind == "ladder") return run_ladder_study(config, command);
  if (kind == "edit") return run_edit_study(config, command);
  if (kind == "light") return run_light_study(config, command);
  if (kind == "uncertainty") return run_uncertainty_study(config, command);
  return run_layer_study(config, command);
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
