// Ablations by short trainings: from a config to a table, whatever was done, interrupted or broken before.
#include "experiments/studies/training_study.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "experiments/studies/differences.hpp"
#include "experiments/studies/light_measures.hpp"
#include "experiments/training/judged_views.hpp"
#include "experiments/training/light_batches.hpp"
#include "experiments/training/options.hpp"
#include "experiments/training/schema.hpp"
#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/report/progress.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tracer/generate.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// ---- Differences ----

Table swept_table(const std::vector<std::vector<Cell>>& rows) {
  Table t;
  t.columns = {{"variant"}, {"runs"}, {"rays"}, {"error", "", Best::Lowest, 3}, {"time", "s"}};
  for (const auto& row : rows) t.add(row);
  return t;
}

std::string text_at(const Table& t, std::size_t row, std::size_t column) {
  return cell_text(t.rows[row][column], t.columns[column]);
}

TEST(Differences, ThatSeedsBringAboutAreNone) {
  const Table t = with_differences(
      swept_table({{"a", "3 of 3", "hit", Measure{1.0, 0.03, 3}, Measure{9}},
                   {"a", "3 of 3", "miss", Measure{2.0, 0.04, 3}, Measure{9}},
                   {"b", "2 of 3", "hit", Measure{1.1, 0.04, 2}, Measure{9}},   // t = 3.0 of 1.7 degrees: p > 0.05
                   {"b", "2 of 3", "miss", Measure{1.5, 0.03, 2}, Measure{9}},  // t = 16 of 2.7 degrees
                   {"c", "1 of 3", "miss", Measure{5.0}, Measure{9}},
                   {"c", "1 of 3", "other", Measure{5.0, 0.1, 3}, Measure{9}},
                   {"d", "0 of 3", std::monostate{}, std::monostate{}, std::monostate{}}}),
      1);
  ASSERT_EQ(t.columns.size(), 6u);
  EXPECT_EQ(t.columns[4].name, "difference");
  EXPECT_EQ(t.columns[4].unit, "to a");
  EXPECT_EQ(text_at(t, 0, 4), "-");
  EXPECT_EQ(text_at(t, 1, 4), "-");
  EXPECT_EQ(text_at(t, 2, 4), "none");
  EXPECT_EQ(text_at(t, 3, 4), "-0.5");
  EXPECT_EQ(text_at(t, 4, 4), "one seed");
  EXPECT_EQ(text_at(t, 5, 4), "-") << "the first variant has no such row";
  EXPECT_EQ(text_at(t, 6, 4), "-");
  EXPECT_EQ(text_at(t, 3, 5), "9");
  EXPECT_THAT(table_text(t), HasSubstr("difference [to a]"));
}

TEST(Differences, AreToTheFirstOfSeveralKeys) {
  Table t;
  t.columns = {{"variant"}, {"light.width"}, {"PSNR", "dB", Best::Highest, 3}};
  t.add({"a", "16", Measure{20, 0.1, 2}}), t.add({"a", "32", Measure{21, 0.1, 2}});
  t.add({"b", "16", Measure{19, 0.1, 2}});
  const Table with = with_differences(t, 2);
  EXPECT_EQ(with.columns[3].unit, "to a 16");
  EXPECT_EQ(text_at(with, 0, 3), "-");
  EXPECT_EQ(text_at(with, 1, 3), "+1");
  EXPECT_EQ(text_at(with, 2, 3), "-1");
}

TEST(Differences, OneVariantHasNone) {
  Table t;
  t.columns = {{"rays"}, {"error", "", Best::Lowest, 3}};
  t.add({"hit", Measure{1}}), t.add({"miss", Measure{2}});
  EXPECT_EQ(table_text(with_differences(t, 0)), table_text(t));
}

// ---- Measures ----

TEST(LightMeasures, RoughnessBinsCoverEachPixelOnce) {
  for (const double roughness : {0.0, 0.1, 0.2, 0.35, 0.5, 0.99, 1.0}) {
    int in = 0;
    for (const RoughnessBin& bin : roughness_bins()) in += bin.holds(roughness);
    EXPECT_EQ(in, 2) << roughness << ": one bin, and all";
  }
}

