#include "experiments/studies/light_study.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numeric>

#include "experiments/evaluation/detection.hpp"
#include "experiments/studies/room_study.hpp"
#include "experiments/studies/study_keys.hpp"
#include "experiments/truth/lit_room.hpp"
#include "experiments/truth/study_light.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/math/panorama.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"
#include "host/stopwatch.hpp"
#include "nets/scene_radiance.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Used = KnownRays::Used;

struct Named {
  std::string key, label;
};
/// Who answers; `asked`: by that light of studies (under_light). The oracle reads the truth.
struct Answerer {
  std::string key, asked, label;
};
const std::vector<Answerer>& answerers() {
  static const std::vector<Answerer> rows{
      {"net", "net", "full (light = net)"},
      {"net+lamps", "net+lamps", "full with lamps fitted"},
      {"out_of_view", "out_of_view", "out of view only"},
      {"photo", "image", "the photograph as light"},
      {"clipped", "image", "the photograph clipped at white as light"},
      {"ssrt", "", "SSRT only: the photograph at hits, 0 elsewhere"},
      {"mean", "constant", "mean colour of the photograph"},
      {"fitted", "constant+fit", "one constant, fitted to the photograph as lamps are"},
      {"oracle", "", "oracle: the view's best constant, which reads the truth"}};
  return rows;
}
const std::vector<Named>& ray_kinds() {
  static const std::vector<Named> kinds{{"hits", "SSRT hits"}, {"misses", "SSRT misses"}, {"all", "all rays"}};
  return kinds;
}

/// Free probes by how far the nearest surface is, metres; each up to the next.
const std::vector<double>& distance_bins() {
  static const std::vector<double> from{0.15, 0.3, 0.5, 0.8, std::numeric_limits<double>::infinity()};
  return from;
}

/// Rays of one view: those of each draw one after the other, then every texel of each probe.
struct ViewRays {
  Rays asked;
  std::vector<std::array<float, 3>> truth;
  std::vector<double> weights;
  std::vector<Used> draws, probes;
  std::vector<float> noise;  // planar: variance of the truth; 0 where it is not known

  void add(const Vec3& point, const Vec3& direction, int skip, const std::array<float, 3>& light, double weight) {
    asked.points.push_back(point), asked.directions.push_back(direction), asked.skip.push_back(skip);
    truth.push_back(light), weights.push_back(weight);
  }
};

ViewRays rays_of(const KnownView& known) {
  ViewRays rays;
  for (const LightRays& draw : known.draws) {
    Used& used = rays.draws.emplace_back();
    for (std::size_t i = 0; i < draw.skip.size(); ++i) {
      used.push_back(rays.truth.size());
      rays.add(draw.points[i], draw.directions[i], draw.skip[i], draw.light[i], 1);
    }
  }
  for (const Probe& probe : known.view.probes) {
    Used& used = rays.probes.emplace_back();
    for (int y = 0; y < probe_height; ++y)
      for (int x = 0; x < probe_width; ++x) {
        used.push_back(rays.truth.size());
        rays.add(probe.center, panorama_direction(x, y, probe_width, probe_height), -1,
                 {probe.radiance.at(0, y, x), probe.radiance.at(1, y, x), probe.radiance.at(2, y, x)},
                 panorama_solid_angle(y, probe_width, probe_height));
      }
  }
  const std::size_t count = rays.truth.size();
  rays.noise.resize(3 * count);
  for (std::size_t k = 0; k < rays.probes.size(); ++k)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t t = 0; t < rays.probes[k].size(); ++t)
        rays.noise[c * count + rays.probes[k][t]] = known.noise[k].plane(static_cast<int>(c))[t];
  return rays;
}

struct ViewAnswers {
  std::map<std::string, std::vector<float>> radiance;  // planar, by key; without the constant
  std::map<std::string, double> seconds;               // of asking alone
  std::vector<int> pixel;                              // that SSRT hits, or -1
};

/// The photograph at the hit pixel, sure or not, and nothing elsewhere.
std::vector<float> photograph_at(const std::vector<int>& pixel, const Image& photo) {
  std::vector<float> planar(3 * pixel.size(), 0);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < pixel.size(); ++i)
      if (pixel[i] >= 0) planar[c * pixel.size() + i] = photo.plane(static_cast<int>(c))[pixel[i]];
  return planar;
}

