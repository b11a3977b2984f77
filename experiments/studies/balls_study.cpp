#include "experiments/studies/balls_study.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "experiments/applications/insert.hpp"
#include "experiments/applications/light.hpp"
#include "experiments/applications/light_weights.hpp"
#include "experiments/evaluation/light_errors.hpp"
#include "experiments/evaluation/metrics.hpp"
#include "experiments/studies/compare.hpp"
#include "experiments/studies/known_light.hpp"
#include "experiments/studies/predicted_scene.hpp"
#include "experiments/studies/strip.hpp"
#include "experiments/studies/study_run.hpp"
#include "experiments/studies/true_hits.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"
#include "tracer/balls.hpp"
#include "tracer/probes.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr int kBounces = 2;     // scatterings at the ball that are followed
constexpr int kMostStrips = 4;  // rooms shown
constexpr double kNear = 3;     // radii from a ball's centre within which a surface is around it

constexpr const char* kUnchanged = "none (the photograph)";

struct TrueBall {
  std::string name;
  InsertedObject object;
};

/// What stands in a view's NNN_balls.json; empty where the view had no place for a ball.
std::vector<TrueBall> read_balls(const fs::path& view) {
  const std::string where = view.string() + "_balls.json";
  std::vector<TrueBall> balls;
  try {
    for (const auto& entry : nlohmann::json::parse(read_file(where, 1 << 20))) {
      TrueBall ball{entry.at("name").get<std::string>(), {}};
      ball.object.at_point = entry.at("center").get<std::array<double, 3>>();
      ball.object.radius = entry.at("radius").get<double>();
      ball.object.albedo = entry.at("albedo").get<std::array<double, 3>>();
      ball.object.roughness = entry.at("roughness").get<double>();
      ball.object.metallic = entry.at("metallic").get<double>();
      balls.push_back(ball);
    }
  } catch (const nlohmann::json::exception& e) {
    throw usage_error("not a list of balls", where, e.what());
  }
  return balls;
}

/// Pixels of the room around a ball: where it throws its shadow and its light.
std::vector<bool> around(const Scene& truth, const InsertedObject& ball, const std::vector<bool>& shows) {
  const auto& c = *ball.at_point;
  std::vector<bool> is(shows.size());
  for (int y = 0; y < truth.height(); ++y)
    for (int x = 0; x < truth.width(); ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * truth.width() + x;
      const Vec3 point = truth.camera.unproject(x + 0.5, y + 0.5, truth.depth.data[i]);
      is[i] =
          !shows[i] && truth.depth.data[i] > 0 && glm::distance(point, Vec3(c[0], c[1], c[2])) < kNear * *ball.radius;
    }
  return is;
}

/// A light in a scene with true or predicted maps.
struct Answerer {
  std::string light;
  bool true_maps;
  std::string key() const { return light + (true_maps ? "" : ", predicted maps"); }
};

/// The true light at a point, and which of its directions the picture shows.
struct TrueProbe {
  Rays rays;
  std::vector<std::array<float, 3>> radiance;  // mean of two halves of samples
  std::vector<float> variance;                 // of that mean, planar
  KnownRays::Used in_view, out_of_view;
};

TrueProbe true_probe(TraceScene& traced, const Scene& scene, const Vec3& center, int spp, double exposure) {
  Probe traced_probe;
  traced_probe.center = center;
  RadianceQuery query;
  query.spp = spp;
  const Image variance = trace_probe_twice(traced, scene.camera, traced_probe, query, {1, 2});
  TrueProbe probe;
  probe.rays = panorama_rays({center, -1, {}}, {probe_width, probe_height});
  const std::size_t count = probe.rays.points.size();
  probe.radiance.resize(count), probe.variance.resize(3 * count);
  const auto white = static_cast<float>(exposure);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < count; ++i) {
      probe.radiance[i][c] = white * traced_probe.radiance.data[c * count + i];
      probe.variance[c * count + i] = white * white * variance.data[c * count + i];
    }
  const std::vector<int> hits =
      true_hits(traced, scene.camera, planar(probe.rays.points), planar(probe.rays.directions));
  for (std::size_t i = 0; i < count; ++i) (hits[i] >= 0 ? probe.in_view : probe.out_of_view).push_back(i);
  return probe;
}

