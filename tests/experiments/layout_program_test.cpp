// `clerestory generate --layout`, and the way back: `evaluate --protocol` of what it wrote.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host/io/files.hpp"
#include "host/io/image.hpp"
#include "host/io/json_file.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

struct LayoutProgram : testing::Test {
  ScratchFolder folder{"clerestory-layout-program"};
  fs::path rooms = folder / "rooms", log = folder / "log.txt", json = folder / "result.json";

  int run(const std::vector<std::string>& words) const { return Program(words, log).wait(); }
  int generate(const std::vector<std::string>& more, const std::string& views = "2") const {
    const std::string assets = std::string(CLERESTORY_SOURCE_DIR) + "/assets";
    std::vector<std::string> line{"generate", "--rooms",  "1",     "--views",     views,     "--size",
                                  "32x24",    "--spp",    "2",     "--seed",      "3",       "--light-spp",
                                  "1",        "--probes", "0",     "--box-rooms", "--split", "test",
                                  "--assets", assets,     "--out", rooms.string()};
    line.insert(line.end(), more.begin(), more.end());
    return run(line);
  }
  std::string said() const { return text_of(log); }
  double mean(const std::string& metric) const {
    return read_json_object(json)["metrics"][metric]["mean"].get<double>();
  }
};

TEST_F(LayoutProgram, RoomsAreWrittenAndJudgedAsOtherDataSets) {
  ASSERT_EQ(generate({"--layout", "iiw"}), 0) << said();
  for (const char* layout : {"nyu", "openrooms"}) ASSERT_EQ(generate({"--layout", layout}), 0) << said();
  const std::vector<std::string> files = files_below(rooms / "iiw");
  ASSERT_EQ(files.size(), 4u) << "of two views";
  const std::string id = fs::path(files[0]).stem().string();  // the test picture, room_000
  const std::string room = id.substr(0, id.size() - 4);
  fs::create_directories(folder / "maps" / id);
  fs::copy(rooms / room / "000_albedo.exr", folder / "maps" / id / "albedo.exr");
  const std::string maps = (folder / "maps").string(), out = "--json=" + json.string();
  ASSERT_EQ(run({"evaluate", "--data", (rooms / "iiw").string(), "--protocol", "li", "--maps", maps, "--albedo",
                 "linear", out}),
            0)
      << said();
  EXPECT_EQ(mean("whdr_linear_percent"), 0);
  EXPECT_EQ(mean("whdr_display_percent"), 0);

  for (const char* map : {"normal", "depth"})
    for (const char* number : {"0001", "0002"})
      fs::copy(
          rooms / room / (number[3] == '1' ? std::string("000_") + map + ".exr" : std::string("001_") + map + ".exr"),
          folder / "maps" / (std::string(number) + "_" + map + ".exr"));
  ASSERT_EQ(run({"evaluate", "--data", (rooms / "nyu").string(), "--list", (rooms / "nyu/test.txt").string(),
                 "--protocol", "zhu", "--maps", maps, "--albedo", "linear", out}),
            0)
      << said();
  EXPECT_LT(mean("depth_si_log_rooted"), 1e-3) << "millimetres for metres";
  EXPECT_LT(mean("normal_mean_degrees"), 0.5) << "8 bits";

  ASSERT_EQ(run({"evaluate", "--data", rooms.string(), "--protocol", "zhu", "--maps", rooms.string(), "--albedo",
                 "linear", out}),
            0)
      << said();
  EXPECT_LT(mean("depth_log_mse"), 1e-9) << "the rooms themselves";

  // weights over the third, whose light is read as well
  ASSERT_EQ(run({"evaluate", "--data", (rooms / "openrooms").string(), "--protocol", "marigold", out}), 0) << said();
  EXPECT_GT(mean("albedo_psnr_db"), 3);
  write_file(rooms / "openrooms/main_xml" / room / "imenv_1.hdr",
             read_file(rooms / "openrooms/main_xml" / room / "im_1.hdr"));
  EXPECT_EQ(run({"evaluate", "--data", (rooms / "openrooms").string(), "--protocol", "li"}), 2);
  EXPECT_THAT(said(), HasSubstr("imenv_1.hdr: tiles of a wrong size (found 32x24, expected 256x96"));
}

TEST_F(LayoutProgram, WhatDoesNotGoWithALayoutIsRefusedBeforeTheWork) {
  EXPECT_EQ(generate({"--layout", "iiw", "--shard", "0/2"}), 2);
  EXPECT_THAT(said(), HasSubstr("--shard: does not go with --layout"));
  EXPECT_EQ(generate({"--layout", "interior"}), 2);
  fs::create_directories(rooms / "iiw");
  write_file(rooms / "iiw/mine.txt", "mine");
  EXPECT_EQ(generate({"--layout", "iiw"}), 2);
  EXPECT_THAT(said(), HasSubstr("iiw: is there already"));
  EXPECT_EQ(files_below(rooms), std::vector<std::string>{"iiw/mine.txt"});
}

}  // namespace
}  // namespace clerestory
