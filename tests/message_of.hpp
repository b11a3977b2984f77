// What an error says.
#pragma once
#include <gtest/gtest.h>

#include <string>

#include "host/error.hpp"

namespace clerestory {

/// The message of the error that `work` throws; fails the test's expectations by being empty when it throws none.
template <class Error, class Work>
std::string message_of(Work work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

/// The same of the project's error, which must be of this kind.
template <class Work>
std::string message_of(Work work, ErrorKind kind) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no error";
  return {};
}

}  // namespace clerestory
