// A method as a folder of weights: who it is, every way in which it may be wrong, and that commands and studies take
// it.
#include "experiments/weights/method.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiments/studies/study.hpp"
#include "experiments/weights/weights.hpp"
#include "tests/cl/environment.hpp"
#include "tests/experiments/run_folder.hpp"
#include "tests/experiments/untrained_light.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

const fs::path kShipped = fs::path(CLERESTORY_SOURCE_DIR) / "nets/weights";
constexpr Size kSeen{96, 72};

std::string refused(const std::string& name) {
  return message_of([&] { find_method(name, "--method"); }, ErrorKind::Usage);
}

/// A folder of the rival's small random nets.
struct Methods : testing::Test {
  static void SetUpTestSuite() {
    made_ = std::make_unique<ScratchFolder>("clerestory-method-made");
    write_untrained_li2020(*made_ / "li", kSeen);
  }
  static void TearDownTestSuite() { made_.reset(); }
  static std::string li() { return (*made_ / "li").string(); }

  /// A copy of which one file is another, or none where `other` is empty.
  std::string with(const std::string& file, const fs::path& other) const {
    const fs::path copy = folder_ / "copy";
    fs::remove_all(copy);
    fs::copy(li(), copy);
    fs::remove(copy / file);
    if (!other.empty()) fs::copy(other / file, copy / file);
    return copy;
  }

  ScratchFolder folder_{"clerestory-method"};
  static inline std::unique_ptr<ScratchFolder> made_;
};

TEST_F(Methods, SayThemselvesWhoseTheyAre) {
  const Method ours = find_method("zhu", "--method");
  EXPECT_EQ(ours.name, "zhu");
  EXPECT_EQ(ours.light, "net");
  EXPECT_TRUE(fs::equivalent(ours.maps, kShipped / "maps.safetensors"));
  EXPECT_TRUE(fs::equivalent(ours.light_weights, kShipped));
  const Method same = find_method(kShipped, "--method"), theirs = find_method(li(), "--method");
  EXPECT_EQ(same.name, "zhu");
  EXPECT_EQ(same.light, "net");
  EXPECT_EQ(theirs.name, "li2020");
  EXPECT_EQ(theirs.light, "li2020");
  EXPECT_EQ(theirs.maps, fs::path(li()) / "maps.safetensors");
  EXPECT_EQ(theirs.light_weights, li());
}

TEST_F(Methods, ByNameLieBesideTheShippedWeights) {
  const ScopedVariable data{"CLERESTORY_DATA", folder_.path().string()};
  const std::string place = (folder_ / "nets/weights/li2020").string();
  EXPECT_THAT(refused("li2020"), AllOf(HasSubstr("--method li2020: " + place), HasSubstr("clerestory train"),
                                       HasSubstr("experiments/configs/li2020_maps.toml and li2020_light.toml"),
                                       HasSubstr("maps.safetensors, light_local.safetensors")));
  for (const char* config : {"li2020_maps.toml", "li2020_light.toml"})
    EXPECT_TRUE(fs::exists(fs::path(CLERESTORY_SOURCE_DIR) / "experiments/configs" / config));
  fs::create_directories(folder_ / "nets/weights");
  fs::copy(li(), place);
  EXPECT_EQ(find_method("li2020", "--method").light_weights, place);
  fs::remove_all(place);
  fs::copy(kShipped, place);
  EXPECT_THAT(refused("li2020"), AllOf(HasSubstr(place + "/light_local.safetensors: net"),
                                       HasSubstr("weights of another method"), HasSubstr("zhu"), HasSubstr("li2020")));
}