class BallsStudy : public StudyRun {
 public:
  using StudyRun::StudyRun;

 private:
  /// One record a view.
  void measure() override {
    prepare();
    GenerateOptions options = view_options();
    options.balls = true;
    Progress progress("generate", options.rooms, "rooms");
    options.progress = [&progress](int made, int, bool) { progress.update(made); };
    const std::vector<fs::path> views = make_views(options);
    const RoomAssets assets = load_assets(default_assets(), options.setting);
    for (std::size_t v = records_.size(); v < views.size(); ++v) {
      const Room room = make_room(room_seed(options, static_cast<int>(v)), options.setting, assets);
      run_view(v, views[v], room);
    }
  }

  /// Who answers, and their weights, before anything is made.
  void prepare() {
    bool learned = false;
    for (const std::string& light : config_.texts("balls.lights")) {
      answerers_.push_back({light, true});
      settings_.light = light_of(light);
      if (!is_learned_light(settings_.light)) continue;
      learned = true;
      use_light(settings_);
      answerers_.push_back({light, false});
    }
    if (answerers_.empty())
      throw usage_error("no light to compare", "balls.lights", "none", "image, panorama, net, ...");
    settings_.spp = static_cast<int>(config_.integer("balls.spp"));
    if (!learned) return;
    answerers_.push_back({"image", false});  // what learned light with predicted maps must beat
    maps_weights_ = use_maps();
  }

  void run_view(std::size_t v, const fs::path& view, const Room& room) {
    const RoomView read = read_view(view);
    const Scene truth = scene_of(read, view.string());
    settings_.seed = static_cast<std::uint32_t>(v + 1);
    MetricRecord record{static_cast<std::int64_t>(v + 1), 0, {{"balls", 0}}};
    const std::vector<TrueBall> balls = read_balls(view);
    if (!balls.empty()) {
      const Scene predicted = predicted_at(truth, balls[0].object);
      for (const Answerer& who : answerers_)
        lit_[who.key()] = under_light(settings_, who.light, device_, who.true_maps ? truth : predicted);
      std::vector<Image> strip{truth.photo};
      for (const TrueBall& ball : balls) run_ball(view, ball, truth, predicted, record, strip);
      if (v < kMostStrips && strip.size() > 1)
        write_strip(run_.artifact(fmt::format("room{}_photo_then_tracer_and_lights.png", v)), strip);
      run_probe(room, read.exposure, balls[0].object, truth, predicted, record);
    }
    add_record(std::move(record));
  }

  /// Predicted maps whose depth is right at the foot of the ball; empty when nobody asks for them.
  Scene predicted_at(const Scene& truth, const InsertedObject& ball) {
    if (maps_weights_.empty()) return {};
    Scene scene = predicted_scene(device_, maps_weights_, truth.photo, truth.camera, false);
    const auto& c = *ball.at_point;
    const Vec3 foot = Vec3(c[0], c[1], c[2]) - *ball.radius * truth.camera.direction_to_camera({0, 1, 0});
    if (const auto at = truth.camera.project(foot)) scale_depth(scene, *at, -foot.z);
    return scene;
  }

  void run_ball(const fs::path& view, const TrueBall& ball, const Scene& truth, const Scene& predicted,
                MetricRecord& record, std::vector<Image>& strip) {
    const Image wanted = read_map(view.string() + "_ball_" + ball.name + ".exr", 3);
    std::vector<bool> shows, near;
    Image mask;
    for (const Answerer& who : answerers_) {  // true maps come first
      stop_if_interrupted("study");
      const Insertion made =
          insert_into(device_, who.true_maps ? truth : predicted, {ball.object}, lit_.at(who.key()), kBounces);
      if (shows.empty()) {
        mask = made.covers;
        for (const float s : mask.data) shows.push_back(s > 0);
        if (std::none_of(shows.begin(), shows.end(), [](bool s) { return s; })) return;
        record.values[0].second += 1;
        strip.push_back(wanted);
        near = around(truth, ball.object, shows);
        note_around(record, ball.name, kUnchanged, truth.photo, wanted, near);
      }
      note(record, ball.name + "/" + who.key(), made.composite, wanted, shows, mask, made.seconds);
      note_around(record, ball.name, who.key(), made.composite, wanted, near);
      strip.push_back(made.composite);
    }
  }

