#include "nets/rounds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/error.hpp"
#include "host/math/integers.hpp"
#include "host/math/radiance.hpp"
#include "host/math/statistics.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace {

constexpr int kRow = 16;  // samples come in such rows

/// Samples of the next round: as many as the error seems to ask for, between half and all of those before it, and no
/// more than there is time for; 0 ends the rounds.
int next_round(const RenderGoal& goal, const std::vector<RenderRound>& rounds, double seconds_a_sample) {
  const RenderRound& now = rounds.back();
  const bool second = rounds.size() == 1;  // without which no error is known
  double more = now.spp;
  if (!second && goal.error > 0) {
    if (now.error <= goal.error) return 0;
    const double wanted = now.spp * (std::pow(now.error / goal.error, 2.0) - 1);
    more = std::clamp(wanted, 0.5 * now.spp, 1.0 * now.spp);
  }
  more = std::min(more, static_cast<double>(goal.most - now.spp));
  int samples = round_up(static_cast<int>(std::ceil(more)), kRow);
  if (goal.seconds > 0 && !second) {
    const double left = (goal.seconds - now.seconds) / seconds_a_sample;
    if (left < samples) samples = static_cast<int>(std::max(left, 0.0)) / kRow * kRow;
  }
  return samples;
}

/// Of the picture `now`, which has `more` samples beside the `spp` of the one before.
double error_of(const Image& before, const RoundPicture& now, double spp, double more) {
  Image moved = now.picture;
  for (std::size_t i = 0; i < moved.data.size(); ++i) moved.data[i] -= before.data[i];
  return std::sqrt(spp / more) * root_relative(moved, now);
}

}  // namespace

double root_relative(const Image& differences, const RoundPicture& of) {
  const bool all = std::ranges::find(of.judged, true) == of.judged.end();
  const std::size_t n = of.picture.pixels();
  CompensatedSum sum;
  double count = 0;
  for (std::size_t p = 0; p < n; ++p) {
    if (!all && !of.judged[p]) continue;
    for (std::size_t i = p; i < of.picture.data.size(); i += n, ++count) {
      const double y = of.exposure * of.picture.data[i], d = of.exposure * differences.data[i];
      sum.add(d * d / (y * y + kLightFloor));
    }
  }
  return std::sqrt(sum.value() / count);
}

void check_goal(const RenderSettings& settings, const RenderGoal& goal) {
  for (const auto& [name, value] : {std::pair{"--target-error", goal.error}, std::pair{"--seconds", goal.seconds}})
    if (!(value >= 0 && std::isfinite(value)))
      throw usage_error("is no goal of a render", name, fmt::format("{}", value), "a number above 0");
  if (goal.error == 0 && goal.seconds == 0)
    throw usage_error("a render in rounds has no end", "--target-error, --seconds", "neither", "one of them");
  if (settings.sampler == "grid8x16")
    throw usage_error("has a fixed number of samples", "--sampler", settings.sampler,
                      "another where an error is asked for");
  if (settings.spp < kRow || settings.spp % kRow != 0)
    throw usage_error("beside --target-error and --seconds these are the samples of the first round", "--spp",
                      fmt::format("{}", settings.spp), fmt::format("a multiple of {}", kRow));
  if (settings.spp > goal.most / 2)
    throw usage_error("leaves no second round, by which the error is measured", "--spp",
                      fmt::format("{}", settings.spp), fmt::format("at most {}", goal.most / 2));
}

std::vector<RenderRound> take_rounds(const RenderGoal& goal, int first, const TakeRound& take) {
  const Stopwatch watch;
  std::vector<RenderRound> rounds;
  Image before;
  double rate = std::numeric_limits<double>::infinity();  // seconds a sample, the least: the first built kernels
  for (int more = first; more > 0; more = next_round(goal, rounds, rate)) {
    const Stopwatch one;
    RoundPicture now = take(more, static_cast<std::uint32_t>(rounds.size()));
    rate = std::min(rate, one.seconds() / more);
    const int spp = rounds.empty() ? 0 : rounds.back().spp;
    const double error = rounds.empty() ? std::numeric_limits<double>::quiet_NaN() : error_of(before, now, spp, more);
    rounds.push_back({spp + more, watch.seconds(), error});
    before = std::move(now.picture);
  }
  return rounds;
}

}  // namespace clerestory
