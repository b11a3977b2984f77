#include "experiments/evaluation/whdr.hpp"

#include <algorithm>
#include <cmath>

#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

double lightness(const Image& image, const JudgedPoint& point) {
  const int x = std::min(static_cast<int>(point.x * image.width), image.width - 1),
            y = std::min(static_cast<int>(point.y * image.height), image.height - 1);
  double total = 0;
  for (int c = 0; c < image.channels; ++c) total += image.at(c, y, x);
  return std::max(1e-10, total / image.channels);
}

}  // namespace

Darker darker_of(const Image& reflectance, const JudgedPoint& first, const JudgedPoint& second, double delta) {
  const double one = lightness(reflectance, first), two = lightness(reflectance, second);
  if (two / one > 1 + delta) return Darker::First;
  if (one / two > 1 + delta) return Darker::Second;
  return Darker::Equal;
}

bool counts(const Judgements& judgements, const JudgedPair& pair) {
  const std::vector<JudgedPoint>& points = judgements.points;
  return pair.darker && pair.weight > 0 && points[pair.first].opaque && points[pair.second].opaque;
}

std::optional<Whdr> whdr(const Image& reflectance, const Judgements& judgements, double delta) {
  Whdr result;
  CompensatedSum wrong, all;
  for (const JudgedPair& j : judgements.comparisons) {
    const JudgedPoint &first = judgements.points[j.first], &second = judgements.points[j.second];
    if (!counts(judgements, j)) {
      ++result.passed_over;
      continue;
    }
    ++result.counted;
    all.add(j.weight);
    if (darker_of(reflectance, first, second, delta) != *j.darker) wrong.add(j.weight);
  }
  if (result.counted == 0) return std::nullopt;
  result.weight = all.value(), result.rate = wrong.value() / result.weight;
  return result;
}

Image display_coded(Image linear) {
  for (float& v : linear.data) v = std::pow(std::max(v, 0.0f), static_cast<float>(1 / 2.2));
  return linear;
}

}  // namespace clerestory
