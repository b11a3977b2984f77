#include "experiments/studies/training_study.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <set>

#include "experiments/studies/differences.hpp"
#include "experiments/studies/light_measures.hpp"
#include "experiments/studies/map_measures.hpp"
#include "experiments/studies/room_differences.hpp"
#include "experiments/studies/study.hpp"
#include "experiments/studies/trained_kinds.hpp"
#include "experiments/studies/training_curves.hpp"
#include "experiments/training/schema.hpp"
#include "experiments/training/trainer.hpp"
#include "experiments/training/validation.hpp"
#include "experiments/training/view_store.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/report/file_lock.hpp"
#include "host/report/progress.hpp"
#include "host/report/run_directory.hpp"
#include "tracer/generate.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Texts = std::vector<std::string>;

constexpr const char* kCurves = "curves";  // the table of errors against training

fs::path data_folder(const Config& c, const std::string& split) { return fs::path(c.text("ablation.data")) / split; }

GenerateOptions rooms_of(const Config& c, const std::string& split) {
  const bool training = split == "train";
  GenerateOptions o;
  o.out = data_folder(c, split), o.rooms.split = split;
  o.rooms.count = c.whole(training ? "ablation.rooms" : "ablation.judged_rooms"),
  o.views.count = c.whole("ablation.views");
  const int scale = training ? 1 : c.whole("ablation.judged_scale");
  o.views.width = scale * c.whole("model.width"), o.views.height = scale * c.whole("model.height");
  o.views.spp = c.whole("ablation.picture_spp"), o.light.spp = c.whole("ablation.light_spp");
  o.views.clamp = 1;  // without it fireflies of few samples would be learned as lamps
  o.light.wanted = trained_kind(c).reads_light();
  o.rooms.setting = !training && c.text("ablation.judged_setting") == "held_out" ? Setting::HeldOut : Setting::Training;
  o.rooms.seed = static_cast<std::uint64_t>(c.integer("ablation.data_seed")) + (training ? 0 : 1);
  o.rooms.boxes = c.flag("ablation.box_rooms");
  o.interrupted = [] { return interrupted(); };
  return o;
}

/// Runs of one study that begin at once, on several machines say, find them made by the first.
void make_rooms(const Config& config) {
  const fs::path data = own_path(config.text("ablation.data"));
  make_directories(data.parent_path());
  const FileLock lock = wait_for_lock(data.parent_path() / ("." + data.filename().string() + ".lock"),
                                      std::numeric_limits<double>::max());
  const Device device = Device::open(config.text("run.device"));
  for (const char* split : {"train", "test"}) {
    GenerateOptions options = rooms_of(config, split);
    std::unique_ptr<Progress> bar;
    options.progress = [&](int done, int total, bool made) {
      if (!made && !bar) return;
      if (!bar) bar = std::make_unique<Progress>(fmt::format("{} rooms", split), total, "views", done - 1);
      bar->update(done);
    };
    generate(device, options);
  }
}

/// The rooms that trainings are judged on, and all seeds.
void record_rooms(Provenance& provenance, const Config& config) {
  const GenerateOptions judged = rooms_of(config, "test");
  provenance.rooms.setting = config.text("ablation.judged_setting");
  for (int r = 0; r < judged.rooms.count; ++r) provenance.rooms.seeds.push_back(room_seed(judged, r));
  const DataSection data = training_options(config).data;
  for (const JudgingList& list : data.lists) {
    const std::vector<ViewName> views = all_views(list.folder);
    const std::size_t judging = spread(views.size(), static_cast<std::size_t>(data.list_views)).size();
    provenance.facts["rooms of " + list.name] = fmt::format("{} views of {:016x}", judging, views_hash(views));
  }
  for (const char* key : {"ablation.data_seed", "ablation.seeds"})
    provenance.seeds[key] = static_cast<std::uint64_t>(config.integer(key));
}

fs::path table_file(const fs::path& run, const std::string& name) { return run / "artifacts" / (name + ".table.json"); }

/// One step in a folder of its own: every kernel is compiled before a clock of training runs.
void compile_kernels(const Config& config, const Texts& command) {
  const Config brief = config.with({"train.steps=1", "train.minutes=0", "train.epochs=0", "data.validation_views=1",
                                    "run.variant=" + config.text("run.variant") + "-compile"});
  fs::remove_all(train(brief, command).folder);
}

/// Trains and judges the runs of one sweep, one after another.
class Ablation {
 public:
  explicit Ablation(Texts command) : command_(std::move(command)) {}

  void run(const Config& config) {
    const auto seed = static_cast<std::uint64_t>(config.integer("run.seed"));
    const fs::path folder = RunDirectory::path_of(config.text("run.root"), config.text("run.experiment"),
                                                  config.text("run.variant"), config, seed);
    // All of a run is one process's work: kernels that are compiled before, training, tables.
    make_directories(folder.parent_path());
    const FolderLock claim(folder, LockKind::Write);
    const bool begun = fs::exists(folder / "metrics.jsonl");
    if (!begun && compiled_.insert(config_hash(config)).second) compile_kernels(config, command_);
    train(config, command_);
    const Texts names = trained_kind(config).tables(config);
    if (std::ranges::all_of(names, [&](const std::string& name) { return fs::exists(table_file(folder, name)); }))
      return;
    for (const auto& [name, table] : trained_kind(config).measure(folder, data_folder(config, "test"), config))
      write_file(table_file(folder, name), table_json(table));
  }

 private:
  Texts command_;
  std::set<std::string> compiled_;  // configs, whatever their seeds
};

}  // namespace

