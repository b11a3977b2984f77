// Which devices there are, and the choice among them.
#include "host/cl/platforms.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <iostream>

#include "host/cl/device_table.hpp"
#include "tests/cl/environment.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;

FoundDevice device(int index, const char* platform, const char* name) {
  FoundDevice found;
  found.info.index = index, found.info.platform = platform, found.info.name = name;
  return found;
}

const std::vector<FoundDevice> three = {device(0, "Portable Computing Language", "pthread-skylake"),
                                        device(1, "NVIDIA CUDA", "GeForce 2"), device(2, "NVIDIA CUDA", "GeForce 3")};

std::vector<int> indices(const std::string& selector) {
  std::vector<int> result;
  for (const FoundDevice& found : matching_devices(three, selector)) result.push_back(found.info.index);
  return result;
}

TEST(Platforms, SelectsByIndexOrPartOfAName) {
  using Indices = std::vector<int>;
  EXPECT_EQ(indices(""), (Indices{0, 1, 2}));
  EXPECT_EQ(indices("2"), Indices{2});  // an index, though "GeForce 2" has the digit too
  EXPECT_EQ(indices("7"), Indices{});
  EXPECT_EQ(indices("-1"), Indices{});
  EXPECT_EQ(indices("nvidia"), (Indices{1, 2}));
  EXPECT_EQ(indices("FORCE 3"), Indices{2});
  EXPECT_EQ(indices("skylake"), Indices{0});
  EXPECT_EQ(indices("radeon"), Indices{});
}

TEST(Platforms, ListsADeviceWithItsLimits) {
  const std::vector<DeviceInfo> devices = list_devices();
  ASSERT_FALSE(devices.empty()) << "these tests need an OpenCL driver";
  for (std::size_t i = 0; i < devices.size(); ++i) {
    EXPECT_EQ(devices[i].index, static_cast<int>(i));
    EXPECT_FALSE(devices[i].name.empty());
    EXPECT_FALSE(devices[i].platform.empty());
    EXPECT_GT(devices[i].compute_units, 0);
    EXPECT_GT(devices[i].max_group, 0u);
    EXPECT_GE(devices[i].memory, devices[i].max_allocation);
    EXPECT_GT(devices[i].max_allocation, 0u);
  }
}

TEST(Platforms, TableHasALinePerDevice) {
  std::vector<DeviceInfo> infos;
  for (const FoundDevice& found : three) infos.push_back(found.info);
  infos[1].fp64 = true, infos[1].memory = std::size_t{3} << 30, infos[1].local_memory = 48 << 10;
  const std::string table = device_table(infos);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 4);
  EXPECT_THAT(table, HasSubstr("GeForce 3"));
  EXPECT_THAT(table, HasSubstr("3.0 GiB"));
  EXPECT_THAT(table, HasSubstr("48 KiB"));
}

TEST(Platforms, NamesErrors) {
  EXPECT_EQ(opencl_error_name(-5), "CL_OUT_OF_RESOURCES (-5)");
  EXPECT_EQ(opencl_error_name(-12345), "OpenCL error -12345");
}

// The loader reads its list of drivers once, so that these run in processes of their own.
[[noreturn]] void open_with_drivers(const std::string& folder) {
  ::setenv("OCL_ICD_VENDORS", folder.c_str(), 1);
  ::unsetenv("OCL_ICD_FILENAMES");
  ::unsetenv("CLERESTORY_DEVICE");
  try {
    std::cerr << "opened " << Device::open().info().platform << std::endl;
    std::_Exit(0);
  } catch (const Error& error) {
    std::cerr << error.what() << std::endl;
    std::_Exit(error.exit_code());
  }
}