// ---- Configs that come with the program ----

TEST(TrainingStudy, ShippedConfigsEndWithinAnHour) {
  const std::set<std::string> of_maps{"ablation_encoder", "ablation_maps", "ablation_detail"};
  const fs::path folder = fs::path(CLERESTORY_SOURCE_DIR) / "experiments/configs";
  for (const char* name :
       {"ablation_rerender_loss", "ablation_hdr", "ablation_light_output", "ablation_encoding", "mlp_width",
        "ablation_out_of_view_form", "ablation_encoder", "ablation_maps", "ablation_detail"}) {
    const Config config = load_config(folder / (std::string(name) + ".toml"), training_study_schema());
    EXPECT_EQ(config.text("run.experiment"), name);
    EXPECT_GE(config.integer("ablation.seeds"), 3) << name;
    ASSERT_GE(config.variants().size(), 2u) << name;
    std::set<std::string> hashes;
    double minutes = 0;
    for (const ConfigVariant& v : config.variants()) {
      const Config variant = config.variant(v.name);
      const TrainingOptions options = training_options(variant);
      const bool maps = of_maps.contains(name);
      EXPECT_EQ(options.model.kind, maps ? "maps" : "light");
      minutes += options.train.minutes * static_cast<double>(config.integer("ablation.seeds"));
      EXPECT_TRUE(hashes.insert(config_hash(variant)).second) << name << ": " << v.name << " is another's twin";
    }
    EXPECT_GT(minutes, 0);
    EXPECT_LE(minutes, 46) << name << ": rooms and measures take the rest of the hour";
  }
}

TEST(TrainingStudy, PerceptualVariantsDifferInFeaturesAlone) {
  const Config config = load_config(fs::path(CLERESTORY_SOURCE_DIR) / "experiments/configs/ablation_perceptual.toml",
                                    training_study_schema());
  std::map<std::string, TrainingOptions> variants;
  for (const ConfigVariant& v : config.variants()) variants.emplace(v.name, training_options(config.variant(v.name)));
  ASSERT_EQ(variants.size(), 3u);
  EXPECT_EQ(variants.at("none").loss.weights.perceptual, 0);
  for (const char* name : {"random", "rooms"}) EXPECT_GT(variants.at(name).loss.weights.perceptual, 0) << name;
  EXPECT_EQ(variants.at("random").loss.weights.features.from, PerceptualFeatures::From::Random);
  EXPECT_EQ(variants.at("rooms").loss.weights.features.from, PerceptualFeatures::From::Rooms);
  for (const auto& [name, options] : variants) EXPECT_EQ(options.train.steps, variants.at("none").train.steps) << name;
  EXPECT_GE(config.integer("ablation.seeds"), 3);
}

TEST(TrainingStudy, KeysOfTheEncodingReachTheNet) {
  const InViewSize preset = in_view_size("compact");
  const auto net = [](const std::vector<std::string>& more) {
    std::vector<std::string> all{"train.steps=1", "model.kind=light"};
    all.insert(all.end(), more.begin(), more.end());
    return training_options(Config(training_schema(), all)).model.light.in_view;
  };
  EXPECT_EQ(net({}).direction_deviation, preset.direction_deviation);
  EXPECT_EQ(net({}).surface_deviation, preset.surface_deviation);
  EXPECT_EQ(net({"light.direction_deviation=0.5"}).direction_deviation, 0.5);
  EXPECT_EQ(net({"light.surface_deviation=3"}).surface_deviation, 3);
}

// ---- End to end ----

/// The smallest study there is: two bare rooms to learn from, one to be judged by.
struct TinyAblation : testing::Test {
  static void SetUpTestSuite() { shared_ = std::make_unique<ScratchFolder>("clerestory-ablation-rooms"); }
  static void TearDownTestSuite() { shared_.reset(); }
  void SetUp() override { set_quiet(true); }
  void TearDown() override { set_quiet(false); }

