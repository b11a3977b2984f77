#include "experiments/studies/user_room.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/applications/insert.hpp"
#include "experiments/evaluation/light_errors.hpp"
#include "experiments/evaluation/picture_error.hpp"
#include "experiments/studies/resting.hpp"
#include "experiments/truth/crop.hpp"
#include "experiments/truth/judged_maps.hpp"
#include "experiments/truth/predicted_scene.hpp"
#include "experiments/truth/study_light.hpp"
#include "experiments/truth/traced_room.hpp"
#include "host/math/panorama.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"
#include "nets/scene_radiance.hpp"
#include "tracer/balls.hpp"
#include "tracer/probes.hpp"

namespace clerestory {
namespace {

constexpr int kBounces = 2;  // scatterings at a ball that are followed
constexpr double kNear = 3;  // radii from a ball's centre within which a surface is around it
/// Streams of a room's random numbers.
enum Stream : std::uint64_t { kPhoto = 1, kTruth, kBall, kProbes, kLayer };

struct TrueBall {
  std::string name;
  InsertedObject object;
  Image picture;                  // the tracer's, right where either list is set
  std::vector<bool> shows, near;  // the ball; the room around it
};

/// The light at free points.
struct TrueAir {
  Rays rays;
  std::vector<std::array<float, 3>> radiance;
  std::vector<double> weights;
};

class UserRoomMeasurement {
 public:
  UserRoomMeasurement(Device& device, const ListedRoom& room, const UserOptions& options)
      : device_(device), options_(options), random_(room.seed), view_(device, room, options.width, options.height) {
    const Image linear = view_.traced.picture(view_.camera, options.photo_spp, random_.seed(kPhoto)).mean;
    exposure_ = static_cast<float>(exposure_of(linear.data));
    view_.scene.photo = camera_picture(exposed(linear));
    truth_ = exposed(view_.traced.picture(view_.camera, options.truth_spp, random_.seed(kTruth)).mean);
    const std::size_t n = truth_.pixels();
    for (std::size_t i = 0; i < n; ++i)
      used_.push_back(view_.scene.depth.data[i] > 0 && view_.scene.material.data[2 * n + i] == 0);
    make_balls();
    make_air();
  }

  UserRoom measure(const MapSet* means) {
    const Scene predicted =
        predicted_scene(device_, options_.maps_weights, view_.scene.photo, view_.camera, /*clipped=*/true);
    result_.maps = judge_maps(predicted, means);
    result_.ball = !balls_.empty();
    result_.strip = {{"photograph", view_.scene.photo}};
    if (!balls_.empty()) result_.strip.push_back({"tracer's ball", balls_[0].picture});
    for (const auto& [maps, scene] : {std::pair{&kPredictedMaps, &predicted}, {&kTrueMaps, &view_.scene}}) {
      maps_ = *maps;
      for (const TrueBall& ball : balls_)
        note(kUnchanged, "around " + ball.name, 0, picture_error(view_.scene.photo, ball.picture, ball.near));
      for (const std::string& light : options_.lights) measure_light(light, *scene);
    }
    return std::move(result_);
  }

 private:
  Image exposed(Image image) const { return scaled(std::move(image), exposure_); }

  // --- The truth --------------------------------------------------------------------------------------------------

  void make_balls() {
    const std::optional<BallPlace> place =
        place_ball(view_.traced, view_.room.scene, view_.camera, random_.fork(kBall));
    if (!place) return;
    for (const BallKind& kind : ball_kinds()) {
      TraceScene with(device_, with_ball(view_.room.scene, view_.camera, *place, kind));
      const TraceMaps maps = with.maps(view_.camera);
      TrueBall ball{kind.name, {}, truth_, {}, {}};
      const auto albedo = static_cast<double>(kind.albedo);
      ball.object.at_point = {place->center.x, place->center.y, place->center.z};
      ball.object.radius = place->radius, ball.object.albedo = {albedo, albedo, albedo};
      ball.object.roughness = static_cast<double>(kind.roughness);
      ball.object.metallic = static_cast<double>(kind.metallic);
      const auto first = static_cast<int>(view_.room.scene.triangles.size());  // the ball's are the last
      for (const int triangle : maps.triangle) ball.shows.push_back(triangle >= first);
      if (std::ranges::find(ball.shows, true) == ball.shows.end()) continue;
      ball.near = around(*place, ball.shows);
      std::vector<bool> wanted = ball.near;
      for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = wanted[i] || ball.shows[i];
      const Crop crop = crop_to(view_.camera, wanted);
      paste(exposed(with.picture(crop.camera, options_.truth_spp, random_.seed(kTruth)).mean), crop, wanted,
            ball.picture);
      balls_.push_back(std::move(ball));
    }
  }

