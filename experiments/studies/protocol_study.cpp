#include "experiments/studies/protocol_study.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "experiments/evaluation/layouts.hpp"
#include "experiments/evaluation/retinex.hpp"
#include "experiments/evaluation/room_box.hpp"
#include "experiments/studies/findings.hpp"
#include "experiments/studies/intervals.hpp"
#include "experiments/studies/study_run.hpp"
#include "experiments/training/evaluate_benchmark.hpp"
#include "host/io/nyu.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr int kSimpleSize = 320;  // longer side of the picture that simple methods read

/// A data set that is judged, and how its pictures are called in tables.
struct Judged {
  std::string key, label;
  fs::path data;
  BenchmarkList list;
};
struct Answerer {
  std::string key, label;
  fs::path weights;
  std::function<PredictedMaps(const Image& picture)> answer;  // in place of weights
};

/// Colour Retinex and the box of lines. Pictures of a protocol come without their cameras: the usual 65 degrees
/// are assumed, and rows say so.
PredictedMaps simple_maps(const Image& picture) {
  const Image small = prepare_photo(picture, kSimpleSize);
  const Camera camera = Camera::from_fov(small.width, small.height);
  BoxMaps box = maps_of(fitted_box(small, camera), camera);
  return {retinex_albedo(small), std::move(box.normal), std::move(box.depth), {}};
}

/// Grey, rough, a wall before the viewer.
PredictedMaps one_value(const Image& picture) {
  const int w = picture.width, h = picture.height;
  Image normal(w, h, 3), material(w, h, 2);
  std::fill_n(normal.plane(2), normal.pixels(), 1.0f), std::fill_n(material.plane(0), material.pixels(), 0.5f);
  return {Image(w, h, 3, 0.5f), std::move(normal), Image(w, h, 1, 1), std::move(material)};
}

class ProtocolStudy : public StudyRun {
 public:
  using StudyRun::StudyRun;

 private:
  /// One record for each data set and answerer.
  void measure() override {
    const std::string where = run_.metrics_path().string();
    for (const MetricRecord& record : records_) found_.add_room(record, where);
    prepare();
    std::size_t done = 0;
    for (const Judged& set : sets_)
      for (const Answerer& who : answerers_) {
        const std::size_t number = done++;
        if (number < records_.size()) continue;
        stop_if_interrupted("study");
        BenchmarkOptions o;
        o.protocol = "zhu", o.data = set.data, o.list = set.list, o.weights = who.weights, o.method = who.answer;
        o.device = config_.text("run.device"), o.gemm = config_.text("run.gemm");
        const BenchmarkResult result = evaluate_benchmark(o);
        RoomFindings found;
        for (std::size_t p = 0; p < result.pictures.size(); ++p)
          for (std::size_t m = 0; m < result.metrics.size(); ++m)
            if (const auto& value = result.pictures[p].values[m])
              found.add(Finding{result.metrics[m].key, set.key, who.key}.of(static_cast<std::int64_t>(p)), *value);
        add_record({static_cast<std::int64_t>(number) + 1, 0, found.values()});
        found_.add_room(records_.back(), where);
      }
  }

  void prepare() {
    answerers_.push_back({"ours", own_label(), use_maps(), {}});
    if (const std::optional<Method> rival = use_rival())
      answerers_.push_back({"rival", rival_label(*rival), rival->maps, {}});
    answerers_.push_back({"simple", "simple: Retinex, box of lines under 65 degrees", {}, simple_maps});
    answerers_.push_back({"constant", "one value for all pixels", {}, one_value});
    lacks("Wang et al. 2021");

    const GenerateOptions rooms = view_options();
    make_views(rooms);
    for (const char* layout : {"nyu", "iiw"})
      if (!fs::exists(rooms.out / layout)) write_layout(rooms.out, layout);
    sets_.push_back({"rooms_nyu", "our rooms, as NYUv2", rooms.out / "nyu", {}});
    sets_.push_back({"rooms_iiw", "our rooms, as IIW", rooms.out / "iiw", {{}, "all"}});
    sets_.push_back({"rooms", "our rooms", rooms.out, {{}, "test"}});
    add_named("nyu", "NYUv2", DataLayout::Nyu, {config_.text("protocol.nyu_list"), ""});
    add_named("iiw", "IIW", DataLayout::Iiw, {{}, "test"});
  }

  /// A public data set, where its folder is named.
  void add_named(const std::string& name, const std::string& label, DataLayout layout, const BenchmarkList& list) {
    const std::string key = "protocol." + name;
    const fs::path data = config_.text(key);
    if (data.empty()) return lacks(label + " (" + key + ")");
    if (layout_of(data) != layout) throw usage_error("this is not " + label, key, data.string(), "its folder");
    sets_.push_back({name, label, data, list});
  }