  void write_config(const std::string& variants) const {
    write_file(folder / "tiny.toml",
               fmt::format("extends = \"{}/experiments/configs/ablation_light.toml\"\n"
                           "[run]\nroot = \"{}/runs\"\nexperiment = \"tiny\"\n"
                           "[ablation]\ndata = \"{}/data\"\nrooms = 2\njudged_rooms = 1\nviews = 1\nseeds = 2\n"
                           "picture_spp = 2\nlight_spp = 1\nspp = 4\nbox_rooms = true\n"
                           "measures = [\"range\", \"rerender\"]\n"
                           "[model]\nwidth = 32\nheight = 24\n[train]\nminutes = 0\nsteps = 3\nbatch = 1\n"
                           "[light]\nrows = 4\nsamples = 16\nwidth = 16\nlayers = 2\nsegments = 4\n"
                           "shade_width = 8\nshade_height = 6\n[log]\nevery = 1\ncheckpoint_every = 1\n{}",
                           CLERESTORY_SOURCE_DIR, folder.path().string(), shared_->path().string(), variants));
  }
  fs::path run(const std::vector<std::string>& words = {}) const {
    return run_training_study(folder / "tiny.toml", words, {}, {"clerestory", "run"});
  }
  static Table table(const fs::path& place, const std::string& name) {
    const fs::path file = place / (name + ".table.json");
    return table_from_json(read_file(file), file.string());
  }
  fs::path only(const std::string& start) const {
    fs::path found;
    for (const auto& entry : fs::directory_iterator(folder / "runs/tiny"))
      if (entry.path().filename().string().starts_with(start)) {
        EXPECT_TRUE(found.empty()) << "two of " << start;
        found = entry.path();
      }
    return found;
  }
  /// Runs by the last write of their weights.
  std::map<std::string, fs::file_time_type> trained() const {
    std::map<std::string, fs::file_time_type> times;
    for (const auto& entry : fs::directory_iterator(folder / "runs/tiny"))
      if (const fs::path weights = entry.path() / "artifacts/last.safetensors"; fs::exists(weights))
        times[entry.path().filename().string()] = fs::last_write_time(weights);
    return times;
  }

  /// Two rooms beside those that the study makes.
  std::string fixed_list() const {
    GenerateOptions o;
    o.out = folder / "fixed", o.rooms.count = 2, o.views.count = 1, o.views.width = 32, o.views.height = 24;
    o.views.spp = 2, o.light.wanted = false, o.rooms.seed = 6, o.rooms.split = "test", o.rooms.boxes = true;
    generate(Device::open(), o);
    return o.out.string();
  }
  /// Means over rooms and seeds of an error of the variant that starts so, from what its trainings say.
  double mean_error(const std::string& variant, const std::string& list, std::size_t error) const {
    double total = 0;
    int count = 0;
    for (const auto& entry : fs::directory_iterator(folder / "runs/tiny"))
      if (entry.path().filename().string().starts_with(variant))
        for (const JudgedErrorsList& l : read_judged_errors(entry.path() / "artifacts/views.json"))
          for (const JudgedErrors& v : l.views)
            if (l.list == list) total += v.errors.at(error), ++count;
    return total / count;
  }

