// What counts as a fault of a case of stability: made-up cases, whose numbers are known.
#include "checks/stability/stability_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kCount = 2000;

Evaluated vectors(double size) {
  Evaluated e{Tensor(Shape{1, 2, 1, kCount})};
  for (int i = 0; i < kCount; ++i) e.tensor.at(0, 0, 0, i) = 3 * size, e.tensor.at(0, 1, 0, i) = 4 * size;
  return e;
}

/// Equal in both precisions but for what `spoil` does to the one in float.
StabilityCase made_up(const std::function<void(Evaluations&)>& spoil, bool inside = true) {
  StabilityCase c{.group = "made up", .name = "case", .inside = inside};
  c.evaluate = [spoil](const Device&, Precision precision) {
    Evaluations e{{vectors(1)}, {vectors(2)}};
    if (precision == Precision::Single) spoil(e);
    return e;
  };
  return c;
}

StabilityRow row_of(const StabilityCase& c) { return check_stability(c, test_devices()); }

TEST(Stability, EqualNumbersAreRight) {
  const StabilityRow row = row_of(made_up([](Evaluations&) {}));
  EXPECT_THAT(row.faults, IsEmpty());
  EXPECT_EQ(row.evaluations, kCount);
  EXPECT_EQ(row.inside, kCount);
  EXPECT_EQ(row.value_error, 0);
  EXPECT_EQ(row.gradient_error, 0);
  EXPECT_EQ(row.dropped, 0);
}

// A vector's error is relative to its length; two in two thousand are beyond the percentile, three are not.
TEST(Stability, ErrorsAreJudgedByTheirPercentile) {
  for (const int wrong : {2, 3}) {
    const StabilityRow row = row_of(made_up([wrong](Evaluations& e) {
      for (int i = 0; i < wrong; ++i) e.values[0].tensor.at(0, 0, 0, 7 * i) += 5e-4;
    }));
    EXPECT_NEAR(row.value_error, wrong == 3 ? 1e-4 : 0, 1e-12);
    EXPECT_EQ(row.faults.size(), wrong == 3 ? 1u : 0u);
  }
  const StabilityRow slope = row_of(made_up([](Evaluations& e) {
    for (double& x : e.gradients[0].tensor.real) x *= 1.0002;
  }));
  EXPECT_THAT(slope.faults, ElementsAre(HasSubstr("gradient 0 is wrong by 0.0002")));
}

TEST(Stability, WhatIsNotFiniteIsAFaultEverywhere) {
  for (const bool inside : {true, false}) {
    const StabilityRow row = row_of(made_up([](Evaluations& e) { e.values[0].tensor.at(0, 1, 0, 3) = NAN; }, inside));
    EXPECT_EQ(row.bad_values, 1);
    EXPECT_THAT(row.faults, testing::Contains(HasSubstr("1 of 2000 values are not finite")));
    EXPECT_EQ(row.dropped, inside ? 1 : 0);
  }
  const StabilityRow row = row_of(made_up([](Evaluations& e) { e.gradients[0].tensor.at(0, 1, 0, 3) = INFINITY; }));
  EXPECT_THAT(row.faults, testing::Contains(HasSubstr("1 gradients are not finite")));
}

TEST(Stability, NothingIsDroppedInsideAndAllIsCountedOutside) {
  const auto lost = [](Evaluations& e) { e.values[0].tensor.at(0, 0, 0, 5) = e.values[0].tensor.at(0, 1, 0, 5) = 0; };
  EXPECT_THAT(row_of(made_up(lost)).faults, ElementsAre(HasSubstr("1 samples are dropped")));
  EXPECT_THAT(row_of(made_up(lost, false)).faults, IsEmpty());
  const auto counted = [](Evaluations& e) { e.dropped = 3; };
  EXPECT_THAT(row_of(made_up(counted, false)).faults, ElementsAre(HasSubstr("3 samples are counted as dropped, 0")));
}

TEST(Stability, OutsideErrorsAreShownAndNotJudged) {
  const auto wrong = [](Evaluations& e) {
    for (double& x : e.values[0].tensor.real) x *= 1.01;
  };
  const StabilityRow row = row_of(made_up(wrong, false));
  EXPECT_THAT(row.faults, IsEmpty());
  EXPECT_NEAR(row.value_error, 0.01, 1e-9);
}

// Evaluations outside of a case inside are not judged, and those that are nothing in both precisions hide none.
TEST(Stability, OnlyWhatIsInsideCounts) {
  StabilityCase c = made_up([](Evaluations&) {});
  c.evaluate = [](const Device&, Precision precision) {
    Evaluations e{{vectors(0)}, {}};
    e.values[0].inside.assign(kCount, 1);
    const double grown = precision == Precision::Single ? 1.5 : 1;
    e.values[0].tensor.at(0, 0, 0, 0) = 1, e.values[0].inside[1] = 0, e.values[0].tensor.at(0, 0, 0, 1) = grown;
    return e;
  };
  EXPECT_THAT(row_of(c).faults, IsEmpty());
  c.evaluate = [inner = c.evaluate](const Device& device, Precision precision) {
    Evaluations e = inner(device, precision);
    e.values[0].inside[1] = 1;
    for (int i = 1; i < kCount; ++i) e.values[0].tensor.at(0, 1, 0, i) = 0;
    if (precision == Precision::Single) e.values[0].tensor.at(0, 0, 0, 0) = 1.5;
    return e;
  };
  EXPECT_THAT(row_of(c).faults, ElementsAre(HasSubstr("value 0 is wrong by 0.5")));
}

TEST(Stability, RunsThatDifferAndValuesBeyondTheirBoundAreFaults) {
  int runs = 0;
  const StabilityRow row = row_of(made_up([&runs](Evaluations& e) { e.values[0].tensor.real[0] += 1e-9 * ++runs; }));
  EXPECT_THAT(row.faults, ElementsAre(HasSubstr("two runs differ")));
  StabilityCase bounded = made_up([](Evaluations&) {});
  bounded.most = 3.5;
  EXPECT_THAT(row_of(bounded).faults, ElementsAre(HasSubstr("a value is 4, allowed 3.5")));
}

TEST(Stability, SumsAreRelativeToAllOfThem) {
  const auto with = [](bool sums) {
    StabilityCase c = made_up([](Evaluations&) {});
    c.evaluate = [sums](const Device&, Precision precision) {
      Evaluations e{{vectors(1)}, {vectors(1)}};
      e.gradients[0].sums = sums;
      for (int i = 0; i < 10; ++i)
        for (int k = 0; k < 2; ++k) e.gradients[0].tensor.at(0, k, 0, i) = precision == Precision::Single ? 1e-6 : 2e-6;
      return e;
    };
    return row_of(c).gradient_error;
  };
  EXPECT_NEAR(with(false), 0.5, 1e-9);
  EXPECT_LT(with(true), 1e-6);
}

TEST(Stability, CasesHaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (const StabilityCase& c : stability_cases()) EXPECT_TRUE(names.insert(c.label()).second) << c.label();
  EXPECT_GT(names.size(), 100u);
}

}  // namespace
}  // namespace clerestory