void add_ablation_keys(Schema& s) {
  s.section("ablation", "Trainings, one for each variant and seed, and how they are judged.");
  s.integer("ablation.seeds", 3, "trainings of each variant, with the seeds 1, 2, ...; run.seed in their place",
            {1, 100})
      .aside();
  Texts measures = light_measures();
  std::ranges::copy(map_measures(), std::back_inserter(measures));
  s.texts("ablation.measures", {}, "tables beside the errors: range and rerender of the light, edges of maps", measures)
      .aside();
  s.flag("ablation.clamped", false,
         "light: judged nets read pictures clamped to [0, 1], as a photograph is; the truth is HDR");
  s.texts("ablation.frames", {}, "maps: folders of photographs with measured depth that judge beside the rooms");
  s.integer("ablation.spp", 64, "light: samples a pixel of pictures rendered again", {2, 65536});
  s.text("ablation.data", "data/ablation", "folder of the rooms; made where they are missing").aside();
  s.integer("ablation.data_seed", 7300, "seed of the training rooms; the judged ones have the next", {0, 1e15});
  s.integer("ablation.rooms", 20, "training rooms", {1, 100000});
  s.integer("ablation.judged_rooms", 6, "rooms that no training sees", {1, 100000});
  s.text("ablation.judged_setting", "training", "content of the judged rooms", {"training", "held_out"});
  s.integer("ablation.judged_scale", 1, "maps: views of these rooms are so many times as large as the net's", {1, 8})
      .later();
  s.integer("ablation.views", 3, "views of each room", {1, 1000});
  s.integer("ablation.picture_spp", 48, "samples a pixel of the pictures", {1, 65536});
  s.integer("ablation.light_spp", 8, "light: samples a texel of it", {1, 4096});
  s.flag("ablation.box_rooms", false, "bare boxes in place of furnished rooms");
}

Schema training_study_schema() {
  Schema schema;
  schema.include(training_schema());
  schema.section("study", "What is compared.").text("study.kind", "training", "which study", {"training"});
  add_ablation_keys(schema);
  return schema;
}

namespace {

/// Overrides as the sweep takes them: seeds are added, and the folders of the rooms.
struct SweepWords {
  Texts words, fixed;
};

SweepWords sweep_words_of(const Config& config, const Texts& words, const Texts& fixed) {
  SweepWords all{words, fixed};
  const auto is_seed = [](const std::string& word) { return word.starts_with("run.seed="); };
  if (std::ranges::none_of(words, is_seed))
    all.words.push_back(fmt::format("run.seed=range(1,{})", config.integer("ablation.seeds") + 1));
  const auto folder = [&](const char* split) { return "[\"" + data_folder(config, split).string() + "\"]"; };
  all.fixed.insert(all.fixed.end(), {"data.train=" + folder("train"), "data.validation=" + folder("test"),
                                     "data.validation_split=test"});
  return all;
}

}  // namespace

std::string training_study_hash(const fs::path& path, const Texts& words) {
  const Schema schema = training_study_schema();
  const SweepWords all = sweep_words_of(load_config(path, schema, expand_sweep(words)[0]), words, {});
  return sweep_hash(path, schema, all.words, all.fixed);
}

namespace {

/// Rooms and tables are those of one kind.
void one_kind(const Config& run, const Config& config) {
  if (&trained_kind(run) != &trained_kind(config))
    throw usage_error("the trainings of a study are of one kind", run.where("model.kind"), run.text("model.kind"),
                      config.text("model.kind"));
}

/// Of a finished run; a training leaves tables of its own beside them.
RunTables tables_of(const fs::path& run, const Config& config) {
  RunTables tables = study_tables(run);
  const Texts names = trained_kind(config).tables(config);
  std::erase_if(tables, [&](const auto& table) { return std::ranges::count(names, table.first) == 0; });
  tables[kCurves] = training_curve(run);
  return tables;
}

}  // namespace

Texts training_study_names(const fs::path& path, const Texts& words, const Texts& fixed) {
  const Schema schema = training_study_schema();
  const Config config = load_config(path, schema, expand_sweep(words)[0]).with(fixed);
  const SweepWords all = sweep_words_of(config, words, fixed);
  return sweep_names(path, schema, all.words, all.fixed);
}

fs::path run_training_study(const fs::path& path, const Texts& words, const Texts& fixed, const Texts& command,
                            const std::string& only) {
  const Schema schema = training_study_schema();
  const Config config = load_config(path, schema, expand_sweep(words)[0]).with(fixed);
  trained_kind(config).check(config);
  for (const JudgingList& list : training_options(config).data.lists)
    all_views(list.folder);  // a mistake costs no rooms
  for (const Texts& overrides : expand_sweep(words))
    for (const ConfigVariant& v : config.variants()) one_kind(config.variant(v.name).with(overrides), config);
  catch_interrupts();
  make_rooms(config);

  const SweepWords all = sweep_words_of(config, words, fixed);
  Ablation ablation(command);
  SweepTask task;
  task.run = [&](const Config& c) { ablation.run(c); };
  task.results = [&](const fs::path& run) { return tables_of(run, config); };
  task.finish = with_differences;
  task.record = [&](Provenance& provenance) { record_rooms(provenance, config); };
  task.further = [](const Texts& keys, const std::vector<SweptPoint>& points) {
    return RunTables{{"rooms", room_differences(keys, points)}};
  };
  task.plots = [](const RunTables& tables, std::size_t named) {
    const auto curves = tables.find(kCurves);
    return curves == tables.end() ? std::vector<Plot>() : training_curve_plots(curves->second, named);
  };
  return only.empty() ? run_sweep(path, schema, all.words, all.fixed, command, task)
                      : run_of_sweep(path, schema, all.words, all.fixed, only, task);
}

}  // namespace clerestory
