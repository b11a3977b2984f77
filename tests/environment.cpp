// Linked into every test program. Cases of a suite share a process; what one sets in the environment ends with it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <map>
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

// Google Test owns its listeners.
const bool appended = [] {
  testing::UnitTest::GetInstance()->listeners().Append(new EnvironmentRestored);
  return true;
}();

}  // namespace
