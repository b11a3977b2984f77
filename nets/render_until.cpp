#include "nets/render_until.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/error.hpp"
#include "host/math/integers.hpp"
#include "host/math/radiance.hpp"
#include "host/math/statistics.hpp"
#include "host/stopwatch.hpp"
#include "nets/learned_light.hpp"

namespace clerestory {
namespace {

constexpr int kRow = 16;  // samples come in such rows

/// Mean of squares over size^2 + floor, over the three channels of the pixels that have a depth.
template <class Square>
double relative_mean(const Image& depth, const Image& size, Square square) {
  CompensatedSum sum;
  double count = 0;
  const std::size_t n = depth.pixels();
  for (std::size_t p = 0; p < n; ++p) {
    if (!(depth.data[p] > 0)) continue;
    for (std::size_t i = p; i < 3 * n; i += n, ++count) {
      const double y = size.data[i];
      sum.add(square(i) / (y * y + kLightFloor));
    }
  }
  return count > 0 ? sum.value() / count : 0;
}

void add_counts(std::vector<std::pair<std::string, double>>& to,
                const std::vector<std::pair<std::string, double>>& more) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i].second += more[i].second;
}

/// Rounds together; how far the last was from those before it is what the error is read off.
class Rounds {
 public:
  Rounds(const Scene& scene, int first_spp, Rendering first) : scene_(scene), all_(std::move(first)), spp_(first_spp) {}

  void add(int more, Rendering round) {
    const double n = spp_, m = more, a = n / (n + m), b = m / (n + m);
    Image before = all_.radiance;
    const auto mix = [&](Image& to, const Image& from) {
      for (std::size_t i = 0; i < to.data.size(); ++i)
        to.data[i] = static_cast<float>(a * to.data[i] + b * from.data[i]);
    };
    mix(all_.radiance, round.radiance), mix(all_.uncertainty, round.uncertainty);
    for (std::size_t i = 0; i < all_.standard_error.data.size(); ++i)
      all_.standard_error.data[i] =
          static_cast<float>(std::hypot(a * all_.standard_error.data[i], b * round.standard_error.data[i]));
    error_ = std::sqrt(a * b * relative_mean(scene_.depth, all_.radiance, [&](std::size_t i) {
                         return std::pow(static_cast<double>(round.radiance.data[i]) - before.data[i], 2.0);
                       }));
    all_.rays += round.rays, all_.dropped += round.dropped, all_.hits += round.hits, all_.seconds += round.seconds;
    if (all_.first_dropped.empty()) all_.first_dropped = round.first_dropped;
    add_counts(all_.answered, round.answered);
    all_.shared_answers += round.shared_answers;
    all_.kernels.insert(all_.kernels.end(), round.kernels.begin(), round.kernels.end());
    spp_ += more;
  }

  int spp() const { return spp_; }
  double error() const { return error_; }

  /// standard_error as the measured error has it over the whole picture.
  Rendering finished() && {
    const double stated = std::sqrt(relative_mean(scene_.depth, all_.radiance, [&](std::size_t i) {
      return std::pow(static_cast<double>(all_.standard_error.data[i]), 2.0);
    }));
    if (stated > 0 && error_ > 0)
      for (float& v : all_.standard_error.data) v = static_cast<float>(v * (error_ / stated));
    return std::move(all_);
  }

 private:
  const Scene& scene_;
  Rendering all_;
  int spp_;
  double error_ = std::numeric_limits<double>::quiet_NaN();
};

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

}  // namespace

void check_goal(const RenderSettings& settings, const RenderGoal& goal) {
  for (const auto& [name, value] : {std::pair{"--target-error", goal.error}, std::pair{"--seconds", goal.seconds}})
    if (!(value >= 0 && std::isfinite(value)))
      throw usage_error("is no goal of a re-render", name, fmt::format("{}", value), "a number above 0");
  if (goal.error == 0 && goal.seconds == 0)
    throw usage_error("a re-render in rounds has no end", "--target-error, --seconds", "neither", "one of them");
  if (settings.sampler == "grid8x16")
    throw usage_error("has a fixed number of samples", "--sampler", settings.sampler,
                      "another where an error is asked for");
  if (settings.spp < kRow || settings.spp % kRow != 0)
    throw usage_error("is no first round of samples", "--spp", fmt::format("{}", settings.spp),
                      fmt::format("a multiple of {}", kRow));
}

RenderedUntil render_until(Device& device, const Scene& scene, const RenderSettings& settings, const RenderGoal& goal) {
  check_goal(settings, goal);
  const Stopwatch watch;
  RenderSettings round = settings;
  const double rays = static_cast<double>(scene.photo.pixels()) * round.spp;  // all rounds alike: they differ by noise
  round.sharing = shares_answers(scene, round, rays) ? Sharing::Always : Sharing::Never;
  RenderedUntil result;
  Rounds rounds(scene, round.spp, render_scene(device, scene, round));
  result.rounds.push_back({rounds.spp(), watch.seconds(), rounds.error()});
  double rate = watch.seconds() / rounds.spp();  // the least of all rounds: the first built kernels
  while ((round.spp = next_round(goal, result.rounds, rate)) > 0) {
    const Stopwatch one;
    ++round.seed;
    rounds.add(round.spp, render_scene(device, scene, round));
    rate = std::min(rate, one.seconds() / round.spp);
    result.rounds.push_back({rounds.spp(), watch.seconds(), rounds.error()});
  }
  result.rendering = std::move(rounds).finished();
  return result;
}

}  // namespace clerestory
