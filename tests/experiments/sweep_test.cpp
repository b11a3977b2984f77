// Sweeps: what is run, what is skipped, what the tables over all runs say; then the real program on tiny configs.
#include "experiments/studies/sweep.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <sstream>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/report/file_lock.hpp"
#include "host/report/progress.hpp"
#include "host/report/run_directory.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
namespace fs = std::filesystem;

Table error_table(const std::vector<std::pair<std::string, double>>& rows) {
  Table table;
  table.title = "Errors";
  table.columns = {{"method"}, {"error", "relMSE", Best::Lowest, 3}};
  for (const auto& [name, error] : rows) table.add({name, Measure{error, 0.125, 4}});
  return table;
}

SweptRun swept(std::vector<std::string> values, const RunTables& tables, const std::string& failure = "") {
  return {std::move(values), "runs/x", failure, tables};
}

const Measure& number(const Table& table, std::size_t row, std::size_t column) {
  return std::get<Measure>(table.rows.at(row).at(column));
}
std::string words(const Table& table, std::size_t row) {
  std::string text;
  for (const Cell& cell : table.rows.at(row))
    if (const auto* word = std::get_if<std::string>(&cell)) text += (text.empty() ? "" : "|") + *word;
  return text;
}

TEST(SweepTables, SeedsArePutTogetherAndNothingElseIs) {
  const auto run = [](const char* rate, const char* seed, double a, double b) {
    return swept({rate, seed}, {{"errors", error_table({{"ours", a}, {"grid", b}})}});
  };
  const RunTables tables =
      sweep_tables({"train.rate", "run.seed"},
                   {run("1", "0", 1, 10), run("1", "1", 3, 10), run("2", "0", 5, 1), run("2", "1", 5, std::nan(""))});
  ASSERT_EQ(tables.size(), 1u);
  const Table& t = tables.at("errors");
  EXPECT_EQ(t.title, "Errors");
  ASSERT_EQ(t.columns.size(), 4u);
  EXPECT_EQ(t.columns[0].name, "train.rate");
  EXPECT_EQ(t.columns[1].name, "runs");
  EXPECT_EQ(t.columns[3].unit, "relMSE");
  ASSERT_EQ(t.rows.size(), 4u);
  EXPECT_EQ(words(t, 0), "1|2 of 2|ours");
  EXPECT_EQ(words(t, 3), "2|2 of 2|grid");
  EXPECT_EQ(number(t, 0, 3).mean, 2);
  EXPECT_DOUBLE_EQ(number(t, 0, 3).deviation, std::sqrt(2.0));
  EXPECT_EQ(number(t, 0, 3).count, 2);
  EXPECT_EQ(number(t, 1, 3).deviation, 0);
  EXPECT_TRUE(std::isnan(number(t, 3, 3).mean)) << "a seed that is not finite shows";
}

TEST(SweepTables, ASingleRunKeepsItsOwnSpread) {
  const RunTables tables = sweep_tables({"a"}, {swept({"1"}, {{"errors", error_table({{"ours", 7}, {"ours", 8}})}}),
                                                swept({"2"}, {{"errors", error_table({{"other", 9}})}})});
  const Table& t = tables.at("errors");
  ASSERT_EQ(t.columns.size(), 3u) << "no column of runs";
  ASSERT_EQ(t.rows.size(), 3u) << "rows of equal name stay apart";
  EXPECT_EQ(number(t, 1, 2).mean, 8);
  EXPECT_EQ(number(t, 1, 2).deviation, 0.125);
  EXPECT_EQ(number(t, 1, 2).count, 4);
  EXPECT_EQ(words(t, 2), "2|other");
}

TEST(SweepTables, ARowOfSomeRunsStandsWhereTheyHaveIt) {
  const auto run = [](const char* seed, const std::vector<std::pair<std::string, double>>& rows) {
    return swept({"1", seed}, {{"errors", error_table(rows)}});
  };
  const RunTables tables = sweep_tables(
      {"a", "run.seed"}, {run("0", {{"step 1", 4}, {"end", 2}}), run("1", {{"step 1", 6}, {"step 2", 5}, {"end", 4}})});
  const Table& t = tables.at("errors");
  ASSERT_EQ(t.rows.size(), 3u);
  EXPECT_EQ(words(t, 0), "1|2 of 2|step 1");
  EXPECT_EQ(words(t, 1), "1|1 of 2|step 2");
  EXPECT_EQ(words(t, 2), "1|2 of 2|end");
  EXPECT_EQ(number(t, 1, 3).mean, 5);
  EXPECT_EQ(number(t, 2, 3).mean, 3);
}