  void check_rooms(const Table& rooms) const {
    std::map<std::string, int> lists;  // rows of the second variant
    for (std::size_t row = 0; row < rooms.rows.size(); ++row) {
      const std::string variant = text_at(rooms, row, 0), list = text_at(rooms, row, 1), error = text_at(rooms, row, 2);
      if (variant == "one") {
        for (const std::size_t c : {5u, 6u, 7u, 8u}) EXPECT_EQ(text_at(rooms, row, c), "-") << "against itself";
        continue;
      }
      ++lists[list];
      if (list == "photographs") {
        EXPECT_EQ(error, "depth, rooted si-log");
        EXPECT_EQ(text_at(rooms, row, 8), "-") << "one photograph is no spread";
        continue;
      }
      EXPECT_EQ(text_at(rooms, row, 3), list == "fixed" ? "2" : "3");
      const auto number = [&](std::size_t c) { return std::get<Measure>(rooms.rows[row][c]).mean; };
      EXPECT_LE(number(6), number(5));
      EXPECT_LE(number(5), number(7));
      const bool clear = number(6) > 0 || number(7) < 0;
      EXPECT_EQ(text_at(rooms, row, 8), !clear ? "none" : number(5) < 0 ? "better" : "worse");
      if (error != "normals, degrees") continue;
      const double two = mean_error("two", list, 0), one = mean_error("one", list, 0);
      EXPECT_NEAR(number(4), two, 1e-9 * two);
      EXPECT_NEAR(number(5), two - one, 1e-9 * two);
      EXPECT_NE(two, one) << "the case would not tell them apart";
    }
    EXPECT_EQ(lists.size(), 3u) << "validation, fixed, photographs";
    EXPECT_GE(lists["fixed"], 3);
  }

  static void check_curves(const Table& curves) {
    std::vector<std::string> fixed;  // of the first variant: where it was judged on that list
    double before = -1;
    for (std::size_t row = 0; row < curves.rows.size(); ++row) {
      if (text_at(curves, row, 0) != "one" || text_at(curves, row, 3) != "fixed") continue;
      fixed.push_back(text_at(curves, row, 2));
      const double seconds = std::get<Measure>(curves.rows[row][5]).mean;
      if (fixed.size() == 1) {
        EXPECT_LT(seconds, 0.02) << "judging counts as training";
      }
      EXPECT_GT(seconds, before);
      before = seconds;
    }
    EXPECT_THAT(fixed, testing::ElementsAre("0", "1", "2", "end"));
    EXPECT_EQ(curves.columns[6].name, "ratio");
  }

  ScratchFolder folder{"clerestory-ablation"};
  static inline std::unique_ptr<ScratchFolder> shared_;  // the rooms: alike in all cases
};

const char* const kVariants =
    "[[variant]]\nname = \"ldr\"\noverrides = [\"light.ldr=true\"]\n"
    "[[variant]]\nname = \"hdr\"\nlabel = \"HDR\"\noverrides = []\n";
const char* const kBroken =
    "[[variant]]\nname = \"broken\"\noverrides = [\"loss.mixed=0\", \"loss.out_of_view=0\", \"loss.rerender=0\"]\n";

