// The data base of `clerestory tune`: kept and read back, found by the device alone, passed over where it is damaged;
// and what `auto` makes of it.
#include "host/tuning/tuning.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cl/environment.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

using testing::AllOf;
using testing::HasSubstr;

struct TuningFile : testing::Test {
  ScopedFolder folder;
  ScopedVariable home{"XDG_DATA_HOME", folder.string()};
  ScopedVariable nothing_shipped{"CLERESTORY_DATA", folder.string()};
  Device device = Device::open();

  Tuning entry(const std::string& gemm) const {
    Tuning t;
    t.device = device.fingerprint(), t.kind = tuning_kind(device.info()), t.measured = "2026-01-31T12:00:00Z";
    t.complete = true, t.sets = 7, t.noise = 0.01;
    t.clblast_version = clblast_version(), t.clblast = {{"Xgemm", {{"MWG", 64}, {"NWG", 32}}}};
    t.tile = "8x48", t.gemm = gemm, t.kernels = gemm_kernels();
    t.figures = {{"product 1x2x3", 12, 3, 2, 1}};
    return t;
  }
};

TEST_F(TuningFile, GivesBackWhatWasKept) {
  EXPECT_FALSE(tuning_in_use(device));
  keep_tuning(entry("clblast"));
  const auto used = tuning_in_use(device);
  ASSERT_TRUE(used);
  EXPECT_FALSE(used->shipped);
  EXPECT_EQ(used->file, folder.path() / "clerestory/tuning.json");
  EXPECT_EQ(tuning_json(used->tuning), tuning_json(entry("clblast")));
  EXPECT_EQ(used->tuning.clblast.at("Xgemm").at("NWG"), 32u);
  EXPECT_EQ(used->tuning.figures.at(0).tuned, 2);
}

TEST_F(TuningFile, AnotherTuningOfADeviceTakesItsPlaceAndLeavesOthers) {
  Tuning other = entry("packed");
  other.device = "another device";
  keep_tuning(other);
  EXPECT_FALSE(tuning_in_use(device)) << "the entry of another device";
  keep_tuning(entry("clblast"));
  keep_tuning(entry("packed"));
  EXPECT_EQ(read_tunings(tuning_file()).size(), 2u);
  EXPECT_EQ(tuning_in_use(device)->tuning.gemm, "packed");
}

TEST_F(TuningFile, AutoFollowsIt) {
  EXPECT_EQ(preferred_gemm(device), "packed");
  keep_tuning(entry("clblast"));
  EXPECT_EQ(preferred_gemm(device), "clblast");
  Tuning older = entry("clblast");
  older.kernels = "of other kernels";
  keep_tuning(older);
  EXPECT_EQ(preferred_gemm(device), "packed") << "measured with kernels that this program does not have";
  Tuning other = entry("clblast");
  other.clblast_version = "1.0.0";
  keep_tuning(other);
  EXPECT_EQ(preferred_gemm(device), "packed") << "CLBlast of another release would run untuned";
}

TEST_F(TuningFile, AShippedOneIsForItsKindOfDeviceUnlessTheUserHasMeasured) {
  Tuning shipped = entry("clblast");
  shipped.device = "a machine elsewhere", shipped.kernels = "of whichever kernels";
  keep_tuning(shipped);
  std::filesystem::create_directories(folder.path() / "assets");
  std::filesystem::rename(tuning_file(), folder.path() / "assets/tuning.json");
  const auto used = tuning_in_use(device);
  ASSERT_TRUE(used);
  EXPECT_TRUE(used->shipped);
  EXPECT_EQ(preferred_gemm(device), "clblast");
  keep_tuning(entry("packed"));
  EXPECT_EQ(preferred_gemm(device), "packed");

  shipped.kind = "PoCL of a processor unlike this";
  std::filesystem::remove(tuning_file());
  keep_tuning(shipped);
  std::filesystem::rename(tuning_file(), folder.path() / "assets/tuning.json");
  EXPECT_FALSE(tuning_in_use(device));
}

// Commands that only want to be fast go on without it; the one that would write it does not.
TEST_F(TuningFile, ADamagedOneIsNamedAndPassedOver) {
  keep_tuning(entry("clblast"));
  const std::filesystem::path file = tuning_file();
  const std::string whole = read_text(file);
  std::string without_sets = whole, wrong_kernels = whole;
  without_sets.replace(without_sets.find("\"sets\""), 6, "\"steps\"");
  wrong_kernels.replace(wrong_kernels.find("\"clblast\",\n"), 9, "\"cublas\"");
  for (const std::string& text :
       {whole.substr(0, whole.size() / 2), std::string("[]"), std::string("{}"), without_sets, wrong_kernels}) {
    folder.write("clerestory/tuning.json", text);
    EXPECT_THAT(message_of<Error>([&] { read_tunings(file); }), HasSubstr(file.string()));
    EXPECT_THAT(message_of<Error>([&] { keep_tuning(entry("packed")); }), HasSubstr(file.string()));
    EXPECT_EQ(read_text(file), text) << "somebody's file was replaced";
    testing::internal::CaptureStderr();
    EXPECT_FALSE(tuning_in_use(device));
    EXPECT_FALSE(tuning_in_use(device));
    const std::string said = testing::internal::GetCapturedStderr();
    EXPECT_THAT(said, AllOf(HasSubstr(file.string()), HasSubstr("passed over")));
    EXPECT_EQ(said.find("passed over"), said.rfind("passed over")) << "said twice: " << said;
  }
}

}  // namespace
}  // namespace clerestory
