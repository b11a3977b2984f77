// Results as data: from a finished run to files, README and docs; what differs, and what is stale.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiments/results/blocks.hpp"
#include "experiments/results/catalogue.hpp"
#include "experiments/results/result.hpp"
#include "experiments/studies/study.hpp"
#include "host/cl/device.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/report/run_directory.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;
using Texts = std::vector<std::string>;

TEST(Results, EveryTableOfTheTreeIsThatOfItsFigures) {
  for (const std::string& difference : differences_in(CLERESTORY_SOURCE_DIR)) ADD_FAILURE() << difference;
}

TEST(Results, EveryScriptHasATitleAndMinutes) {
  const auto entries = catalogue(CLERESTORY_SOURCE_DIR);
  EXPECT_GT(entries.size(), 10u);
  for (const CatalogueEntry& entry : entries) {
    EXPECT_GT(entry.minutes, 0) << entry.name;
    EXPECT_FALSE(entry.title.empty()) << entry.name;
  }
}

// ---- Blocks ----

constexpr const char* kDocument =
    "# Page\n\n<!-- result study errors -->\n| a |\n<!-- end of result -->\nbetween\n"
    "  <!-- result study times -->\n<!-- end of result -->\nlast";

TEST(Blocks, AreFoundAndFilled) {
  const std::vector<Block> blocks = blocks_of(kDocument, "page.md");
  ASSERT_EQ(blocks.size(), 2u);
  EXPECT_EQ(blocks[0].result + " " + blocks[0].table + " " + blocks[0].text, "study errors | a |\n");
  EXPECT_EQ(blocks[1].line, 7);
  EXPECT_EQ(blocks[1].text, "");
  const auto same = [](const Block& block) { return block.text; };
  EXPECT_EQ(with_blocks(kDocument, "page.md", same), kDocument);
  const auto named = [](const Block& block) { return block.table + "\n"; };
  EXPECT_EQ(with_blocks(kDocument, "page.md", named),
            "# Page\n\n<!-- result study errors -->\nerrors\n<!-- end of result -->\nbetween\n"
            "  <!-- result study times -->\ntimes\n<!-- end of result -->\nlast");
}

TEST(Blocks, AMisspeltMarkerIsNoProse) {
  for (const char* text :
       {"<!-- result study -->\n<!-- end of result -->\n", "<!-- result study errors\n<!-- end of result -->\n",
        "<!-- result study errors -->\n", "<!-- end of result -->\n", "<!--result study errors -->\n",
        "<!-- result a b -->\n<!-- result c d -->\n<!-- end of result -->\n", "<!-- results a b -->\n"}) {
    try {
      blocks_of(text, "page.md");
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Usage);
      EXPECT_THAT(error.what(), HasSubstr("page.md:")) << text;
    }
  }
}

// ---- A small source tree with a made-up run ----

class ResultTree : public testing::Test {
 protected:
  void SetUp() override {
    write("experiments/configs/study.toml", "[study]\nkind = \"layer\"\n[data]\nrooms = 3\n");
    write("experiments/reproduce/study.sh", "#!/usr/bin/env bash\n# Ours against theirs.\n# minutes: 12\n");
    write("experiments/reproduce/all.sh", "#!/usr/bin/env bash\n# No result.\n");
    write("weights/maps.safetensors", "weights");
    write("README.md",
          "Before.\n<!-- result study errors -->\nold\n<!-- end of result -->\nAfter.\n"
          "<!-- result other errors -->\nkept\n<!-- end of result -->\n");
    write("docs/page.md", "<!-- result study times -->\n<!-- end of result -->\n");
  }
  fs::path tree() const { return folder_ / "tree"; }
  void write(const std::string& name, const std::string& text) const {
    make_directories((tree() / name).parent_path());
    write_file(tree() / name, text);
  }
  std::string text(const std::string& name) const { return read_file(tree() / name); }
  void replace(const std::string& name, const std::string& from, const std::string& to) const {
    std::string whole = text(name);
    const auto at = whole.find(from);
    ASSERT_NE(at, std::string::npos) << from << " in " << whole;
    write(name, whole.replace(at, from.size(), to));
  }

