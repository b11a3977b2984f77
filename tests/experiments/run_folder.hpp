// A run folder made once by the real program, on a small generated room with true maps, and a copy for each test. No
// weights are needed, and every light is the photograph.
#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "host/io/image.hpp"
#include "host/report/progress.hpp"
#include "tests/experiments/bare_room.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {

/// One bare room, its view taken apart once; each test works on a copy.
struct RunFolder : testing::Test {
  using Words = std::vector<std::string>;
  static constexpr int kUsage = 2, kInterrupted = 4;

  static void SetUpTestSuite() {
    set_quiet(true);
    made_ = std::make_unique<ScratchFolder>("clerestory-run-folder-made");
    view_ = make_bare_room(Device::open(), *made_ / "rooms", 8);
    set_quiet(false);
    Program program(taken_apart(photo(), *made_ / "run"), *made_ / "said.txt");
    ASSERT_EQ(program.wait(), 0) << text_of(*made_ / "said.txt");
  }
  static void TearDownTestSuite() { made_.reset(); }

  static std::filesystem::path photo() { return view_.string() + "_im.exr"; }
  /// `invert` by true maps, in a second.
  static Words taken_apart(const std::filesystem::path& photograph, const std::filesystem::path& out) {
    Words words{"invert", photograph, "--gbuffer", view_, "--light", "image", "--spp", "2"};
    if (!out.empty()) words.insert(words.end(), {"--out", out});
    return words;
  }
  Words inserted(const Words& more = {}) const {
    Words words{"insert", run(), "--at", "32,40", "--radius", "0.1", "--light", "image", "--spp", "2"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  Words edited(const Words& more = {}) const {
    Words words{"edit", run(), "--mask", mask(), "--roughness", "0.5", "--light", "image", "--spp", "2"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  Words lit(const Words& more = {}) const {
    Words words{"light", run(), "--at", "32,40", "--size", "16x8", "--light", "image"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  /// A copy of the run, and a mask over half of its picture.
  void SetUp() override {
    std::filesystem::copy(*made_ / "run", run());
    Image half(64, 48, 1);
    std::fill(half.data.begin() + half.data.size() / 2, half.data.end(), 1.0f);
    write_png(mask(), half, Encoding::Linear);
  }
  std::filesystem::path run() const { return folder_ / "run"; }
  std::filesystem::path mask() const { return folder_ / "mask.png"; }

  int start(Words words, const Surroundings& around = {}) const { return Program(words, said_, around).wait(); }
  static void put(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
  }
  std::string said() const { return text_of(said_); }
  void expect_refused(const Words& words, const std::string& because) const {
    EXPECT_EQ(start(words), kUsage) << said();
    EXPECT_THAT(said(), testing::HasSubstr(because));
  }
  nlohmann::json record(const std::filesystem::path& path) const { return nlohmann::json::parse(text_of(path)); }

  ScratchFolder folder_{"clerestory-run-folder"};
  std::filesystem::path said_ = folder_ / "said.txt";
  static inline std::unique_ptr<ScratchFolder> made_;
  static inline std::filesystem::path view_;
};

}  // namespace clerestory
