// Cases of a suite share a process (tests/suites.cmake), but not what they do to the environment
// (tests/environment.cpp).
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace clerestory {
namespace {

const std::string path_at_start = std::getenv("PATH");

TEST(Environment, ACaseMaySetWhatItLikes) {
  ::setenv("CLERESTORY_LEFT_BEHIND", "1", 1);
  ::setenv("PATH", "/nowhere", 1);
  ::unsetenv("HOME");
}

TEST(Environment, TheNextDoesNotSeeIt) {
  EXPECT_EQ(std::getenv("CLERESTORY_LEFT_BEHIND"), nullptr);
  EXPECT_EQ(std::getenv("PATH"), path_at_start);
}

}  // namespace
}  // namespace clerestory