  /// Where a ball throws its shadow and its light.
  std::vector<bool> around(const BallPlace& place, const std::vector<bool>& shows) const {
    std::vector<bool> is(shows.size());
    for (std::size_t i = 0; i < is.size(); ++i) {
      const auto x = static_cast<double>(i % static_cast<std::size_t>(options_.width)),
                 y = static_cast<double>(i / static_cast<std::size_t>(options_.width));
      is[i] = !shows[i] && used_[i] &&
              glm::distance(view_.camera.unproject(x + 0.5, y + 0.5, view_.scene.depth.data[i]), place.center) <
                  kNear * place.radius;
    }
    return is;
  }

  void make_air() {
    Random random = random_.fork(kProbes);
    RadianceQuery query;
    query.spp = options_.probe_spp;
    for (Probe& probe :
         place_probes(view_.traced, view_.room.scene, view_.camera, view_.maps, options_.probes, random.fork(0))) {
      const auto first = static_cast<std::uint32_t>(random.bits()), second = static_cast<std::uint32_t>(random.bits());
      trace_probe_twice(view_.traced, view_.camera, probe, query, {first, second});
      for (int y = 0; y < probe_height; ++y)
        for (int x = 0; x < probe_width; ++x) {
          air_.rays.points.push_back(probe.center);
          air_.rays.directions.push_back(panorama_direction(x, y, probe_width, probe_height));
          air_.radiance.push_back({exposure_ * probe.radiance.at(0, y, x), exposure_ * probe.radiance.at(1, y, x),
                                   exposure_ * probe.radiance.at(2, y, x)});
          air_.weights.push_back(panorama_solid_angle(y, probe_width, probe_height));
        }
    }
  }

  // --- Answers ----------------------------------------------------------------------------------------------------

  ViewResult judge_maps(const Scene& predicted, const MapSet* means) const {
    const PreparedView prepared = prepare_scene(view_.scene, options_.width, options_.height);
    double scale = 0;
    const MapSet maps = relative_maps(predicted, &scale);
    ViewResult result = trivial_errors("room", prepared, means);
    judge(result, prepared, maps, std::log(scale));
    return result;
  }

  void note(const std::string& light, const std::string& job, int seed, const RadianceError& error) {
    result_.errors.push_back({maps_, light, job, seed, error});
  }

  void measure_light(const std::string& light, const Scene& scene) {
    stop_if_interrupted("study");
    RenderSettings settings = under_light(options_.render, light, device_, scene);
    for (int s = 0; s < options_.seeds; ++s) {
      settings.seed = random_.seed(kLayer + static_cast<std::uint64_t>(s));
      const Rendering again = render_scene(device_, scene, settings);
      note(light, "render", s, picture_error(again.radiance, truth_, used_));
      if (light == "constant") note(kOracle, "render", s, best_scaled_error(again.radiance, truth_, used_));
      const bool shown = s == 0 && maps_ == kPredictedMaps;
      if (shown && light == options_.lights[0]) result_.seconds = again.seconds;
      if (shown) result_.strip.push_back({light + ": re-render", again.radiance});
      for (const TrueBall& ball : balls_) {
        const Insertion made =
            insert_into(device_, scene, {resting_on(scene, view_.scene, ball.object)}, settings, kBounces);
        note(light, ball.name, s, picture_error(made.composite, ball.picture, ball.shows));
        note(light, "around " + ball.name, s, picture_error(made.composite, ball.picture, ball.near));
        if (shown && &ball == &balls_[0]) result_.strip.push_back({light + ": ball", made.composite});
      }
    }
    measure_air(light, scene, settings);
  }

  void measure_air(const std::string& light, const Scene& scene, const RenderSettings& settings) {
    if (air_.radiance.empty()) return;
    const KnownRays known(air_.radiance, air_.weights);
    KnownRays::Used all(known.count());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    SceneRadiance asked(device_, scene, settings, known.count());
    note(light, "air", 0, known.error(asked.radiance(air_.rays).radiance, all));
    if (light == "constant") note(kOracle, "air", 0, known.best_constant(all));
  }

  Device& device_;
  const UserOptions& options_;
  Random random_;
  TracedRoom view_;  // its photograph is the camera's
  float exposure_ = 1;
  Image truth_;
  std::vector<bool> used_;  // pixels of re-renders that are compared
  std::vector<TrueBall> balls_;
  TrueAir air_;
  std::string maps_;
  UserRoom result_;
};

}  // namespace

UserRoom measure_user_room(Device& device, const ListedRoom& room, const UserOptions& options, const MapSet* means) {
  return UserRoomMeasurement(device, room, options).measure(means);
}

}  // namespace clerestory
