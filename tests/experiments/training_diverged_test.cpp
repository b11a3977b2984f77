// Training that diverges, through the real program: it ends with step, tensor and the last good checkpoint, and keeps
// no number that is not finite. Kernels with one mistake are what makes it do so at a step that is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "host/error.hpp"
#include "host/io/safetensors.hpp"
#include "host/report/metrics.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/training_run.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

/// Adam's rate is infinite at that step.
std::string infinite_rate(int step) {
  return fmt::format("AT(schedule, 0)[0] = t == {} ? INFINITY : AT(rate, 0)[0]", step);
}

struct TrainingThatDiverges : TrainingRun {
  /// Runs 12 steps with the first `right` of a kernel replaced, and expects that it ends as a failure.
  std::string said_with(const std::string& root, const std::string& file, const std::string& right,
                        const std::string& wrong, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"train.steps=12", "log.validate_every=0"});
    const int code = start(root, more, with_changed_kernel(folder / "kernels", file, right, wrong)).wait();
    EXPECT_EQ(code, 1) << output_of(root);
    EXPECT_TRUE(fs::exists(run_below(root) / "FAILED"));
    EXPECT_FALSE(fs::exists(run_below(root) / "DONE"));
    return output_of(root);
  }
  /// Checkpoints of a run, oldest first; reading them fails where a number is not finite.
  std::vector<std::string> checkpoints(const std::string& root) const {
    std::vector<std::string> names = files_below(run_below(root) / "checkpoints");
    for (const std::string& name : names) read_finite_safetensors(run_below(root) / "checkpoints" / name);
    return names;
  }
};

TEST_F(TrainingThatDiverges, ParameterIsNamedWithTheStepThatSpoiltIt) {
  const std::string right = "AT(schedule, 0)[0] = AT(rate, 0)[0]";
  const std::string said = said_with("runs", "nn/adam.cl", right, infinite_rate(4), {"log.checkpoint_every=3"});
  EXPECT_THAT(said, AllOf(HasSubstr("the training diverged"), HasSubstr("encoder.features.conv0.weight is not finite"),
                          HasSubstr("after step 4"), HasSubstr("step-00000003.safetensors")));
  EXPECT_EQ(checkpoints("runs"), std::vector<std::string>{"step-00000003.safetensors"});

  // Where the spoilt step is one of a checkpoint, that checkpoint is not written.
  const std::string at_checkpoint =
      said_with("others", "nn/adam.cl", right, infinite_rate(4), {"log.checkpoint_every=2"});
  EXPECT_THAT(at_checkpoint, AllOf(HasSubstr("is not finite after step 4"), HasSubstr("step-00000002.safetensors")));
  EXPECT_EQ(checkpoints("others"), std::vector<std::string>{"step-00000002.safetensors"});
}

TEST_F(TrainingThatDiverges, GradientIsNamedWithItsStepAndViews) {
  const std::string said = said_with("runs", "nn/group_norm.cl", "AT(dgamma, n)[c] = channel_gt",
                                     "AT(dgamma, n)[c] = c == 2 ? NAN : channel_gt", {"log.checkpoint_every=1"});
  EXPECT_THAT(said, AllOf(HasSubstr("the gradient of decoder_albedo."), HasSubstr("is not finite at step 1"),
                          HasSubstr("train_room_"), HasSubstr("no checkpoint is known to be good")));
  EXPECT_TRUE(checkpoints("runs").empty());
}

// Running statistics are no parameters: validation and checkpoints are what sees them.
TEST_F(TrainingThatDiverges, RunningStatisticsAreNamedWhenTheyAreToBeJudged) {
  const std::string said = said_with("runs", "nn/batch_norm.cl", "global real *mean = AT(running_mean, 0) + c;",
                                     "global real *mean = AT(running_mean, 0) + c; *mean = NAN;",
                                     {"log.validate_every=5", "log.checkpoint_every=0"});
  EXPECT_THAT(said, AllOf(HasSubstr("running_mean is not finite after step 5"),
                          HasSubstr("no checkpoint is known to be good")));
}

TEST_F(TrainingThatDiverges, LossThatIsNotFiniteIsNamedWithStepAndViews) {
  // Infinite in float; one that is not has a loss that is finite, and a gradient that is not.
  for (const auto& [weight, found] :
       {std::pair{"1e39", "the loss \"loss\""}, {"1e38", "the gradient of scale.weight"}}) {
    const std::string root = std::string("runs") + weight;
    Program program = start(root, {"train.steps=2", "log.validate_every=0", std::string("loss.scale=") + weight});
    EXPECT_EQ(program.wait(), 1);
    EXPECT_THAT(output_of(root), AllOf(HasSubstr(found), HasSubstr("not finite at step 1"), HasSubstr("train_room_")));
    EXPECT_TRUE(fs::exists(run_below(root) / "FAILED"));
    EXPECT_FALSE(fs::exists(run_below(root) / "DONE"));
  }
}

// One step a million times too wide: all numbers stay finite, and the loss is far above what it was. What the sixth
// made of the weights no line of metrics has seen that was good.
TEST_F(TrainingThatDiverges, LossThatHasRunAwayEndsTheLegAndDoesSoAgainWhenItGoesOn) {
  const std::vector<std::string> settings{"log.checkpoint_every=3", "train.runaway=100"};
  const auto run_away = [&](const std::vector<std::string>& more) {
    return said_with("runs", "nn/adam.cl", "AT(schedule, 0)[0] = AT(rate, 0)[0]",
                     "AT(schedule, 0)[0] = (t == 7 ? 1e6f : 1) * AT(rate, 0)[0]", more);
  };
  const std::string said = run_away(settings);
  EXPECT_THAT(said, AllOf(HasSubstr("the loss has run away"), HasSubstr("over the last 3 steps to step 9"),
                          HasSubstr("step-00000003.safetensors"), HasSubstr("train.runaway")));
  const std::vector<std::string> good{"step-00000003.safetensors", "step-00000006.safetensors"};
  EXPECT_EQ(checkpoints("runs"), good);
  const std::string again = run_away(settings);
  EXPECT_THAT(again, AllOf(HasSubstr("goes on after step 6"), HasSubstr("over the last 3 steps to step 9")));
  EXPECT_EQ(checkpoints("runs"), good);
}

}  // namespace
}  // namespace clerestory