const Finding kHitShare{"share", "hits"};
Finding seconds_of(const std::string& who) { return {"seconds for a million rays", "all", who}; }
Finding way_of(const std::string& rays) { return {"way gone", rays}; }
const Finding kDistance{"distance", "probes"};
const std::string kAngle = "angle", kRange = "range", kTruth = "truth";

class LightStudy : public RoomStudy {
 public:
  using RoomStudy::RoomStudy;

 private:
  void measure() override {
    options_ = lit_room_options(config_);
    settings_.light = "net";
    use_light(settings_);
    std::ranges::copy_if(answerers(), std::back_inserter(answerers_),
                         [&](const Answerer& who) { return who.asked.empty() || nets_answer(settings_, who.asked); });
    if (options_.predicted) options_.maps_weights = use_maps();
    measure_rooms([this](const ListedRoom& listed) {
      LitRoom room(device_, listed, options_);
      room_ = {};
      for (int v = 0; v < options_.views; ++v) {
        stop_if_interrupted("study");
        measure_view(listed.index, v, room.view(v));
      }
      return room_;
    });
  }

  fs::path probe_folder(std::int64_t room) const { return run_ / "data" / fmt::format("room-{:04}", room); }

  void measure_view(std::int64_t room, int v, const KnownView& known) {
    make_directories(probe_folder(room));
    write_probes(probe_folder(room), view_id(v), known.view.probes);  // the other rooms' mean panorama needs them
    const ViewRays rays = rays_of(known);
    const ViewAnswers answers = ask(scene_of(known.view), rays);
    const KnownRays truth(rays.truth, rays.weights);
    for (std::size_t s = 0; s < rays.draws.size(); ++s) measure_draw(s, rays, truth, answers);
    for (std::size_t p = 0; p < rays.probes.size(); ++p)
      measure_probe(fmt::format("v{}p{}", v, p), rays.probes[p], truth, rays, answers, known.view.probes[p].distance);
    measure_way(v, truth, rays, answers);
    for (const auto& [key, seconds] : answers.seconds)
      room_.add(seconds_of(key), seconds / static_cast<double>(truth.count()) * 1e6);
  }

  ViewAnswers ask(const Scene& scene, const ViewRays& rays) {
    ViewAnswers answers;
    for (const Answerer& who : answerers_) {
      if (who.asked.empty()) continue;
      Scene lit = scene;
      if (who.key == "clipped")
        for (float& v : lit.photo.data) v = std::min(v, 1.f);
      const RenderSettings settings = under_light(settings_, who.asked, device_, lit);
      SceneRadiance radiance(device_, lit, settings, rays.truth.size());
      const Stopwatch watch;
      const RadianceAnswers given = radiance.radiance(rays.asked);
      answers.seconds[who.key] = watch.seconds();
      answers.radiance[who.key] = given.radiance;
      if (who.key == "photo") answers.pixel = given.pixel;
    }
    answers.radiance["ssrt"] = photograph_at(answers.pixel, scene.photo);
    answers.seconds["ssrt"] = answers.seconds["photo"];  // the same trace and the same look-up
    return answers;
  }

  /// Those of `used` that are of a kind.
  static Used of_kind(const std::string& kind, const Used& used, const std::vector<int>& pixel) {
    if (kind == "all") return used;
    Used some;
    std::ranges::copy_if(used, std::back_inserter(some),
                         [&](std::size_t i) { return (pixel[i] >= 0) == (kind == "hits"); });
    return some;
  }

  static RadianceError error_of(const std::string& who, const KnownRays& truth, const Used& used,
                                const ViewAnswers& answers) {
    return who == "oracle" ? truth.best_constant(used) : truth.error(answers.radiance.at(who), used);
  }

  void measure_draw(std::size_t seed, const ViewRays& rays, const KnownRays& truth, const ViewAnswers& answers) {
    const Used& draw = rays.draws[seed];
    const auto item = static_cast<std::int64_t>(seed);
    std::vector<std::pair<std::string, Used>> kinds;
    for (const Named& kind : ray_kinds()) kinds.emplace_back(kind.key, of_kind(kind.key, draw, answers.pixel));
    Used& surface = kinds.emplace_back("surface", Used{}).second;
    std::ranges::copy_if(draw, std::back_inserter(surface), [&](std::size_t i) { return rays.asked.skip[i] >= 0; });
    for (const auto& [kind, used] : kinds) {
      if (used.empty()) continue;
      for (const Answerer& who : answerers_)
        note(Finding{"", kind, who.key}.of(item), error_of(who.key, truth, used, answers));
    }
    room_.add(kHitShare.of(item), static_cast<double>(kinds[0].second.size()) / static_cast<double>(draw.size()));
  }

