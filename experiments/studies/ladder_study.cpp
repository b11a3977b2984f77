#include "experiments/studies/ladder_study.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "experiments/applications/light_weights.hpp"
#include "experiments/applications/predict.hpp"
#include "experiments/studies/compare.hpp"
#include "experiments/studies/predicted_scene.hpp"
#include "experiments/studies/strip.hpp"
#include "experiments/studies/study_run.hpp"
#include "experiments/studies/traced_room.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"
#include "tracer/balls.hpp"

namespace clerestory {
namespace {

constexpr int kMostStrips = 4;                            // rooms shown
constexpr double kFoot = 1.002;                           // radii below its centre that a ball stands (place_ball)
constexpr double kLeastPsnr = 20, kMostOfConstant = 0.5;  // the bar for the re-render with true maps

const std::vector<std::string>& plain_lights() {
  static const std::vector<std::string> names{"image", "constant"};
  return names;
}
std::string plain_key(const std::string& light, bool true_maps) {
  return light + (true_maps ? ", true maps" : ", predicted maps");
}
const std::string kBest = "best constant, true maps", kWithBall = "all true, the ball in the room";

std::uint32_t seed_of(std::uint64_t seed, std::uint64_t stream) {
  return static_cast<std::uint32_t>(Random(seed).fork(stream).bits());
}

Image exposed(Image image, double exposure) {
  for (float& v : image.data) v = static_cast<float>(v * exposure);
  return image;
}

/// The scene that lights, with predicted or true maps, and its lights.
struct Lit {
  Lit(const Device& device, Scene s, const RenderSettings& settings)
      : scene(std::move(s)), light(device, scene, settings) {}
  Scene scene;
  LinkedLight light;
};

/// One picture that is rendered at every rung.
struct Job {
  std::string key;
  ShadedSurface surface[2];  // under predicted and under true maps
  std::vector<bool> used;    // pixels compared; empty: all that true maps shade
  Image truth;
  Image before[2];             // what a pixel shows that is not shaded; empty: nothing
  TraceScene* with = nullptr;  // the room with the ball
};

/// The part of a camera's picture that holds all of some pixels.
struct Crop {
  Camera camera;
  int x = 0, y = 0;
};
Crop crop_to(const Camera& camera, const std::vector<bool>& pixels) {
  int low_x = camera.width, low_y = camera.height, high_x = -1, high_y = -1;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      if (!pixels[static_cast<std::size_t>(y) * camera.width + x]) continue;
      low_x = std::min(low_x, x), high_x = std::max(high_x, x), low_y = std::min(low_y, y),
      high_y = std::max(high_y, y);
    }
  Crop crop{camera, low_x, low_y};
  crop.camera.width = high_x - low_x + 1, crop.camera.height = high_y - low_y + 1;
  crop.camera.cx -= low_x, crop.camera.cy -= low_y;
  return crop;
}

void paste(const Image& part, const Crop& crop, const std::vector<bool>& pixels, Image& to) {
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < part.height; ++y)
      for (int x = 0; x < part.width; ++x)
        if (pixels[static_cast<std::size_t>(crop.y + y) * to.width + crop.x + x])
          to.at(c, crop.y + y, crop.x + x) = part.at(c, y, x);
}

/// Only the pixels where `keep` is set are left to be shaded.
Scene only(Scene maps, const std::vector<bool>& keep) {
  for (std::size_t i = 0; i < keep.size(); ++i)
    if (!keep[i]) maps.depth.data[i] = 0;
  return maps;
}

/// Pixels at which `from` is shaded.
Image with_pixels(const Image& under, const Image& from, const std::vector<bool>& shaded) {
  if (under.data.empty()) return from;
  Image picture = under;
  for (std::size_t i = 0; i < picture.data.size(); ++i)
    if (shaded[i % shaded.size()]) picture.data[i] = from.data[i];
  return picture;
}

class LadderStudy : public StudyRun {
 public:
  using StudyRun::StudyRun;

