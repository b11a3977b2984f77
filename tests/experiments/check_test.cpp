// `clerestory check`: what it says of right kernels, and that one small mistake in one kernel is named by its op.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "host/cl/device.hpp"
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
      {"lib/ggx.clh", "const reals k = alpha * (across + h.z * h.z) / (across + alpha * alpha * h.z * h.z);",
       "const reals c2 = h.z * h.z / (across + h.z * h.z), k = alpha / (c2 * (alpha * alpha - R(1)) + R(1));", "brdf",
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

// --- Every device ---------------------------------------------------------------------------------------------------

std::string last_line_of(const fs::path& file) {
  std::istringstream lines(text_of(file));
  std::string last;
  for (std::string line; std::getline(lines, line);) last = line;
  return last;
}

struct CheckAll : CheckCommand {
  Surroundings with_cache(Surroundings around = {}) const {
    around.environment["XDG_CACHE_HOME"] = (folder / "cache").string();
    around.results = results;
    return around;
  }
  int check_all(const Surroundings& around, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"--device", "all", "--only", "unit_vector,pad"});
    return check(more, with_cache(around));
  }
  fs::path results = folder / "results.txt";
};

TEST_F(CheckAll, CountsVariantsDevicesAndFailuresAndKeepsTheVerdict) {
  const fs::path markdown = folder / "devices.md", page = folder / "devices.html";
  ASSERT_EQ(check_all({}, {"--report", markdown.string()}), 0) << text_of(log) << text_of(results);
  const int devices = static_cast<int>(list_devices().size());
  EXPECT_THAT(last_line_of(results), HasSubstr(fmt::format(" devices {} failed 0 unexplained 0", devices)));
  EXPECT_THAT(text_of(results), Not(HasSubstr("as checked before")));
  EXPECT_THAT(text_of(markdown), HasSubstr("| nn/unit_vector.cl:unit_vector_adjoint | "));
  ASSERT_EQ(check_all({}, {"--report", page.string(), "--json=" + json.string()}), 0) << text_of(log);
  EXPECT_THAT(text_of(results), HasSubstr("as checked before"));
  EXPECT_THAT(text_of(page), HasSubstr("nn/unit_vector.cl:unit_vector"));
  const auto found = nlohmann::json::parse(text_of(json));
  ASSERT_EQ(found["devices"].size(), static_cast<std::size_t>(devices));
  const auto& verdict = found["devices"][0];
  EXPECT_EQ(verdict["state"], "right");
  EXPECT_TRUE(verdict["kept"]);
  const auto kernels = verdict["kernels"].size();
  EXPECT_GE(kernels, 4u);  // forward and backward of two ops
  for (const auto& kernel : verdict["kernels"]) {
    EXPECT_GT(kernel["cases"], 0) << kernel;
    EXPECT_TRUE(kernel["in_double"]) << kernel;
    EXPECT_LT(kernel["value_ulps"], 100) << kernel;
  }
  ASSERT_EQ(check_all({}, {"--again"}), 0);
  EXPECT_THAT(text_of(results), Not(HasSubstr("as checked before")));
  auto other = found;  // of a machine elsewhere
  for (auto& each : other["devices"]) each["device"]["driver"] = "another";
  write_file(folder / "other.json", other.dump());
  ASSERT_EQ(check({"--from", json.string() + "," + (folder / "other.json").string()}, with_cache()), 0) << text_of(log);
  EXPECT_EQ(last_line_of(results), fmt::format("kernels {} devices {} failed 0 unexplained 0", kernels, 2 * devices));
}