  /// Every figure of it, under the name but for its metric.
  void note(Finding finding, const RadianceError& e) {
    for (const RadianceFigure& f : kRadianceFigures) finding.metric = f.key, room_.add(finding, e.*f.value);
  }

  static std::vector<float> planar(const std::vector<float>& whole, const Used& used) {
    const std::size_t count = whole.size() / 3;
    std::vector<float> part;
    for (std::size_t c = 0; c < 3; ++c)
      for (const std::size_t i : used) part.push_back(whole[c * count + i]);
    return part;
  }

  void measure_probe(const std::string& name, const Used& used, const KnownRays& truth, const ViewRays& rays,
                     const ViewAnswers& answers, double distance) {
    const auto finding = [&](const std::string& metric, const std::string& who) {
      return Finding{metric, "probes", who, "", name};
    };
    room_.add({kDistance.metric, kDistance.region, "", "", name}, distance);
    const std::vector<double> weights = probe_weights();
    for (const Answerer& who : answerers_) {
      note(finding("", who.key), error_of(who.key, truth, used, answers));
      if (who.key == "oracle") continue;
      const std::vector<float>& answer = answers.radiance.at(who.key);
      room_.add(finding(kAngle, who.key), truth.angle(answer, used));
      room_.add(finding(kRange, who.key), log_intensity_range(planar(answer, used), weights));
    }
    std::vector<float> light;
    for (std::size_t c = 0; c < 3; ++c)
      for (const std::size_t i : used) light.push_back(rays.truth[i][c]);
    room_.add(finding(kRange, kTruth), log_intensity_range(light, weights));
  }

  /// Of all probes of the view together: from the better of the clipped photograph and its mean colour to the truth.
  void measure_way(int v, const KnownRays& truth, const ViewRays& rays, const ViewAnswers& answers) {
    Used all;
    for (const Used& probe : rays.probes) all.insert(all.end(), probe.begin(), probe.end());
    for (const Named& kind : ray_kinds()) {
      const Used used = of_kind(kind.key, all, answers.pixel);
      if (used.empty()) continue;
      const auto relmse = [&](const char* who) { return error_of(who, truth, used, answers).relmse; };
      const double share =
          way_gone(std::min(relmse("clipped"), relmse("mean")), relmse("net"), truth.noise(rays.noise, used));
      room_.add(way_of(kind.key).of(v), share);
    }
  }

  // --- What the records say ---------------------------------------------------------------------------------------

  Findings::BySeed by_seed(const RadianceFigure& figure, const std::string& rays, const std::string& who) const {
    return found().by_seed({figure.key, rays, who}, config_.integer("study.seeds"));
  }
  Cell over_rooms_or_nothing(const std::vector<std::vector<double>>& rooms) const {
    const bool any = std::ranges::any_of(
        rooms, [](const auto& room) { return std::ranges::all_of(room, [](double v) { return std::isfinite(v); }); });
    return any ? Cell(over_rooms(rooms)) : Cell();
  }

  std::string setting() const {
    return fmt::format("{} rooms of {} x {} views, {} maps{}, {}", found().rooms(), rooms_.file.filename().string(),
                       config_.integer("incident.views"), config_.text("data.maps"),
                       config_.text("data.maps") == "predicted" ? " (depth by the predicted scale)" : "",
                       incident_text(config_));
  }

  Table ablation_table() const {
    Table table;
    table.title = fmt::format(
        "Incident light, {}: mean over rooms and {} draws of rays ± the larger of the spread over draws and the "
        "standard "
        "error over rooms",
        setting(), config_.integer("study.seeds"));
    table.columns = {{"rays"}, {"who answers"}};
    for (const RadianceFigure& f : kRadianceFigures) table.columns.push_back({f.name, f.unit, Best::None, f.digits});
    table.columns.push_back({"time", "s for a million rays"});
    for (const Named& kind : ray_kinds())
      for (const Answerer& who : answerers_) {
        std::vector<Cell> row{kind.label, who.label};
        for (const RadianceFigure& f : kRadianceFigures)
          row.push_back(over_rooms_or_nothing(by_seed(f, kind.key, who.key)));
        const std::vector<double> seconds = found().values(seconds_of(who.key));
        row.push_back(seconds.empty() ? Cell{} : Cell{Measure{median(seconds)}});
        table.add(std::move(row));
      }
    return table;
  }

