#include "experiments/studies/user_study.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "experiments/applications/predict.hpp"
#include "experiments/evaluation/detection.hpp"
#include "experiments/studies/room_study.hpp"
#include "experiments/studies/strip.hpp"
#include "experiments/studies/user_room.hpp"
#include "experiments/truth/study_light.hpp"
#include "experiments/weights/weights.hpp"
#include "host/math/statistics.hpp"
#include "tracer/balls.hpp"

namespace clerestory {
namespace {

constexpr int kMostStrips = 4;  // rooms shown

struct Job {
  std::string key, name;
};
std::vector<Job> jobs() {
  std::vector<Job> all{{"render", "re-render"}, {"air", "light in free air"}};
  for (const BallKind& kind : ball_kinds()) all.push_back({kind.name, kind.name + " ball"});
  for (const BallKind& kind : ball_kinds())
    all.push_back({"around " + kind.name, "room around the " + kind.name + " ball"});
  return all;
}

/// Of a predicted map: `who`: ours or a trivial predictor.
Finding map_finding(const MapErrorInfo& error, const char* who) { return {error.key, "maps", who}; }
const Finding kScale{"scale", "maps", "ours"}, kSeconds{"seconds", "render"}, kBall{"ball"};

class UserStudy : public RoomStudy {
 public:
  using RoomStudy::RoomStudy;

 private:
  void measure() override {
    prepare();
    measure_rooms([this](const ListedRoom& listed) {
      const UserRoom room = measure_user_room(device_, listed, options_, means_ ? &*means_ : nullptr);
      RoomFindings found;
      found.add(kBall, room.ball), found.add(kSeconds, room.seconds);
      for (const UserError& e : room.errors)
        for (const RadianceFigure& f : kRadianceFigures)
          found.add(Finding{f.key, e.job, e.light, e.maps}.of(e.seed), e.error.*f.value);
      for (int m = 0; m < map_error_count; ++m) add_map_errors(found, room.maps, static_cast<MapError>(m));
      if (room.maps.log_scale_error) found.add(kScale, *room.maps.log_scale_error);
      if (listed.index < kMostStrips)
        write_strip(run_.artifact(fmt::format("room{}_photo_tracers_ball_then_lights.png", listed.index)), room.strip);
      return found;
    });
  }

  void prepare() {
    options_.width = config_.whole("data.width"), options_.height = config_.whole("data.height"),
    options_.photo_spp = config_.whole("data.spp");
    options_.truth_spp = config_.whole("user.truth_spp"), options_.probes = config_.whole("user.probes");
    options_.probe_spp = config_.whole("user.probe_spp"), options_.seeds = config_.whole("study.seeds");
    options_.lights = config_.texts("user.lights"), options_.render.spp = config_.whole("user.spp");
    for (const std::string& light : options_.lights) {
      options_.render.light = study_light(light).light;
      if (is_learned_light(options_.render.light)) use_light(options_.render);
    }
    options_.maps_weights = use_maps();
    if (const LoadedWeights weights = load_weights(options_.maps_weights, device_); weights.means)
      means_ = weights.means->maps(options_.width, options_.height);
  }

  static void add_map_errors(RoomFindings& found, const ViewResult& result, MapError error) {
    const auto add = [&](const char* who, const MapErrors& errors) {
      if (const auto& e = errors[static_cast<std::size_t>(error)]) found.add(map_finding(info(error), who), *e);
    };
    add("ours", result.ours), add("mean map", result.mean_map), add("picture", result.picture);
    add("constant", result.constant);
  }

  Findings::BySeed values(const std::string& maps, const std::string& light, const std::string& job,
                          const RadianceFigure& figure) const {
    return found().present_by_seed({figure.key, job, light, maps}, config_.integer("study.seeds"));
  }
  Cell cell(const std::string& maps, const std::string& light, const std::string& job,
            const RadianceFigure& figure) const {
    const auto rooms = values(maps, light, job, figure);
    return rooms.empty() ? Cell() : Cell(over_rooms(rooms));
  }

