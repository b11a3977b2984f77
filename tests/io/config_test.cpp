// Configs: inheritance, overrides, types, messages, dumps.
#include "host/io/config.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace clerestory {
namespace {

namespace fs = std::filesystem;

Schema example_schema() {
  Schema schema;
  schema.section("model", "The net.");
  schema.integer("seed", 0, "Seed of everything random.").aside();
  schema.text("title", "untitled", "Heading of the report.").aside();
  schema.integer("model.width", 64, "Channels of the first layer.", {1, 4096});
  schema.text("model.norm", "batch", "Normalisation.", {"batch", "group", "none"});
  schema.flag("model.residual", true, "Add the input again.");
  schema.real("train.lr", 1e-3, "Learning rate.", {0, 1});
  schema.integers("train.drops", {100, 200}, "Steps at which the rate falls.", {0});
  schema.reals("train.betas", {0.9, 0.999}, "Adam's decays.", {0, 1});
  schema.texts("data.sets", {"generated"}, "Folders of views.");
  schema.text("train.init", "", "Weights to start from.").optional();
  schema.real("data.share.*", 1, "Share of a data set in a batch.", {0});
  return schema;
}

class ConfigTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("config_test_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path file(const std::string& name, const std::string& text) const {
    const fs::path path = folder_ / name;
    fs::create_directories(path.parent_path());
    std::ofstream(path) << text;
    return path;
  }
  Config load(const std::string& text, const std::vector<std::string>& overrides = {}) const {
    return load_config(file("config.toml", text), schema_, overrides);
  }
  /// The message of the usage error that `text` and `overrides` cause.
  std::string refusal(const std::string& text, const std::vector<std::string>& overrides = {}) const {
    try {
      load(text, overrides);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Usage) << error.what();
      return error.what();
    }
    return "accepted";
  }

  const Schema schema_ = example_schema();
  fs::path folder_;
};