  Table difference_table() const {
    constexpr std::array figures{kShownPsnr, kSmape, kRelMse, kLogRmse};
    Table table;
    table.title =
        "Full less the others: a difference of at most two spreads is none; spread is the larger of that over draws "
        "and the standard error over rooms";
    table.columns = {{"rays"}, {"full less"}};
    for (const RadianceFigure& f : figures)
      table.columns.insert(table.columns.end(), {{f.name, "difference"}, {"full is"}});
    for (const Named& kind : ray_kinds())
      for (const Answerer& who : answerers_) {
        if (who.key == "net" || found().room_means({kRelMse.key, kind.key, "net"}).empty()) continue;
        std::vector<Cell> row{kind.label, who.label};
        for (const RadianceFigure& f : figures) {
          const PairedDifference d = paired_difference(by_seed(f, kind.key, "net"), by_seed(f, kind.key, who.key));
          row.insert(row.end(), {Measure{d.mean, d.spread, 2}, std::string(d.verdict())});
        }
        table.add(row);
      }
    return table;
  }

  /// Rays from surfaces, then probes by their distance from the nearest one.
  Table distance_table() const {
    Table table;
    table.title = fmt::format(
        "Incident light by the distance of a ray's origin from the nearest surface, {}: on surfaces mean and deviation "
        "over rooms, at free probes over probes",
        setting());
    table.columns = {{"distance", "m"},      {"probes", "", Best::None, 4}, {"who answers"},
                     {"relMSE", "eps 0.01"}, {"relMSE", "median"},          {"log-RGB RMSE"}};
    for (const Answerer& who : answerers_) {
      const std::vector<double> relmse = found().room_means({kRelMse.key, "surface", who.key});
      if (relmse.empty()) continue;
      table.add({"0, on surfaces", Cell{}, who.label, measure_of(relmse), Measure{median(relmse)},
                 measure_or_nothing(found().room_means({kLogRmse.key, "surface", who.key}))});
    }
    const std::vector<double>& from = distance_bins();
    for (std::size_t b = 0; b + 1 < from.size(); ++b)
      for (const Answerer& who : answerers_) add_distance(table, from[b], from[b + 1], who);
    return table;
  }

  void add_distance(Table& table, double from, double to, const Answerer& who) const {
    std::vector<double> relmse, logs;
    for (std::size_t r = 0; r < found().rooms(); ++r)
      for (const auto& [probe, distance] : found().items(r, kDistance)) {
        if (distance < from || distance >= to) continue;
        relmse.push_back(found().value_or_nan(r, {kRelMse.key, "probes", who.key, "", probe}));
        logs.push_back(found().value_or_nan(r, {kLogRmse.key, "probes", who.key, "", probe}));
      }
    if (relmse.empty()) return;
    const std::string bin = std::isfinite(to) ? fmt::format("{} to {}", from, to) : fmt::format("from {}", from);
    table.add({bin, Measure{static_cast<double>(relmse.size())}, who.label, measure_of(relmse), Measure{median(relmse)},
               measure_of(logs)});
  }

  /// What every room's probes are beside the mean of all other rooms', by metric: means of rooms.
  std::map<std::string, std::vector<double>> mean_panorama_errors() const {
    std::vector<std::vector<Image>> rooms(found().rooms());
    for (std::size_t r = 0; r < found().rooms(); ++r)
      for (int v = 0; v < config_.integer("incident.views"); ++v)
        for (Probe& probe : read_probes(probe_folder(static_cast<std::int64_t>(r)), view_id(v)))
          rooms[r].push_back(std::move(probe.radiance));
    const std::vector<double> weights = probe_weights();
    Used texels(weights.size());
    std::iota(texels.begin(), texels.end(), std::size_t{0});
    std::map<std::string, std::vector<double>> errors;
    for (std::size_t r = 0; r < rooms.size(); ++r) {
      const std::vector<float> others = mean_of_others(rooms, r);
      if (others.empty()) continue;
      std::map<std::string, std::vector<double>> of_room;
      for (const Image& probe : rooms[r]) {
        std::vector<std::array<float, 3>> truth(texels.size());
        for (std::size_t i = 0; i < truth.size(); ++i)
          truth[i] = {probe.plane(0)[i], probe.plane(1)[i], probe.plane(2)[i]};
        const KnownRays known(std::move(truth), weights);
        const RadianceError e = known.error(others, texels);
        for (const RadianceFigure& f : kRadianceFigures) of_room[f.key].push_back(e.*f.value);
        of_room[kAngle].push_back(known.angle(others, texels));
        of_room[kRange].push_back(log_intensity_range(others, weights));
      }
      for (const auto& [metric, list] : of_room) errors[metric].push_back(mean(list));
    }
    return errors;
  }