  std::string label(const std::string& light) const {
    if (light == kUnchanged) return "none: the photograph unchanged";
    if (light == kOracle) return "oracle: the best constant, which reads the truth";
    return light_label(light, own_label());
  }
  std::vector<std::string> rows() const {
    std::vector<std::string> lights = config_.texts("user.lights");
    lights.push_back(kUnchanged);
    if (std::ranges::find(lights, "constant") != lights.end()) lights.push_back(kOracle);
    return lights;
  }

  /// What every table of the study says of itself.
  std::string conditions() const {
    return fmt::format(
        "{} rooms of {} ({}), one photograph of {}x{} each, clipped at white and stored in 8 bits; mean over rooms and "
        "{} seeds of the layer, ± the larger of the spread over seeds and the standard error over rooms; {} samples a "
        "pixel, truth by {} (of the light in free air by {}), whose noise is in all figures, nothing clamped",
        found().rooms(), rooms_.file.filename().string(),
        rooms_.setting == Setting::HeldOut ? "content kept out of training" : "content of the training",
        config_.integer("data.width"), config_.integer("data.height"), config_.integer("study.seeds"),
        config_.integer("user.spp"), config_.integer("user.truth_spp"), 2 * config_.integer("user.probe_spp"));
  }

  Table user_table() const {
    Table table;
    table.title = "What a user gets";
    table.note =
        conditions() +
        ". Lamps and the fitted constant are fitted to the picture that the re-render is judged by; air, balls "
        "and the room around them are not. The camera is known; balls stand at the pixel where the truth's stand and "
        "are as large in the picture, whatever the scale of depth.";
    table.columns = {{"maps"}, {"light"}};
    struct Shown {
      std::string job, column;
      RadianceFigure figure;
    };
    std::vector<Shown> shown{{"render", "re-render", kShownPsnr},
                             {"render", "re-render", kSmape},
                             {"air", "light in free air", kSmape},
                             {"air", "light in free air", kMedianLog}};
    for (const BallKind& kind : ball_kinds()) shown.push_back({kind.name, kind.name + " ball", kShownPsnr});
    shown.push_back({"around diffuse", "room around the diffuse ball", kShownPsnr});
    for (const Shown& s : shown)
      table.columns.push_back(
          {s.column, fmt::format("{}, {}", s.figure.name, s.figure.unit), Best::None, s.figure.digits});
    for (const std::string& maps : {kPredictedMaps, kTrueMaps})
      for (const std::string& light : rows()) {
        std::vector<Cell> row{maps, label(light)};
        for (const Shown& s : shown) row.push_back(cell(maps, light, s.job, s.figure));
        table.add(std::move(row));
      }
    return table;
  }

  Table all_figures_table() const {
    Table table;
    table.title = "The same by every measure";
    table.note = conditions() + ".";
    table.columns = {{"judged"}, {"maps"}, {"light"}};
    for (const RadianceFigure& f : kRadianceFigures) table.columns.push_back({f.name, f.unit, Best::None, f.digits});
    table.columns.push_back({"rooms"});
    for (const Job& job : jobs())
      for (const std::string& maps : {kPredictedMaps, kTrueMaps})
        for (const std::string& light : rows()) {
          const auto rooms = values(maps, light, job.key, kShownPsnr);
          if (rooms.empty()) continue;
          std::vector<Cell> row{job.name, maps, label(light)};
          for (const RadianceFigure& f : kRadianceFigures) row.push_back(cell(maps, light, job.key, f));
          row.push_back(Measure{static_cast<double>(rooms.size())});
          table.add(std::move(row));
        }
    return table;
  }

