// Keys of studies: those of a config's kind, and no others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiments/studies/study.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const fs::path kConfigs = fs::path(CLERESTORY_SOURCE_DIR) / "experiments/configs";

TEST(StudyKeys, EveryShippedStudyLoads) {
  int studies = 0;
  for (const auto& entry : fs::directory_iterator(kConfigs)) {
    if (read_file(entry.path()).find("[study]") == std::string::npos) continue;
    const Config config = study_config(entry.path(), {});
    EXPECT_EQ(config.text("study.kind"), study_kind(entry.path(), {})) << entry.path();
    ++studies;
  }
  EXPECT_GE(studies, 10);
}

TEST(StudyKeys, KeysOfAnotherKindAreUnknown) {
  const fs::path truth = kConfigs / "truth.toml";
  EXPECT_EQ(study_config(truth, {"truth.batches=3"}).integer("truth.batches"), 3);
  EXPECT_THAT(message_of<Error>([&] { study_config(truth, {"user.spp=3"}); }), HasSubstr("user.spp"));
  EXPECT_THAT(message_of<Error>([&] { study_kind(truth, {"study.spps=3"}); }),
              testing::AllOf(HasSubstr("study.spps"), testing::Not(HasSubstr("one is study.spp"))))
      << "a key of another kind is no help";
  EXPECT_NE(study_hash(truth, {}, false), study_hash(truth, {"truth.batches=3"}, false));
}

TEST(StudyKeys, KindsAreNotSweptTogether) {
  EXPECT_THAT(message_of<Error>([&] { study_kind(kConfigs / "truth.toml", {"study.kind=truth,layer"}); }),
              HasSubstr("study.kind=truth,layer"));
  EXPECT_EQ(study_kind(kConfigs / "truth.toml", {"study.kind=layer"}), "layer");
}

}  // namespace
}  // namespace clerestory
