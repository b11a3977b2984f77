// Manifests of data sets: what they say, and that whatever is wrong is named by file, key, value and expectation.
#include "tracer/manifest.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "host/io/files.hpp"
#include "tests/message_of.hpp"
#include "tests/tracer/small_manifest.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

struct Manifests : testing::Test {
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "clerestory-manifest-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder = name, file = folder / "set.toml";
    write_file(file, kSmallManifest);
  }
  void TearDown() override { fs::remove_all(folder); }

  /// The small manifest with what must come out made up.
  Manifest filled() const {
    Manifest m = read_manifest(file, false);
    m.expected_version = m.version, m.assets_hash = "0123456789abcdef";
    for (SetSplit& split : m.splits) {
      split.rooms_hash = "fedcba9876543210", split.cameras.assign(static_cast<std::size_t>(2 * split.rooms), 1);
      split.cameras[0] = 23;
      split.views.resize(2);
      for (std::size_t k = 0; k < kViewMeans; ++k) split.views[1][k] = {0.1 * static_cast<double>(k), 1e-3};
    }
    return m;
  }
  /// What is said where `right` stands as `wrong`.
  std::string refusal_of(const std::string& right, const std::string& wrong) const {
    std::string text = manifest_text(filled());
    const std::size_t at = text.find(right);
    EXPECT_NE(at, std::string::npos) << right;
    if (at == std::string::npos) return "";
    write_file(folder / "wrong.toml", text.replace(at, right.size(), wrong));
    return message_of([&] { read_manifest(folder / "wrong.toml"); }, ErrorKind::Usage);
  }
  fs::path folder, file;
};

TEST_F(Manifests, SayAllThatPixelsFollowFrom) {
  const Manifest m = read_manifest(file, false);
  EXPECT_EQ(m.name, "small");
  EXPECT_EQ(m.version, 3);
  EXPECT_EQ(m.expected_version, 0);
  EXPECT_EQ(m.views.count, 2);
  EXPECT_EQ(m.views.width, 32);
  EXPECT_EQ(m.views.height, 24);
  EXPECT_EQ(m.views.spp, 4);
  EXPECT_EQ(m.views.clamp, 1);
  EXPECT_EQ(m.views.handling.roll, 5);
  EXPECT_EQ(m.views.handling.close_ups, 0.25);
  EXPECT_EQ(m.views.handling.from_above, 0);  // a set of before there was any
  EXPECT_TRUE(m.light.wanted);
  EXPECT_EQ(m.light.spp, 1);
  EXPECT_EQ(m.light.probes, 1);
  ASSERT_EQ(m.splits.size(), 2u);
  EXPECT_EQ(m.splits[0].name, "train");
  EXPECT_EQ(m.splits[0].rooms, 3);
  EXPECT_EQ(m.splits[0].seed, 7u);
  EXPECT_EQ(m.splits[0].setting, Setting::Training);
  EXPECT_EQ(m.splits[1].name, "test");
  EXPECT_EQ(m.splits[1].setting, Setting::HeldOut);
}

TEST_F(Manifests, AreReadAsTheyWereWritten) {
  const std::string text = manifest_text(filled());
  EXPECT_EQ(text, manifest_text(filled()));
  EXPECT_TRUE(text.starts_with("# Small.\n\n")) << "the comment is lost";
  write_file(file, text);
  const Manifest m = read_manifest(file);
  EXPECT_EQ(m.expected_version, 3);
  EXPECT_EQ(m.assets_hash, "0123456789abcdef");
  EXPECT_EQ(m.splits[1].rooms_hash, "fedcba9876543210");
  EXPECT_THAT(m.splits[1].cameras, ElementsAre(23, 1));
  ASSERT_EQ(m.splits[0].views.size(), 2u);
  for (std::size_t k = 0; k < kViewMeans; ++k) {
    EXPECT_EQ(m.splits[0].views[1][k].value, 0.1 * static_cast<double>(k));
    EXPECT_EQ(m.splits[0].views[1][k].within, 1e-3);
  }
  EXPECT_EQ(text, manifest_text(m));
}

TEST_F(Manifests, WithoutWhatMustComeOutAreOnlyBegun) {
  EXPECT_THAT(message_of([&] { read_manifest(file); }, ErrorKind::Usage),
              AllOf(HasSubstr("set.toml"), HasSubstr("expected.version is missing")));
}

TEST_F(Manifests, WhatIsWrongIsNamed) {
  struct Case {
    const char *right, *wrong;
    std::vector<std::string> says;
  };
  for (const Case& c : std::vector<Case>{
           {"spp = 4", "spp = 0", {"wrong.toml:", "views.spp", "0", "1 to 1048576"}},
           {"spp = 4", "spp = \"4\"", {"wrong.toml:", "views.spp", "\"4\"", "integer"}},
           {"spp = 4", "sppp = 4", {"wrong.toml:", "views.sppp", "views.spp"}},
           {"spp = 4\n", "", {"wrong.toml", "views.spp is missing", "integer"}},
           {"rooms = 3", "rooms = 0", {"wrong.toml:", "train.rooms", "0", "1 to 4000"}},
           {"setting = \"held_out\"\n", "", {"wrong.toml", "test.setting is missing"}},
           {"\"held_out\"", "\"training\"", {"wrong.toml:", "test.seed", "rooms of train", "7", "another seed"}},
           {"version = 3", "version = 4", {"wrong.toml:", "expected.version", "4", "3", "--write-expected"}},
           {"fedcba9876543210", "fedcba987654321", {"wrong.toml:", "expected.rooms", "fedcba987654321", "16"}},
           {"0123456789abcdef", "0123456789abcdeg", {"wrong.toml:", "expected.assets", "16 hexadecimal"}},
           {"\"xb\"", "\"xbb\"", {"wrong.toml:", "test.expected.cameras", "3 letters", "2"}},
           {"\"xb\"", "\"xy\"", {"wrong.toml:", "test.expected.cameras", "'y'", "a to x"}},
           {"light = [0.0, 0.8]", "light = [0.0]", {"wrong.toml:", "test.expected.light", "1", "2"}},
           {"light = [0.0, 0.8]", "light = [0.0, nan]", {"wrong.toml:", "test.expected.light"}},
           {"albedo = [0.0, 0.0]", "albedo = [0.0, 0.0, 0.0]", {"wrong.toml:", "test.expected.albedo", "3", "1 to 2"}},
           {"depth_within = [0.0, 0.001]", "depth_within = [0.0, -1.0]", {"wrong.toml:", "depth_within", "-1"}},
       }) {
    SCOPED_TRACE(c.wrong);
    const std::string message = refusal_of(c.right, c.wrong);
    for (const std::string& part : c.says) EXPECT_THAT(message, HasSubstr(part));
  }
}

TEST_F(Manifests, NeedASplit) {
  const std::string text = kSmallManifest;
  write_file(file, text.substr(0, text.find("[train]")));
  EXPECT_THAT(message_of([&] { read_manifest(file, false); }, ErrorKind::Usage),
              AllOf(HasSubstr("set.toml"), HasSubstr("train"), HasSubstr("rooms, seed, setting")));
}

}  // namespace
}  // namespace clerestory