  /// The first light less the others, over equal rooms and seeds.
  Table differences_table() const {
    Table table;
    const std::string& ours = config_.texts("user.lights").at(0);
    table.title = label(ours) + " less the others, room by room";
    table.note =
        "A difference of at most two spreads is none; spread is the larger of that over seeds and the standard error "
        "over "
        "rooms. " +
        conditions() + ".";
    table.columns = {{"judged"}, {"maps"}, {"less"}};
    for (const RadianceFigure& f : {kShownPsnr, kSmape}) {
      table.columns.push_back({f.name, f.unit, Best::None, f.digits});
      table.columns.push_back({"ours is"});
    }
    for (const Job& job : jobs())
      for (const std::string& maps : {kPredictedMaps, kTrueMaps})
        for (const std::string& light : rows()) {
          if (light == ours || values(maps, light, job.key, kShownPsnr).empty()) continue;
          std::vector<Cell> row{job.name, maps, label(light)};
          for (const RadianceFigure& f : {kShownPsnr, kSmape}) {
            const PairedDifference d = difference(maps, ours, light, job.key, f);
            row.insert(row.end(), {Measure{d.mean, d.spread, 2}, std::string(d.verdict())});
          }
          table.add(std::move(row));
        }
    return table;
  }

  /// Of rooms' means over seeds where one side has no seeds of its own.
  PairedDifference difference(const std::string& maps, const std::string& ours, const std::string& theirs,
                              const std::string& job, const RadianceFigure& figure) const {
    auto a = values(maps, ours, job, figure), b = values(maps, theirs, job, figure);
    if (a.at(0).size() != b.at(0).size())
      for (auto* rooms : {&a, &b})
        for (std::vector<double>& seeds : *rooms) seeds = {mean(seeds)};
    return paired_difference(a, b);
  }

  Table maps_table() const {
    Table table;
    table.title = "Maps predicted from these photographs";
    table.note = "Mean over rooms ± its standard error. " + conditions() + ".";
    table.columns = {{"map"},
                     {"error"},
                     {"predicted"},
                     {"mean map of the training"},
                     {"the picture as albedo"},
                     {"oracle: the view's best constant"}};
    for (int m = 0; m < map_error_count; ++m) {
      const MapErrorInfo& error = info(static_cast<MapError>(m));
      std::vector<Cell> row{std::string(error.name), std::string(error.unit)};
      for (const char* who : {"ours", "mean map", "picture", "constant"})
        row.push_back(of_rooms(map_finding(error, who)));
      table.add(std::move(row));
    }
    table.add({"scale of depth", "|ln predicted / true|", of_rooms(kScale), Cell{}, Cell{}, Cell{}});
    return table;
  }
  Cell of_rooms(const Finding& finding) const {
    std::vector<std::vector<double>> rooms;
    for (const double v : found().values(finding)) rooms.push_back({v});
    return rooms.empty() ? Cell() : Cell(over_rooms(rooms));
  }

  void conclude() override {
    for (const auto& [name, table] : {std::pair{"1_user", user_table()},
                                      {"2_maps", maps_table()},
                                      {"3_differences", differences_table()},
                                      {"4_all_figures", all_figures_table()}}) {
      write_table(name, table);
      std::fputs("\n", stdout);
    }
    provenance_.figures["rooms with a ball"] = sum(found().values(kBall));
    provenance_.figures["seconds: a re-render, median"] = median(found().values(kSeconds));
  }

  UserOptions options_;
  std::optional<MapSet> means_;
};

}  // namespace

void add_user_keys(Schema& schema) {
  schema.section("user", "What a user gets.")
      .integer("user.spp", 64, "Samples a pixel of the layer", {2, 65536})
      .integer("user.truth_spp", 1024, "Samples a pixel of the tracer's pictures that judge", {2, 65536})
      .integer("user.probes", 4, "Points in free air; fewer where there is no place for them", {0, 100})
      .integer("user.probe_spp", 64, "Paths of a texel in each of two estimates of their light", {1, 65536})
      .texts("user.lights", {"net+lamps", "net", "constant+fit", "constant+lamps", "constant", "image"},
             "Who answers, the first against the others; +lamps: lamps fitted, constant+fit, mirrored+fit: as bright "
             "as shading says");
}

std::string run_user_study(const Config& config, const std::vector<std::string>& command) {
  return UserStudy(config, command).run();
}

}  // namespace clerestory