void expect_holds(const std::string& message, const std::vector<std::string>& parts) {
  for (const std::string& part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is missing in: " << message;
}

TEST_F(ConfigTest, DefaultsAndTypes) {
  const Config config(schema_);
  EXPECT_EQ(config.integer("model.width"), 64);
  EXPECT_EQ(config.text("model.norm"), "batch");
  EXPECT_TRUE(config.flag("model.residual"));
  EXPECT_EQ(config.real("train.lr"), 1e-3);
  EXPECT_EQ(config.integers("train.drops"), (std::vector<std::int64_t>{100, 200}));
  EXPECT_EQ(config.reals("train.betas"), (std::vector<double>{0.9, 0.999}));
  EXPECT_EQ(config.texts("data.sets"), std::vector<std::string>{"generated"});
  EXPECT_FALSE(config.has("train.init"));
  EXPECT_EQ(config.origin("model.width"), "default");
}

TEST_F(ConfigTest, FileSetsValuesAndRemembersTheLine) {
  const Config config = load("seed = 7\n[model]\nwidth = 32\n\n[train]\nlr = 1\nbetas = [0, 0.5]\n");
  EXPECT_EQ(config.integer("seed"), 7);
  EXPECT_EQ(config.integer("model.width"), 32);
  EXPECT_EQ(config.real("train.lr"), 1.0) << "an integer is a number";
  EXPECT_EQ(config.reals("train.betas"), (std::vector<double>{0, 0.5}));
  EXPECT_EQ(config.origin("train.lr"), (folder_ / "config.toml").string() + ":6");
}

TEST_F(ConfigTest, UnknownKeyNamesFileLineAndNearest) {
  expect_holds(refusal("[model]\n\nwidht = 3\n"), {"config.toml:3", "model.widht", "model.width"});
  expect_holds(refusal("width = 3\n"), {"config.toml:1", "unknown key width", "model.width"});
  expect_holds(refusal("[modle]\nwidth = 3\n"), {"config.toml", "model.width"});
  expect_holds(refusal("", {"tran.lr=0.1"}), {"tran.lr=0.1", "train.lr"});
  expect_holds(refusal("", {"+model.depth=3"}), {"unknown key model.depth"});
}

TEST_F(ConfigTest, TypeChangesAreErrors) {
  expect_holds(refusal("[model]\nwidth = 1.5\n"), {"config.toml:2", "model.width", "number 1.5", "integer"});
  expect_holds(refusal("[model]\nwidth = \"wide\"\n"), {"model.width", "\"wide\"", "integer"});
  expect_holds(refusal("[model]\nnorm = 3\n"), {"model.norm", "integer 3", "text"});
  expect_holds(refusal("[model]\nresidual = 1\n"), {"model.residual", "true or false"});
  expect_holds(refusal("[train]\ndrops = 5\n"), {"train.drops", "list of integers"});
  expect_holds(refusal("[train]\ndrops = [1, 2.5]\n"), {"train.drops", "a list", "list of integers"});
  expect_holds(refusal("model = 3\n"), {"config.toml:1", "model is a section"});
  expect_holds(refusal("[model.width]\nx = 3\n"), {"model.width", "a section", "integer"});
  expect_holds(refusal("[train]\nlr = 1979-05-27\n"), {"train.lr", "a date or time"});
  expect_holds(refusal("", {"model.width=1.5"}), {"model.width=1.5", "found 1.5", "an integer"});
  expect_holds(refusal("", {"model.residual=yes"}), {"true or false"});
  expect_holds(refusal("", {"train.lr="}), {"a number"});
}

TEST_F(ConfigTest, BoundsAndChoices) {
  expect_holds(refusal("[model]\nwidth = 0\n"), {"config.toml:2", "model.width is out of range", "1 to 4096"});
  expect_holds(refusal("[train]\nlr = nan\n"), {"train.lr is not a finite number"});
  expect_holds(refusal("[train]\nbetas = [0.9, 1.5]\n"), {"train.betas", "1.5"});
  expect_holds(refusal("[train]\ndrops = [-1]\n"), {"train.drops", "at least 0"});
  expect_holds(refusal("[model]\nnorm = \"grup\"\n"), {"model.norm", "did you mean group?", "batch, group, none"});
  expect_holds(refusal("", {"train.lr=inf"}), {"not a finite number"});
  EXPECT_EQ(load("[model]\nwidth = 4096\n").integer("model.width"), 4096);
}

TEST_F(ConfigTest, ExtendsIsRelativeAndLaterWins) {
  file("bases/model.toml", "[model]\nwidth = 8\nnorm = \"none\"\n");
  file("bases/train.toml", "extends = \"model.toml\"\n[model]\nwidth = 16\n[train]\nlr = 0.5\n");
  const Config one = load("extends = \"bases/train.toml\"\n[train]\nlr = 0.25\n");
  EXPECT_EQ(one.integer("model.width"), 16);
  EXPECT_EQ(one.text("model.norm"), "none");
  EXPECT_EQ(one.real("train.lr"), 0.25);
  const Config two = load("extends = [\"bases/train.toml\", \"bases/model.toml\"]\n");
  EXPECT_EQ(two.integer("model.width"), 8);
  expect_holds(refusal("extends = 3\n"), {"config.toml:1", "extends"});
  expect_holds(refusal("extends = \"missing.toml\"\n"), {"missing.toml"});
}

TEST_F(ConfigTest, CyclesAreNamed) {
  file("a.toml", "extends = \"b.toml\"\n");
  file("b.toml", "extends = \"./a.toml\"\n");
  try {
    load_config(folder_ / "a.toml", schema_);
    FAIL() << "a cycle was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Usage);
    expect_holds(error.what(), {"a.toml -> b.toml -> a.toml"});
  }
}

TEST_F(ConfigTest, BadFiles) {
  expect_holds(refusal("[model\nwidth=3\n"), {"config.toml:1", "TOML"});
  expect_holds(refusal("[model]\nwidth = 1\nwidth = 2\n"), {"config.toml:3", "TOML"});
  expect_holds(refusal("\"model.width\" = 32\n"), {"config.toml:1", "holds a point"});
  EXPECT_THROW(load_config(folder_ / "none.toml", schema_), Error);
  EXPECT_THROW(load_config(folder_, schema_), Error);
  EXPECT_EQ(load("").integer("model.width"), 64) << "an empty file changes nothing";
}

TEST_F(ConfigTest, OverrideGrammar) {
  const std::string text = "[model]\nwidth = 32\n[data.share]\noffice = 2.0\n";
  EXPECT_EQ(load(text, {"model.width=48"}).integer("model.width"), 48);
  EXPECT_EQ(load(text, {"model.norm=group"}).text("model.norm"), "group");
  EXPECT_EQ(load(text, {"title='a b'"}).text("title"), "a b");
  EXPECT_EQ(load(text, {"title=64"}).text("title"), "64");
  EXPECT_EQ(load(text, {"train.lr=1e-4"}).real("train.lr"), 1e-4);
  EXPECT_EQ(load(text, {"train.drops=[1, 2]"}).integers("train.drops"), (std::vector<std::int64_t>{1, 2}));
  EXPECT_EQ(load(text, {"train.drops=[]"}).integers("train.drops").size(), 0u);
  EXPECT_EQ(load(text, {"data.sets=[a,\"b,c\"]"}).texts("data.sets"), (std::vector<std::string>{"a", "b,c"}));
  EXPECT_EQ(load(text, {"+train.init=w.safetensors"}).text("train.init"), "w.safetensors");
  EXPECT_EQ(load(text, {"+data.share.real=0.5"}).real("data.share.real"), 0.5);
  for (const char* name : {"data.share.office", "data.share.real"})  // one that is there, and one that is not
    EXPECT_EQ(load(text, {fmt::format("++{}=3", name)}).real(name), 3);
  EXPECT_EQ(load(text, {"~model.width"}).integer("model.width"), 64) << "back to the default";
  EXPECT_FALSE(load(text, {"~data.share.office"}).has("data.share.office"));
  EXPECT_EQ(load(text, {"model.width=5", "model.width=6"}).integer("model.width"), 6) << "the last one wins";

  expect_holds(refusal(text, {"train.init=w"}), {"has no value yet", "+train.init=w"});
  expect_holds(refusal(text, {"+model.width=3"}), {"has a value already", "config.toml:2"});
  expect_holds(refusal(text, {"~train.init"}), {"has no value yet"});
  expect_holds(refusal(text, {"model.width"}), {"not an override"});
  expect_holds(refusal(text, {"=3"}), {"not an override"});
  expect_holds(refusal(text, {"~model.width=3"}), {"not an override"});
  expect_holds(refusal(text, {"data.share.*=3"}), {"unknown key"});
  expect_holds(refusal(text, {"data.sets=[a"}), {"ends with ]"});
  expect_holds(refusal(text, {"title=\"a"}), {"quotation mark"});
}

TEST_F(ConfigTest, VariantsLieBetweenFileAndCommandLine) {
  file("base.toml", "[[variant]]\nname = \"plain\"\n[[variant]]\nname = \"wide\"\noverrides = [\"model.width=128\"]\n");
  const std::string text =
      "extends = \"base.toml\"\n[model]\nwidth = 32\n[[variant]]\nname = \"wide\"\nlabel = \"Wide net\"\n"
      "overrides = [\"model.width=256\", \"train.lr=0.5\"]\n[[variant]]\nname = \"group-norm\"\noverrides = "
      "[\"model.norm=group\"]\n";
  const Config config = load(text, {"train.lr=0.125"});
  ASSERT_EQ(config.variants().size(), 3u);
  EXPECT_EQ(config.variants()[0].name, "plain");
  EXPECT_EQ(config.variants()[1].label, "Wide net") << "redefined in place";
  EXPECT_EQ(config.variants()[2].label, "group-norm");
  EXPECT_EQ(config.integer("model.width"), 32);
  EXPECT_EQ(config.variant("wide").integer("model.width"), 256);
  EXPECT_EQ(config.variant("wide").real("train.lr"), 0.125) << "the command line has the last word";
  EXPECT_EQ(config.variant("wide").variant("plain").integer("model.width"), 32) << "one variant at a time";
  EXPECT_EQ(config.variant("wide").with({"model.width=1"}).integer("model.width"), 1);
  try {
    config.variant("wid");
    FAIL();
  } catch (const Error& error) {
    expect_holds(error.what(), {"no variant wid", "wide"});
  }
  expect_holds(refusal("[[variant]]\nname = \"a/b\"\n"), {"config.toml:1", "fit for a folder"});
  expect_holds(refusal("[[variant]]\nlabel = \"x\"\n"), {"fit for a folder"});
  expect_holds(refusal("[[variant]]\nname = \"a\"\n[[variant]]\nname = \"a\"\n"), {"config.toml:3", "twice"});
  expect_holds(refusal("[[variant]]\nname = \"a\"\nwidth = 3\n"), {"config.toml:3", "variant.width"});
  expect_holds(refusal("[variant]\nname = \"a\"\n"), {"[[variant]]"});
}

TEST_F(ConfigTest, VariantErrorsNameTheVariant) {
  const Config config = load("[[variant]]\nname = \"a\"\noverrides = [\"model.widht=3\"]\n");
  try {
    config.variant("a");
    FAIL();
  } catch (const Error& error) {
    expect_holds(error.what(), {"config.toml:1", "variant a", "model.widht", "model.width"});
  }
}

TEST_F(ConfigTest, DumpReadsBackToTheSameBits) {
  const std::vector<double> odd = {0.1, 1.0 / 3, 5e-324, 1.7976931348623157e308, -0.0, 1e22, 123456789012345680.0};
  Schema schema = example_schema();
  schema.reals("odd.values", odd, "Doubles that are hard to print.");
  const std::string nasty = "quote \" backslash \\ line\nend\ttab \x01 umlaut \xc3\xa4";
  const Config first(schema, {"title=" + nasty, "+data.share.living room=0.25", "train.lr=1", "model.residual=false"});
  const Config second = parse_config(config_toml(first), "dump", schema);
  EXPECT_EQ(config_toml(second), config_toml(first));
  EXPECT_EQ(config_hash(second), config_hash(first));
  EXPECT_EQ(second.text("title"), nasty);
  EXPECT_EQ(second.real("data.share.living room"), 0.25);
  ASSERT_EQ(second.reals("odd.values").size(), odd.size());
  for (std::size_t i = 0; i < odd.size(); ++i)
    EXPECT_EQ(std::bit_cast<std::uint64_t>(second.reals("odd.values")[i]), std::bit_cast<std::uint64_t>(odd[i]))
        << odd[i];
}

TEST_F(ConfigTest, HashFollowsResultsOnly) {
  const Config config = load("[model]\nwidth = 32\n");
  EXPECT_EQ(config_hash(config).size(), 8u);
  EXPECT_EQ(config_hash(config), config_hash(Config(schema_, {"model.width=32"}))) << "not how it was said";
  EXPECT_EQ(config_hash(config), config_hash(config.with({"seed=9", "title=x"}))) << "keys that stand aside";
  EXPECT_NE(config_hash(config), config_hash(config.with({"model.width=33"})));
  EXPECT_NE(config_hash(config), config_hash(config.with({"+data.share.a=1"})));
  Schema more = schema_;
  more.text("model.kind", "", "Came after results that are kept.").later();
  EXPECT_EQ(config_hash(config), config_hash(Config(more, {"model.width=32", "model.kind="}))) << "its default";
  EXPECT_NE(config_hash(config), config_hash(Config(more, {"model.width=32", "model.kind=a"})));
}

TEST_F(ConfigTest, ProgramErrorsAreNotTheUsersFault) {
  const Config config(schema_);
  for (const auto& read : {+[](const Config& c) { c.integer("train.lr"); }, +[](const Config& c) { c.flag("no.such"); },
                           +[](const Config& c) { c.text("train.init"); }}) {
    try {
      read(config);
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Failed);
    }
  }
  Schema twice;
  twice.flag("a", true, "A.");
  EXPECT_THROW(twice.flag("a", true, "A."), Error);
  EXPECT_THROW(twice.integer("b", 5, "Default out of bounds.", {0, 4}), Error);
  EXPECT_THROW(twice.flag("c", true, ""), Error);
}