TEST_F(TinyAblation, TrainsJudgesComparesAndSkipsWhatIsDone) {
  write_config(std::string(kVariants) + kBroken);
  try {
    run();
    FAIL() << "a broken variant went unseen";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage) << "all that failed did by it";
    EXPECT_THAT(e.what(), HasSubstr("2 of 6 runs failed"));
  }
  const auto times = trained();
  EXPECT_EQ(times.size(), 4u) << "what compiled kernels is gone";
  const fs::path place = only("sweep-");
  EXPECT_FALSE(fs::exists(place / "validation.table.json"));

  const Table light = table(place, "light");
  ASSERT_EQ(light.rows.size(), 7u);  // three of each variant, one of the broken one
  EXPECT_EQ(text_at(light, 0, 0), "ldr");
  EXPECT_EQ(text_at(light, 0, 1), "2 of 2");
  EXPECT_EQ(text_at(light, 0, 2), "hit");
  EXPECT_EQ(text_at(light, 5, 0), "HDR");
  EXPECT_EQ(text_at(light, 5, 2), "all");
  EXPECT_EQ(text_at(light, 6, 0), "broken");
  EXPECT_EQ(text_at(light, 6, 1), "0 of 2");
  EXPECT_EQ(light.columns[4].name, "difference");
  EXPECT_EQ(light.columns[4].unit, "to ldr");
  for (const std::size_t row : {0u, 1u, 2u, 3u, 4u, 5u}) {
    const auto& error = std::get<Measure>(light.rows[row][3]);
    EXPECT_TRUE(error.mean > 0 && std::isfinite(error.mean)) << row;
    EXPECT_EQ(error.count, 2);
    EXPECT_EQ(std::get<Measure>(light.rows[row][16]).mean, 3) << "steps";
    for (const std::size_t seconds : {17u, 18u, 19u}) EXPECT_GT(std::get<Measure>(light.rows[row][seconds]).mean, 0);
  }
  EXPECT_EQ(table(place, "range").rows.size(), 3u);
  const Table rerender = table(place, "rerender");
  EXPECT_EQ(rerender.rows.size(), 9u);
  EXPECT_EQ(text_at(rerender, 3, 2), "all");
  EXPECT_GT(std::get<Measure>(rerender.rows[3][3]).mean, 0);
  const Table rooms = table(place, "rooms");
  ASSERT_EQ(rooms.rows.size(), 12u) << "six errors of the light, of two variants";
  EXPECT_EQ(text_at(rooms, 11, 2), "all rays, log, log-RGB RMSE");
  EXPECT_EQ(text_at(rooms, 11, 8), "-") << "one room is no spread";

  // The same again, but for tables that were lost: nothing is trained, the light has the same errors.
  for (const auto& [name, time] : times)
    if (name.starts_with("hdr")) fs::remove(folder / "runs/tiny" / name / "artifacts/light.table.json");
  write_config(kVariants);
  fs::remove_all(place);
  const fs::path again = run();
  EXPECT_EQ(trained(), times);
  const Table same = table(again, "light");
  ASSERT_EQ(same.rows.size(), 6u);
  for (std::size_t row = 0; row < 6; ++row) EXPECT_EQ(text_at(same, row, 3), text_at(light, row, 3));
}

TEST_F(TinyAblation, MapsAreTrainedAndJudgedOnRoomsAndPhotographs) {
  write_config(
      "[[variant]]\nname = \"one\"\noverrides = []\n"
      "[[variant]]\nname = \"two\"\noverrides = [\"train.steps=2\"]\n");
  const std::string frame = std::string(CLERESTORY_SOURCE_DIR) + "/assets/real/office";
  const fs::path place =
      run({"model.kind=maps", "ablation.measures=[]", "ablation.data=" + (folder / "maps").string(), "model.growth=4",
           "model.first=16", "model.layers=[1,1,1,1]", "model.decoder=[32,16,16,8,4]",
           "ablation.frames=[\"" + frame + "\"]", "loss.radiance=hdr", "ablation.judged_setting=held_out",
           "ablation.judged_rooms=3", "log.validate_every=1", "data.frames=[\"" + frame + "\"]",
           "data.lists=[\"fixed=" + fixed_list() + "\"]"});
  EXPECT_FALSE(fs::exists(folder / "maps/train/room-s7300-00000/000_envmap.exr")) << "light that nobody reads";
  EXPECT_THAT(read_file(folder / "maps/test/generate.json"), HasSubstr("held_out"));
  EXPECT_THAT(read_file(folder / "maps/train/generate.json"), HasSubstr("\"training\""));
  const Table maps = table(place, "maps");
  // Of each variant the maps that the room has, their mean and one photograph.
  std::vector<std::string> rows;
  for (std::size_t row = 0; row < maps.rows.size(); ++row)
    if (text_at(maps, row, 0) == "two") rows.push_back(text_at(maps, row, 2));
  EXPECT_THAT(rows, testing::Contains("normals, degrees"));
  EXPECT_THAT(rows, testing::Contains("all maps, geometric mean"));
  EXPECT_EQ(rows.back(), "depth of office, rooted si-log");
  EXPECT_EQ(maps.rows.size(), 2 * rows.size());
  for (const auto& row : maps.rows) {
    const auto& ratio = std::get<Measure>(row[5]);
    EXPECT_TRUE(std::isfinite(ratio.mean));
    EXPECT_EQ(ratio.count, 2);
  }
  EXPECT_EQ(std::get<Measure>(maps.rows.front()[7]).mean, 3);
  EXPECT_EQ(std::get<Measure>(maps.rows.back()[7]).mean, 2) << "steps";
  check_rooms(table(place, "rooms"));
  check_curves(table(place, "curves"));
  EXPECT_THAT(read_file(place / "report.html"), HasSubstr("Rooms of fixed"));
  EXPECT_THAT(read_file(place / "provenance.json"), HasSubstr("\"rooms of fixed\": \"2 views of "));
}

