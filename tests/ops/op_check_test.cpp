// The check of cases: what it measures, and that it notices what is wrong.
#include "checks/op_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cfloat>

#include "host/ops/tensor/elementwise.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// x * x, whose float result is within half an epsilon of the reference.
OpCase square() {
  return {.stem = "elementwise",
          .label = "square",
          .kernels = {"multiply"},
          .inputs = {{"x", random_tensor({1, 2, 3, 4}, 1, 1, 2)}},
          .build = [](Graph&, const Values& v) { return std::vector<Value>{multiply(v.at("x"), v.at("x"))}; },
          .reference =
              [](const Tensors& t) {
                Tensor y = t.at("x");
                for (double& v : y.real) v *= v;
                return std::vector<Tensor>{y};
              },
          .roundings = 1,
          .differentiate = {"x"}};
}

/// The first of its stem.
OpCase case_named(const std::string& stem) {
  const auto found = std::ranges::find(declared_cases(), stem, &OpCase::stem);
  EXPECT_NE(found, declared_cases().end()) << stem;
  return *found;
}

TEST(OpCheck, FindsNothingInWhatIsRight) {
  const OpFindings found = check_op(square(), test_devices());
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_LE(found.value_error, 0.5);
  EXPECT_GT(found.value_error, 0);
  EXPECT_LE(found.twin_error, 0.5);
  EXPECT_GT(found.twin_error, 0);
  EXPECT_LT(found.gradient_error, 1);
  EXPECT_LE(found.value_ulps, 0.5);
  EXPECT_GT(found.value_ulps, 0);
  EXPECT_GT(found.gradient_ulps, 0);
  const auto is_multiply = [](const KernelVariant& v) { return v.name == "multiply"; };
  EXPECT_EQ(std::ranges::count_if(found.launched, is_multiply), 1);
  EXPECT_EQ(std::ranges::count_if(found.launched_in_double, is_multiply), 1);
  EXPECT_THAT(found.suspects, IsEmpty());
}

TEST(OpCheck, SuspectsAreTheForwardKernelsOrThoseOfTheGradientAlone) {
  OpCase wrong = case_named("unit_vector");
  wrong.reference = [right = wrong.reference](const Tensors& t) {
    std::vector<Tensor> y = right(t);
    y[0].real[0] += 1;
    return y;
  };
  EXPECT_THAT(check_op(wrong, test_devices()).suspects, ElementsAre("unit_vector"));
  OpCase strict = case_named("unit_vector");
  strict.gradient_tolerance = 1e-20;
  EXPECT_THAT(check_op(strict, test_devices()).suspects, ElementsAre("unit_vector_adjoint"));
}

TEST(OpCheck, ErrorsAreSharesOfWhatIsAllowed) {
  OpCase c = square();
  c.reference = [right = c.reference](const Tensors& t) {
    std::vector<Tensor> y = right(t);
    y[0].real[5] += 30 * FLT_EPSILON * 4;
    return y;
  };
  c.magnitude = 4;
  const OpFindings found = check_op(c, test_devices());
  EXPECT_NEAR(found.value_error, 30, 0.5);  // and what the kernel itself is off, above
  EXPECT_LT(found.twin_error, 1);
  EXPECT_THAT(found.faults, ElementsAre(HasSubstr("elementwise/square in float against the reference, output 0, "
                                                  "element 5 of "),
                                        HasSubstr("elementwise/square in double against the reference")));
  c.roundings = 1e20;  // double, too
  EXPECT_THAT(check_op(c, test_devices()).faults, IsEmpty());
}

TEST(OpCheck, NamesWhatIsWrongWithACase) {
  OpCase other = square();
  other.kernels = {"conv_cpu"};
  EXPECT_THAT(check_op(other, test_devices()).faults,
              ElementsAre(HasSubstr("in float did not launch conv_cpu"), HasSubstr("in double did not launch")));
  OpCase strict = square();
  strict.gradient_tolerance = 1e-20;
  const OpFindings steep = check_op(strict, test_devices());
  EXPECT_THAT(steep.faults, ElementsAre(HasSubstr("elementwise/square: gradient of x, element ")));
  EXPECT_GT(steep.gradient_error, 1);
  OpCase more = square();
  more.reference = [](const Tensors&) { return std::vector<Tensor>(2); };
  EXPECT_THAT(check_op(more, test_devices()).faults, ElementsAre(HasSubstr("another number of tensors")));
  OpCase broken = square();
  broken.build = [](Graph& g, const Values& v) {
    return std::vector<Value>{multiply(v.at("x"), g.fill({1, 5, 3, 4}, 1))};
  };
  EXPECT_THAT(check_op(broken, test_devices()).faults, ElementsAre(HasSubstr("elementwise/square: ")));
}

TEST(OpCheck, WithoutDoublesFloatIsComparedWithTheReferenceAlone) {
  const OpFindings found = check_op(square(), {test_device(), {}});
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_GT(found.value_error, 0);
  EXPECT_TRUE(std::isnan(found.twin_error));
  EXPECT_TRUE(std::isnan(found.gradient_error));
}

}  // namespace
}  // namespace clerestory
