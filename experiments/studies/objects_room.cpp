#include "experiments/studies/objects_room.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/applications/insert.hpp"
#include "experiments/evaluation/picture_error.hpp"
#include "experiments/studies/resting.hpp"
#include "experiments/studies/user_room.hpp"
#include "experiments/truth/crop.hpp"
#include "experiments/truth/predicted_scene.hpp"
#include "experiments/truth/study_light.hpp"
#include "experiments/truth/traced_room.hpp"
#include "host/math/radiance.hpp"
#include "host/math/statistics.hpp"
#include "host/report/preview.hpp"
#include "host/report/progress.hpp"
#include "tracer/balls.hpp"
#include "tracer/generate.hpp"
#include "tracer/stereo.hpp"

namespace clerestory {
namespace {

constexpr int kBounces = 2;  // scatterings at an object that are followed
constexpr float kAlbedo = 0.9f;
/// Streams of a room's random numbers; each camera has its own of all but the first.
enum Stream : std::uint64_t { kPlace = 1, kPhoto, kTruth = 10, kLayer = 20 };

/// Two independent estimates of one picture.
using Halves = std::array<Image, 2>;
Image mean_of(const Halves& halves) {
  Image mean = halves[0];
  for (std::size_t i = 0; i < mean.data.size(); ++i) mean.data[i] = 0.5f * (mean.data[i] + halves[1].data[i]);
  return mean;
}

/// Pixels whose four neighbours are set too: an object's edge shows the room as well.
std::vector<bool> inside(const std::vector<bool>& pixels, int width) {
  std::vector<bool> in(pixels.size());
  const auto w = static_cast<std::size_t>(width);
  for (std::size_t i = w; i + w < pixels.size(); ++i)
    in[i] = i % w > 0 && i % w + 1 < w && pixels[i] && pixels[i - 1] && pixels[i + 1] && pixels[i - w] && pixels[i + w];
  return in;
}

/// The box around set pixels, half as large again to each side: what shows an object's shadow.
std::vector<bool> around(const std::vector<bool>& pixels, int width) {
  int x0 = width, x1 = 0, y0 = static_cast<int>(pixels.size()), y1 = 0;
  for (int i = 0; i < static_cast<int>(pixels.size()); ++i)
    if (pixels[static_cast<std::size_t>(i)])
      x0 = std::min(x0, i % width), x1 = std::max(x1, i % width), y0 = std::min(y0, i / width), y1 = i / width;
  const int wide = (x1 - x0) / 2, high = (y1 - y0) / 2;
  std::vector<bool> box(pixels.size());
  for (int i = 0; i < static_cast<int>(pixels.size()); ++i) {
    const int x = i % width, y = i / width;
    box[static_cast<std::size_t>(i)] = x >= x0 - wide && x <= x1 + wide && y >= y0 - high && y <= y1 + high;
  }
  return box;
}

struct TrueObject {
  std::string shape;
  InsertedObject object;      // in this view's camera space
  Halves pictures;            // the tracer's, right where the box around the object is
  std::vector<bool> covered;  // pixels that are judged
};

/// A camera's photograph, what is known there, and the objects in it.
struct ObjectView {
  Camera camera;
  Scene scene;  // true maps; the photograph is the camera's
  std::vector<TrueObject> objects;
};

class ObjectsMeasurement {
 public:
  ObjectsMeasurement(Device& device, const ListedRoom& room, const ObjectsOptions& options)
      : device_(device), options_(options), random_(room.seed), room_(device, room, options.width, options.height) {}

  ObjectsRoom measure() {
    const std::optional<BallPlace> place =
        place_ball(room_.traced, room_.room.scene, room_.camera, random_.fork(kPlace));
    std::vector<Camera> cameras{room_.camera};
    if (options_.baseline > 0) {
      const std::optional<Camera> right = right_camera(room_.traced, room_.camera, options_.baseline);
      if (!right) return {};
      cameras.push_back(*right);
    }
    if (!place) return {};
    for (const Camera& camera : cameras) add_view(camera);
    for (const std::string& shape : options_.shapes) add_object(shape, *place);
    for (const std::string& shape : options_.shapes) start_rows(shape);
    for (const std::string& maps : {kPredictedMaps, kTrueMaps})
      for (const ObjectAnswerer& who : options_.answerers)
        for (std::size_t v = 0; v < views_.size(); ++v) measure_view(maps, who, v);
    return std::move(result_);
  }

 private:
  Image exposed(Image image) const { return scaled(std::move(image), exposure_); }
  std::uint32_t seed(std::uint64_t stream, std::size_t view) const { return random_.fork(view).seed(stream); }

  /// All under the first camera's exposure, as the pictures of a pair are.
  void add_view(const Camera& camera) {
    const std::size_t v = views_.size();
    const Image linear = room_.traced.picture(camera, options_.photo_spp, seed(kPhoto, v)).mean;
    if (v == 0) exposure_ = static_cast<float>(exposure_of(linear.data));
    views_.push_back({camera, scene_of(room_.traced.maps(camera), camera), {}});
    views_.back().scene.photo = camera_picture(exposed(linear));
  }

  /// A ball, or a mesh as tall and wide as it, on the same foot.
  InsertedObject object_of(const std::string& shape, const BallPlace& place) const {
    InsertedObject object;
    Vec3 at = place.center;
    if (shape == "ball") {
      object.radius = place.radius;
    } else {
      at -= place.radius * room_.camera.direction_to_camera({0, 1, 0});
      object.mesh = default_assets() / "models" / (shape + ".glb"), object.size = 2 * place.radius;
    }
    object.at_point = {at.x, at.y, at.z};
    object.albedo = {kAlbedo, kAlbedo, kAlbedo}, object.roughness = options_.roughness, object.metallic = 1;
    return object;
  }