TEST(SweepTables, FailedRunsAreSeen) {
  const RunTables fine{{"errors", error_table({{"ours", 7}})}};
  const RunTables tables = sweep_tables({"a", "seed"}, {swept({"1", "0"}, fine), swept({"1", "1"}, {}, "no"),
                                                        swept({"2", "0"}, {}, "no"), swept({"2", "1"}, {}, "no")});
  const Table& t = tables.at("errors");
  ASSERT_EQ(t.rows.size(), 2u);
  EXPECT_EQ(words(t, 0), "1|1 of 2|ours");
  EXPECT_EQ(words(t, 1), "2|0 of 2");
  EXPECT_TRUE(std::holds_alternative<std::monostate>(t.rows[1][3]));
  Table other = error_table({{"ours", 1}});
  other.columns[1].name = "time";
  EXPECT_THROW(sweep_tables({"a"}, {swept({"1"}, fine), swept({"2"}, {{"errors", other}})}), Error);
}

Schema schema() {
  Schema s;
  s.text("run.root", "runs", "folder").aside().text("run.experiment", "sweep", "first part").aside();
  s.text("run.variant", "main", "second part").aside().integer("run.seed", 0, "seed").aside();
  s.text("run.device", "", "device").aside();
  s.integer("model.width", 1, "a number", {1, 100}).texts("model.names", {}, "a list");
  return s;
}

/// A sweep whose runs only note that they ran.
struct Sweep : testing::Test {
  ScratchFolder folder{"clerestory-sweep"};
  std::vector<std::string> ran;  // "width/seed", in order
  std::string fails;             // the one that throws
  ErrorKind fails_by = ErrorKind::Usage;
  std::map<std::string, std::function<void()>> besides;  // what else happens while a run is made

  void SetUp() override {
    set_quiet(true);
    write_file(folder / "a.toml", "[run]\nroot = \"" + (folder / "runs").string() + "\"\n");
  }
  void TearDown() override { set_quiet(false); }

  fs::path sweep(const std::vector<std::string>& overrides, const std::vector<std::string>& fixed = {}) {
    return run_sweep(folder / "a.toml", schema(), overrides, fixed, {"clerestory", "run"}, task());
  }
  std::vector<std::string> names(const std::vector<std::string>& overrides) const {
    return sweep_names(folder / "a.toml", schema(), overrides, {});
  }
  fs::path only(const std::vector<std::string>& overrides, const std::string& name) {
    return run_of_sweep(folder / "a.toml", schema(), overrides, {}, name, task());
  }

  SweepTask task() {
    ran.clear();
    const auto run = [&](const Config& c) {
      const RunDirectory directory(c.text("run.root"), c.text("run.experiment"), c.text("run.variant"), c,
                                   static_cast<std::uint64_t>(c.integer("run.seed")));
      if (directory.done()) return;
      ran.push_back(fmt::format("{}{}/{}", c.text("run.variant") == "main" ? "" : c.text("run.variant") + ":",
                                c.integer("model.width"), c.integer("run.seed")));
      if (const auto other = besides.find(ran.back()); other != besides.end()) other->second();
      if (ran.back() == fails) throw Error(fails_by, "the rope broke", "here");
      write_file(directory.artifact("errors.table.json"),
                 table_json(error_table({{"ours", static_cast<double>(c.integer("model.width"))}})));
      directory.finish();
    };
    const auto results = [](const fs::path& run_folder) {
      const fs::path file = run_folder / "artifacts/errors.table.json";
      return RunTables{{"errors", table_from_json(read_file(file), file)}};
    };
    return {run, results};
  }
  Error error_of(const std::vector<std::string>& overrides, const std::vector<std::string>& fixed = {}) {
    try {
      sweep(overrides, fixed);
    } catch (const Error& e) {
      return e;
    }
    ADD_FAILURE() << "no error";
    return usage_error("none");
  }
};

TEST_F(Sweep, RunsTheProductInOrderAndSkipsWhatIsDone) {
  const std::vector<std::string> overrides{"model.width=4,9", "run.seed=range(0,2)", "model.names=[\"a\",\"b\"]"};
  const fs::path place = sweep(overrides);
  EXPECT_THAT(ran, ElementsAre("4/0", "4/1", "9/0", "9/1"));
  EXPECT_EQ(place.parent_path(), folder / "runs/sweep");
  const Table errors = table_from_json(read_file(place / "errors.table.json"), "errors");
  ASSERT_EQ(errors.rows.size(), 2u);
  EXPECT_EQ(words(errors, 1), "9|2 of 2|ours");
  EXPECT_EQ(number(errors, 1, 3).mean, 9);
  const Table runs = table_from_json(read_file(place / "runs.table.json"), "runs");
  ASSERT_EQ(runs.rows.size(), 4u);
  EXPECT_THAT(words(runs, 3), HasSubstr("9|1|done|main-"));
  EXPECT_TRUE(fs::exists(place / "report.html"));
  EXPECT_EQ(sweep(overrides), place);
  EXPECT_TRUE(ran.empty());
  EXPECT_EQ(read_file(place / "errors.table.json"), table_json(errors));
}