TEST_F(ConfigTest, PageListsEveryKey) {
  const std::string page = config_page(schema_, "Keys");
  for (const auto& [name, key] : schema_.keys()) expect_holds(page, {"`" + name + "`", key.doc});
  expect_holds(page, {"# Keys", "## model\n\nThe net.", "| `model.width` | integer | `64` | 1 to 4096 |",
                      "| `train.init` | text | none |", "## Top level"});
}

TEST_F(ConfigTest, ParsedTextRefusesExtends) {
  EXPECT_EQ(parse_config("model.width = 3\n", "weights", schema_).integer("model.width"), 3);
  EXPECT_THROW(parse_config("extends = \"a.toml\"\n", "weights", schema_), Error);
}

TEST(ConfigSweep, CartesianProductInOrder) {
  using Runs = std::vector<std::vector<std::string>>;
  EXPECT_EQ(expand_sweep({}), Runs{{}});
  EXPECT_EQ(expand_sweep({"a=1,2", "seed=range(0,3)"}), (Runs{{"a=1", "seed=0"},
                                                              {"a=1", "seed=1"},
                                                              {"a=1", "seed=2"},
                                                              {"a=2", "seed=0"},
                                                              {"a=2", "seed=1"},
                                                              {"a=2", "seed=2"}}));
  EXPECT_EQ(expand_sweep({"d=[1,2],[3]", "t='a,b'", "~x", "seed=range(-2,0)"}),
            (Runs{{"d=[1,2]", "t='a,b'", "~x", "seed=-2"},
                  {"d=[1,2]", "t='a,b'", "~x", "seed=-1"},
                  {"d=[3]", "t='a,b'", "~x", "seed=-2"},
                  {"d=[3]", "t='a,b'", "~x", "seed=-1"}}));
  EXPECT_EQ(expand_sweep({"room=dad's,mum's"}), (Runs{{"room=dad's"}, {"room=mum's"}}));
  EXPECT_EQ(expand_sweep({"d=[ 'a,]', b's],[\"c's\"]"}), (Runs{{"d=[ 'a,]', b's]"}, {"d=[\"c's\"]"}}));
  EXPECT_THROW(expand_sweep({"a=1,,2"}), Error);
  EXPECT_THROW(expand_sweep({"a=range(3,3)"}), Error);
  EXPECT_THROW(expand_sweep({"a=range(0,9999999999)"}), Error);
  EXPECT_THROW(expand_sweep({"a=range(0,1000)", "b=range(0,1000)"}), Error);
}

}  // namespace
}  // namespace clerestory
