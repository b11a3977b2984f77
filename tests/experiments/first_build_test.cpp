// What the first run of a command on a machine says, and the ones after it do not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

struct FirstBuild : testing::Test {
  ScratchFolder folder{"clerestory-first"};
  int rooms = 0;

  std::string said_by_generate(const std::string& cache, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"generate", "--out",  (folder / std::to_string(++rooms)).string(),
                                       "--rooms",  "1",      "--views",
                                       "1",        "--size", "32x24",
                                       "--spp",    "1",      "--no-light"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const std::string caches = (folder / cache).string();
    Program program(arguments, folder / "said.txt",
                    {{}, {{"XDG_CACHE_HOME", caches}, {"POCL_CACHE_DIR", caches + "/pocl"}}});
    EXPECT_EQ(program.wait(), 0);
    return text_of(folder / "said.txt");
  }
};

TEST_F(FirstBuild, IsOneLineWithItsSeconds) {
  const std::string first = said_by_generate("cache");
  EXPECT_THAT(first, ContainsRegex("\nkernels built for .+ in [0-9.]+ s\n$"));
  EXPECT_THAT(first, Not(HasSubstr("generated.")));  // "6 warnings generated."
  EXPECT_THAT(said_by_generate("cache"), Not(HasSubstr("kernels built")));
}

TEST_F(FirstBuild, IsNotSaidWhenQuiet) { EXPECT_THAT(said_by_generate("another", {"--quiet"}), IsEmpty()); }

}  // namespace
}  // namespace clerestory