TEST_F(Sweep, IsOfTheProgramThatMadeItsRuns) {
  const std::vector<std::string> overrides{"run.seed=range(0,2)"};
  sweep(overrides);
  for (const std::string& name : names(overrides)) {
    Provenance made;
    made.command = {"clerestory"}, made.build.commit = "0123abc";
    made.hashes["kernels"] = "fedc", made.hashes["kernels/nn/one.cl"] = made.hashes["kernels/" + name] = name;
    write_provenance(folder / "runs/sweep" / name / "provenance.json", made);
  }
  const Provenance all = read_provenance(sweep(overrides) / "provenance.json");
  EXPECT_TRUE(ran.empty()) << "tables alone are written again";
  EXPECT_EQ(all.build.commit, "0123abc");
  EXPECT_FALSE(all.build.dirty);
  EXPECT_EQ(all.hashes.at("kernels"), "fedc");
  for (const std::string& name : names(overrides)) {
    EXPECT_EQ(all.hashes.at("kernels/" + name), name);
    EXPECT_THAT(all.hashes.at("kernels/nn/one.cl"), HasSubstr(name)) << "of none alone, so that it is stale";
  }
}

TEST_F(Sweep, RunsThatReadOtherContentsOfOneFileAreNoTable) {
  const std::vector<std::string> overrides{"run.seed=range(0,2)"};
  sweep(overrides);
  const auto recorded = [&](const std::string& name, const std::string& hash, const std::string& device) {
    Provenance made;
    made.command = {"clerestory"}, made.device = device;
    made.inputs = {{"nets/light.safetensors", hash, 4}};
    write_provenance(folder / "runs/sweep" / name / "provenance.json", made);
  };
  const std::vector<std::string> runs = names(overrides);
  recorded(runs[0], "0123", "a CPU"), recorded(runs[1], "0123", "a GPU");
  EXPECT_EQ(read_provenance(sweep(overrides) / "provenance.json").device, "a CPU, a GPU");
  recorded(runs[1], "4567", "a GPU");
  const Error e = error_of(overrides);
  EXPECT_EQ(e.kind(), ErrorKind::Usage);
  EXPECT_THAT(std::string(e.what()), testing::AllOf(HasSubstr("nets/light.safetensors"), HasSubstr(runs[1])));
}

TEST_F(Sweep, ANetTooLargeForTheDeviceLetsTheOthersGoOnAndSaysWhatKindOfFailureItWas) {
  fails = "4/1", fails_by = ErrorKind::Device;
  EXPECT_EQ(error_of({"model.width=4,9", "run.seed=0,1"}).kind(), ErrorKind::Device);
  EXPECT_THAT(ran, ElementsAre("4/0", "4/1", "9/0", "9/1"));
}

TEST_F(Sweep, OneFailureLetsTheOthersGoOnAndIsTriedAgain) {
  fails = "4/1";
  const Error e = error_of({"model.width=4,9", "run.seed=0,1"});
  EXPECT_EQ(e.kind(), ErrorKind::Usage) << "what all that failed did by";
  EXPECT_THAT(std::string(e.what()), HasSubstr("1 of 4 runs failed"));
  EXPECT_THAT(ran, ElementsAre("4/0", "4/1", "9/0", "9/1"));
  fs::path place;
  for (const auto& entry : fs::directory_iterator(folder / "runs/sweep"))
    if (entry.path().filename().string().starts_with("sweep-")) place = entry.path();
  EXPECT_THAT(words(table_from_json(read_file(place / "runs.table.json"), "runs"), 1),
              HasSubstr("4|1|failed: here: the rope broke|main-"));
  fails = "";
  EXPECT_EQ(sweep({"model.width=4,9", "run.seed=0,1"}), place);
  EXPECT_THAT(ran, ElementsAre("4/1"));
}

TEST_F(Sweep, AnInterruptedOneGoesOn) {
  fails = "9/0", fails_by = ErrorKind::Interrupted;
  EXPECT_EQ(error_of({"model.width=4,9,16"}).kind(), ErrorKind::Interrupted);
  EXPECT_THAT(ran, ElementsAre("4/0", "9/0"));
  fails = "";
  sweep({"model.width=4,9,16"});
  EXPECT_THAT(ran, ElementsAre("9/0", "16/0"));
}

