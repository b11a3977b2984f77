// NYUv2: normals and depth as in Table 1 of Zhu et al., by the conventions of Li et al.'s scripts.
#include <algorithm>
#include <cmath>
#include <memory>

#include "experiments/evaluation/benchmark.hpp"
#include "experiments/evaluation/benchmark_errors.hpp"
#include "host/error.hpp"
#include "host/io/nyu.hpp"
#include "host/io/resize.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

struct NyuSet {
  fs::path folder;  // of normals and masks
  NyuFile file;
  std::vector<int> numbers;
  bool has_normals;
  Lengths lengths;

  NyuSet(const fs::path& data, const BenchmarkList& list, Protocol protocol)
      : folder(fs::is_directory(data) ? data : data.parent_path()),
        file(fs::is_directory(data) ? data / kNyuFile : data),
        has_normals(fs::is_directory(folder / "normals")),
        lengths(protocol == Protocol::Li ? Lengths::AsTheyAre : Lengths::Unit) {
    if (list.file.empty() && !list.split.empty() && list.split != "all")
      throw usage_error("the official split is not in this file", "--split", list.split,
                        "--list FILE with a number a line, from 1 on: testNdxs or trainNdxs of splits.mat");
    numbers = nyu_numbers(file, list.file);
  }

  std::vector<std::optional<double>> judge(std::size_t i, const PredictedMaps& maps) const {
    std::vector<std::optional<double>> values(4);
    if (maps.normal && has_normals) {
      const NyuNormals truth = read_nyu_normals(folder, numbers[i]);
      const Image ours = resize_bilinear(*maps.normal, truth.normal.width, truth.normal.height);
      if (const auto angles = normal_angles(ours, truth.normal, truth.mask, lengths))
        values[0] = angles->mean, values[1] = angles->median;
    }
    if (maps.depth) {
      const Image truth = file.depth(numbers[i]);
      if (const auto error = centred_log_error(resize_bilinear(*maps.depth, truth.width, truth.height), truth))
        values[2] = std::sqrt(*error), values[3] = *error;
    }
    return values;
  }
};

}  // namespace

std::vector<int> nyu_numbers(const NyuFile& file, const fs::path& list) {
  std::vector<int> numbers;
  for (int n = 1; n <= file.size(); ++n) numbers.push_back(n);
  if (list.empty()) return numbers;
  std::vector<std::string> known;
  for (const int n : numbers) known.push_back(nyu_name(n)), known.push_back(std::to_string(n));
  numbers.clear();
  for (const std::string& name : read_list(list, known)) {
    numbers.push_back(std::stoi(name));
    if (std::ranges::count(numbers, numbers.back()) > 1)
      throw usage_error("names a picture twice", list.string(), name);
  }
  return numbers;
}

Benchmark nyu_benchmark(Protocol protocol, const fs::path& data, const BenchmarkList& list) {
  if (protocol == Protocol::Marigold)
    throw usage_error("has nothing to say of NYUv2", "--protocol", "marigold", "zhu or li");
  const auto set = std::make_shared<NyuSet>(data, list, protocol);
  Benchmark out;
  out.protocol = protocol == Protocol::Zhu ? "zhu" : "li", out.layout = "nyu";
  for (const int number : set->numbers) out.names.push_back(nyu_name(number));
  const std::string angle =
      std::string(
          "angle to the true normal where the mask is 255 in all channels; predictions resized bilinearly to ") +
      "the size of the truth and " +
      (protocol == Protocol::Li ? "not made unit length again, as in Li et al.'s script" : "made unit length again") +
      "; mean over pictures";
  const std::string depth = fmt::format(
      "difference of natural logarithms, each less its mean over all pixels with a depth, squared, mean where the "
      "truth "
      "lies between {} and {} m; predictions resized bilinearly",
      kNearestJudged, kFarthestJudged);
  out.metrics = {{"normal_mean_degrees", "normals, mean", "degrees", "mean " + angle},
                 {"normal_median_degrees", "normals, median", "degrees", "median " + angle},
                 {"depth_si_log_rooted", "depth, si-log rooted", "", depth + "; rooted, mean over pictures"},
                 {"depth_si_log", "depth, si-log", "", depth + "; not rooted, mean over pictures"}};
  out.conventions = {
      list.file.empty() ? "pictures: all of the file; the official split (795 to train on, 654 to test) "
                          "takes --list FILE, a number a line"
                        : "pictures: the list that was given",
      fmt::format("truth: {}x{}, depths as filled in by the data set's authors", set->file.width(), set->file.height()),
      "Table 1 of Zhu et al. calls the rooted figure si-MSE, by all that is known"};
  if (!set->has_normals)
    out.conventions.push_back(
        "normals are not judged: no folder normals (NNNN.png, with masks/NNNN.png) beside the file");
  out.picture = [set](std::size_t i) { return set->file.picture(set->numbers[i]); };
  out.judge = [set](std::size_t i, const PredictedMaps& maps) { return BenchmarkFigures{set->judge(i, maps)}; };
  return out;
}

}  // namespace clerestory