  static void note(MetricRecord& record, const std::string& key, const Image& picture, const Image& truth,
                   const std::vector<bool>& shows, const Image& mask, double seconds) {
    const RadianceError e = picture_error(picture, truth, shows);
    record.values.insert(record.values.end(),
                         {{key + "/relmse", e.relmse},
                          {key + "/psnr", e.psnr},
                          {key + "/si_rmse", std::sqrt(scale_invariant_mse(picture, truth, mask).value())},
                          {key + "/angle", mean_angle(picture, truth, mask).value()},
                          {key + "/seconds", seconds}});
  }

  static std::string around_key(const std::string& ball, const std::string& who, const char* metric) {
    return fmt::format("around/{}/{}/{}", ball, who, metric);
  }
  static void note_around(MetricRecord& record, const std::string& ball, const std::string& key, const Image& picture,
                          const Image& truth, const std::vector<bool>& near) {
    const RadianceError e = picture_error(picture, truth, near);
    record.values.emplace_back(around_key(ball, key, "relmse"), e.relmse);
    record.values.emplace_back(around_key(ball, key, "psnr"), e.psnr);
  }

  /// Incident light at the ball's centre, in the room without it.
  void run_probe(const Room& room, double exposure, const InsertedObject& ball, const Scene& truth,
                 const Scene& predicted, MetricRecord& record) {
    TraceScene traced(device_, room.scene);
    const auto& c = *ball.at_point;
    const TrueProbe probe =
        true_probe(traced, truth, {c[0], c[1], c[2]}, static_cast<int>(config_.integer("balls.probe_spp")), exposure);
    const KnownRays known(probe.radiance, probe_weights());
    for (const auto& [region, used] : {std::pair{"in view", &probe.in_view}, {"out of view", &probe.out_of_view}}) {
      if (used->empty()) continue;
      record.values.emplace_back(fmt::format("probe/noise/{}", region), known.noise(probe.variance, *used));
    }
    for (const Answerer& who : answerers_) {
      SceneRadiance light(device_, who.true_maps ? truth : predicted, lit_.at(who.key()), probe.rays.points.size());
      const std::vector<float> answers = light.radiance(probe.rays).radiance;
      for (const auto& [region, used] : {std::pair{"in view", &probe.in_view}, {"out of view", &probe.out_of_view}})
        if (!used->empty())
          record.values.emplace_back(fmt::format("probe/{}/{}", who.key(), region), known.error(answers, *used).relmse);
    }
  }

  /// Rooms in which an error is below the other one.
  static double closer_than(const std::vector<double>& others, const std::vector<double>& errors) {
    double rooms = 0;
    for (std::size_t i = 0; i < errors.size(); ++i) rooms += errors[i] < others[i];
    return rooms;
  }

  Table balls_table() const {
    Table table;
    table.title = "Balls put into rooms: medians over rooms, on the ball's pixels";
    table.columns = {{"ball", "", Best::None, 3},
                     {"light", "", Best::None, 3},
                     {"rooms", "", Best::None, 3},
                     {"relMSE", "eps 0.01, median", Best::None, 3},
                     {"PSNR", "dB, median", Best::None, 4},
                     {"si-RMSE", "median", Best::None, 3},
                     {"RGB angle", "degrees, median", Best::None, 3},
                     {"closer than the first", "rooms, relMSE", Best::None, 3},
                     {"time", "s a view", Best::None, 3}};
    for (const BallKind& kind : ball_kinds()) {
      const std::vector<double> first = values_of(kind.name + "/" + answerers_.at(0).key() + "/relmse");
      if (first.empty()) throw Error(ErrorKind::Failed, "no view had a place for a ball", run_.path().string());
      for (const Answerer& who : answerers_) {
        const std::string key = kind.name + "/" + who.key();
        const std::vector<double> errors = values_of(key + "/relmse");
        table.add({kind.name, who.key(), Measure{static_cast<double>(errors.size())}, Measure{median(errors)},
                   Measure{median(values_of(key + "/psnr"))}, Measure{median(values_of(key + "/si_rmse"))},
                   Measure{median(values_of(key + "/angle"))}, Measure{closer_than(first, errors)},
                   Measure{median(values_of(key + "/seconds"))}});
      }
    }
    return table;
  }