TEST_F(CheckAll, OneDeviceCheckedApartIsOneVerdict) {
  const Surroundings changed = with_kernel("nn/unit_vector.cl", "? R(1e-6) :", "? R(1e-5) :");
  const auto check_some = [&](const std::string& stem, int status) {
    const fs::path file = folder / (stem + ".json");
    EXPECT_EQ(check({"--device", "all", "--only", stem, "--json=" + file.string()}, with_cache(changed)), status)
        << text_of(log);
    return std::pair{file.string(), nlohmann::json::parse(text_of(file))["devices"]};
  };
  const auto [right, of_right] = check_some("pad", 0);
  const auto [wrong, of_wrong] = check_some("unit_vector", 1);
  EXPECT_EQ(check({"--from", right + "," + wrong, "--json=" + json.string()}), 1);
  const auto joined = nlohmann::json::parse(text_of(json))["devices"];
  ASSERT_EQ(joined.size(), of_right.size());
  EXPECT_EQ(joined[0]["state"], "wrong");
  EXPECT_EQ(joined[0]["failures"].size(), 1u);
  EXPECT_EQ(joined[0]["kernels"].size(), of_right[0]["kernels"].size() + of_wrong[0]["kernels"].size());
}

TEST_F(CheckAll, WhatADeviceIsLostByIsNamedAndTheOthersAreChecked) {
  const auto check_some = [&](const std::string& lost_after, int status) {
    Surroundings around = with_cache();
    if (!lost_after.empty()) around.environment["CLERESTORY_PRETEND"] = "lost_after=" + lost_after;
    EXPECT_EQ(check({"--device", "all", "--only", "pad,ceilings,unit_vector", "--json=" + json.string()}, around),
              status)
        << text_of(log);
    return nlohmann::json::parse(text_of(json))["devices"][0];
  };
  const auto whole = check_some("", 0), lost = check_some("600", 1);
  ASSERT_FALSE(lost["failures"].empty());
  std::set<std::string> seen;
  for (const auto& failure : lost["failures"]) {
    EXPECT_THAT(failure["kernel"].get<std::string>(), testing::StartsWith("tensor/pad.cl:"));
    EXPECT_THAT(failure["fault"].get<std::string>(), HasSubstr("CL_DEVICE_NOT_AVAILABLE"));
  }
  for (const auto& kernel : lost["kernels"]) seen.insert(kernel["kernel"]);
  for (const auto& kernel : whole["kernels"]) {
    const std::string name = kernel["kernel"];
    EXPECT_TRUE(seen.count(name) || name.starts_with("tensor/pad.cl:")) << name;
  }
}

TEST_F(CheckAll, OneSmallMistakeIsNamedByItsKernelAndForgottenWithIt) {
  ASSERT_EQ(check_all({}), 0) << text_of(log);
  const Surroundings changed = with_kernel("nn/unit_vector.cl", "to[2 * plane] = inverse * (c - along * z);",
                                           "to[2 * plane] = inverse * (c - along * y);");
  for (int round = 0; round < 2; ++round) {  // the second time from the kept verdict
    EXPECT_EQ(check_all(changed), 1) << text_of(results);
    EXPECT_THAT(text_of(results), HasSubstr(": nn/unit_vector.cl:unit_vector_adjoint: unit_vector/"));
    EXPECT_THAT(text_of(results), Not(HasSubstr("nn/unit_vector.cl:unit_vector:")));
    EXPECT_THAT(last_line_of(results), HasSubstr("failed 1 unexplained 1"));
  }
  EXPECT_EQ(check_all({}), 0) << text_of(log);
  EXPECT_THAT(text_of(results), HasSubstr("as checked before"));
}

TEST_F(CheckAll, AnAdjointThatTakesASliceForAWholeTensorIsNamed) {
  // Right for tensors of their own: all that is seen is other bits in the gradient of a slice.
  const Surroundings changed =
      with_kernel("nn/unit_vector.cl", "(a - along * x)", "(a - along * (t_base + t_offset + n * 3 * plane)[i])");
  EXPECT_EQ(check_all(changed), 1) << text_of(results);
  EXPECT_THAT(text_of(results), HasSubstr(": nn/unit_vector.cl:unit_vector_adjoint: unit_vector/usual in float, as "
                                          "slices of bigger tensors, gradient 0"));
  EXPECT_THAT(text_of(results), Not(HasSubstr("nn/unit_vector.cl:unit_vector:")));
}