 private:
  /// One record a room.
  void measure() override {
    settings_.light = "net", settings_.spp = static_cast<int>(config_.integer("ladder.spp"));
    load_light_nets(settings_, config_.text("light.weights"), device_);
    provenance_.facts["light"] = answerer_text(settings_);
    weights_ =
        config_.text("maps.weights").empty() ? shipped_weights() : std::filesystem::path(config_.text("maps.weights"));
    provenance_.inputs.push_back(record_file(weights_));
    measure_rooms([this](std::int64_t r, std::uint64_t seed, const RoomAssets& assets) { run_room(r, seed, assets); });
  }

  void run_room(std::int64_t r, std::uint64_t seed, const RoomAssets& assets) {
    TracedRoom view(device_, assets, seed, static_cast<int>(config_.integer("data.width")),
                    static_cast<int>(config_.integer("data.height")));
    const auto spp = static_cast<int>(config_.integer("data.spp"));
    view.scene.photo = view.traced.picture(view.camera, spp, seed_of(seed, 1)).mean;
    const double exposure = exposure_of(view.scene.photo.data);
    view.scene.photo = exposed(view.scene.photo, exposure);

    const auto start = std::chrono::steady_clock::now();
    Scene predicted = predicted_scene(device_, weights_, view.scene);
    const double maps_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const std::optional<BallPlace> place = place_ball(view.traced, view.camera, Random(seed).fork(200));
    if (place) {
      const Vec3 foot = place->center - kFoot * place->radius * view.camera.direction_to_camera({0, 1, 0});
      if (const auto at = view.camera.project(foot)) scale_depth(predicted, *at, -foot.z);
    }
    Lit predicted_light(device_, predicted, settings_), true_light(device_, view.scene, settings_);
    Lit* lit[2] = {&predicted_light, &true_light};

    MetricRecord record{r + 1, 0, {{"maps seconds", maps_seconds}, {"ball", place ? 1.0 : 0.0}}};
    Job render = render_job(predicted, view.scene);
    run_job(r, render, lit, view.traced, exposure, seed, record);
    for (const BallKind& kind : ball_kinds()) {
      if (!place) break;
      TraceScene with(device_, with_ball(view.room.scene, view.camera, *place, kind));
      std::optional<Job> ball = ball_job(view, with, kind.name, predicted, spp, exposure, seed);
      if (ball) run_job(r, *ball, lit, view.traced, exposure, seed, record);
    }
    MetricsWriter(run_.metrics_path()).write(record.step, record.values);
    records_.push_back(record);
  }

  static Job render_job(const Scene& predicted, const Scene& truth) {
    Job job{"render", {}, {}, truth.photo, {}, nullptr};
    job.surface[0] = {predicted, truth.depth, truth.normal, true};
    job.surface[1] = {truth, truth.depth, truth.normal, true};
    return job;
  }

  /// Nothing where no pixel shows the ball.
  static std::optional<Job> ball_job(TracedRoom& view, TraceScene& with, const std::string& name,
                                     const Scene& predicted, int spp, double exposure, std::uint64_t seed) {
    const TraceMaps maps = with.maps(view.camera);
    const auto first = static_cast<int>(view.room.scene.triangles.size());  // the ball's are the last
    std::vector<bool> shows, before_predicted;
    for (std::size_t i = 0; i < maps.triangle.size(); ++i) {
      const float d = predicted.depth.data[i];
      shows.push_back(maps.triangle[i] >= first);
      before_predicted.push_back(shows.back() && !(d > 0 && d <= maps.depth.data[i]));
    }
    if (std::none_of(shows.begin(), shows.end(), [](bool s) { return s; })) return std::nullopt;
    const Scene ball = scene_of(maps, view.camera);
    Job job{name, {}, shows, view.scene.photo, {view.scene.photo, view.scene.photo}, &with};
    job.surface[0] = {only(ball, before_predicted), ball.depth, ball.normal, false};
    job.surface[1] = {only(ball, shows), ball.depth, ball.normal, false};
    const Crop crop = crop_to(view.camera, shows);
    paste(exposed(with.picture(crop.camera, spp, seed_of(seed, 2)).mean, exposure), crop, shows, job.truth);
    return job;
  }

  void note(MetricRecord& record, const Job& job, const std::string& rung, std::int64_t s, const PictureError& e,
            double seconds) const {
    const std::string end = fmt::format("/{}.s{}", rung, s);
    record.values.insert(record.values.end(), {{job.key + "/relmse" + end, e.relmse},
                                               {job.key + "/psnr" + end, e.psnr},
                                               {job.key + "/seconds" + end, seconds}});
  }