  Table around_table() const {
    Table table;
    table.title =
        fmt::format("The room within {:g} radii of the ball: medians over rooms, on pixels that do not show it", kNear);
    table.columns = {{"ball", "", Best::None, 3},
                     {"light", "", Best::None, 3},
                     {"relMSE", "eps 0.01, median", Best::None, 3},
                     {"PSNR", "dB, median", Best::None, 4},
                     {"closer than the photograph", "rooms, relMSE", Best::None, 3}};
    for (const BallKind& kind : ball_kinds()) {
      std::vector<std::string> keys{kUnchanged};
      for (const Answerer& who : answerers_) keys.push_back(who.key());
      const std::vector<double> unchanged = values_of(around_key(kind.name, kUnchanged, "relmse"));
      for (const std::string& key : keys) {
        const std::vector<double> errors = values_of(around_key(kind.name, key, "relmse"));
        table.add({kind.name, key, Measure{median(errors)},
                   Measure{median(values_of(around_key(kind.name, key, "psnr")))},
                   key == kUnchanged ? Cell() : Cell(Measure{closer_than(unchanged, errors)})});
      }
    }
    return table;
  }

  /// Rooms where the photograph is no further from the truth than the truth's own noise say nothing of the gap.
  Table centre_table() const {
    Table table;
    table.title =
        "Incident light at the ball's centre: medians over rooms; the gap is that of `image` with the same maps";
    table.columns = {{"light", "", Best::None, 3},
                     {"directions", "by the tracer", Best::None, 3},
                     {"relMSE", "eps 0.01, RGB", Best::None, 3},
                     {"of it the truth's noise", "", Best::None, 3},
                     {"gap closed", "share", Best::None, 3},
                     {"rooms", "", Best::None, 3}};
    for (const std::string region : {"in view", "out of view"})
      for (const Answerer& who : answerers_) {
        const std::vector<double> errors = values_of("probe/" + who.key() + "/" + region),
                                  noise = values_of("probe/noise/" + region),
                                  photo = values_of("probe/" + Answerer{"image", who.true_maps}.key() + "/" + region);
        if (errors.empty()) continue;
        std::vector<double> closed;
        for (std::size_t i = 0; i < photo.size(); ++i)
          if (const double gap = way_gone(photo[i], errors[i], noise[i]); std::isfinite(gap)) closed.push_back(gap);
        table.add({who.key(), region, Measure{median(errors)}, Measure{median(noise)},
                   closed.empty() || who.light == "image" ? Cell() : Cell(Measure{median(closed)}),
                   Measure{static_cast<double>(who.light == "image" ? errors.size() : closed.size())}});
      }
    return table;
  }

  void conclude() override {
    write_table("balls", balls_table());
    std::fputs("\n", stdout);
    write_table("balls_around", around_table());
    std::fputs("\n", stdout);
    write_table("balls_centre", centre_table());
    const auto places = values_of(ball_kinds()[0].name + "/" + answerers_.at(0).key() + "/relmse").size();
    provenance_.figures["rooms without a place for a ball"] = static_cast<double>(records_.size() - places);
  }

  RenderSettings settings_;
  std::map<std::string, RenderSettings> lit_;  // of the view at hand, by Answerer::key()
  std::vector<Answerer> answerers_;
  fs::path maps_weights_;  // empty: nobody asks for predicted maps
};

}  // namespace

std::string run_balls_study(const Config& config, const std::vector<std::string>& command) {
  return BallsStudy(config, command).run();
}

}  // namespace clerestory
