// What the tests of host/io share: a scratch folder, and the check that an error is the user's and says the right
// thing.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "host/error.hpp"

namespace clerestory {

/// A folder of its own for each test, removed with it.
class Scratch : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder = std::filesystem::temp_directory_path() / (std::string("clerestory_") + info->test_suite_name() + "_" +
                                                       info->name() + "_" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  std::filesystem::path put(const std::string& name, const std::string& bytes) const {
    const auto path = folder / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  static std::string get(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  /// Names in the folder, hidden ones too: what an output may have left behind.
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
  }

  std::filesystem::path folder;
};

inline std::filesystem::path asset(const std::string& name) {
  return std::filesystem::path(CLERESTORY_SOURCE_DIR) / "assets" / name;
}

/// The call must throw an Error of this kind whose text holds every part.
inline void expect_error(const std::function<void()>& call, std::initializer_list<std::string> parts,
                         ErrorKind kind = ErrorKind::Usage) {
  try {
    call();
    ADD_FAILURE() << "no error; expected one that says " << *parts.begin();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    for (const std::string& part : parts)
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << "\"" << error.what() << "\" lacks " << part;
  }
}

}  // namespace clerestory
