#include "experiments/commands/sample_options.hpp"

#include "experiments/applications/light_choice.hpp"

namespace clerestory {
namespace {

constexpr int kFirstRound = 16;  // samples a pixel
constexpr int kMostSamples = 1 << 20, kGridSamples = 128;

double goal_of(const std::optional<double>& given, const char* name) {
  if (given && !(*given > 0)) throw usage_error("is no goal of a render", name, fmt::format("{}", *given), "above 0");
  return given.value_or(0);
}

}  // namespace

void add_sample_options(Command& command, RenderSettings& render, SampleOptions& options, const std::string& of,
                        const std::vector<std::string>& more) {
  std::vector<std::string> samplers{"vndf_caps", "guided", "vndf_hemisphere", "vndf_bounded",
                                    "ndf",       "cosine", "uniform"};
  samplers.insert(samplers.end(), more.begin(), more.end());
  command
      .choice("--sampler",
              "How directions are drawn; default: guided, towards bright pixels too, under --light image, else "
              "vndf_caps",
              render.sampler, std::move(samplers))
      .option("--target-error", "E",
              "Take samples in rounds until the root relMSE of " + of + " is measured below this", options.error)
      .option("--seconds", "S", "Take samples in rounds for so many seconds", options.seconds);
}

std::optional<RenderGoal> take_samples(const CommonOptions& common, const SampleOptions& options,
                                       RenderSettings& render) {
  if (!was_given(common, "--sampler")) choose_sampler(render);
  std::optional<RenderGoal> goal;
  if (options.error || options.seconds) {
    goal = RenderGoal{goal_of(options.error, "--target-error"), goal_of(options.seconds, "--seconds")};
    render.spp = kFirstRound;
  }
  if (common.spp && *common.spp > kMostSamples)
    throw usage_error("out of range", "--spp", fmt::format("{}", *common.spp), fmt::format("1 to {}", kMostSamples));
  if (common.spp && render.sampler == "grid8x16" && *common.spp != kGridSamples)
    throw usage_error("a grid of 8x16 directions has its number", "--spp", fmt::format("{}", *common.spp),
                      fmt::format("{}, or none", kGridSamples));
  if (common.spp) render.spp = static_cast<int>(*common.spp);
  return goal;
}

}  // namespace clerestory
