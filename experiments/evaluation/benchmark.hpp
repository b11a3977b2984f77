// What others report of their maps, by their own conventions: a protocol over a data set.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "experiments/evaluation/predicted_maps.hpp"
#include "host/report/table.hpp"

namespace clerestory {

class NyuFile;

/// Zhu et al. 2022, Li et al. 2020, Marigold's intrinsic images (Ke et al. 2025).
enum class Protocol { Zhu, Li, Marigold };
Protocol protocol_of(const std::string& word);  // "zhu", "li", "marigold"

/// How a data set lies on disk: rooms as InteriorVerse's, IIW, NYUv2, OpenRooms.
enum class DataLayout { Rooms, Iiw, Nyu, OpenRooms };
/// Known by what lies in it: kNyuFile (or that file itself), main*_xml*, <id>.json beside its picture, else rooms.
/// Throws usage_error where nothing is there.
DataLayout layout_of(const std::filesystem::path& data);

struct BenchmarkMetric {
  std::string key, name, unit, convention;
};

/// The figures of one picture in the order of the metrics: nothing where the map was not predicted, or no pixel counts.
struct BenchmarkFigures {
  std::vector<std::optional<double>> values;
  int pairs = 0, passed_over = 0;  // comparisons of IIW
};

struct Benchmark {
  std::string protocol, layout;
  std::vector<std::string> names;  // of the pictures, in the list's order
  std::vector<BenchmarkMetric> metrics;
  std::vector<std::string> conventions;       // beside those of the metrics
  std::function<Image(std::size_t)> picture;  // linear radiance, as of a photograph
  std::function<BenchmarkFigures(std::size_t, const PredictedMaps&)> judge;
};

/// Which of a data set's pictures.
struct BenchmarkList {
  std::filesystem::path file;  // a name a line, an ending such as .png is passed over; empty: as `split` says
  std::string split;           // IIW: test, train or all; default: test. NYUv2: not without a file
};

/// IIW for zhu and li: WHDR of linear values and of those coded for a display.
Benchmark iiw_benchmark(Protocol protocol, const std::filesystem::path& data, const BenchmarkList& list);
/// NYUv2 for zhu and li: angles of normals, errors of depth rooted and not.
Benchmark nyu_benchmark(Protocol protocol, const std::filesystem::path& data, const BenchmarkList& list);
/// Views ROOM/NNN: what the test scripts of zhu and li print of synthetic rooms, PSNR and SSIM of albedo for marigold.
Benchmark rooms_benchmark(Protocol protocol, const std::vector<std::filesystem::path>& views);

/// OpenRooms for li and marigold, as rooms; zhu asks for what it does not have. `split`: train, test (the default).
Benchmark openrooms_benchmark(Protocol protocol, const std::filesystem::path& data, const BenchmarkList& list);

/// Lines of a list. Throws usage_error naming file and line: a name twice, one that is not among `known` (if that is
/// not empty), no name at all.
std::vector<std::string> read_list(const std::filesystem::path& file, const std::vector<std::string>& known);

/// Numbers of the pictures of NYUv2 that a list names, with zeros in front or without; of none: all.
std::vector<int> nyu_numbers(const NyuFile& file, const std::filesystem::path& list);

struct BenchmarkResult {
  std::vector<std::pair<std::string, std::string>> facts;  // protocol, layout, pictures and their list's hash, pairs
  std::vector<std::string> conventions;
  std::vector<BenchmarkMetric> metrics;
  std::vector<std::vector<double>> figures;  // of each metric, over the pictures that have it
  std::vector<std::string> names;
  std::vector<BenchmarkFigures> pictures;
};

/// Judges every picture; `predict` is called in the list's order.
BenchmarkResult run_benchmark(const Benchmark& benchmark, const std::function<PredictedMaps(std::size_t)>& predict);

/// Rows: metrics. Columns: mean and deviation over pictures, median, how many.
Table benchmark_table(const BenchmarkResult& result);
std::string benchmark_json(const BenchmarkResult& result);

}  // namespace clerestory
