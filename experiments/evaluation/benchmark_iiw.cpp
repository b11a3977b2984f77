// IIW: WHDR of an albedo, by both conventions that published figures are on.
#include <algorithm>
#include <memory>

#include "experiments/evaluation/benchmark.hpp"
#include "experiments/evaluation/whdr.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

std::vector<IiwPicture> listed(const std::filesystem::path& data, const BenchmarkList& list, std::string& how) {
  const std::vector<IiwPicture> all = list_iiw(data);
  if (!list.file.empty()) {
    std::vector<std::string> ids;
    for (const IiwPicture& one : all) ids.push_back(one.id);
    std::vector<IiwPicture> kept;
    for (const std::string& name : read_list(list.file, ids))
      kept.push_back(*std::ranges::find(all, name, &IiwPicture::id));
    how = "the list that was given";
    return kept;
  }
  if (list.split == "all") return how = "all", all;
  if (!list.split.empty() && list.split != "test" && list.split != "train")
    throw usage_error("no such split of IIW", "--split", list.split, "test, train or all");
  const bool test = list.split != "train";
  std::vector<IiwPicture> kept = iiw_split(all, test);
  if (kept.empty()) throw usage_error("the split holds no picture", data.string(), list.split);
  how = test ? "every fifth of all ids sorted as texts, from the first on" : "all but every fifth of the sorted ids";
  return kept;
}

}  // namespace

Benchmark iiw_benchmark(Protocol protocol, const std::filesystem::path& data, const BenchmarkList& list) {
  if (protocol == Protocol::Marigold)
    throw usage_error("has nothing to say of IIW", "--protocol", "marigold", "zhu or li");
  std::string how;
  const auto pictures = std::make_shared<std::vector<IiwPicture>>(listed(data, list, how));
  Benchmark out;
  out.protocol = protocol == Protocol::Zhu ? "zhu" : "li", out.layout = "iiw";
  for (const IiwPicture& one : *pictures) out.names.push_back(one.id);
  const std::string common = fmt::format(
      "delta {}, mean of the channels of the pixel floor(y rows), floor(x columns) of the albedo at its own size, "
      "1e-10 "
      "at least; pairs count where people agreed, with a weight above 0 and both points opaque; weight of what is "
      "judged otherwise over all weight, mean over pictures",
      kWhdrDelta);
  out.metrics = {
      {"whdr_linear_percent", "WHDR, linear", "%", "of linear albedo, as in Bell et al.'s reference; " + common},
      {"whdr_display_percent", "WHDR, gamma 1/2.2", "%",
       "of albedo^(1/2.2), as in Li et al.'s script, but not rounded to 8 bits: a delta of some 23 % linear"}};
  out.conventions = {"pictures: " + how, protocol == Protocol::Li
                                             ? "Li et al. report WHDR of display values (gamma 1/2.2)"
                                             : "which of both WHDR Zhu et al. report is not known"};
  out.picture = [pictures](std::size_t i) { return read_photo((*pictures)[i].picture).image; };
  out.judge = [pictures](std::size_t i, const PredictedMaps& maps) {
    BenchmarkFigures figures{{std::nullopt, std::nullopt}};
    if (!maps.albedo) return figures;
    const Judgements judgements = read_judgements((*pictures)[i].judgements);
    const auto linear = whdr(*maps.albedo, judgements), shown = whdr(display_coded(*maps.albedo), judgements);
    if (linear) {
      figures.values = {100 * linear->rate, 100 * shown->rate};
      figures.pairs = linear->counted, figures.passed_over = linear->passed_over;
    } else {
      figures.passed_over = static_cast<int>(judgements.comparisons.size());
    }
    return figures;
  };
  return out;
}

}  // namespace clerestory