TEST_F(TinyAblation, ThePerceptualTermIsJudgedAlongEdges) {
  const std::string weights = std::string(CLERESTORY_SOURCE_DIR) + "/nets/weights/maps.safetensors";
  write_config(
      "[[variant]]\nname = \"none\"\noverrides = []\n"
      "[[variant]]\nname = \"random\"\noverrides = [\"loss.perceptual_features=random\"]\n"
      "[[variant]]\nname = \"rooms\"\noverrides = [\"loss.perceptual_features=rooms\", "
      "\"loss.perceptual_weights=" +
      weights + "\"]\n");
  const fs::path place = run(
      {"model.kind=maps", "ablation.measures=[edges]", "ablation.data=" + (folder / "maps").string(), "model.growth=4",
       "model.first=16", "model.layers=[1,1,1,1]", "model.decoder=[32,16,16,8,4]", "loss.radiance=hdr",
       "loss.perceptual=1", "ablation.judged_scale=2", "ablation.judged_rooms=2", "ablation.box_rooms=false"});
  const fs::path room = folder / "maps/test/room-s7301-00000";
  EXPECT_EQ(read_view(room, list_views(room).at(0)).depth.width, 64) << "twice the net's";
  EXPECT_EQ(read_view(folder / "maps/train/room-s7300-00000", "000").depth.width, 32);

  const Table edges = table(place, "edges");
  ASSERT_EQ(edges.rows.size(), 15u) << "five maps of three variants";
  EXPECT_THAT(edges.note, HasSubstr("64x48"));
  EXPECT_EQ(edges.columns[3].name, "along edges");
  EXPECT_EQ(edges.columns[4].name, "difference");
  EXPECT_EQ(edges.columns[4].unit, "to none");
  EXPECT_EQ(edges.columns[5].name, "away from edges");
  EXPECT_EQ(text_at(edges, 5, 0), "random");
  EXPECT_EQ(text_at(edges, 10, 2), "normals, degrees");
  for (const std::size_t row : {0u, 5u, 10u}) {
    const auto& normals = std::get<Measure>(edges.rows[row][3]);
    EXPECT_TRUE(normals.mean > 0 && std::isfinite(normals.mean)) << row;
    EXPECT_EQ(normals.count, 2) << "seeds";
  }
  const auto normals = [&](std::size_t row) { return std::get<Measure>(edges.rows[row][3]).mean; };
  EXPECT_NE(normals(5), normals(0)) << "the term changes nothing";
  EXPECT_NE(normals(10), normals(0)) << "the term changes nothing";

  const Table rooms = table(place, "rooms");
  int judged = 0;
  for (std::size_t row = 0; row < rooms.rows.size(); ++row)
    if (text_at(rooms, row, 0) == "rooms" && text_at(rooms, row, 1) == "along edges" &&
        text_at(rooms, row, 2) == "normals, degrees") {
      EXPECT_NEAR(std::get<Measure>(rooms.rows[row][4]).mean, normals(10), 1e-9 * normals(10));
      EXPECT_THAT(text_at(rooms, row, 8), testing::AnyOf("none", "better", "worse"));
      ++judged;
    }
  EXPECT_EQ(judged, 1);
}