TEST_F(CheckAll, AReproducerThatComesLaterAndWordsToADriverMakeAVerdictAnew) {
  Surroundings changed = with_kernel("nn/unit_vector.cl", "? R(1e-6) :", "? R(1e-5) :");
  EXPECT_EQ(check_all(changed), 1) << text_of(log);
  EXPECT_THAT(last_line_of(results), HasSubstr("unexplained 1"));
  changed.environment["CL_CONFIG_CPU_TARGET_ARCH"] = "core-avx2";
  EXPECT_EQ(check_all(changed), 1);
  EXPECT_THAT(text_of(results), HasSubstr(") with CL_CONFIG_CPU_TARGET_ARCH=core-avx2"));
  EXPECT_THAT(text_of(results), Not(HasSubstr("as checked before")));
  changed.folder = folder / "work";  // what lies there comes before the program's own
  fs::create_directories(changed.folder / "checks/reproducers");
  fs::copy(fs::path(CLERESTORY_SOURCE_DIR) / "checks/variants.txt", changed.folder / "checks");
  std::ofstream(changed.folder / "checks/reproducers/always.cl")
      << "// device: " << list_devices().at(0).platform << "\n// kernels: nn/unit_vector.cl\n"
      << "kernel void reproduce(global int *wrong, const int many) { wrong[get_global_id(0)] = many; }\n";
  EXPECT_EQ(check_all(changed), 1);
  EXPECT_THAT(last_line_of(results), HasSubstr("unexplained 0")) << text_of(results);
  EXPECT_EQ(check_all(changed), 1);
  EXPECT_THAT(text_of(results), HasSubstr("as checked before"));
}

TEST_F(CheckAll, WhereEveryDeviceIsRefusedNothingIsRight) {
  const Surroundings changed = with_kernel("tensor/probe.cl", "vstore16(sin(v)", "vstore16(cos(v)");
  EXPECT_EQ(check_all(changed), 1) << text_of(results);
  EXPECT_THAT(text_of(log), HasSubstr("tensor/probe.cl"));
  EXPECT_THAT(text_of(results), HasSubstr("sin of 0.01 gives "));
}

TEST_F(CheckAll, ADriverThatHangsIsEndedAndTheKernelNamed) {
  const Surroundings changed = with_kernel("nn/unit_vector.cl", "to[2 * plane] = inverse * (c - along * z);",
                                           "to[2 * plane] = c; while (1) to[2 * plane] = x;");
  EXPECT_EQ(check({"--device", "all", "--only", "unit_vector", "--patience", "0.2"}, with_cache(changed)), 1);
  EXPECT_THAT(text_of(results), HasSubstr(": nn/unit_vector.cl:unit_vector_adjoint: unit_vector: the driver has done "
                                          "nothing for 0.2 minutes"));
  EXPECT_THAT(last_line_of(results), HasSubstr("failed 1 unexplained 1"));
  EXPECT_EQ(check({"--device", "all", "--patience", "0"}), 2);
}

TEST_F(CheckAll, AKernelThatDoesNotBuildIsNamed) {
  const Surroundings changed = with_kernel("nn/unit_vector.cl", "kernel void", "no kernel void");
  EXPECT_EQ(check_all(changed), 1);
  EXPECT_THAT(text_of(results), HasSubstr("unit_vector: unit_vector/usual: "));
  EXPECT_THAT(text_of(results), HasSubstr("failed 2 unexplained 2"));
}

TEST_F(CheckCommand, AMistakeInThePathTracerIsSeenInBothPrecisions) {
  const Surroundings changed = with_kernel("trace/path.cl", "? R(1) / kept :", "? R(1) / (kept + R(1)) :");
  const fs::path found = folder / "found.json";
  EXPECT_EQ(check({"--only", "path", "--json=" + found.string()}, changed), 1) << text_of(log);
  EXPECT_THAT(text_of(log), HasSubstr("one op is wrong: path"));
  for (const char* seen : {"trace_rays in float, 16 wide: ray ", "trace_rays in double, 16 wide: ray "})
    EXPECT_THAT(text_of(found), HasSubstr(seen));
}