  void run_job(std::int64_t r, Job& job, Lit* lit[2], TraceScene& traced, double exposure, std::uint64_t seed,
               MetricRecord& record) {
    std::vector<Image> strip{job.truth};
    for (std::int64_t s = 0; s < config_.integer("ladder.seeds"); ++s) {
      stop_if_interrupted("study");
      RenderSettings settings = settings_;
      settings.seed = seed_of(seed, 20 + static_cast<std::uint64_t>(s));
      std::vector<Image> pictures(rungs().size());
      for (const int truth : {1, 0})
        run_rungs(job, truth, *lit[truth], traced, exposure, settings, s, record, pictures);
      for (const int truth : {0, 1}) run_plain(job, truth, *lit[truth], settings, s, record);
      if (job.with) {
        const LinkedPictures p =
            lit[1]->light.render(*job.with, exposure, job.surface[1], settings, {{true, true, true}});
        note(record, job, kWithBall, s,
             picture_error(with_pixels(job.before[1], p.radiance[0], p.shaded), job.truth, job.used),
             p.seconds.of({true, true, true}));
      }
      if (s == 0) strip.insert(strip.end(), pictures.begin(), pictures.end());
    }
    if (r >= kMostStrips) return;
    for (Image& picture : strip) picture = with_pixels(job.truth, picture, job.used);
    write_strip(run_.artifact(fmt::format("room{}_{}_tracer_then_rungs.png", r, job.key)), strip);
  }

  void run_rungs(Job& job, int truth, Lit& lit, TraceScene& traced, double exposure, const RenderSettings& settings,
                 std::int64_t s, MetricRecord& record, std::vector<Image>& pictures) const {
    std::vector<Links> choices;
    for (const Rung& rung : rungs())
      if (rung.true_maps == (truth == 1)) choices.push_back(rung.links);
    const LinkedPictures made = lit.light.render(traced, exposure, job.surface[truth], settings, choices);
    if (job.used.empty()) {  // true maps come first
      const float* emits = lit.scene.material.plane(2);
      for (std::size_t i = 0; i < made.shaded.size(); ++i) job.used.push_back(made.shaded[i] && emits[i] == 0);
    }
    std::size_t next = 0;
    for (std::size_t k = 0; k < rungs().size(); ++k) {
      const Rung& rung = rungs()[k];
      if (rung.true_maps != (truth == 1)) continue;
      pictures[k] = with_pixels(job.before[truth], made.radiance[next++], made.shaded);
      const double maps_seconds = truth ? 0 : record.values.at(0).second;
      note(record, job, rung.key, s, picture_error(pictures[k], job.truth, job.used),
           maps_seconds + made.seconds.of(rung.links));
    }
    record.values.emplace_back("dropped/" + job.key + (truth ? "/true" : "/predicted") + fmt::format(".s{}", s),
                               made.dropped);
  }

  void run_plain(const Job& job, int truth, Lit& lit, RenderSettings settings, std::int64_t s,
                 MetricRecord& record) const {
    for (const std::string& light : plain_lights()) {
      settings.light = light;
      double seconds = 0;
      const LinkedPictures made = lit.light.render_plain(job.surface[truth], settings);
      const Image picture = with_pixels(job.before[truth], made.radiance[0], made.shaded);
      seconds = made.seconds.layer + made.seconds.nets + (truth ? 0 : record.values.at(0).second);
      note(record, job, plain_key(light, truth), s, picture_error(picture, job.truth, job.used), seconds);
      if (light == "constant" && truth)
        note(record, job, kBest, s, best_scaled_error(picture, job.truth, job.used), seconds);
    }
  }

  /// A value of every room that has it.
  std::vector<double> of_rooms(const std::string& key) const {
    std::vector<double> values;
    for (const MetricRecord& record : records_)
      for (const auto& [name, value] : record.values)
        if (name == key) values.push_back(value);
    return values;
  }