TEST_F(Methods, WrongOnesAreNamed) {
  EXPECT_THAT(refused("li2021"),
              AllOf(HasSubstr("--method"), HasSubstr("li2021"), HasSubstr("zhu, li2020 or a folder")));
  for (const char* file : {"maps.safetensors", "light_local.safetensors", "light_global.safetensors"}) {
    const std::string folder = with(file, {});
    EXPECT_THAT(refused(folder), AllOf(HasSubstr(folder + "/" + file), HasSubstr("lacks weights")));
  }
  const std::string mixed = with("maps.safetensors", kShipped);
  EXPECT_THAT(refused(mixed), AllOf(HasSubstr(mixed + "/maps.safetensors: net"), HasSubstr("weights of another method"),
                                    HasSubstr("zhu"), HasSubstr("li2020")));
  const std::string swapped = with("maps.safetensors", {});
  fs::copy(fs::path(li()) / "light_local.safetensors", fs::path(swapped) / "maps.safetensors");
  EXPECT_THAT(refused(swapped), HasSubstr(swapped + "/maps.safetensors"));
  const ScopedVariable light{"CLERESTORY_LIGHT_WEIGHTS", li()};
  EXPECT_THAT(refused("zhu"), AllOf(HasSubstr(li() + "/light_local.safetensors: net"), HasSubstr("another method")));
}

// --- Commands ----------------------------------------------------------------------------------------------------

