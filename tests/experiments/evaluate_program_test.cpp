// `clerestory evaluate` with maps of another method and by protocols: what it says, and what it refuses with code 2.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/io/nyu.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/experiments/untrained_light.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

struct EvaluateProgram : testing::Test {
  ScratchFolder folder{"clerestory-evaluate-program"};
  fs::path rooms = folder / "rooms", maps = folder / "maps", log = folder / "log.txt", json = folder / "result.json";

  void SetUp() override { write_synthetic_rooms(rooms, "test", 1, 2, 32, 24, 3); }
  int evaluate(std::vector<std::string> words) const {
    words.insert(words.begin(), "evaluate");
    return Program(words, log).wait();
  }
  std::string said() const { return text_of(log); }
  void expect_refused(std::vector<std::string> words, const std::string& part) const {
    EXPECT_EQ(evaluate(std::move(words)), 2);
    EXPECT_THAT(said(), HasSubstr(part));
  }
  /// The true albedo a little too bright, as a method would leave it: display values in PNG, or linear in EXR.
  void write_albedo(bool shown) const {
    for (const char* id : {"000", "001"}) {
      const fs::path to = maps / "test_room_0" / id;
      fs::create_directories(to);
      Image albedo = read_view(rooms / "test_room_0" / id).albedo;
      for (float& v : albedo.data) {
        const float eight_bits = std::round(255 * std::pow(0.95f * v, 1 / 2.2f)) / 255;
        v = shown ? eight_bits : std::pow(eight_bits, 2.2f);
      }
      shown ? write_png(to / "albedo.png", albedo, Encoding::Linear)
            : write_exr(to / "albedo.exr", albedo, ExrType::Float);
    }
  }
  double metric(const std::string& name, const char* figure) const {
    return read_json_object(json)["metrics"][name][figure].get<double>();
  }
};

TEST_F(EvaluateProgram, MapsOfOthersAreJudgedOnceTheirColourIsKnown) {
  write_albedo(true);
  const std::vector<std::string> line{"--data", rooms.string(), "--maps", maps.string(), "--protocol", "marigold"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), line.begin(), line.end());
    more.push_back("--json=" + json.string());
    return more;
  };
  expect_refused(line, "--albedo: how is the albedo of these maps stored? (found none, expected linear, or srgb");
  ASSERT_EQ(evaluate(with({"--albedo", "srgb"})), 0) << said();
  EXPECT_THAT(said(), AllOf(HasSubstr("protocol: marigold"), HasSubstr("pictures: 2"),
                            HasSubstr("sha256 of their list: "), HasSubstr("albedo of the maps: display values")));
  const double shown = metric("albedo_psnr_db", "mean");
  EXPECT_GT(shown, 30);
  ASSERT_EQ(evaluate(with({"--albedo", "linear"})), 0) << said();
  EXPECT_LT(metric("albedo_psnr_db", "mean"), shown - 10) << "display values taken for linear ones";
  fs::remove_all(maps);
  write_albedo(false);
  ASSERT_EQ(evaluate(with({"--albedo", "linear"})), 0) << said();
  EXPECT_NEAR(metric("albedo_psnr_db", "mean"), shown, 1e-2);
}

TEST_F(EvaluateProgram, TheTruthHasNoErrorAmongOurOwnFigures) {
  ASSERT_EQ(
      evaluate({"--data", rooms.string(), "--maps", rooms.string(), "--albedo", "linear", "--json=" + json.string()}),
      0)
      << said();
  for (const char* key : {"normal_degrees", "depth_si_log", "albedo_si_mse", "roughness_mse", "metallic_mse"})
    EXPECT_NEAR(read_json_object(json)["metrics"][key]["ours"]["mean"].get<double>(), 0, 1e-6) << key;
  fs::create_directories(maps);
  fs::copy(rooms, maps, fs::copy_options::recursive);
  for (const char* id : {"000", "001"}) fs::remove(maps / "test_room_0" / (std::string(id) + "_depth.exr"));
  ASSERT_EQ(
      evaluate({"--data", rooms.string(), "--maps", maps.string(), "--albedo", "linear", "--json=" + json.string()}), 0)
      << said();
  EXPECT_FALSE(read_json_object(json)["metrics"].contains("depth_si_log"));
  EXPECT_NEAR(read_json_object(json)["metrics"]["albedo_si_mse"]["ours"]["mean"].get<double>(), 0, 1e-6);
  fs::remove(maps / "test_room_0/001_normal.exr");
  expect_refused({"--data", rooms.string(), "--maps", maps.string(), "--albedo", "linear"},
                 "test_room_0/001: not the same kinds of maps as of the first picture (found no normal)");
}

