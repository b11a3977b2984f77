#include "experiments/studies/ladder_room.hpp"

#include <algorithm>
#include <map>

#include "experiments/evaluation/picture_error.hpp"
#include "experiments/truth/crop.hpp"
#include "experiments/truth/predicted_scene.hpp"
#include "experiments/truth/traced_room.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"
#include "host/stopwatch.hpp"
#include "tracer/balls.hpp"

namespace clerestory {
namespace {

Image mean_of(const Image& a, const Image& b) {
  Image m = a;
  for (std::size_t i = 0; i < m.data.size(); ++i) m.data[i] = 0.5f * (a.data[i] + b.data[i]);
  return m;
}

/// Halves of a reference's samples, in the photograph's unit.
using Halves = std::array<Image, 2>;
Halves traced_halves(TraceScene& traced, const Camera& camera, int spp, double exposure, std::uint64_t seed) {
  Halves halves;
  for (std::size_t k = 0; k < 2; ++k) {
    halves[k] = traced.picture(camera, (spp + 1) / 2, Random(seed).seed(k)).mean;
    scale(halves[k].data, exposure);
  }
  return halves;
}

/// The scene that lights, with predicted or true maps.
struct Lit {
  Lit(const Device& device, Scene s, const RenderSettings& settings)
      : scene(std::move(s)), light(device, scene, settings) {}
  Scene scene;
  LinkedLight light;
  double maps_seconds = 0;
};

/// One picture that is rendered at every rung.
struct Job {
  std::string key;
  ShadedSurface surface[2];  // under predicted and under true maps
  std::vector<bool> used;    // pixels compared; empty: all that true maps shade and that do not emit
  Halves truth;
  Image before;                // what a pixel shows that is not shaded; empty: nothing
  TraceScene* with = nullptr;  // the room with the ball

  struct Row {
    std::vector<Image> pictures;  // of each seed
    std::vector<double> seconds;
  };
  std::map<std::string, Row> rows;

  void add(const std::string& row, const Image& picture, const std::vector<bool>& shaded, double seconds) {
    Image whole = before.data.empty() ? picture : before;
    for (std::size_t i = 0; i < whole.data.size(); ++i)
      if (shaded[i % shaded.size()]) whole.data[i] = picture.data[i];
    rows[row].pictures.push_back(std::move(whole)), rows[row].seconds.push_back(seconds);
  }
};

/// Only the pixels where `keep` is set are left to be shaded.
Scene only(Scene maps, const std::vector<bool>& keep) {
  for (std::size_t i = 0; i < keep.size(); ++i)
    if (!keep[i]) maps.depth.data[i] = 0;
  return maps;
}

class RoomLadder {
 public:
  RoomLadder(Device& device, const ListedRoom& room, const LadderOptions& options)
      : device_(device), options_(options), seed_(room.seed), view_(device, room, options.width, options.height) {
    photo_ = traced_halves(view_.traced, view_.camera, options.picture_spp, 1, Random(seed_).fork(1).bits());
    exposure_ = exposure_of(mean_of(photo_[0], photo_[1]).data);
    for (Image& half : photo_) scale(half.data, exposure_);
    view_.scene.photo = mean_of(photo_[0], photo_[1]);
    place_ = place_ball(view_.traced, view_.room.scene, view_.camera, Random(seed_).fork(200));
    lit_[1] = std::make_unique<Lit>(device, view_.scene, options.render);
    lit_[0] = predicted();
  }

  LadderRoom climb() {
    climb(render_job());
    for (const BallKind& kind : ball_kinds()) {
      if (!place_) break;
      TraceScene with(device_, with_ball(view_.room.scene, view_.camera, *place_, kind));
      if (std::optional<Job> job = ball_job(with, kind.name)) climb(std::move(*job));
    }
    result_.found.add({"ball"}, place_ ? 1 : 0), result_.found.add({"dropped"}, dropped_);
    return std::move(result_);
  }

 private:
  std::unique_ptr<Lit> predicted() {
    const Stopwatch watch;
    Scene scene = predicted_scene(device_, options_.maps_weights, view_.scene.photo, view_.camera, false);
    const double seconds = watch.seconds();
    if (place_) {
      const Vec3 foot = place_->center - kBallLift * place_->radius * view_.camera.direction_to_camera({0, 1, 0});
      if (const auto at = view_.camera.project(foot)) scale_depth(scene, *at, -foot.z);
    }
    auto lit = std::make_unique<Lit>(device_, std::move(scene), options_.render);
    lit->maps_seconds = seconds;
    return lit;
  }

  Job render_job() const {
    Job job;
    job.key = "render", job.truth = photo_;
    for (const int maps : {0, 1}) job.surface[maps] = {lit_[maps]->scene, view_.scene.depth, view_.scene.normal, true};
    return job;
  }

