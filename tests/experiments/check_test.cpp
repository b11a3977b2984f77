// `clerestory check`: what it says of right kernels, and that one small mistake in one kernel is named by its op.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "host/io/files.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

struct CheckCommand : testing::Test {
  ScratchFolder folder{"clerestory-check"};
  fs::path log = folder / "log.txt", json = folder / "check.json";

  int check(std::vector<std::string> arguments, const Surroundings& around = {}) const {
    arguments.insert(arguments.begin(), "check");
    return Program(arguments, log, around).wait();
  }

  /// The kernels with the first `right` in one file replaced.
  Surroundings with_kernel(const std::string& file, const std::string& right, const std::string& wrong) const {
    const fs::path kernels = folder / "kernels";
    fs::copy(fs::path(CLERESTORY_SOURCE_DIR) / "kernels", kernels,
             fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    std::string source = read_file(kernels / file);
    const std::size_t at = source.find(right);
    EXPECT_NE(at, std::string::npos) << file;
    std::ofstream(kernels / file) << source.replace(at, right.size(), wrong);
    return {{}, {{"CLERESTORY_KERNELS", kernels.string()}}};
  }
};

TEST_F(CheckCommand, RightOpsAreOkWithTheirErrors) {
  ASSERT_EQ(check({"--only", "unit_vector,group_norm", "--json=" + json.string()}), 0) << text_of(log);
  EXPECT_THAT(text_of(log), HasSubstr("group_norm"));
  EXPECT_THAT(text_of(log), Not(HasSubstr("FAULT")));
  const auto found = nlohmann::json::parse(text_of(json));
  EXPECT_FALSE(found["device"]["name"].get<std::string>().empty());
  EXPECT_EQ(found["faults"], 0);
  ASSERT_EQ(found["ops"].size(), 2u);
  EXPECT_EQ(found["ops"][0]["stem"], "group_norm");
  const auto& op = found["ops"][1];
  EXPECT_EQ(op["stem"], "unit_vector");
  EXPECT_EQ(op["kernels"], nlohmann::json({"unit_vector", "unit_vector_adjoint"}));
  EXPECT_EQ(op["cases"], 3);
  EXPECT_TRUE(op["faults"].empty());
  for (const char* error : {"value_error", "twin_error", "gradient_error"}) {
    EXPECT_GT(op[error], 0) << error;
    EXPECT_LE(op[error], 1) << error;
  }
  EXPECT_GT(op["seconds"], 0);
}

TEST_F(CheckCommand, OneWrongConstantIsNamedByItsOp) {
  const Surroundings changed = with_kernel("nn/unit_vector.cl", "? R(1e-6) :", "? R(1e-5) :");
  EXPECT_EQ(check({"--only", "unit_vector,pad", "--json=" + json.string()}, changed), 1) << text_of(log);
  EXPECT_THAT(text_of(log), HasSubstr("unit_vector/tiny in float against the reference"));
  EXPECT_THAT(text_of(log), HasSubstr("one op is wrong: unit_vector\n"));
  const auto found = nlohmann::json::parse(text_of(json));
  EXPECT_GT(found["faults"], 0);
  EXPECT_TRUE(found["ops"][0]["faults"].empty());  // pad
  EXPECT_EQ(found["ops"][1]["faults"].size(), found["faults"]);
}

TEST_F(CheckCommand, AWriteBesideTheOutputIsSeenOnBothSides) {
  // Of a case of two pictures of 5x7, into the other picture: where there is nothing between them, into memory it has.
  const std::string value = "to[2 * plane] = inverse * z;", slope = "to[2 * plane] = inverse * (c - along * z);",
                    first = " if (plane == 35 && i == 0 && n == 0) to[3 * plane] = 0;",
                    second = " if (plane == 35 && i == 0 && n == 1) to[-1] = 0;";
  for (const auto& [line, write, seen] : {std::tuple{value, first, "behind output 0"},
                                          {value, second, "before output 0"},
                                          {slope, first, "behind the gradient of t"},
                                          {slope, second, "before the gradient of t"}}) {
    const Surroundings changed = with_kernel("nn/unit_vector.cl", line, line + write);
    EXPECT_EQ(check({"--only", "unit_vector"}, changed), 1) << seen;
    EXPECT_THAT(text_of(log), HasSubstr(std::string("unit_vector/usual in float: written ") + seen));
  }
}

TEST_F(CheckCommand, AKernelThatDoesNotBuildIsAFaultAndTheOthersGoOn) {
  const Surroundings changed = with_kernel("nn/unit_vector.cl", "kernel void", "no kernel void");
  EXPECT_EQ(check({"--only", "unit_vector,pad", "-q", "--json"}, changed), 1);
  EXPECT_THAT(text_of(log), HasSubstr("unit_vector/usual: "));
  EXPECT_THAT(text_of(log), HasSubstr("\"stem\": \"pad\""));
}

TEST_F(CheckCommand, AnOpThatThereIsNotIsBadUsage) {
  EXPECT_EQ(check({"--only", "pad,unit_vectr"}), 2);
  EXPECT_THAT(text_of(log), HasSubstr("unit_vectr"));
  EXPECT_THAT(text_of(log), HasSubstr("the nearest is unit_vector"));
  EXPECT_THAT(text_of(log), HasSubstr("group_norm"));
}

TEST_F(CheckCommand, IsInterrupted) {
  Program program({"check", "--only", "conv"}, log);
  ASSERT_TRUE(wait_until([&] { return text_of(log).find("check") != std::string::npos; }));
  program.signal(SIGINT);
  EXPECT_EQ(program.wait(), 4) << text_of(log);
}

}  // namespace
}  // namespace clerestory