TEST_F(Sweep, ARunOfItAloneIsTheSame) {
  const std::vector<std::string> overrides{"model.width=4,9"};
  const std::vector<std::string> all = names(overrides);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(only(overrides, all[1]), folder / "runs/sweep" / all[1]);
  EXPECT_THAT(ran, ElementsAre("9/0"));
  only(overrides, all[1]);
  EXPECT_TRUE(ran.empty()) << "again: done";
  sweep(overrides);
  EXPECT_THAT(ran, ElementsAre("4/0"));
  try {
    only({"model.width=4,8"}, all[1]);
    FAIL() << "the sweep has changed";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage);
    EXPECT_THAT(e.what(), HasSubstr(all[1]));
  }
}

TEST_F(Sweep, CommandsOfItsRunsAreSafeForAShell) {
  EXPECT_EQ(
      sweep_commands({"main-1-s0", "main-2-s0"}, {"a b/clerestory", "train", "a.toml", "x=\"$y\"", "-m", "--list"}),
      "'a b/clerestory' train a.toml 'x=\"$y\"' -m --only main-1-s0\n"
      "'a b/clerestory' train a.toml 'x=\"$y\"' -m --only main-2-s0\n");
}

// As if another process had the run: locks of one process keep each other out.
TEST_F(Sweep, LeavesARunToWhoIsAtWorkOnIt) {
  const std::vector<std::string> overrides{"model.width=4,9"};
  const fs::path held = folder / "runs/sweep" / names(overrides)[0];
  fs::create_directories(held);
  std::optional<FileLock> other(std::in_place, RunDirectory::lock_of(held));
  const Error error = error_of(overrides);
  EXPECT_EQ(error.kind(), ErrorKind::Interrupted);
  EXPECT_THAT(error.what(), HasSubstr("at work on 1 of 2 runs"));
  EXPECT_THAT(ran, ElementsAre("9/0"));
  fs::remove_all(folder / "runs");
  fs::create_directories(held);
  other.emplace(RunDirectory::lock_of(held));
  besides["9/0"] = [&] { other.reset(); };
  EXPECT_TRUE(fs::exists(sweep(overrides) / "DONE")) << "it was free in the end";
  EXPECT_THAT(ran, ElementsAre("9/0", "4/0"));
}

TEST_F(Sweep, VariantsOfTheConfigAreSweptToo) {
  std::ofstream(folder / "a.toml", std::ios::app)
      << "[[variant]]\nname = \"thin\"\noverrides = [\"model.width=2\"]\n[[variant]]\nname = \"wide\"\n"
         "label = \"Wide\"\noverrides = [\"model.width=50\"]\n";
  const fs::path place = sweep({"run.seed=0,1"});
  EXPECT_THAT(ran, ElementsAre("thin:2/0", "wide:50/0", "thin:2/1", "wide:50/1"));
  EXPECT_EQ(words(table_from_json(read_file(place / "errors.table.json"), "errors"), 1), "Wide|2 of 2|ours");
}

TEST_F(Sweep, MistakesAreFoundBeforeTheFirstRun) {
  EXPECT_THAT(error_of({"model.width=4,900"}).what(), HasSubstr("model.width"));
  EXPECT_THAT(error_of({"model.widht=4,9"}).what(), HasSubstr("nearest known one is model.width"));
  EXPECT_THAT(error_of({"run.device=a,b"}).what(), HasSubstr("would be the same"));
  EXPECT_THAT(error_of({"run.seed=0,1"}, {"run.seed=5"}).what(), HasSubstr("would be the same"));
  EXPECT_TRUE(ran.empty());
  EXPECT_FALSE(fs::exists(folder / "runs"));
}

/// The real program.
struct SweepProgram : testing::Test {
  ScratchFolder folder{"clerestory-sweep-program"};
  const fs::path said = folder / "said.txt";
  int run(const std::vector<std::string>& words) const { return Program(words, said).wait(); }
};