TEST_F(TinyAblation, ClampedTruthIsLearnedClamped) {
  GenerateOptions o;
  o.out = folder / "room", o.rooms.count = 1, o.views.count = 1, o.views.width = 32, o.views.height = 24,
  o.views.spp = 2;
  o.light.spp = 1, o.light.probes = 1, o.rooms.seed = 5, o.rooms.split = "train", o.rooms.boxes = true;
  generate(Device::open(), o);
  LightStore store(name_views({o.out.string()}, "train"), 32, 24, 1 << 30);
  const LightTrainingOptions step{
      .batch = 1, .height = 24, .width = 32, .rows = 16, .samples = 64, .shade_height = 6, .shade_width = 8};
  const auto feeds = [&](bool ldr) { return light_batch({store.get(0)}, step, {.clipped = 0, .ldr = ldr}, {3}).feeds; };
  const auto hdr = feeds(false), ldr = feeds(true);
  for (const char* name : {"light0", "image", "shade_image"}) {
    const std::vector<double>&bright = hdr.at(name).real, &clamped = ldr.at(name).real;
    ASSERT_EQ(bright.size(), clamped.size());
    for (std::size_t i = 0; i < bright.size(); ++i) ASSERT_EQ(clamped[i], std::clamp(bright[i], 0.0, 1.0)) << name;
    if (std::string(name) != "shade_image") {  // a coarse grid may miss the lamp
      EXPECT_GT(*std::ranges::max_element(bright), 1) << name << ": there was nothing to clamp";
    }
  }
  EXPECT_EQ(ldr.at("points0").real, hdr.at("points0").real);
}

TEST_F(TinyAblation, MistakesAreFoundBeforeRoomsAreMade) {
  write_config(kVariants);
  const auto message = [&](const std::vector<std::string>& words) {
    try {
      run(words);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Usage);
      return std::string(e.what());
    }
    ADD_FAILURE() << "no error";
    return std::string();
  };
  const std::string elsewhere = "ablation.data=" + (folder / "elsewhere").string();
  EXPECT_THAT(message({elsewhere, "model.kind=maps"}), HasSubstr("are tables of the light (found range, rerender"));
  EXPECT_THAT(message({elsewhere, "ablation.measures=[edges]"}), HasSubstr("are tables of maps (found edges"));
  EXPECT_THAT(message({elsewhere, "ablation.judged_scale=2"}), HasSubstr("1 where model.kind = light"));
  EXPECT_THAT(message({elsewhere, "light.widht=3"}), HasSubstr("nearest known one is light.width"));
  EXPECT_THAT(message({elsewhere, "train.steps=0"}), HasSubstr("the run has no end"));
  EXPECT_THAT(message({elsewhere, "ablation.measures=[sharpness]"}), HasSubstr("ablation.measures"));
  EXPECT_FALSE(fs::exists(folder / "elsewhere"));
}

TEST_F(TinyAblation, TheProgramGoesOnWhereItWasInterrupted) {
  write_config("");  // one training a seed
  const fs::path said = folder / "said.txt";
  const std::vector<std::string> words{"run", folder / "tiny.toml", "ablation.seeds=1", "train.steps=12"};
  const auto checkpoint = [&] {
    for (const std::string& name : files_below(folder / "runs"))
      if (name.find("-compile-") == std::string::npos && name.find("checkpoints/step-") != std::string::npos)
        return true;
    return false;
  };
  {
    Program program(words, said);
    ASSERT_TRUE(wait_until(checkpoint)) << text_of(said);
    program.signal(SIGINT);
    EXPECT_EQ(program.wait(), 4) << text_of(said);
  }
  EXPECT_TRUE(only("sweep-").empty()) << "tables of a part";
  EXPECT_EQ(Program(words, said).wait(), 0) << text_of(said);
  EXPECT_THAT(text_of(said), HasSubstr("goes on after step"));
  EXPECT_THAT(text_of(said), HasSubstr("Incident light on 1 views of unseen rooms"));
  EXPECT_THAT(text_of(said), HasSubstr(only("sweep-").string()));
  EXPECT_EQ(Program({"run", folder / "tiny.toml", "run.seed=1,2"}, said).wait(), 2) << "a list without -m";
}

}  // namespace
}  // namespace clerestory
