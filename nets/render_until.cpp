#include "nets/render_until.hpp"

#include <algorithm>
#include <cmath>

#include "host/error.hpp"
#include "host/io/exposure.hpp"
#include "nets/learned_light.hpp"

namespace clerestory {
namespace {

void add_counts(std::vector<std::pair<std::string, double>>& to,
                const std::vector<std::pair<std::string, double>>& more) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i].second += more[i].second;
}

/// Rounds together.
class Rounds {
 public:
  void add(int more, Rendering round) {
    if (spp_ == 0)
      all_ = std::move(round);
    else
      join(spp_, more, round);
    spp_ += more;
  }
  const Image& radiance() const { return all_.radiance; }

  /// standard_error as the measured error has it over the pixels that are judged.
  Rendering finished(const std::vector<bool>& judged, double exposure, double error) && {
    const double stated = root_relative(all_.standard_error, {all_.radiance, judged, exposure});
    if (stated > 0 && error > 0)
      for (float& v : all_.standard_error.data) v = static_cast<float>(v * (error / stated));
    return std::move(all_);
  }

 private:
  void join(double n, double m, const Rendering& round) {
    const double a = n / (n + m), b = m / (n + m);
    const auto mix = [&](Image& to, const Image& from) {
      for (std::size_t i = 0; i < to.data.size(); ++i)
        to.data[i] = static_cast<float>(a * to.data[i] + b * from.data[i]);
    };
    mix(all_.radiance, round.radiance), mix(all_.uncertainty, round.uncertainty);
    for (std::size_t i = 0; i < all_.standard_error.data.size(); ++i)
      all_.standard_error.data[i] =
          static_cast<float>(std::hypot(a * all_.standard_error.data[i], b * round.standard_error.data[i]));
    all_.rays += round.rays, all_.dropped += round.dropped, all_.hits += round.hits, all_.seconds += round.seconds;
    if (!all_.first_dropped && round.first_dropped) {
      all_.first_dropped = round.first_dropped;
      all_.first_dropped->sample += spp_;
    }
    add_counts(all_.answered, round.answered);
    all_.shared_answers += round.shared_answers;
    all_.kernels.insert(all_.kernels.end(), round.kernels.begin(), round.kernels.end());
  }

  Rendering all_;
  int spp_ = 0;
};

}  // namespace

RenderedUntil render_until(Device& device, const Scene& scene, const RenderSettings& settings, const RenderGoal& goal,
                           const std::vector<bool>& where) {
  check_goal(settings, goal);
  RenderSettings round = settings;
  const double rays = static_cast<double>(scene.photo.pixels()) * round.spp;  // all rounds alike: they differ by noise
  round.sharing = shares_answers(scene, round, rays) ? Sharing::Always : Sharing::Never;
  std::vector<bool> judged;
  for (std::size_t i = 0; i < scene.depth.data.size(); ++i)
    judged.push_back(scene.depth.data[i] > 0 && (where.empty() || where[i]));
  if (!where.empty() && std::ranges::find(judged, true) == judged.end())
    throw usage_error("its pixels are not rendered", "--mask", "no depth at any of them", "surfaces");
  const double exposure = shown_exposure(scene.photo);
  RenderedUntil result;
  Rounds all;
  result.rounds = take_rounds(goal, settings.spp, [&](int samples, std::uint32_t number) {
    round.spp = samples, round.seed = round_seed(settings.seed, number);
    all.add(samples, render_scene(device, scene, round));
    return RoundPicture{all.radiance(), judged, exposure};
  });
  result.rendering = std::move(all).finished(judged, exposure, result.error());
  return result;
}

}  // namespace clerestory
