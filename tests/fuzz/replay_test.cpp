// Every input of the corpus, without a fuzzer: what once crashed stays mended.
#include <gtest/gtest.h>

#include "host/io/files.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {
namespace {

class FuzzCorpus : public testing::TestWithParam<FuzzTarget> {};

TEST_P(FuzzCorpus, IsReadOrRefused) {
  const std::filesystem::path folder =
      std::filesystem::path(CLERESTORY_SOURCE_DIR) / "tests/fuzz/corpus" / GetParam().name();
  int read = 0, refused = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    SCOPED_TRACE(name);
    bool good = false;
    ASSERT_NO_THROW(good = GetParam().reads(read_file(entry.path(), 1 << 20, true)));
    EXPECT_FALSE(name.starts_with("good") && !good);
    EXPECT_FALSE(name.starts_with("bad") && good);
    ++(good ? read : refused);
  }
  EXPECT_GT(read, 0) << "the corpus has no file that is right";
  EXPECT_GT(refused, 0) << "the corpus has no file that is wrong";
}

INSTANTIATE_TEST_SUITE_P(All, FuzzCorpus, testing::ValuesIn(fuzz_targets()),
                         [](const auto& about) { return about.param.name(); });

}  // namespace
}  // namespace clerestory