  /// A run as `clerestory run` leaves it, of that command.
  fs::path run(const Texts& words = {"experiments/configs/study.toml", "data.seed=7", "run.root=/somewhere/runs"},
               bool done = true) const {
    const Config config = study_config(tree() / "experiments/configs/study.toml", {"data.seed=7"});
    const RunDirectory run(folder_ / "runs", "study", "main", config, 0, true);
    Provenance p;
    p.command = {"/home/me/build/clerestory", "run"};
    p.command.insert(p.command.end(), words.begin(), words.end());
    p.build.commit = "0123abc", p.device = "a device, 2 units";
    p.hashes = {{"config", config_hash(config)}, {"kernels", kernels_hash()}};
    for (const char* file : {"nn/activation.cl", "shade/insertion.cl"})
      p.hashes[std::string("kernels/") + file] = kernel_hash(file);
    p.inputs.push_back(record_file(tree() / "weights/maps.safetensors"));
    p.rooms = {"held_out", {18446744073709551615u, 5}};
    p.seeds = {{"data.seed", 7}};
    p.facts = {{"light", "net (" + fs::weakly_canonical(tree()).string() + "/nets/weights)"}};
    p.figures = {{"minutes", 3.14}};
    write_provenance(run / "provenance.json", p);
    Table errors{"Errors", {{"who", ""}, {"hits", ""}, {"relMSE", "", Best::Lowest}}, {}, "Clamp 1, epsilon 0.01."};
    errors.add({std::string("ours|x"), Measure{20}, Measure{0.31, 0.02, 3}});
    errors.add({std::string("theirs"), Measure{30}, Measure{0.47, 0.03, 3}});
    Table times{"Times", {{"who", ""}, {"time", "s"}}, {}};
    times.add({std::string("ours"), Measure{2.5}});
    write_file(run.artifact("errors.table.json"), table_json(errors));
    write_file(run.artifact("times.table.json"), table_json(times));
    if (done) run.finish();
    return run.path();
  }
  /// The same where the command sweeps.
  fs::path swept_run(const std::string& word) const {
    const fs::path made = run({"experiments/configs/study.toml", word, "-m"});
    Provenance p = read_provenance(made / "provenance.json");
    p.hashes["config"] = study_hash(tree() / "experiments/configs/study.toml", {word}, true);
    write_provenance(made / "provenance.json", p);
    return made;
  }
  Result result() const { return result_of_run(run(), "study", "Ours against theirs", {}, tree()); }
  void make() const {
    write_result(result(), tree());
    refresh_blocks(tree(), "study");
  }
  Texts differences() const { return differences_in(tree()); }
  std::string difference() const {
    const Texts all = differences();
    EXPECT_THAT(all, SizeIs(1));
    return all.empty() ? "" : all[0];
  }
  CatalogueEntry entry() const { return catalogue(tree()).at(0); }

  ScratchFolder folder_{"results"};
};

TEST_F(ResultTree, FromARunToFilesAndBlocks) {
  make();
  const std::string json = text("docs/results/study.json"), markdown = text("docs/results/study.md");
  EXPECT_THAT(json, HasSubstr("\"command\": \"clerestory run experiments/configs/study.toml data.seed=7\""));
  EXPECT_THAT(json, HasSubstr("18446744073709551615"));
  EXPECT_THAT(json, HasSubstr("net (nets/weights)"));
  for (const char* place : {"/home/me", "/somewhere", folder_.path().c_str()}) EXPECT_THAT(json, Not(HasSubstr(place)));
  for (const char* part : {"# Ours against theirs", "0123abc, in 3.1 minutes, on a device", "2 of the setting held_out",
                           "data.rooms = 3", "Clamp 1, epsilon 0.01.", "| ours\\|x | 20 | **0.310 ± 0.020** |",
                           "weights/maps.safetensors", "![errors: relMSE](study.svg)"})
    EXPECT_THAT(markdown, HasSubstr(part));
  EXPECT_THAT(text("docs/results/study.svg"), HasSubstr(">theirs<"));
  const Result back = read_result(tree() / "docs/results/study.json");
  EXPECT_EQ(result_json(back), json);
  EXPECT_EQ(back.rooms.seeds, result().rooms.seeds);
  const std::string readme = text("README.md");
  EXPECT_EQ(readme.find("Before.\n<!-- result study errors -->\n**Errors**"), 0u) << readme;
  EXPECT_THAT(readme, Not(HasSubstr("old")));
  EXPECT_THAT(readme, HasSubstr("kept")) << "another result's";
  EXPECT_THAT(text("docs/page.md"), HasSubstr("2.5"));
}

