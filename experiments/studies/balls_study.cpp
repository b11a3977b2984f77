#include "experiments/studies/balls_study.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "experiments/applications/insert.hpp"
#include "experiments/studies/compare.hpp"
#include "experiments/studies/strip.hpp"
#include "experiments/studies/study_run.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"
#include "tracer/balls.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr int kBounces = 2;     // scatterings at the ball that are followed
constexpr int kMostStrips = 4;  // rooms shown

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

class BallsStudy : public StudyRun {
 public:
  using StudyRun::StudyRun;

 private:
  /// One record a view.
  void measure() override {
    GenerateOptions options = view_options();
    options.balls = true;
    Progress progress("generate", options.rooms, "rooms");
    options.progress = [&progress](int made, int, bool) { progress.update(made); };
    const std::vector<fs::path> views = make_views(options);
    const std::size_t done = records_.size();
    for (std::size_t v = done; v < views.size(); ++v) run_view(v, views[v]);
  }

  void run_view(std::size_t v, const fs::path& view) {
    const Scene scene = scene_of(read_view(view), view.string());
    RenderSettings settings;
    settings.spp = static_cast<int>(config_.integer("balls.spp")), settings.seed = static_cast<std::uint32_t>(v + 1);
    MetricRecord record{static_cast<std::int64_t>(v + 1), 0, {{"balls", 0}}};
    std::vector<Image> strip{scene.photo};
    for (const TrueBall& ball : read_balls(view)) {
      stop_if_interrupted("study");
      const Image truth = read_map(view.string() + "_ball_" + ball.name + ".exr", 3);
      settings.light = "image";
      const Insertion image = insert_into(device_, scene, {ball.object}, settings, kBounces);
      settings.light = "panorama";
      const Rendering panorama = render_scene(device_, image.with.scene, settings);
      std::vector<bool> shows(truth.pixels());
      for (std::size_t i = 0; i < shows.size(); ++i) shows[i] = image.with.shows.data[i] > 0;
      if (std::none_of(shows.begin(), shows.end(), [](bool s) { return s; })) continue;
      record.values[0].second += 1;
      note(record, ball.name + "/image", picture_error(image.composite, truth, shows), image.seconds);
      note(record, ball.name + "/panorama", picture_error(panorama.radiance, truth, shows), panorama.seconds);
      Image other = scene.photo;
      for (std::size_t i = 0; i < other.data.size(); ++i)
        if (shows[i % shows.size()]) other.data[i] = panorama.radiance.data[i];
      strip.insert(strip.end(), {truth, image.composite, other});
    }
    if (v < kMostStrips && strip.size() > 1)
      write_strip(run_.artifact(fmt::format("room{}_photo_then_tracer_image_panorama.png", v)), strip);
    MetricsWriter(run_.metrics_path()).write(record.step, record.values);
    records_.push_back(record);
  }

  static void note(MetricRecord& record, const std::string& key, const PictureError& e, double seconds) {
    record.values.insert(record.values.end(),
                         {{key + "/relmse", e.relmse}, {key + "/psnr", e.psnr}, {key + "/seconds", seconds}});
  }

  std::vector<double> values(const std::string& key) const {
    std::vector<double> found;
    for (const MetricRecord& r : records_)
      for (const auto& [name, value] : r.values)
        if (name == key) found.push_back(value);
    return found;
  }

  void conclude() override {
    Table table;
    table.title = "Balls put into rooms: medians over rooms, on the ball's pixels";
    table.columns = {{"ball", "", Best::None, 3},           {"light", "", Best::None, 3},
                     {"rooms", "", Best::None, 3},          {"relMSE", "eps 0.01, median", Best::None, 3},
                     {"PSNR", "dB, median", Best::None, 4}, {"closer in", "rooms, relMSE", Best::None, 3},
                     {"time", "s a view", Best::None, 3}};
    for (const BallKind& kind : ball_kinds()) {
      const std::vector<double> errors[2] = {values(kind.name + "/image/relmse"),
                                             values(kind.name + "/panorama/relmse")};
      if (errors[0].empty()) throw Error(ErrorKind::Failed, "no view had a place for a ball", run_.path().string());
      double image_wins = 0;
      for (std::size_t i = 0; i < errors[0].size(); ++i) image_wins += errors[0][i] < errors[1][i];
      const auto rooms = static_cast<double>(errors[0].size());
      for (const int panorama : {0, 1}) {
        const std::string light = panorama ? "panorama" : "image", key = kind.name + "/" + light;
        table.add({kind.name, light, Measure{rooms}, Measure{median(errors[panorama])},
                   Measure{median(values(key + "/psnr"))}, Measure{panorama ? rooms - image_wins : image_wins},
                   Measure{median(values(key + "/seconds"))}});
      }
    }
    write_table("balls", table);
    provenance_.figures["rooms without a place for a ball"] =
        static_cast<double>(records_.size() - values("mirror/image/relmse").size());
  }
};

}  // namespace

std::string run_balls_study(const Config& config, const std::vector<std::string>& command) {
  return BallsStudy(config, command).run();
}

}  // namespace clerestory