  /// Empty where no other room has a probe.
  static std::vector<float> mean_of_others(const std::vector<std::vector<Image>>& rooms, std::size_t room) {
    std::vector<double> sums;
    double count = 0;
    for (std::size_t r = 0; r < rooms.size(); ++r)
      for (const Image& probe : rooms[r]) {
        if (r == room) continue;
        sums.resize(probe.data.size(), 0), ++count;
        for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += static_cast<double>(probe.data[i]);
      }
    std::vector<float> means;
    for (const double s : sums) means.push_back(static_cast<float>(s / count));
    return means;
  }

  Table probe_table() const {
    Table table;
    table.title = fmt::format("Panoramas at free probes, {}: mean over rooms ± its standard error", setting());
    table.columns = {{"who answers"}};
    for (const RadianceFigure& f : kRadianceFigures) table.columns.push_back({f.name, f.unit, Best::None, f.digits});
    table.columns.insert(table.columns.end(),
                         {{"angle of RGB", "degrees"}, {"log-intensity range", "ln of 99th over 1st percentile"}});
    const auto rooms = [&](const std::string& metric, const std::string& who) {
      std::vector<std::vector<double>> means;
      for (const double m : found().room_means({metric, "probes", who})) means.push_back({m});
      return means.empty() ? Cell() : Cell(over_rooms(means));
    };
    const auto add = [&](const std::string& label, const auto& of) {
      std::vector<Cell> row{label};
      for (const RadianceFigure& f : kRadianceFigures) row.push_back(of(f.key));
      row.push_back(of(kAngle)), row.push_back(of(kRange));
      table.add(std::move(row));
    };
    for (const Answerer& who : answerers_) add(who.label, [&](const std::string& m) { return rooms(m, who.key); });
    const auto others = mean_panorama_errors();
    add("mean panorama of the other rooms", [&](const std::string& metric) {
      std::vector<std::vector<double>> means;
      if (others.contains(metric))
        for (const double m : others.at(metric)) means.push_back({m});
      return means.empty() ? Cell() : Cell(over_rooms(means));
    });
    add("truth", [&](const std::string& metric) { return metric == kRange ? rooms(kRange, kTruth) : Cell(); });
    return table;
  }

  Table way_table() const {
    Table table;
    table.title = fmt::format(
        "Share of the way in relMSE that the nets go from the better of two simple answers, the clipped photograph as "
        "light and its mean colour, to the truth's own variance, {}",
        setting());
    table.columns = {{"directions"},
                     {"views", "", Best::None, 4},
                     {"share", "median"},
                     {"share", "25 % of views below"},
                     {"share", "75 % of views below"}};
    for (const Named& kind : ray_kinds()) {
      const std::vector<double> shares = found().finite_items(way_of(kind.key));
      if (shares.empty()) continue;
      table.add({kind.label, Measure{static_cast<double>(shares.size())}, Measure{median(shares)},
                 Measure{quantile(shares, 0.25)}, Measure{quantile(shares, 0.75)}});
    }
    return table;
  }

  void conclude() override {
    for (const auto& [name, table] : {std::pair{"1_ablation", ablation_table()},
                                      {"2_differences", difference_table()},
                                      {"3_probes", probe_table()},
                                      {"4_way", way_table()},
                                      {"5_distance", distance_table()}}) {
      write_table(name, table);
      std::fputs("\n", stdout);
    }
    provenance_.figures["share of rays that hit"] = mean(found().finite_items(kHitShare));
    provenance_.facts["what is in view"] = "a ray that SSRT answers on the maps in use, sure or not";
  }

  LitRoomOptions options_;
  RenderSettings settings_;
  std::vector<Answerer> answerers_;  // but those that the nets are not made of
  RoomFindings room_;                // that is measured
};

}  // namespace

std::string run_light_study(const Config& config, const std::vector<std::string>& command) {
  return LightStudy(config, command).run();
}

}  // namespace clerestory
