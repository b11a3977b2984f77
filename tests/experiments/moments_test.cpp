// Second moments in factors: what comes back, through files and through legs.
#include "experiments/weights/moments.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/error.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

struct MomentsTest : testing::Test {
  Graph graph;
  States states{Device::open()};

  void SetUp() override {
    graph.state("adam.v.conv", {4, 3, 2, 2}, {});
    graph.state("adam.v.bias", {1, 4, 1, 1}, {});
    graph.state("adam.m.conv", {4, 3, 2, 2}, {});
    states.initialise(graph, 1);
    Tensor conv({4, 3, 2, 2}), bias({1, 4, 1, 1});
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 12; ++c) conv.real[static_cast<std::size_t>(12 * r + c)] = 1e-9 * (r + 1) * (c + 2);
    bias.real = {1e-3, 0, 4e-12, 2.5};
    states.set("adam.v.conv", conv), states.set("adam.v.bias", bias);
  }
};

TEST_F(MomentsTest, ProductsOfRowsAndColumnsComeBackThroughAFileOfHalves) {
  ScratchFolder folder("clerestory-moments");
  TensorFile file;
  store_moments(file, factored_moments(states, 120));
  write_safetensors(folder / "moments.safetensors", file, FloatStorage::F16);
  const Moments back = stored_moments(read_safetensors(folder / "moments.safetensors"), "test");
  EXPECT_EQ(back.steps, 120);
  States other{Device::open()};
  other.initialise(graph, 1);
  EXPECT_TRUE(set_moments(other, back, "test"));
  for (const char* name : {"adam.v.conv", "adam.v.bias"}) {
    const Tensor wanted = states.get(name), found = other.get(name);
    // A logarithm below 32 in halves is off by 2^-7 at most; a product has two of them and their mean.
    for (std::size_t i = 0; i < wanted.real.size(); ++i)
      EXPECT_NEAR(found.real[i], wanted.real[i], 0.03 * wanted.real[i] + 1e-29) << name << " " << i;
  }
  for (const double m : other.get("adam.m.conv").real) EXPECT_EQ(m, 0);
}

// One step count corrects the bias of all second moments: a parameter that brings none would move too far.
TEST_F(MomentsTest, OfAllParametersOrOfNone) {
  Moments some = factored_moments(states, 120);
  some.tensors.erase("moments.rows.bias"), some.tensors.erase("moments.columns.bias");
  States other{Device::open()};
  other.initialise(graph, 1);
  EXPECT_FALSE(set_moments(other, some, "test"));
  for (const double v : other.get("adam.v.conv").real) EXPECT_EQ(v, 0);
}

// A leg that does not train the bias passes on what is known of it, through its checkpoint too.
TEST_F(MomentsTest, OfWhatALegDoesNotTrainAreKept) {
  const Moments all = factored_moments(states, 120);
  Graph part;
  part.state("adam.v.conv", {4, 3, 2, 2}, {});
  States frozen{Device::open()};
  frozen.initialise(part, 1);
  const Moments kept = moments_of_others(all, frozen);
  EXPECT_EQ(kept.steps, 120);
  ASSERT_EQ(kept.tensors.size(), 2u);
  EXPECT_EQ(kept.tensors.at("moments.rows.bias").values, all.tensors.at("moments.rows.bias").values);
  EXPECT_EQ(moments_of_others(all, states).steps, 0);

  const Moments both = joined(factored_moments(frozen, 40), kept);
  EXPECT_EQ(both.steps, 40) << "of two counts the smaller one";
  EXPECT_EQ(both.tensors.size(), 4u);
  EXPECT_NE(both.tensors.at("moments.rows.conv").values, all.tensors.at("moments.rows.conv").values)
      << "this leg's own";
  EXPECT_EQ(joined(both, {}).steps, 40);
  EXPECT_EQ(joined({}, kept).steps, 120);

  TensorFile checkpoint;
  checkpoint.metadata = {{"kind", "checkpoint"}, {"step", "7"}, {kEarlierSteps, "50"}};
  store_moments(checkpoint, kept);
  EXPECT_EQ(kept_moments(checkpoint, "test").steps, 120);
  const Moments back = stored_moments(checkpoint, "test");
  EXPECT_EQ(back.steps, 57);
  EXPECT_TRUE(back.tensors.contains("moments.columns.bias"));
}

TEST_F(MomentsTest, OnlyThoseAskedForGoIntoAFileAndNoneIsSaid) {
  TensorFile file;
  store_moments(file, factored_moments(states, 0));
  EXPECT_TRUE(file.tensors.empty() && file.metadata.empty());
  EXPECT_EQ(stored_moments(file, "test").steps, 0);
  store_moments(file, factored_moments(states, 5), "bi");
  EXPECT_EQ(file.tensors.size(), 2u);
  EXPECT_TRUE(file.tensors.contains("moments.rows.bias"));
}

TEST_F(MomentsTest, ACheckpointCountsTheStepsOfLegsBeforeIt) {
  TensorFile file;
  file.metadata = {{"kind", "checkpoint"}, {"step", "5"}};
  EXPECT_EQ(stored_moments(file, "test").steps, 5);
  file.metadata.insert({kEarlierSteps, "7"});
  EXPECT_EQ(stored_moments(file, "test").steps, 12);
}

TEST_F(MomentsTest, FactorsThatDoNotFitAreRefusedByName) {
  Moments moments = factored_moments(states, 5);
  moments.tensors["moments.columns.conv"] = StoredTensor({2}, std::vector<float>{1, 2});
  try {
    set_moments(states, moments, "w.safetensors");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage);
    EXPECT_NE(std::string(e.what()).find("w.safetensors: moments.columns.conv"), std::string::npos) << e.what();
  }
  TensorFile file;
  file.metadata["moment_steps"] = "many";
  EXPECT_THROW(stored_moments(file, "test"), Error);
}

}  // namespace
}  // namespace clerestory