  /// Over seeds: means over rooms and jobs; nothing where no room has such a job.
  std::optional<Measure> over_seeds(const std::vector<std::string>& jobs, const std::string& what,
                                    const std::string& rung) const {
    std::vector<double> seeds;
    for (std::int64_t s = 0; s < config_.integer("ladder.seeds"); ++s) {
      std::vector<double> all;
      for (const std::string& job : jobs)
        for (const double v : of_rooms(fmt::format("{}/{}/{}.s{}", job, what, rung, s))) all.push_back(v);
      if (all.empty()) return std::nullopt;
      seeds.push_back(mean(all));
    }
    return measure_of(seeds);
  }
  /// Over rooms, each by its mean over seeds.
  double median_of_rooms(const std::string& job, const std::string& what, const std::string& rung) const {
    std::vector<double> sums;
    const auto seeds = config_.integer("ladder.seeds");
    for (std::int64_t s = 0; s < seeds; ++s) {
      const std::vector<double> of = of_rooms(fmt::format("{}/{}/{}.s{}", job, what, rung, s));
      sums.resize(of.size());
      for (std::size_t i = 0; i < of.size(); ++i) sums[i] += of[i] / static_cast<double>(seeds);
    }
    return median(sums);
  }

  static const std::vector<std::string>& render_only() {
    static const std::vector<std::string> jobs{"render"};
    return jobs;
  }
  static std::vector<std::string> balls() {
    std::vector<std::string> names;
    for (const BallKind& kind : ball_kinds()) names.push_back(kind.name);
    return names;
  }

  /// relMSE, change against `before`, PSNR of some jobs at a rung.
  void add_errors(std::vector<Cell>& row, const std::vector<std::string>& jobs, const std::string& rung,
                  const std::string& before) const {
    const auto relmse = over_seeds(jobs, "relmse", rung), psnr = over_seeds(jobs, "psnr", rung);
    Cell change;
    if (relmse && !before.empty()) {
      const auto changed = change_beyond_spread(*over_seeds(jobs, "relmse", before), *relmse);
      change = changed ? fmt::format("{:+.0f} %", 100 * *changed) : std::string("none");
    }
    row.push_back(relmse ? Cell(*relmse) : Cell()), row.push_back(change), row.push_back(psnr ? Cell(*psnr) : Cell());
  }

  void add_row(Table& table, const std::string& label, const std::string& rung, const std::string& before) const {
    std::vector<Cell> row{label};
    add_errors(row, render_only(), rung, before);
    add_errors(row, balls(), rung, before);
    const auto seconds = over_seeds(render_only(), "seconds", rung);
    row.push_back(seconds ? Cell(*seconds) : Cell());
    table.add(std::move(row));
  }

  Table ladder_table() const {
    Table table;
    table.title = fmt::format(
        "The oracle ladder: means over {} rooms, {} samples a pixel; spread over {} seeds of the layer, a change "
        "inside it "
        "is none",
        records_.size(), config_.integer("ladder.spp"), config_.integer("ladder.seeds"));
    table.columns = {{"links", "", Best::None, 3},
                     {"re-render relMSE", "eps 0.01", Best::None, 3},
                     {"change", "relMSE", Best::None, 3},
                     {"PSNR", "dB", Best::None, 4},
                     {"balls relMSE", "eps 0.01", Best::None, 3},
                     {"change", "relMSE", Best::None, 3},
                     {"PSNR", "dB", Best::None, 4},
                     {"time", "s a re-render", Best::None, 3}};
    const std::string first = rungs().front().key;
    add_row(table, "all predicted", first, "");
    for (const char* alone : {"hits", "in view", "out of view", "maps"})
      add_row(table, std::string(alone) + " true alone", alone, first);
    std::string before = first, label;
    for (const auto& [key, more] : {std::pair{"hits", "hits"},
                                    {"hits, in view", "+ in view"},
                                    {"all light", "+ out of view"},
                                    {"all", "+ maps: all true"}}) {
      add_row(table, std::string("true in turn: ") + more, key, before);
      before = key;
    }
    add_row(table, kWithBall, kWithBall, before);
    for (const bool truth : {true, false})
      for (const std::string& light : plain_lights())
        add_row(table, "light = " + plain_key(light, truth), plain_key(light, truth), "");
    add_row(table, kBest, kBest, "");
    return table;
  }