  /// Nothing where no pixel shows the ball.
  std::optional<Job> ball_job(TraceScene& with, const std::string& name) {
    const TraceMaps maps = with.maps(view_.camera);
    const auto first = static_cast<int>(view_.room.scene.triangles.size());  // the ball's are the last
    std::vector<bool> shows, before_predicted;
    for (std::size_t i = 0; i < maps.triangle.size(); ++i) {
      const float d = lit_[0]->scene.depth.data[i];
      shows.push_back(maps.triangle[i] >= first);
      before_predicted.push_back(shows.back() && !(d > 0 && d <= maps.depth.data[i]));
    }
    if (std::none_of(shows.begin(), shows.end(), [](bool s) { return s; })) return std::nullopt;
    const Scene ball = scene_of(maps, view_.camera);
    Job job;
    job.key = name, job.used = shows, job.before = view_.scene.photo, job.with = &with;
    job.surface[0] = {only(ball, before_predicted), ball.depth, ball.normal, false};
    job.surface[1] = {only(ball, shows), ball.depth, ball.normal, false};
    const Crop crop = crop_to(view_.camera, shows);
    const Halves parts =
        traced_halves(with, crop.camera, options_.picture_spp, exposure_, Random(seed_).fork(2).bits());
    job.truth = {view_.scene.photo, view_.scene.photo};
    for (std::size_t k = 0; k < 2; ++k) paste(parts[k], crop, shows, job.truth[k]);
    return job;
  }

  void climb(Job job) {
    for (int s = 0; s < options_.seeds; ++s) {
      stop_if_interrupted("study");
      RenderSettings settings = options_.render;
      settings.seed = Random(seed_).seed(20 + static_cast<std::uint64_t>(s));
      for (const int maps : {1, 0}) {  // true maps say which pixels are compared
        add_rungs(job, maps, settings);
        add_plain(job, maps, settings);
      }
      if (!job.with) continue;
      const std::vector<Links> all{{true, true, true}};
      const LinkedPictures p =
          lit_[1]->light.render(*job.with, exposure_, job.surface[1], settings, all, options_.emission_spp);
      job.add(kWithBall, p.radiance[0], p.shaded, p.seconds.of(all[0]));
    }
    conclude(job);
  }

  void add_rungs(Job& job, int maps, const RenderSettings& settings) {
    std::vector<std::string> keys;
    std::vector<Links> choices;
    for (const Rung& rung : rungs())
      if (rung.true_maps == (maps == 1)) keys.push_back(rung.key), choices.push_back(rung.links);
    Lit& lit = *lit_[maps];
    const LinkedPictures made =
        lit.light.render(view_.traced, exposure_, job.surface[maps], settings, choices, options_.emission_spp);
    for (std::size_t k = 0; k < keys.size(); ++k)
      job.add(keys[k], made.radiance[k], made.shaded, lit.maps_seconds + made.seconds.of(choices[k]));
    dropped_ += made.dropped;
    if (!job.used.empty()) return;
    const float* emits = lit.scene.material.plane(2);
    for (std::size_t i = 0; i < made.shaded.size(); ++i) job.used.push_back(made.shaded[i] && emits[i] == 0);
  }

  void add_plain(Job& job, int maps, const RenderSettings& settings) {
    for (const std::string& light : plain_lights()) {
      const LinkedPictures made = lit_[maps]->light.render_plain(job.surface[maps], light, settings);
      job.add(plain_key(light, maps == 1), made.radiance[0], made.shaded,
              lit_[maps]->maps_seconds + made.seconds.layer + made.seconds.nets);
    }
  }

  /// Errors of all rows, each seed beside the next.
  void conclude(const Job& job) {
    const Image truth = mean_of(job.truth[0], job.truth[1]);
    const auto note = [&](const char* metric, const std::string& row, std::size_t s, double value) {
      result_.found.add(Finding{metric, job.key, row}.of(static_cast<std::int64_t>(s)), value);
    };
    for (const auto& [key, row] : job.rows)
      for (std::size_t s = 0; s < row.pictures.size(); ++s) {
        const Image &one = row.pictures[s], &other = row.pictures[(s + 1) % row.pictures.size()];
        note("relmse", key, s, relmse_of_pair(one, other, job.truth[0], job.truth[1], job.used));
        note("psnr", key, s, picture_error(one, truth, job.used).psnr), note("seconds", key, s, row.seconds[s]);
        if (key != plain_key("constant", true)) continue;
        const RadianceError best = best_scaled_error(one, truth, job.used);
        note("relmse", kBestConstant, s, best.relmse), note("psnr", kBestConstant, s, best.psnr);
        note("seconds", kBestConstant, s, row.seconds[s]);
      }
    std::vector<StripPicture> strip{{"tracer", truth}};
    for (const Rung& rung : rungs()) {
      strip.push_back({rung.key, truth});
      const Image& picture = job.rows.at(rung.key).pictures[0];
      for (std::size_t i = 0; i < picture.data.size(); ++i)
        if (job.used[i % job.used.size()]) strip.back().picture.data[i] = picture.data[i];
    }
    result_.strips.emplace_back(job.key, std::move(strip));
  }

  Device& device_;
  const LadderOptions& options_;
  std::uint64_t seed_;
  TracedRoom view_;
  double exposure_ = 1, dropped_ = 0;
  Halves photo_;
  std::optional<BallPlace> place_;
  std::unique_ptr<Lit> lit_[2];  // predicted, true maps
  LadderRoom result_;
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

const std::vector<std::string>& plain_lights() {
  static const std::vector<std::string> names{"image", "constant", "net+lamps"};
  return names;
}
std::string plain_key(const std::string& light, bool true_maps) {
  return light + (true_maps ? ", true maps" : ", predicted maps");
}

LadderRoom climb_ladder(Device& device, const ListedRoom& room, const LadderOptions& options) {
  return RoomLadder(device, room, options).climb();
}

}  // namespace clerestory
