// The program as `cmake --install` leaves it, which knows nothing of the source tree; and its manual page.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "host/io/files.hpp"
#include "host/report/provenance.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

const fs::path kSource = CLERESTORY_SOURCE_DIR;

TEST(ManualPage, NamesEveryCommandAndVariable) {
  const ScratchFolder folder("clerestory-page");
  const std::string page = read_file(kSource / "docs/clerestory.1");
  Program help({"--help"}, folder / "help.txt");
  ASSERT_EQ(help.wait(), 0);
  const std::string text = text_of(folder / "help.txt");
  const std::regex command("\n  ([a-z]+) {2,}[A-Z]");
  int commands = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), command), end; it != end; ++it, ++commands)
    EXPECT_THAT(page, HasSubstr("\n.B " + (*it)[1].str() + "\n"));
  EXPECT_GE(commands, 15);

  std::set<std::string> variables;
  const std::regex variable("\"(CLERESTORY_[A-Z_]*[A-Z])\"");
  for (const char* room : {"host", "checks", "nets", "tracer", "experiments"})
    for (const auto& entry : fs::recursive_directory_iterator(kSource / room)) {
      if (entry.path().extension() != ".cpp" && entry.path().extension() != ".hpp") continue;
      const std::string code = read_file(entry.path());
      for (std::sregex_iterator it(code.begin(), code.end(), variable), end; it != end; ++it)
        variables.insert((*it)[1]);
    }
  variables.erase("CLERESTORY_DOUBLE");  // of kernels
  EXPECT_GE(variables.size(), 8u);
  for (const std::string& name : variables) EXPECT_THAT(page, HasSubstr("\n.B " + name + "\n"));
}

struct Installed : testing::Test {
  ScratchFolder folder{"clerestory-installed"};
  fs::path prefix = folder / "prefix";
  void SetUp() override {
    const std::string build = fs::path(CLERESTORY_PROGRAM).parent_path().string();
    ASSERT_EQ(std::system(("cmake --install " + build + " --prefix " + prefix.string() + " > /dev/null").c_str()), 0);
  }
};

TEST_F(Installed, TheProgramFindsWhatItNeedsBesideIt) {
  EXPECT_THAT(read_file(prefix / "bin/clerestory"), Not(HasSubstr(kSource.string())));
  const fs::path share = prefix / "share/clerestory", run = folder / "run", log = folder / "log.txt";
  const Surroundings elsewhere{folder.path(), {}, prefix / "bin/clerestory"};
  Program invert({"invert", "assets/office.jpg", "--only", "normal", "--out", run.string()}, log, elsewhere);
  ASSERT_EQ(invert.wait(), 0) << text_of(log);
  EXPECT_THAT(text_of(run / "provenance.json"), HasSubstr((share / "nets/weights/maps.safetensors").string()));
  Program rooms({"generate", "--out", (folder / "rooms").string(), "--rooms", "1", "--views", "1", "--size", "32x24",
                 "--spp", "1", "--no-light"},
                log, elsewhere);
  EXPECT_EQ(rooms.wait(), 0) << text_of(log);
  Program config({"train", "experiments/configs/mgnet_compact.toml", "data.train=[\"rooms\"]", "data.train_split=train",
                  "data.validation_split=train", "train.steps=1", "model.width=32", "model.height=32"},
                 log, elsewhere);
  EXPECT_EQ(config.wait(), 0) << text_of(log);
  for (const char* document : {"README.md", "docs/commands.md", "docs/light.md", "docs/conventions.md"})
    EXPECT_TRUE(fs::exists(prefix / "share/doc/clerestory" / document)) << document;
  Program results({"results", "check"}, log, elsewhere);
  EXPECT_EQ(results.wait(), 2);
  EXPECT_THAT(text_of(log), HasSubstr("no source tree"));
}

}  // namespace
}  // namespace clerestory