TEST_F(SweepProgram, TrainsOneAfterAnotherAndSaysWhichFailed) {
  write_synthetic_rooms(folder / "data", "train", 1, 2, 32, 32, 5);
  write_synthetic_rooms(folder / "data", "val", 1, 2, 32, 32, 6);
  write_file(folder / "tiny.toml",
             fmt::format("[run]\nroot = \"{0}/runs\"\n[data]\ntrain = [\"{0}/data\"]\n[model]\ngrowth = 4\nfirst = 16\n"
                         "layers = [1,1,1,1]\ndecoder = [32,16,16,8,4]\nwidth = 32\nheight = 32\n[train]\nbatch = 1\n"
                         "steps = 1\nschedule = \"constant\"\n",
                         folder.path().string()));
  EXPECT_EQ(run({"train", folder / "tiny.toml", "-m", "loss.scale=1,1e300", "run.seed=range(1,3)"}), 1);
  const std::string text = text_of(said);
  EXPECT_THAT(text, HasSubstr("run 4 of 4: loss.scale=1e300 run.seed=2"));
  EXPECT_THAT(text, HasSubstr("2 of 4 runs failed"));
  EXPECT_THAT(text, HasSubstr("2 of 2"));  // of loss.scale = 1
  EXPECT_THAT(text, HasSubstr("±"));
  EXPECT_THAT(text, HasSubstr("failed: "));
  EXPECT_EQ(run({"train", folder / "tiny.toml", "-m", "run.seed=range(1,3)"}), 0);
  EXPECT_THAT(text_of(said), HasSubstr("nothing to do")) << "trained anew";
  EXPECT_EQ(run({"train", folder / "tiny.toml", "--list"}), 2) << "no sweep";
  EXPECT_THAT(text_of(said), HasSubstr("-m"));
}

// What a machine of a cluster does: one line of the list, by a shell, and the same again.
TEST_F(SweepProgram, EachLineOfTheListMakesItsRun) {
  write_file(folder / "it's tiny.toml",
             fmt::format("[run]\nroot = \"{}/runs\"\n[study]\nspp = [2]\ntruth_spp = 4\nseeds = 1\n[data]\nrooms = 1\n"
                         "width = 32\nheight = 24\nspp = 1\n",
                         folder.path().string()));
  const std::vector<std::string> sweep{"run", folder / "it's tiny.toml", "-m", "data.seed=1,2"};
  std::vector<std::string> listing = sweep;
  listing.push_back("--list");
  ASSERT_EQ(run(listing), 0);
  EXPECT_FALSE(fs::exists(folder / "runs")) << "a list makes nothing";
  std::istringstream lines(text_of(said));
  std::vector<std::string> commands;
  for (std::string line; std::getline(lines, line);) commands.push_back(line);
  ASSERT_EQ(commands.size(), 2u);
  const auto shell = [&](const std::string& line) { return Program({"-c", line}, said, {{}, {}, "/bin/sh"}).wait(); };
  EXPECT_EQ(shell(commands[1]), 0) << text_of(said);
  EXPECT_EQ(shell(commands[1]), 0);
  EXPECT_THAT(text_of(said), HasSubstr("done before, skipped"));
  EXPECT_EQ(run(sweep), 0);
  EXPECT_THAT(text_of(said), HasSubstr("done before, skipped"));
  EXPECT_THAT(text_of(said), HasSubstr("2 of 2"));
  EXPECT_EQ(shell(commands[0] + "x"), 2);
  EXPECT_THAT(text_of(said), HasSubstr("no run of this name"));
}

TEST_F(SweepProgram, RunsStudiesOneAfterAnother) {
  write_file(folder / "tiny.toml",
             fmt::format("[run]\nroot = \"{}/runs\"\n[study]\nspp = [2]\ntruth_spp = 4\nseeds = 1\n[data]\nrooms = 1\n"
                         "width = 32\nheight = 24\nspp = 1\n",
                         folder.path().string()));
  ASSERT_EQ(run({"run", folder / "tiny.toml", "study.light=image,constant", "-m", "data.seed=1,2"}), 0)
      << text_of(said);
  fs::path place;
  for (const auto& entry : fs::directory_iterator(folder / "runs/study"))
    if (entry.path().filename().string().starts_with("sweep-")) place = entry.path();
  EXPECT_THAT(text_of(said), HasSubstr(place.string()));
  const Table table = table_from_json(read_file(place / "layer.table.json"), "layer");
  EXPECT_EQ(table.columns[0].name, "study.light");
  EXPECT_THAT(words(table, 0), HasSubstr("image|2 of 2|"));
  EXPECT_THAT(words(table, table.rows.size() - 1), HasSubstr("constant|2 of 2|"));
  EXPECT_EQ(run({"run", folder / "tiny.toml", "-m", "run.seed=1,2"}), 2) << "a spread of nothing";
  EXPECT_EQ(run({"run", folder / "tiny.toml", "-m", "study.kind=layer,training"}), 2) << "two layers";
  EXPECT_THAT(text_of(said), HasSubstr("study.kind"));
}

}  // namespace
}  // namespace clerestory
