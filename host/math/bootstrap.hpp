// Whether two answers to the same questions differ by more than chance: a bootstrap (Efron 1979) over the questions,
// which both share, and over the repetitions, of which each has its own.
#pragma once
#include <cstdint>
#include <vector>

namespace clerestory {

/// The mean difference and the interval that holds it with a probability of 0.95.
struct Difference {
  double mean = 0, low = 0, high = 0;
  bool clear() const { return low > 0 || high < 0; }  // of 0
};

/// One answer's errors: [repetition][question], a training by seeds on rooms, say.
using Repeated = std::vector<std::vector<double>>;

/// `mine` less `other`. A question's difference is that of its means over repetitions, a repetition's departure is that
/// of its mean over questions. `draws` times questions are drawn anew, their departures widened to what Student's t
/// asks for so many, and what chance does to the repetitions' means is drawn from Welch's t, which lets the sides
/// spread unequally (of two repetitions a side 2 to 6 intervals of a hundred miss, by how unequal they are). A side
/// with one repetition says nothing of the spread over them: the interval is then over questions alone. Throws
/// usage_error unless all repetitions have the same number of questions, at least 2.
Difference paired_bootstrap(const Repeated& mine, const Repeated& other, std::uint64_t seed, int draws = 4000);

}  // namespace clerestory