  /// By picture; NaN where one has no such figure.
  std::vector<double> figures(const std::string& metric, const Judged& set, const Answerer& who) const {
    std::vector<double> all;
    for (std::size_t record = 0; record < found_.rooms(); ++record)
      for (const auto& [item, value] : found_.items(record, {metric, set.key, who.key})) {
        all.resize(std::max<std::size_t>(all.size(), std::stoul(item) + 1), std::nan(""));
        all[std::stoul(item)] = value;
      }
    return all;
  }

  std::string conditions() const {
    return fmt::format(
               "By the conventions of Zhu et al. 2022 (docs/commands.md); mean over pictures and its interval of 95 % "
               "by a bootstrap over them, ± half of it or from and up to. Our rooms: {} of {}, {}x{}, {} samples a "
               "pixel.",
               rooms_.seeds.size(), rooms_.file.filename().string(), config_.integer("data.width"),
               config_.integer("data.height"), config_.integer("data.spp")) +
           lacking();
  }

  /// In the paper's form.
  void conclude() override {
    struct Shown {
      const char *metric, *name, *unit;
    };
    constexpr std::array<Shown, 5> shown{{{"normal_mean_degrees", "normals", "mean angle, degrees"},
                                          {"depth_si_log_rooted", "depth", "si-log, rooted"},
                                          {"depth_si_log", "depth", "si-log, not rooted"},
                                          {"whdr_linear_percent", "WHDR", "%, linear"},
                                          {"whdr_display_percent", "WHDR", "%, gamma 1/2.2"}}};
    Table paper{"Table 1", {{"data", "", Best::None}, {"method", "", Best::None}}, {}, conditions()};
    for (const Shown& s : shown) paper.columns.push_back({s.name, s.unit, Best::None, 4});
    for (const Judged& set : sets_)
      for (const Answerer& who : answerers_) {
        std::vector<Cell> row{set.label, who.label};
        bool any = false;
        for (const Shown& s : shown) {
          row.push_back(with_interval(figures(s.metric, set, who)));
          any = any || row.back().index() > 0;
        }
        if (any) paper.add(std::move(row));
      }
    write_table("1_paper", paper);
    std::fputs("\n", stdout);
    write_table("2_rooms", rooms_table());
    std::fputs("\n", stdout);
    write_table("3_differences", differences_table());
  }

  Table rooms_table() const {
    Table table{"Our rooms by the same paper's script", {{"method", "", Best::None}}, {}, conditions()};
    for (const char* map : {"albedo", "normals", "roughness", "metallic"}) table.columns.push_back({map, "MSE"});
    table.columns.push_back({"depth", "log MSE"});
    for (const Answerer& who : answerers_) {
      std::vector<Cell> row{who.label};
      for (const char* metric : {"albedo_mse", "normal_mse", "roughness_mse", "metallic_mse", "depth_log_mse"})
        row.push_back(with_interval(figures(metric, sets_[2], who)));
      table.add(std::move(row));
    }
    return table;
  }

  Table differences_table() const {
    Table table{
        own_label() + "'s error less the others', picture by picture",
        {{"data"}, {"error"}, {"less"}, {"pictures", "", Best::None, 4}},
        {},
        "Below 0 ours is better; the verdict is none where the interval holds 0. Pictures: those of which both have "
        "the figure. " +
            conditions()};
    add_difference_columns(table, "", "ours is");
    for (const Judged& set : sets_)
      for (const char* metric :
           {"normal_mean_degrees", "depth_si_log_rooted", "whdr_linear_percent", "whdr_display_percent", "albedo_mse",
            "normal_mse", "roughness_mse", "metallic_mse", "depth_log_mse"})
        for (std::size_t m = 1; m < answerers_.size(); ++m) {
          std::vector<double> ours = figures(metric, set, answerers_[0]), theirs = figures(metric, set, answerers_[m]);
          const std::size_t pictures = std::max(ours.size(), theirs.size());
          ours.resize(pictures, std::nan("")), theirs.resize(pictures, std::nan(""));
          if (const auto d = roomwise_difference(ours, theirs)) {
            std::vector<Cell> row{set.label, std::string(metric), answerers_[m].label,
                                  Measure{static_cast<double>(d->rooms)}};
            add_difference(row, *d);
            table.add(std::move(row));
          }
        }
    return table;
  }

  std::vector<Judged> sets_;
  std::vector<Answerer> answerers_;
  Findings found_;
};

}  // namespace

void add_protocol_keys(Schema& schema) {
  schema.section("protocol", "Maps judged as others judge.")
      .text("protocol.nyu", "", "Folder of NYUv2: nyu_depth_v2_labeled.mat, normals, masks; empty: it is lacking")
      .text("protocol.nyu_list", "", "Its pictures that count, a number a line; empty: all")
      .text("protocol.iiw", "", "Folder of IIW: <id>.png and <id>.json; empty: it is lacking");
}

std::string run_protocol_study(const Config& config, const std::vector<std::string>& command) {
  return ProtocolStudy(config, command).run();
}

}  // namespace clerestory