struct MethodCommands : RunFolder {
  static void SetUpTestSuite() {
    RunFolder::SetUpTestSuite();
    write_untrained_li2020(li(), kSeen);
  }
  static std::string li() { return (*made_ / "li").string(); }
  /// With maps by the nets.
  Words inverted(const fs::path& out, const Words& more) const {
    Words words{"invert", photo(), "--fov", "60", "--spp", "2", "--out", out};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
};

TEST_F(MethodCommands, TakeAFolderInPlaceOfEachWeights) {
  const fs::path one = folder_ / "one", each = folder_ / "each";
  ASSERT_EQ(start(inverted(one, {"--method", li()})), 0) << said();
  ASSERT_EQ(
      start(inverted(each, {"--weights", li() + "/maps.safetensors", "--light", "li2020", "--light-weights", li()})), 0)
      << said();
  const nlohmann::json facts = record(one / "provenance.json")["facts"];
  EXPECT_EQ(facts["light"], "li2020 (" + li() + ")");
  EXPECT_THAT(std::string(facts["network"]), HasSubstr("li2020"));
  EXPECT_EQ(record(one / "render.json")["light"], "li2020");
  for (const char* map : {"albedo.exr", "normal.exr", "depth.exr", "material.exr", "rerender.exr"})
    EXPECT_EQ(text_of(one / map), text_of(each / map)) << map;

  // What goes on from the run: the folder alone, and nets that are not those by default.
  const Words probe{"light", one, "--at", "32,40", "--size", "16x8"};
  const auto asked = [&](const Words& more, const std::string& name) {
    Words words = probe;
    words.insert(words.end(), more.begin(), more.end());
    words.insert(words.end(), {"--out", folder_ / name});
    EXPECT_EQ(start(words), 0) << said();
    return text_of(folder_ / name);
  };
  const std::string by_method = asked({"--method", li()}, "method.exr");
  EXPECT_EQ(by_method, asked({"--light-weights", li()}, "weights.exr"));
  const std::string ours = asked({"--method", "zhu"}, "zhu.exr");
  EXPECT_EQ(ours, asked({}, "default.exr"));
  EXPECT_NE(ours, by_method);

  // Under a light that needs no nets the maps alone are the method's.
  ASSERT_EQ(start(inverted(each, {"--method", li(), "--light", "constant"})), 0) << said();
  EXPECT_EQ(record(each / "provenance.json")["facts"]["light"], "constant");
  EXPECT_EQ(text_of(one / "albedo.exr"), text_of(each / "albedo.exr"));
  for (const Words& words :
       {Words{"insert", one, "--at", "32,40", "--radius", "0.1", "--spp", "2", "--method", li()},
        Words{"edit", one, "--mask", mask(), "--roughness", "0.5", "--spp", "2", "--method", li()}}) {
    ASSERT_EQ(start(words), 0) << said();
    EXPECT_THAT(said(), HasSubstr("light: li2020 (" + li() + ")"));
  }
}

TEST_F(MethodCommands, AreRefusedBeforeTheWork) {
  const auto refused = [&](const Words& more, const std::string& because) {
    for (Words words : {inverted(folder_ / "never", {}), lit(), inserted(), edited()}) {
      if (words[0] != "invert")
        words.erase(std::ranges::find(words, "--light"), std::ranges::find(words, "--light") + 2);
      words.insert(words.end(), more.begin(), more.end());
      expect_refused(words, because);
    }
  };
  refused({"--method", "li2021"}, "there is no such method or folder");
  refused({"--method", run()}, "the folder of a method lacks weights");
  refused({"--method", li(), "--light-weights", li()}, "a method names these weights as well");
  expect_refused(inverted(folder_ / "never", {"--method", li(), "--weights", "x"}),
                 "a method names these weights as well");
  refused({"--method", li(), "--light", "net"}, "weights of another method");
  refused({"--method", "zhu", "--light", "li2020"}, "weights of another method");
  expect_refused(inverted(folder_ / "never", {"--method", "zhu", "--light", "li2020"}), "weights of another method");
  EXPECT_EQ(said().find("depth:"), std::string::npos) << "the nets of the maps have answered";
  EXPECT_FALSE(fs::exists(folder_ / "never"));
}

// --- Studies -----------------------------------------------------------------------------------------------------

struct MethodStudies : Methods {
  std::string ran(const std::string& kind, std::vector<std::string> more) const {
    std::vector<std::string> words{"study.kind=" + kind,
                                   "run.root=" + (folder_ / "runs").string(),
                                   "study.method=" + li(),
                                   "data.rooms=1",
                                   "data.width=64",
                                   "data.height=48",
                                   "data.spp=4"};
    if (kind != "ladder") words.push_back("study.seeds=1");
    words.insert(words.end(), more.begin(), more.end());
    return run_study(Config(study_schema(kind), words), {"clerestory", "run"});
  }
  static nlohmann::json provenance(const std::string& run) {
    return nlohmann::json::parse(text_of(fs::path(run) / "provenance.json"));
  }
};

TEST_F(MethodStudies, RestOnItsWeightsAlone) {
  const nlohmann::json user =
      provenance(ran("user", {"user.lights=[net]", "user.spp=2", "user.truth_spp=2", "user.probes=0"}));
  EXPECT_EQ(user["facts"]["method"], "li2020");
  EXPECT_EQ(user["facts"]["light"], "li2020 (" + li() + ")");
  std::vector<std::string> weights;
  for (const auto& input : user["inputs"])
    if (const std::string path = input["path"]; path.ends_with(".safetensors")) weights.push_back(path);
  EXPECT_THAT(weights, testing::UnorderedElementsAre(li() + "/maps.safetensors", li() + "/light_local.safetensors",
                                                     li() + "/light_global.safetensors"));
  const std::string light = ran("light", {"incident.views=1", "incident.points=10", "incident.ray_spp=2",
                                          "incident.probes=1", "incident.probe_spp=1"});
  EXPECT_EQ(provenance(light)["facts"]["light"], "li2020 (" + li() + ")");
  const std::string who = text_of(fs::path(light) / "artifacts/1_ablation.table.json");
  EXPECT_THAT(who, AllOf(HasSubstr("full (light = net)"), testing::Not(HasSubstr("out of view only"))));
  const nlohmann::json layer = provenance(ran("layer", {"study.light=net", "study.spp=[2]", "study.truth_spp=2"}));
  EXPECT_EQ(layer["facts"]["light"], "li2020 (" + li() + ")");
}

TEST_F(MethodStudies, RefuseWhatItIsNot) {
  const auto refused = [&](const std::string& kind, const std::vector<std::string>& more) {
    return message_of([&] { ran(kind, more); }, ErrorKind::Usage);
  };
  EXPECT_THAT(refused("light", {"study.method=li2021", "run.experiment=refused"}),
              AllOf(HasSubstr("study.method"), HasSubstr("li2021")));
  EXPECT_FALSE(fs::exists(folder_ / "runs/refused")) << "a run that never began";
  EXPECT_THAT(refused("light", {"light.weights=" + li()}),
              AllOf(HasSubstr("light.weights"), HasSubstr("a method names these weights as well")));
  EXPECT_THAT(refused("user", {"maps.weights=x"}), HasSubstr("maps.weights"));
  for (const char* kind : {"uncertainty", "ladder"})
    EXPECT_THAT(refused(kind, {}), AllOf(HasSubstr("takes the light apart"), HasSubstr(li()), HasSubstr("li2020")));
}

}  // namespace
}  // namespace clerestory
