// Linked into every test program. Cases of a suite share a process; what one sets in the environment ends with it.
// Kernel variants that a test program launches, itself or by programs that it starts, must stand in
// checks/variants.txt: `clerestory check` runs those, and none may be forgotten.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>

namespace {

class EnvironmentRestored : public testing::EmptyTestEventListener {
  using Variables = std::map<std::string, std::string>;

  static Variables current() {
    Variables all;
    for (char** entry = environ; entry && *entry; ++entry) {
      const std::string line = *entry;
      const std::size_t equals = line.find('=');
      if (equals != std::string::npos) all[line.substr(0, equals)] = line.substr(equals + 1);
    }
    return all;
  }
  void OnTestStart(const testing::TestInfo&) override { before_ = current(); }
  void OnTestEnd(const testing::TestInfo&) override {
    const Variables after = current();
    for (const auto& [name, value] : after)
      if (!before_.contains(name)) unsetenv(name.c_str());
    for (const auto& [name, value] : before_)
      if (!after.contains(name) || after.at(name) != value) setenv(name.c_str(), value.c_str(), 1);
  }

  Variables before_;
};

#ifdef CLERESTORY_VARIANTS
/// Kernels that tests alone launch: probes of functions, faults that are switched on, a stack too short for any tree,
/// sources of their own.
bool is_of_tests(const std::string& variant) {
  const std::string file = variant.substr(0, variant.find(':'));
  const auto has = [&](const char* define) { return variant.find(define) != std::string::npos; };
  return file.ends_with("_probe.cl") || has("PROBE_FAULT") || has("BVH_STACK=1 ") ||
         !std::filesystem::exists(CLERESTORY_SOURCE_DIR "/kernels/" + file);
}

class VariantsListed : public testing::Environment {
 public:
  void SetUp() override {
    if (std::getenv("CLERESTORY_LAUNCHES") != nullptr) return;  // they are being listed: tests/variants.sh
    file_ = testing::TempDir() + "clerestory-launches-" + std::to_string(::getpid());
    setenv("CLERESTORY_LAUNCHES", file_.c_str(), 1);
  }
  void TearDown() override {
    if (file_.empty()) return;
    const std::set<std::string> listed = lines_of(CLERESTORY_VARIANTS);
    EXPECT_GT(listed.size(), 100u);
    for (const std::string& variant : lines_of(file_))
      EXPECT_TRUE(listed.contains(variant) || is_of_tests(variant))
          << variant << " is launched, but not in checks/variants.txt, which tests/variants.sh writes";
    std::filesystem::remove(file_);
  }

 private:
  static std::set<std::string> lines_of(const std::string& file) {
    std::ifstream in(file);
    std::set<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.insert(line);
    return lines;
  }
  std::string file_;
};

const bool listed = testing::AddGlobalTestEnvironment(new VariantsListed) != nullptr;
#endif

// Google Test owns its listeners and environments.
const bool appended = [] {
  testing::UnitTest::GetInstance()->listeners().Append(new EnvironmentRestored);
  return true;
}();

}  // namespace
