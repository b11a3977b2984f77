// Built programs kept on disk, where asked for; and every kernel source builds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host/cl/device.hpp"
#include "tests/cl/environment.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;

int add_three(Device& device) {
  const Buffer x = device.allocate(sizeof(int));
  device.zero(x, sizeof(int));
  device.launch(device.kernel("small.cl", "add"), Range::of(1, 1), x);
  int value = 0;
  device.read(x, &value, sizeof value);
  return value;
}

class ProgramCache : public testing::Test {
 protected:
  ProgramCache()
      : warm_(Device::open()), home_("XDG_CACHE_HOME", cache_.string()), switch_("CLERESTORY_PROGRAM_CACHE", "on") {
    kernels_.write("small.cl", "kernel void add(global int *x) { x[0] += 3; }\n");
  }
  std::vector<std::filesystem::path> programs() const {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(cache_.path() / "clerestory"))
      if (entry.path().filename().string().starts_with("program-")) files.push_back(entry.path());
    return files;
  }
  int builds_of_small() {
    Device device = Device::open();  // before the folder is named: the probe is one of the program's own kernels
    const int before = device.builds();
    ScopedVariable folder("CLERESTORY_KERNELS", kernels_.string());
    EXPECT_EQ(add_three(device), 3);
    return device.builds() - before;
  }

  ScopedFolder cache_, kernels_;
  Device warm_;
  ScopedVariable home_, switch_;
};

TEST_F(ProgramCache, ABuiltProgramIsLoadedTheNextTime) {
  EXPECT_EQ(builds_of_small(), 1);
  EXPECT_EQ(builds_of_small(), 0);
  kernels_.write("small.cl", "kernel void add(global int *x) { x[0] += 1; x[0] += 2; }\n");
  EXPECT_EQ(builds_of_small(), 1);  // another source is another program
}

TEST_F(ProgramCache, OtherDefinesAreAnotherProgram) {
  kernels_.write("small.cl", "#ifndef ADD\n#define ADD 3\n#endif\nkernel void add(global int *x) { x[0] += ADD; }\n");
  EXPECT_EQ(builds_of_small(), 1);
  Device device = Device::open();
  ScopedVariable folder("CLERESTORY_KERNELS", kernels_.string());
  const Buffer x = device.allocate(sizeof(int));
  device.zero(x, sizeof(int));
  device.launch(device.kernel("small.cl", "add", {{"ADD", "2"}}), Range::of(1, 1), x);
  int value = 0;
  device.read(x, &value, sizeof value);
  EXPECT_EQ(value, 2);
}

TEST_F(ProgramCache, WhatDriversAreToldIsAnotherProgram) {
  EXPECT_EQ(builds_of_small(), 1);
  ScopedVariable told("CL_CONFIG_CLERESTORY_TEST", "1");
  EXPECT_EQ(builds_of_small(), 1);
  EXPECT_EQ(builds_of_small(), 0);
}

TEST_F(ProgramCache, DamageMeansBuildingAgain) {
  EXPECT_EQ(builds_of_small(), 1);
  for (const auto& file : programs()) std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  EXPECT_EQ(builds_of_small(), 1);
  EXPECT_EQ(builds_of_small(), 0);
}

TEST_F(ProgramCache, OffKeepsNothing) {
  ScopedVariable off("CLERESTORY_PROGRAM_CACHE", "off");
  EXPECT_EQ(builds_of_small(), 1);
  EXPECT_EQ(builds_of_small(), 1);
  EXPECT_TRUE(programs().empty());
}

TEST_F(ProgramCache, AnUnknownSettingIsAUsageError) {
  ScopedVariable wrong("CLERESTORY_PROGRAM_CACHE", "maybe");
  EXPECT_THAT(message_of<Error>([] { Device::open(); }),
              HasSubstr("CLERESTORY_PROGRAM_CACHE: unknown value (found maybe"));
}

// The drivers that cache by themselves are not asked for binaries: on PoCL that would compile every kernel once more.
TEST_F(ProgramCache, DriversWithACacheOfTheirOwnKeepTheirPrograms) {
  ScopedVariable unset("CLERESTORY_PROGRAM_CACHE", "");
  const bool own = warm_.info().platform == "Portable Computing Language";
  if (own) {
    EXPECT_EQ(builds_of_small(), 1);
    EXPECT_TRUE(programs().empty());
  }
  ScopedVariable on("CLERESTORY_PROGRAM_CACHE", "on");
  builds_of_small();
  EXPECT_FALSE(programs().empty());
}

TEST_F(ProgramCache, WhatNoCacheHadCountsAsAFirstBuildOnce) {
  ScopedVariable unset("CLERESTORY_PROGRAM_CACHE", ""), pocl("POCL_CACHE_DIR", (cache_.path() / "pocl").string());
  const auto seconds_of_small = [&] {
    const double before = first_builds().seconds;
    EXPECT_EQ(builds_of_small(), 1);
    return first_builds().seconds - before;
  };
  EXPECT_GT(seconds_of_small(), 0);
  EXPECT_EQ(first_builds().device, warm_.info().name);
  EXPECT_EQ(seconds_of_small(), 0);
  kernels_.write("small.cl", "kernel void add(global int *x) { x[0] += 2; x[0] += 1; }\n");
  EXPECT_GT(seconds_of_small(), 0);
}

// Every source has to build alone, in both precisions, with no defines: a feature has a default.
TEST(KernelFiles, BuildInBothPrecisionsWithoutDefines) {
  Device device = Device::open();
  int built = 0;
  for (const std::string& file : kernel_files()) {
    if (!file.ends_with(".cl")) continue;
    for (const Precision precision : {Precision::Single, Precision::Double}) {
      if (precision == Precision::Double && !device.has_double()) continue;
      // The program is built before the kernel is looked for in it.
      const std::string message = message_of<Error>([&] { device.kernel(file, "no_such_kernel", {}, precision); });
      EXPECT_THAT(message, HasSubstr(file + ": no kernel \"no_such_kernel\"")) << file;
      ++built;
    }
  }
  EXPECT_GT(built, 0);
}

}  // namespace
}  // namespace clerestory
