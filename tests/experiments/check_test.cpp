// `clerestory check`: what it says of right kernels, and that one small mistake in one kernel is named by its op.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>
#include <set>

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

  /// With the first `right` in one kernel file replaced.
  Surroundings with_kernel(const std::string& file, const std::string& right, const std::string& wrong) const {
    return with_changed_kernel(folder / "kernels", file, right, wrong);
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

// The whole list, on the kernels that are shipped: it ends well, says so of every case, and its totals are the cases'.
TEST_F(CheckCommand, ShippedKernelsAreStable) {
  ASSERT_EQ(check({"--stability", "--json=" + json.string()}), 0) << text_of(log);
  EXPECT_THAT(text_of(log), Not(HasSubstr("FAULT")));
  EXPECT_THAT(text_of(log), HasSubstr("0 dropped inside; 0 at fault"));
  const auto found = nlohmann::json::parse(text_of(json));
  EXPECT_EQ(found["faults"], 0);
  std::set<std::string> groups;
  int inside = 0, with_gradients = 0;
  for (const auto& row : found["cases"]) {
    groups.insert(row["group"]);
    const std::string name = row["group"].get<std::string>() + "/" + row["name"].get<std::string>();
    EXPECT_TRUE(row["faults"].empty()) << name;
    EXPECT_EQ(row["values_not_finite"], 0) << name;
    EXPECT_EQ(row["gradients_not_finite"], 0) << name;
    EXPECT_GT(row["evaluations"], 0) << name;
    if (!row["inside"]) continue;
    ++inside;
    EXPECT_EQ(row["dropped"], 0) << name;
    ASSERT_TRUE(row["value_error"].is_number()) << name;
    EXPECT_LE(row["value_error"], 1e-5) << name;
    if (row["gradient_error"].is_null()) continue;
    ++with_gradients;
    EXPECT_LE(row["gradient_error"], 1e-4) << name;
  }
  EXPECT_EQ(groups, (std::set<std::string>{"brdf", "field", "hypernetwork", "losses", "norms", "optimiser", "rays",
                                           "samples", "scenes", "uncertainty"}));
  EXPECT_GT(inside, 90);
  EXPECT_GT(with_gradients, 60);
}

// Forms that are right on paper and lose their digits, or divide by nothing: one at a time, each is named by its case.
TEST_F(CheckCommand, AnUnstableFormIsNamedByItsCase) {
  struct Mistake {
    std::string file, right, wrong, group, seen;
  };
  const std::vector<Mistake> mistakes{
      {"lib/ggx.clh", "const real k = alpha * (across + h.z * h.z) / (across + alpha * alpha * h.z * h.z);",
       "const real c2 = h.z * h.z / (across + h.z * h.z), k = alpha / (c2 * (alpha * alpha - R(1)) + R(1));", "brdf",
       "brdf/drawn, roughness 0: value 1 is wrong by"},
      {"light/composite.cl", "* -expm1(-thickness)", "* (R(1) - exp(-thickness))", "field",
       "field/density times step 1e-08: value 0 is wrong by"},
      {"nn/group_norm.cl", "group_sum(squares, scratch) + epsilon", "group_sum(squares, scratch)", "norms",
       "norms/group norm, one value a group, 0: 120 of 120 values are not finite"},
      {"shade/accumulate_samples.cl", "WHERE((x - x) + (y - y) + (z - z) == R(0), R(1), R(0))", "(lanes)(R(1))",
       "samples", "samples/radiance NaN in some rays: "}};
  for (const Mistake& m : mistakes) {
    const Surroundings changed = with_kernel(m.file, m.right, m.wrong);
    EXPECT_EQ(check({"--stability", "--only", m.group}, changed), 1) << m.seen << text_of(log);
    EXPECT_THAT(text_of(log), HasSubstr(m.seen));
    EXPECT_THAT(text_of(log), HasSubstr("FAULT"));
  }
}

TEST_F(CheckCommand, AGroupThatThereIsNotIsBadUsage) {
  EXPECT_EQ(check({"--stability", "--only", "brdf,feild"}), 2);
  EXPECT_THAT(text_of(log), HasSubstr("no such group, the nearest is field"));
}

TEST_F(CheckCommand, IsInterrupted) {
  Program program({"check", "--only", "conv"}, log);
  ASSERT_TRUE(wait_until([&] { return text_of(log).find("check") != std::string::npos; }));
  program.signal(SIGINT);
  EXPECT_EQ(program.wait(), 4) << text_of(log);
}

}  // namespace
}  // namespace clerestory