  void add_object(const std::string& shape, const BallPlace& place) {
    const InsertedObject object = object_of(shape, place);
    const Scene& scene = views_[0].scene;
    const PlacedMesh placed = place_objects(scene, {object})[0];
    TraceScene with(device_,
                    with_mesh(room_.room.scene, room_.camera, placed.mesh,
                              uniform_material(glm::vec3(kAlbedo), static_cast<float>(options_.roughness), 1)));
    const auto first = static_cast<int>(room_.room.scene.triangles.size());  // the object's are the last
    for (std::size_t v = 0; v < views_.size(); ++v) {
      const Camera& camera = views_[v].camera;
      TrueObject known{shape, object, {}, {}};
      const auto& p = *object.at_point;
      const Vec3 there = camera.to_camera(room_.camera.to_world({p[0], p[1], p[2]}));
      known.object.at_point = {there.x, there.y, there.z};
      std::vector<bool> shows;
      for (const int triangle : with.maps(camera).triangle) shows.push_back(triangle >= first);
      known.covered = inside(shows, options_.width);
      if (std::ranges::find(known.covered, true) == known.covered.end()) continue;
      const std::vector<bool> box = around(shows, options_.width);
      const Crop crop = crop_to(camera, box);
      for (std::size_t h = 0; h < 2; ++h) {
        known.pictures[h] = views_[v].scene.photo;
        paste(exposed(with.picture(crop.camera, options_.truth_spp / 2, seed(kTruth + h, v)).mean), crop, box,
              known.pictures[h]);
      }
      views_[v].objects.push_back(std::move(known));
    }
  }

  void start_rows(const std::string& shape) {
    for (std::size_t v = 0; v < views_.size(); ++v)
      for (const TrueObject& known : views_[v].objects)
        if (known.shape == shape)
          result_.sheet.push_back({{shape + side(v) + ": photograph", show_radiance(views_[v].scene.photo)},
                                   {shape + side(v) + ": truth", show_radiance(mean_of(known.pictures))}});
  }
  std::string side(std::size_t view) const {
    return views_.size() < 2 ? "" : view == 0 ? ", left camera" : ", right camera";
  }
  /// The row of the sheet that start_rows() gave this object of this view.
  std::vector<StripPicture>& row_of(const std::string& shape, std::size_t view) {
    const std::string first = shape + side(view) + ": photograph";
    return *std::ranges::find_if(result_.sheet, [&](const auto& row) { return row[0].label == first; });
  }

  void measure_view(const std::string& maps, const ObjectAnswerer& who, std::size_t v) {
    stop_if_interrupted("study");
    const ObjectView& view = views_[v];
    if (view.objects.empty()) return;
    const Scene scene = maps == kTrueMaps ? view.scene
                                          : predicted_scene(device_, who.maps, view.scene.photo, view.camera,
                                                            /*clipped=*/true);
    RenderSettings settings = under_light(who.render, who.light, device_, scene);
    for (const TrueObject& known : view.objects) {
      const InsertedObject object = resting_on(scene, view.scene, known.object);
      Halves made;
      for (std::size_t h = 0; h < 2; ++h) {
        settings.seed = seed(kLayer + h, v);
        made[h] = insert_into(device_, scene, {object}, settings, kBounces).composite;
      }
      const Image mean = mean_of(made);
      const RadianceError error = picture_error(mean, mean_of(known.pictures), known.covered);
      const double energy = gradient_energy(made[0], made[1], known.covered),
                   truth = gradient_energy(known.pictures[0], known.pictures[1], known.covered);
      result_.errors.push_back({maps, who.name, known.shape, error.shown_psnr, error.smape, energy / truth});
      if (maps == kPredictedMaps) row_of(known.shape, v).push_back({who.name, show_radiance(mean)});
    }
  }

  Device& device_;
  const ObjectsOptions& options_;
  Random random_;
  TracedRoom room_;
  float exposure_ = 1;
  std::vector<ObjectView> views_;
  ObjectsRoom result_;
};

}  // namespace

ObjectsRoom measure_objects_room(Device& device, const ListedRoom& room, const ObjectsOptions& options) {
  return ObjectsMeasurement(device, room, options).measure();
}

double gradient_energy(const Image& a, const Image& b, const std::vector<bool>& used) {
  const auto logs = [](const Image& image) {
    std::vector<double> values;
    const std::size_t n = image.pixels();
    for (std::size_t i = 0; i < n; ++i)
      values.push_back(
          std::log(std::max(luminance(image.data[i], image.data[n + i], image.data[2 * n + i]), 0.0) + kLightFloor));
    return values;
  };
  const std::vector<double> first = logs(a), second = logs(b);
  const auto w = static_cast<std::size_t>(a.width);
  double sum = 0, pairs = 0;
  for (std::size_t i = 0; i < used.size(); ++i)
    for (const std::size_t j : {i + 1, i + w}) {
      if (!used[i] || j >= used.size() || !used[j] || (j == i + 1 && j % w == 0)) continue;
      sum += (first[i] - first[j]) * (second[i] - second[j]), pairs += 1;
    }
  if (pairs == 0) throw Error(ErrorKind::Failed, "no two neighbours to compare", "gradient_energy");
  return sum / pairs;
}

}  // namespace clerestory
