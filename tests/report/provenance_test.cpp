#include "host/report/provenance.hpp"

#include <cstdlib>

#include "host/error.hpp"
#include "tests/report/temporary_folder.hpp"

namespace clerestory {
namespace {

class ProvenanceTest : public InTemporaryFolder {};

TEST_F(ProvenanceTest, KnowsTheBuildAndTheMachine) {
  setenv("CLERESTORY_TEST_VALUE", "a=b", 1);
  setenv("UNRELATED_VALUE", "secret", 1);
  const Provenance p = begin_provenance({"clerestory", "invert"}, "device");
  unsetenv("CLERESTORY_TEST_VALUE");
  EXPECT_FALSE(p.build.commit.empty());
  EXPECT_NE(p.build.compiler.find('.'), std::string::npos) << p.build.compiler;
  EXPECT_FALSE(p.build.version.empty());
  EXPECT_NE(p.cpu, "unknown");
  EXPECT_EQ(p.environment.at("CLERESTORY_TEST_VALUE"), "a=b");
  EXPECT_FALSE(p.environment.contains("UNRELATED_VALUE"));
  EXPECT_EQ(p.started.size(), std::string("2026-01-31T12:00:00Z").size());
  EXPECT_TRUE(p.ended.empty());
}

TEST_F(ProvenanceTest, RoundTrip) {
  put(folder_ / "photo.png", "abc");
  Provenance p = begin_provenance({"clerestory", "invert", "my photo.png"}, "PoCL");
  p.seeds["render"] = 18446744073709551615u;
  p.hashes["kernels"] = "0123";
  p.rooms = {"held_out", {18446744073709551615u, 3}};
  p.facts["light"] = "image";
  p.figures["seconds: network"] = 1.0 / 3;
  p.inputs.push_back(record_file(folder_ / "photo.png"));
  p.left_out.push_back({"emission", "nothing emits", "2 kernels"});
  p.ended = utc_now();
  write_provenance(folder_ / "provenance.json", p);
  const Provenance back = read_provenance(folder_ / "provenance.json");
  EXPECT_EQ(provenance_json(back), provenance_json(p));
  EXPECT_EQ(back.seeds.at("render"), 18446744073709551615u);
  EXPECT_EQ(back.rooms.seeds, p.rooms.seeds);
  EXPECT_EQ(back.figures.at("seconds: network"), 1.0 / 3);
  EXPECT_EQ(back.inputs[0].bytes, 3u);
  EXPECT_EQ(back.left_out[0].saved, "2 kernels");
}

TEST_F(ProvenanceTest, HashesTellFilesApart) {
  put(folder_ / "a", "abc");
  put(folder_ / "b", "abd");
  put(folder_ / "c", "abc");
  EXPECT_EQ(record_file(folder_ / "a").hash, record_file(folder_ / "c").hash);
  EXPECT_NE(record_file(folder_ / "a").hash, record_file(folder_ / "b").hash);
  EXPECT_THROW(record_file(folder_ / "none"), Error);
}

TEST_F(ProvenanceTest, BrokenFilesAreRefused) {
  put(folder_ / "p.json", "{\"command\": 3}");
  EXPECT_THROW(read_provenance(folder_ / "p.json"), Error);
  put(folder_ / "p.json", "[1,");
  EXPECT_THROW(read_provenance(folder_ / "p.json"), Error);
}

TEST_F(ProvenanceTest, StrangeBytesDoNotStopARun) {
  const Provenance p = begin_provenance({"clerestory", "caf\xe9.png"});
  write_provenance(folder_ / "p.json", p);
  EXPECT_EQ(read_provenance(folder_ / "p.json").command[1], "caf\xef\xbf\xbd.png");
}

TEST(CommandText, QuotesWhatTheShellWouldSplit) {
  EXPECT_EQ(command_text({"clerestory", "train", "a.toml", "model.width=64"}),
            "clerestory train a.toml model.width=64");
  EXPECT_EQ(command_text({"invert", "my photo.png", "it's", "", "~a", "$x"}),
            "invert 'my photo.png' 'it'\\''s' '' '~a' '$x'");
}

}  // namespace
}  // namespace clerestory