TEST_F(ResultTree, SettingsAreThoseOfAllOfIt) {
  write("experiments/configs/study.toml",
        "[study]\nkind = \"layer\"\n[data]\nrooms = 3\nspp = 8\n[[variant]]\nname = \"few\"\noverrides = "
        "[\"data.spp=2\"]\n");
  const Result swept = result_of_run(swept_run("data.rooms=3,4"), "study", "Ours against theirs", {}, tree());
  EXPECT_EQ(swept.settings.count("data.rooms"), 0u) << "its values are in the tables";
  EXPECT_EQ(swept.settings.at("data.spp"), "8");
  EXPECT_EQ(swept.settings.at("variant few"), "data.spp=2");
}

TEST_F(ResultTree, ABlockOfNoResultIsFound) {
  make();
  EXPECT_THAT(difference(), StartsWith("README.md:13: no such result (found other"));
  EXPECT_THROW(refresh_blocks(tree()), Error);
  replace("README.md", "result other errors", "result study nothing");
  EXPECT_THAT(difference(), HasSubstr("has no such table"));
}

TEST_F(ResultTree, AChangedDigitIsFoundWhereverItIs) {
  make();
  replace("README.md", "<!-- result other errors -->\nkept\n<!-- end of result -->\n", "");
  EXPECT_THAT(differences(), IsEmpty());
  replace("README.md", "0.310", "0.210");
  EXPECT_THAT(difference(), HasSubstr("README.md:2: differs from table errors of docs/results/study.json: line 7: "));
  refresh_blocks(tree());
  EXPECT_THAT(differences(), IsEmpty());

  replace("docs/results/study.md", "0.470", "0.471");
  EXPECT_THAT(difference(), HasSubstr("docs/results/study.md: differs from its JSON"));
  write_result(read_result(tree() / "docs/results/study.json"), tree());
  EXPECT_THAT(differences(), IsEmpty());

  replace("docs/results/study.json", "0.47", "0.48");  // then all others are wrong
  EXPECT_THAT(differences(), ElementsAre(StartsWith("docs/results/study.md: "), StartsWith("docs/results/study.svg: "),
                                         StartsWith("README.md:2: ")));
}

TEST_F(ResultTree, ProseBetweenMarkersIsFound) {
  make();
  replace("README.md", "<!-- result other errors -->\nkept\n<!-- end of result -->\n", "");
  replace("docs/page.md", "<!-- end", "That is fast.\n<!-- end");
  EXPECT_THAT(difference(), HasSubstr("That is fast."));
}

TEST_F(ResultTree, LeftOversAreFound) {
  make();
  replace("README.md", "<!-- result other errors -->\nkept\n<!-- end of result -->\n", "");
  write("docs/results/gone.md", "# Figures of nothing\n");
  EXPECT_THAT(difference(), HasSubstr("docs/results/gone.md: belongs to no JSON"));
  fs::remove(tree() / "docs/results/gone.md");
  fs::remove(tree() / "experiments/reproduce/study.sh");
  EXPECT_THAT(difference(), HasSubstr("no experiments/reproduce/study.sh makes it"));
}

TEST_F(ResultTree, StaleIsWhatWasMadeWithOtherThings) {
  EXPECT_TRUE(entry().missing);
  EXPECT_EQ(entry().minutes, 12);
  make();
  EXPECT_TRUE(entry().current()) << entry().staled[0];
  EXPECT_EQ(entry().title, "Ours against theirs");
  write("weights/maps.safetensors", "better ones");
  EXPECT_THAT(entry().staled, ElementsAre("weights/maps.safetensors"));
  replace("experiments/configs/study.toml", "rooms = 3", "rooms = 4");
  EXPECT_THAT(entry().staled, ElementsAre("experiments/configs/study.toml", "weights/maps.safetensors"));
  replace("docs/results/study.json", kernel_hash("shade/insertion.cl"), "0000000000000000");
  fs::remove(tree() / "weights/maps.safetensors");
  EXPECT_THAT(entry().staled, ElementsAre("kernels/shade/insertion.cl", "experiments/configs/study.toml",
                                          "weights/maps.safetensors (gone)"));
  replace("docs/results/study.json", "kernels/nn/activation.cl", "kernels/nn/gone.cl");
  EXPECT_EQ(entry().staled[0], "kernels/nn/gone.cl");
  EXPECT_EQ(entry().name, "study");
}