  Table balls_table() const {
    Table table;
    table.title = "The same by ball";
    table.columns = {{"links", "", Best::None, 3}};
    std::vector<std::string> keys;
    for (const Rung& rung : rungs()) keys.push_back(rung.key);
    keys.push_back(kWithBall);
    for (const bool truth : {true, false})
      for (const std::string& light : plain_lights()) keys.push_back(plain_key(light, truth));
    for (const std::string& ball : balls())
      for (const char* what : {"relMSE", "change", "PSNR"})
        table.columns.push_back({ball + " " + what, "", Best::None, 3});
    for (const std::string& key : keys) {
      std::vector<Cell> row{key};
      const bool changes = key != rungs().front().key && key.find("maps") == std::string::npos;
      for (const std::string& ball : balls()) add_errors(row, {ball}, key, changes ? rungs().front().key : "");
      table.add(std::move(row));
    }
    return table;
  }

  /// "Re-render with true maps": what it must reach, and what it does.
  Table bar_table() const {
    Table table;
    table.title = "Re-render with true maps and predicted light: what it must reach";
    table.columns = {{"figure", "", Best::None, 3},
                     {"mean over rooms", "", Best::None, 4},
                     {"median over rooms", "", Best::None, 4},
                     {"bar", "", Best::None, 3},
                     {"mean reaches it", "", Best::None, 3}};
    const std::string constant = plain_key("constant", true);
    const Measure psnr = *over_seeds(render_only(), "psnr", "maps"),
                  ours = *over_seeds(render_only(), "relmse", "maps");
    const double share = ours.mean / over_seeds(render_only(), "relmse", constant)->mean;
    table.add({"PSNR, dB", psnr, Measure{median_of_rooms("render", "psnr", "maps")},
               fmt::format("at least {}", kLeastPsnr), psnr.mean >= kLeastPsnr ? "yes" : "no"});
    table.add({"relMSE over a constant ambient's", Measure{share},
               Measure{median_of_rooms("render", "relmse", "maps") / median_of_rooms("render", "relmse", constant)},
               fmt::format("at most {}", kMostOfConstant), share <= kMostOfConstant ? "yes" : "no"});
    return table;
  }

  /// The link whose truth alone lowers the error most, beyond the spread.
  std::string limit_of(const std::vector<std::string>& jobs) const {
    const auto start = over_seeds(jobs, "relmse", rungs().front().key);
    if (!start) return "no room has it";
    std::string link = "none of them alone";
    double least = 0;
    for (const char* alone : {"hits", "in view", "out of view", "maps"}) {
      const auto change = change_beyond_spread(*start, *over_seeds(jobs, "relmse", alone));
      if (change && *change < least)
        least = *change, link = fmt::format("{} (alone true: {:+.0f} % relMSE)", alone, 100 * least);
    }
    return link;
  }

  void conclude() override {
    write_table("ladder", ladder_table());
    std::fputs("\n", stdout);
    write_table("ladder_balls", balls_table());
    std::fputs("\n", stdout);
    write_table("ladder_bar", bar_table());
    provenance_.facts["what limits the re-render"] = limit_of(render_only());
    provenance_.facts["what limits balls"] = limit_of(balls());
    double dropped = 0;
    for (const MetricRecord& record : records_)
      for (const auto& [name, value] : record.values)
        if (name.starts_with("dropped/")) dropped += value;
    provenance_.figures["paths dropped as not finite"] = dropped;
    provenance_.figures["rooms with a ball"] = sum(of_rooms("ball"));
  }

  RenderSettings settings_;
  std::filesystem::path weights_;
};

}  // namespace

const std::vector<Rung>& rungs() {
  static const std::vector<Rung> all{{"predicted", {}, false},
                                     {"hits", {.hits = true}, false},
                                     {"in view", {.in_view = true}, false},
                                     {"out of view", {.out_of_view = true}, false},
                                     {"maps", {}, true},
                                     {"hits, in view", {.hits = true, .in_view = true}, false},
                                     {"all light", {true, true, true}, false},
                                     {"all", {true, true, true}, true}};
  return all;
}

std::optional<double> change_beyond_spread(const Measure& before, const Measure& after) {
  if (std::abs(after.mean - before.mean) <= std::max(before.deviation, after.deviation)) return std::nullopt;
  return after.mean / before.mean - 1;
}

std::string run_ladder_study(const Config& config, const std::vector<std::string>& command) {
  return LadderStudy(config, command).run();
}

}  // namespace clerestory
