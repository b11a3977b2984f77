// Samples taken in rounds of independent numbers, until what is made of them has an error that is small enough or its
// time is over: a re-render, objects put into a photograph, an edit.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "nets/render_scene.hpp"

namespace clerestory {

/// What a picture is to reach; its rounds end with the first that is.
struct RenderGoal {
  double error = 0;    // root relMSE (eps 0.01 in the photograph's unit) over the pixels that are judged; 0: any
  double seconds = 0;  // that rounds may take, kernels built on the way counted; 0: any
  int most = 1 << 14;  // samples a pixel
};

/// After a round: of all rounds so far.
struct RenderRound {
  int spp = 0;         // samples a pixel
  double seconds = 0;  // since the beginning
  double error = 0;    // root relMSE as measured between rounds; NaN after the first
};

/// What all samples so far make.
struct RoundPicture {
  Image picture;             // 3 channels
  std::vector<bool> judged;  // row-major: the pixels over which its error is measured; where none is set, all
  double exposure = 1;       // by which it is shown: what is dark for a viewer is so in any unit
};

/// Takes so many samples more, by random numbers of the round's own; rounds are counted from 0.
using TakeRound = std::function<RoundPicture(int samples, std::uint32_t round)>;

/// Of a round's random numbers. Rounds lie apart, so that neighbouring seeds of users have none in common.
inline std::uint32_t round_seed(std::uint32_t seed, std::uint32_t round) { return seed + 0x85ebca6bu * round; }

/// Throws usage_error: a goal that is none, a first round that is no multiple of 16 samples or leaves no second one, a
/// sampler of a fixed number.
void check_goal(const RenderSettings& settings, const RenderGoal& goal);

/// Rounds of at most as many samples as all before them, the first of `first` (a multiple of 16); at least two. The
/// error is measured from what a round changes: with A of N samples and B of M, their mean (N A + M B) / (N + M) is
/// M (B - A) / (N + M) away from A, and has the variance <(B - A)^2> N M / (N + M)^2 in expectation where N = M,
/// whatever the points, or where variances go as 1 / N; of Sobol's points and M < N it is more than there is. Of a
/// picture that is no mean but made of means, that is so to first order.
std::vector<RenderRound> take_rounds(const RenderGoal& goal, int first, const TakeRound& take);

/// Root of the mean of differences^2 / (picture^2 + 0.01), both as they are shown, over the pixels that are judged.
double root_relative(const Image& differences, const RoundPicture& of);

}  // namespace clerestory