TEST_F(CheckCommand, OneKernelOfThePathTracerIsNamedAlone) {
  // Maps that are wrong alike in float and in double, and the other eye of a picture.
  for (const auto& [right, wrong, kernel] :
       {std::tuple{"values[4] = at.material.albedo.x,", "values[4] = at.material.albedo.z,", "trace_maps"},
        {"trace_samples(&scene, o, d, R(0)", "trace_samples(&scene, o, -d, R(0)", "trace_view"}}) {
    const Surroundings changed = with_kernel("trace/path.cl", right, wrong);
    EXPECT_EQ(check({"--only", "path", "-q", "--json=" + json.string()}, changed), 1) << text_of(log);
    std::set<std::string> named;
    const auto found = nlohmann::json::parse(text_of(json));
    for (const auto& variant : found["kernels"])
      if (!variant["faults"].empty()) {
        const std::string text = variant["kernel"];
        named.insert(text.substr(0, text.find(' ')));
      } else if (variant["value_ulps"].is_number()) {
        EXPECT_LT(variant["value_ulps"], 1e5) << variant["kernel"] << " has the other's error";
      }
    EXPECT_EQ(named, std::set<std::string>{std::string("trace/path.cl:") + kernel});
  }
}

TEST_F(CheckCommand, AReproducerSaysWhetherTheDeviceShowsItsFault) {
  const auto written = [&](const char* what) {
    std::ofstream(folder / "short.cl") << "kernel void reproduce(global int *wrong, const int many) { " << what << " }";
    return check({"--reproduce", (folder / "short.cl").string(), "--device", "0"});
  };
  EXPECT_EQ(written("wrong[get_global_id(0)] = many - 70001;"), 0) << text_of(log);
  EXPECT_THAT(text_of(log), HasSubstr("does not show it"));
  EXPECT_EQ(written("wrong[get_global_id(0)] = many;"), 1);
  EXPECT_THAT(text_of(log), HasSubstr("shows it: 70001"));
  EXPECT_EQ(written("this is no OpenCL"), 1);
}

TEST(Reproducers, AreShortAndSayWhatTheyAreFor) {
  int seen = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(CLERESTORY_SOURCE_DIR) / "checks/reproducers")) {
    const std::string source = text_of(entry.path());
    EXPECT_LE(std::ranges::count(source, '\n'), 30) << entry.path();
    for (const char* part :
         {"// device: ", "\n// kernels: ", "kernel void reproduce(global int *wrong, const int many)"})
      EXPECT_THAT(source, HasSubstr(part)) << entry.path();
    ++seen;
  }
  EXPECT_GT(seen, 0);
}

TEST_F(CheckCommand, AReproducerShowsNothingOnADriverThatIsRight) {
  if (list_devices().at(0).platform != "Portable Computing Language") GTEST_SKIP() << "reproducers were seen on PoCL";
  for (const auto& entry : fs::directory_iterator(fs::path(CLERESTORY_SOURCE_DIR) / "checks/reproducers"))
    EXPECT_EQ(check({"--reproduce", entry.path().string(), "--device", "0"}), 0) << entry.path() << text_of(log);
}

TEST_F(CheckCommand, WhatIsNoResultIsBadInput) {
  std::ofstream(json) << "{\"devices\": [{\"state\": 3}]}";
  EXPECT_EQ(check({"--from", json.string()}), 2);
  EXPECT_THAT(text_of(log), HasSubstr("check.json"));
  EXPECT_EQ(check({"--device", "all", "--only", "pad", "--report", (folder / "page.txt").string()}), 2);
  EXPECT_EQ(check({"--device", "all", "--stability"}), 2);
  EXPECT_EQ(check({"--only", "pad", "--report", (folder / "page.md").string()}), 2);
}

TEST_F(CheckCommand, IsInterrupted) {
  Program program({"check", "--only", "conv"}, log);
  ASSERT_TRUE(wait_until([&] { return text_of(log).find("check") != std::string::npos; }));
  program.signal(SIGINT);
  EXPECT_EQ(program.wait(), 4) << text_of(log);
}

}  // namespace
}  // namespace clerestory