TEST_F(EvaluateProgram, WeightsAreJudgedByProtocol) {
  ASSERT_EQ(evaluate({"--data", rooms.string(), "--protocol", "zhu", "--json=" + json.string()}), 0) << said();
  EXPECT_THAT(said(), AllOf(HasSubstr("maps.safetensors"), HasSubstr("albedo, MSE"), HasSubstr("views: test")));
  EXPECT_GT(metric("albedo_mse", "mean"), 0);
  EXPECT_LT(metric("albedo_mse", "mean"), 0.3);
}

TEST_F(EvaluateProgram, AMethodIsJudgedByItsMaps) {
  const std::string li = (folder / "li").string();
  write_untrained_li2020(li, {64, 48});
  const auto errors = [&](std::vector<std::string> whose) {
    const std::vector<std::string> on{"--data", rooms.string(), "--protocol", "zhu", "--json=" + json.string()};
    whose.insert(whose.end(), on.begin(), on.end());
    EXPECT_EQ(evaluate(whose), 0) << said();
    return read_json_object(json)["metrics"];
  };
  const auto theirs = errors({"--method", li});
  EXPECT_EQ(theirs, errors({"--weights", li + "/maps.safetensors"}));
  EXPECT_NE(theirs, errors({"--method", "zhu"}));
  EXPECT_EQ(errors({"--method", "zhu"}), errors({}));
  expect_refused({"--data", rooms.string(), "--method", "li2021"}, "there is no such method or folder");
}

TEST_F(EvaluateProgram, WrongDataIsRefused) {
  fs::create_directories(folder / "iiw");
  write_png(folder / "iiw/5.png", Image(4, 4, 3, 0.5f));
  write_png(maps.parent_path() / "5_albedo.png", Image(4, 4, 3, 0.5f));
  write_file(folder / "iiw/5.json", R"({"intrinsic_comparisons": []})");
  const std::string data = (folder / "iiw").string(), given = folder.path().string();
  expect_refused({"--data", data, "--protocol", "zhu", "--maps", given, "--albedo", "srgb"},
                 "5.json: the key intrinsic_points is missing");
  fs::create_directories(folder / "nyu");
  NyuWriter writer(folder / "nyu" / kNyuFile, 1, 8, 6);
  writer.put(1, Image(8, 6, 3), Image(8, 6, 1, 2.0f));
  writer.commit();
  fs::resize_file(folder / "nyu" / kNyuFile, fs::file_size(folder / "nyu" / kNyuFile) - 100);
  expect_refused({"--data", (folder / "nyu").string(), "--protocol", "zhu", "--maps", given, "--albedo", "srgb"},
                 "nyu_depth_v2_labeled.mat: cannot be read: truncated file");
  expect_refused({"--data", data, "--protocol", "marigold", "--maps", given, "--albedo", "srgb"},
                 "has nothing to say of IIW");
}

TEST_F(EvaluateProgram, OptionsThatContradictEachOtherAreRefused) {
  const std::string data = rooms.string(), given = maps.string();
  expect_refused({"--protocol", "zhu"}, "--data: what are these to be judged on?");
  expect_refused({"--data", data, "--albedo", "srgb"}, "--albedo: does not go with weights");
  expect_refused({"--data", data, "--maps", given, "--albedo", "srgb", "--weights", "w"},
                 "--weights: does not go with");
  expect_refused({"run", "--data", data, "--protocol", "zhu"}, "RUN: does not go with --protocol");
  expect_refused({"run", "--data", data, "--weights", "w"}, "RUN: does not go with --weights");
  expect_refused({"run", "--data", data, "--method", "zhu"}, "RUN: does not go with --method");
  expect_refused({"run", "--data", data, "--frames", data}, "RUN: does not go with --frames");
  expect_refused({"run", "--data", data, "--mean-data", data}, "RUN: does not go with --mean-data");
  expect_refused({"run", "--data", data, "--split", "val"}, "RUN: does not go with --split");
  expect_refused({"--data", data, "--method", "zhu", "--weights", "w"}, "--weights: does not go with --method");
  expect_refused({"--data", data, "--maps", given, "--albedo", "srgb", "--method", "zhu"},
                 "--method: does not go with --maps");
  expect_refused({"--data", data, "--list", "l"}, "--list: does not go with rooms");
  expect_refused({"--data", data, "--list", "l", "--protocol", "zhu"}, "--list: rooms have lists of their own");
  expect_refused({"--data", data, "--protocol", "ours"}, "--protocol: unknown choice");
  expect_refused({"--data", data, "--protocol", "zhu", "--frames", data}, "--frames: does not go with --protocol");
}

}  // namespace
}  // namespace clerestory
