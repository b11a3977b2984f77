#include "host/report/shared_text.hpp"

#include <gtest/gtest.h>

#include "host/report/html.hpp"

namespace clerestory {
namespace {

Provenance made_by(std::vector<std::string> command) {
  Provenance record;
  record.command = std::move(command);
  return record;
}

TEST(SharedText, NamesFilesWithoutTheirFolders) {
  const Provenance nothing;
  EXPECT_EQ(without_folders("net (/home/me/nets/weights), at /tmp/x.exr; done", nothing),
            "net (weights), at x.exr; done");
  EXPECT_EQ(without_folders("/data/rooms/", nothing), "rooms");
  EXPECT_EQ(without_folders("--camera=/data/camera.json", nothing), "--camera=camera.json");
  for (const char* text :
       {"runs/x/photo.exr", "and/or", "answer / truth", "1/2", "../x/y", "https://example.org/a", "/"})
    EXPECT_EQ(without_folders(text, nothing), text);
}

TEST(SharedText, PathsOfTheRecordAreKnownWhole) {
  Provenance record = made_by({"/opt/bin/clerestory", "invert", "/home/me/my photos/a, b.png", "--out=/tmp/my runs/x"});
  record.inputs = {{"/home/me/my photos/true maps.exr", "", 0}};
  EXPECT_EQ(without_folders("of /home/me/my photos/a, b.png by /home/me/my photos/true maps.exr", record),
            "of a, b.png by true maps.exr");
  EXPECT_EQ(shared_command(record), "clerestory invert 'a, b.png' --out=x");
  EXPECT_EQ(
      shared_command(made_by({"clerestory", "data.train=[\"/home/me/a\",\"/home/me/b\"]", "data.test=/x/a,/y/b"})),
      command_text({"clerestory", "data.train=[\"a\",\"b\"]", "data.test=a,b"}));
  EXPECT_EQ(without_folders("W/m²/sr, (a+b)/c", record), "W/m²/sr, (a+b)/c");
  EXPECT_EQ(shared_command(made_by({"build/clerestory", "report", "runs/x"})), "build/clerestory report runs/x");
}

TEST(SharedText, APathThatBeginsAQuotedTextEndsWithTheQuote) {
  const Provenance nothing;
  EXPECT_EQ(without_folders("train = [\"/home/my name/rooms\", \"flat=/data/a b/judge\", \"runs/c d\"]", nothing),
            "train = [\"rooms\", \"flat=judge\", \"runs/c d\"]");
  EXPECT_EQ(without_folders("a \"big /x/y of\" /data/z, \"/open", nothing), "a \"big y of\" z, \"open");
  EXPECT_EQ(without_folders("root = \"/a b/c\"\n# /d e", nothing), "root = \"c\"\n# d e");
}

TEST(SharedText, ATableNamesNoFoldersEither) {
  Table table{"Runs", {{"state", ""}, {"run", ""}}, {}, "of /home/me/rooms"};
  table.add({std::string("failed: /home/me/a.exr: no such file"), Measure{2}});
  const Table shared = without_folders(table, Provenance());
  EXPECT_EQ(std::get<std::string>(shared.rows[0][0]), "failed: a.exr: no such file");
  EXPECT_EQ(std::get<Measure>(shared.rows[0][1]).mean, 2);
  EXPECT_EQ(shared.note, "of rooms");
}

TEST(SharedText, TheFooterOfAPageHasNoFolders) {
  const auto page_of = [](const Provenance& record) { return HtmlReport("t").footer(record).html(); };
  const std::string page = page_of(made_by({"/opt/clerestory", "report", "/home/me/runs/x"}));
  EXPECT_EQ(page.find("/home/me"), std::string::npos);
  EXPECT_NE(page.find("clerestory report x"), std::string::npos);
  EXPECT_NE(page.find("with the paths that provenance.json has"), std::string::npos) << "it is not the whole command";
  EXPECT_EQ(page_of(made_by({"clerestory", "report", "runs/x"})).find("provenance.json has"), std::string::npos);
}

}  // namespace
}  // namespace clerestory
