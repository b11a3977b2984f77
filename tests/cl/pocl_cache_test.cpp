// PoCL's own cache: where it lies, and entries that a power cut or a full disk left incomplete.
#include "host/cl/pocl_cache.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iostream>
#include <map>

#include "host/cl/device.hpp"
#include "tests/cl/environment.hpp"

namespace clerestory {
namespace {

TEST(PoclCache, LiesWherePoclPutsIt) {
  ScopedVariable home("HOME", "/home/somebody"), xdg("XDG_CACHE_HOME", "/elsewhere"), own("POCL_CACHE_DIR", "/mine");
  EXPECT_EQ(pocl_cache_folder().path, "/mine");
  ::unsetenv("POCL_CACHE_DIR");
  EXPECT_EQ(pocl_cache_folder().path, "/elsewhere/pocl/kcache");
  ::setenv("XDG_CACHE_HOME", "", 1);
  EXPECT_EQ(pocl_cache_folder().path, "/home/somebody/.cache/pocl/kcache");
  ::unsetenv("HOME");
  EXPECT_EQ(pocl_cache_folder().path, "/tmp/pocl/kcache");
}

[[noreturn]] void compute(const SharedFolder& shared) {
  ::setenv("OCL_ICD_VENDORS", (shared / "drivers").c_str(), 1);
  ::setenv("POCL_CACHE_DIR", (shared / "cache").c_str(), 1);
  ::unsetenv("CLERESTORY_DEVICE");
  Device device = Device::open();  // before the folder is named: the probe is one of the program's own kernels
  ::setenv("CLERESTORY_KERNELS", (shared / "kernels").c_str(), 1);
  const Buffer x = device.allocate(sizeof(int));
  device.zero(x, sizeof(int));
  device.launch(device.kernel("small.cl", "add"), Range::of(1, 1), x);
  int value = 0;
  device.read(x, &value, sizeof value);
  std::cerr << "computed " << value << std::endl;
  std::_Exit(0);
}

// As they are, PoCL ends the program on them: a signal, or an assertion, and often not a word.
TEST(PoclCache, EntriesCutShortAreMadeAgain) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const SharedFolder shared;
  if (!only_pocl(shared / "drivers")) GTEST_SKIP() << "needs PoCL";
  std::ofstream(shared / "kernels" / "small.cl") << "kernel void add(global int *x) { x[0] += 3; }\n";
  EXPECT_EXIT(compute(shared), testing::ExitedWithCode(0), "computed 3");

  // Half of it, none of it, and the right length with blocks that never reached the disk.
  struct Damage {
    const char* ending;
    std::uintmax_t quarters;  // that are left of it
    bool stretched;           // to its length again
  };
  for (const auto& [ending, quarters, stretched] :
       {Damage{".so", 2, false}, {".so", 0, false}, {".so", 2, true}, {".bc", 2, false}, {".bc", 0, false}}) {
    SCOPED_TRACE(ending);
    std::map<std::filesystem::path, std::uintmax_t> damaged;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(shared / "cache"))
      if (entry.path().extension() == ending) damaged[entry.path()] = entry.file_size();
    ASSERT_FALSE(damaged.empty());
    for (const auto& [file, size] : damaged) {
      std::filesystem::resize_file(file, size * quarters / 4);
      if (stretched) std::filesystem::resize_file(file, size);
    }
    EXPECT_EXIT(compute(shared), testing::ExitedWithCode(0), "computed 3");
    for (const auto& [file, size] : damaged) EXPECT_EQ(std::filesystem::file_size(file), size) << "it is made again";
  }
}

TEST(PoclCache, WholeEntriesAreLeftAlone) {
  ScopedFolder cache;
  ScopedVariable folder("POCL_CACHE_DIR", cache.string());
  // An identification block (13) of one word and a module block (8) of two: LLVM's bitstream, "Bitcode Wrapper" aside.
  const std::string bitcode("BC\xc0\xde\x35\x14\0\0\x01\0\0\0....\x21\x0c\0\0\x02\0\0\0........", 32);
  const auto whole = cache.write("AB/CD/program.bc", bitcode);
  const auto shorter = cache.write("AB/EF/program.bc", bitcode.substr(0, 28));
  const auto longer = cache.write("AB/GH/program.bc", bitcode + "....");
  const auto other = cache.write("AB/CD/last_accessed", "");
  const auto source = cache.write("tempfile.cl", "kernel");
  EXPECT_EQ(drop_broken_pocl_entries(), 2);
  EXPECT_TRUE(std::filesystem::exists(whole) && std::filesystem::exists(other) && std::filesystem::exists(source));
  EXPECT_FALSE(std::filesystem::exists(shorter) || std::filesystem::exists(longer));
}

// Without its temporary the other process ends: "Final linking of kernel ... failed".
TEST(PoclCache, WhatAnotherProcessIsLinkingIsLeftAlone) {
  ScopedFolder cache;
  ScopedVariable folder("POCL_CACHE_DIR", cache.string());
  const auto begun = cache.write("tempfile_67O0Zf.so", ""), half = cache.write("tempfile_a1B2c3.so", "half of it");
  EXPECT_EQ(drop_broken_pocl_entries(), 0);
  EXPECT_TRUE(std::filesystem::exists(begun) && std::filesystem::exists(half));
}

}  // namespace
}  // namespace clerestory