TEST_F(ResultTree, WhatIsNotAResultIsRefused) {
  const auto reason = [&](const fs::path& folder, const PlottedColumn& plotted = {}) -> std::string {
    try {
      result_of_run(folder, "study", "x", plotted, tree());
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Usage);
      return error.what();
    }
    return "nothing";
  };
  EXPECT_THAT(reason(folder_ / "none"), HasSubstr("no such folder"));
  EXPECT_THAT(reason(run({"experiments/configs/study.toml"}, false)), HasSubstr("not done"));
  EXPECT_THAT(reason(run({"/etc/study.toml"})), HasSubstr("outside of the source tree"));
  EXPECT_THAT(reason(run({"experiments/configs/study.toml", "data.seed=8"})), HasSubstr("another config"));
  EXPECT_THAT(reason(run({"experiments/configs/study.toml", "data.seed=7", "run.variant=a=/tmp/b"})),
              HasSubstr("path of this machine"));
  EXPECT_THAT(reason(run(), {"errors", "PSNR"}), HasSubstr("who, hits, relMSE"));
  EXPECT_THAT(reason(run(), {"sums", ""}), HasSubstr("errors, times"));
  EXPECT_EQ(result_of_run(run(), "study", "x", {"", "time"}, tree()).plotted.table, "times");
  EXPECT_EQ(result_of_run(run(), "study", "x", {"times", ""}, tree()).plotted.column, "time");
  const fs::path other = folder_ / "elsewhere";
  write_file(other, "weights");
  const fs::path folder = run();
  Provenance p = read_provenance(folder / "provenance.json");
  p.inputs.push_back(record_file(other));
  write_provenance(folder / "provenance.json", p);
  EXPECT_THAT(reason(folder), HasSubstr("what this run rests on lies outside of the source tree"));
}

TEST_F(ResultTree, TheCommandLineWritesListsAndChecks) {
  const auto clerestory = [&](Texts words) {
    words.insert(words.end(), {"--tree", tree().string()});
    words.insert(words.begin(), "results");
    const int code = Program(words, folder_ / "said").wait();
    return std::pair(code, read_file(folder_ / "said", 1 << 20, true));
  };
  EXPECT_THAT(clerestory({"list"}).second, HasSubstr("missing"));
  EXPECT_EQ(clerestory({"list", "--stale", "--names"}).second, "study\n");
  EXPECT_EQ(clerestory({"check", "--stale"}).first, 1);
  EXPECT_EQ(clerestory({"write", run({"experiments/configs/study.toml"}, false).string(), "--name", "study"}).first, 2);
  EXPECT_EQ(clerestory({"write", run().string(), "--name", "../study"}).first, 2);
  EXPECT_EQ(clerestory({"write", run().string(), "--name", "study", "--title", "T", "--plot", "hits"}).first, 0);
  EXPECT_EQ(clerestory({"list", "--stale", "--names"}).second, "");
  EXPECT_EQ(clerestory({"check"}).first, 1) << "README speaks of another";
  replace("README.md", "<!-- result other errors -->\nkept\n<!-- end of result -->\n", "");
  EXPECT_EQ(clerestory({"check", "--stale"}), std::pair(0, std::string("1 results, 0 of them missing or stale; 0 "
                                                                       "differences from their figures\n")));
  write("weights/maps.safetensors", "others");
  EXPECT_EQ(clerestory({"check"}).first, 0) << "said, no failure";
  EXPECT_THAT(clerestory({"check"}).second, HasSubstr("study: stale: weights/maps.safetensors"));
  EXPECT_EQ(clerestory({"check", "--stale"}).first, 1);
  write("docs/results/study.md", "# By hand\n");
  EXPECT_EQ(clerestory({"check"}).first, 1);
  EXPECT_EQ(clerestory({"refresh"}).first, 0);
  EXPECT_EQ(clerestory({"check"}).first, 0);
}

}  // namespace
}  // namespace clerestory