class Drivers : public testing::Test {
 protected:
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

TEST_F(Drivers, NoneAtAllIsSaidWithAWayOut) {
  ScopedFolder folder;
  EXPECT_EXIT(open_with_drivers(folder.string()), testing::ExitedWithCode(3), "no OpenCL device.*pocl-opencl-icd");
}

// The loader's folder, the file in it, the library that file names: whichever is at fault is named.
TEST_F(Drivers, WhatIsWrongWithTheirFolderIsNamed) {
  const SharedFolder shared;
  const std::string empty = (shared / "empty").string(), missing = shared.path() / "missing",
                    wrong = (shared / "wrong").string();
  std::ofstream(wrong + "/a.icd") << "/nowhere/libmissing.so\n";
  std::ofstream(wrong + "/b.icd") << "libm.so.6\n";
  EXPECT_EXIT(open_with_drivers(empty), testing::ExitedWithCode(3), "OCL_ICD_VENDORS.*" + empty + ".*no .icd file");
  EXPECT_EXIT(open_with_drivers(missing), testing::ExitedWithCode(3), "OCL_ICD_VENDORS.*" + missing + ".*no folder");
  EXPECT_EXIT(open_with_drivers(wrong), testing::ExitedWithCode(3),
              "OCL_ICD_VENDORS.*a.icd: .*libmissing.so.*b.icd: libm.so.6");
}

// PoCL gives no device, fails at every program, or ends the process, without a word about its cache.
TEST_F(Drivers, ACacheThatPoclCannotUseIsNamed) {
  const SharedFolder shared;
  const std::string drivers = (shared / "drivers").string(), file = shared.path() / "file",
                    fresh = shared.path() / "new";
  if (!only_pocl(drivers)) GTEST_SKIP() << "needs PoCL";
  std::ofstream(file) << "not a folder";
  const auto open_with = [&](const char* variable, const std::string& value) {
    for (const char* name : {"POCL_CACHE_DIR", "XDG_CACHE_HOME"}) ::unsetenv(name);
    ::setenv(variable, value.c_str(), 1);
    open_with_drivers(drivers);
  };
  const testing::ExitedWithCode device_trouble(3);
  for (const std::string& place : {file, file + "/below"})
    EXPECT_EXIT(open_with("POCL_CACHE_DIR", place), device_trouble, place + ", from POCL_CACHE_DIR");
  EXPECT_EXIT(open_with("POCL_CACHE_DIR", ""), device_trouble, "POCL_CACHE_DIR is empty");
  EXPECT_EXIT(open_with("XDG_CACHE_HOME", file), device_trouble, file + "/pocl/kcache, from XDG_CACHE_HOME");
  EXPECT_EXIT(open_with("HOME", file), device_trouble, file + "/.cache/pocl/kcache, from HOME");
  EXPECT_EXIT(open_with("POCL_CACHE_DIR", fresh), testing::ExitedWithCode(0), "opened Portable");
}

/// An empty folder over /sys, for this process alone; false where that is not permitted.
bool hide_sysfs() {
  if (::unshare(CLONE_NEWNS) != 0 && ::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return false;
  return ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         ::mount("none", "/sys", "tmpfs", 0, nullptr) == 0;
}

// PoCL would end the process with "Not enough memory to run on this device".
TEST_F(Drivers, AChrootWithoutSysIsNamed) {
  const SharedFolder shared;
  const std::string drivers = (shared / "drivers").string();
  if (!only_pocl(drivers)) GTEST_SKIP() << "needs PoCL";
  const pid_t child = ::fork();
  if (child == 0) std::_Exit(hide_sysfs() ? 0 : 1);
  int status = 0;
  ::waitpid(child, &status, 0);
  if (status != 0) GTEST_SKIP() << "needs namespaces of mounts";
  const auto open_without_sysfs = [&] {
    hide_sysfs();
    open_with_drivers(drivers);
  };
  EXPECT_EXIT(open_without_sysfs(), testing::ExitedWithCode(3), "no OpenCL device.*/sys does not describe");
}

TEST_F(Drivers, ABrokenOneDoesNotHideTheOthers) {
  ScopedFolder folder;
  folder.write("a_missing.icd", "/nowhere/libmissing.so\n");
  folder.write("b_not_opencl.icd", "libm.so.6\n");
  folder.write("c_empty.icd", "");
  EXPECT_EXIT(open_with_drivers(folder.string()), testing::ExitedWithCode(3), "no OpenCL device");
  for (const auto& entry : std::filesystem::directory_iterator("/etc/OpenCL/vendors"))
    std::filesystem::copy(entry.path(), folder.path() / ("d_" + entry.path().filename().string()));
  EXPECT_EXIT(open_with_drivers(folder.string()), testing::ExitedWithCode(0), "opened ");
}

}  // namespace
}  // namespace clerestory
