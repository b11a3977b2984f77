#include "experiments/applications/light.hpp"

#include <cmath>

#include "experiments/applications/chunk_progress.hpp"
#include "experiments/applications/insert.hpp"
#include "experiments/applications/light_choice.hpp"
#include "experiments/applications/run_folder.hpp"
#include "experiments/applications/run_results.hpp"
#include "host/error.hpp"
#include "host/io/exposure.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/math/panorama.hpp"
#include "host/math/statistics.hpp"
#include "host/report/preview.hpp"
#include "host/report/progress.hpp"
#include "host/report/provenance.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr double kHiddenBy = 0.01;  // scene scales behind the depth map from which on a point is called hidden

std::string text_of(const Vec3& p) { return fmt::format("{:.3f},{:.3f},{:.3f}", p.x, p.y, p.z); }

/// What the depth map says about a point.
std::string note_of(const Scene& scene, const Vec3& point) {
  const std::optional<Vec2> seen = scene.camera.project(point);
  if (!seen)
    return fmt::format(
        "the point lies {:.2f} m behind the camera: light from there is in view only along rays that enter the picture",
        point.z);
  const int x = static_cast<int>(std::floor(seen->x)), y = static_cast<int>(std::floor(seen->y));
  if (x < 0 || y < 0 || x >= scene.width() || y >= scene.height()) return {};
  const double depth = scene.depth.at(0, y, x);
  if (!(depth > 0) || -point.z <= depth + kHiddenBy * scene.scale()) return {};
  return fmt::format(
      "the point lies {:.2f} m behind the surface that pixel {},{} shows: inside of a wall, or hidden from the camera",
      -point.z - depth, x, y);
}

Image image_of(const std::vector<float>& planar, const Size& size) {
  Image image(size.width, size.height, 3);
  image.data = planar;
  return image;
}

}  // namespace

AskedPlace asked_place(const Scene& scene, const LightOptions& options) {
  if (options.at.has_value() == options.at_point.has_value())
    throw usage_error("name the one place whose light is asked for", "--at, --at-point",
                      options.at ? "both" : "neither", "one of them");
  AskedPlace place;
  if (options.at) {
    const auto [point, normal] = surface_at(scene, *options.at);
    place.point = point + kAboveSurface * glm::normalize(normal);
    const auto [x, y] = pixel_of(*options.at);
    place.skip = y * scene.width() + x;
  } else {
    const auto& p = *options.at_point;
    place.point = {p[0], p[1], p[2]};
    for (const double v : p)
      if (!std::isfinite(v)) throw usage_error("not a point", "--at-point", text_of(place.point), "finite metres");
  }
  const double distance = glm::length(place.point), most = kRoomRadius * scene.scale();
  if (distance > most)
    throw usage_error("the point lies out of the room", options.at ? "--at" : "--at-point",
                      fmt::format("{} ({:.2f} m from the camera)", text_of(place.point), distance),
                      fmt::format("at most {:.2f} m, {} times the 99th percentile of depth", most, kRoomRadius));
  if (!options.at) place.note = note_of(scene, place.point);
  return place;
}

Rays panorama_rays(const AskedPlace& place, const Size& size) {
  const std::size_t count = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  Rays rays;
  rays.points.assign(count, place.point), rays.skip.assign(count, place.skip);
  rays.directions.reserve(count);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) rays.directions.push_back(panorama_direction(x, y, size.width, size.height));
  return rays;
}

std::string light(const LightOptions& options) {
  const Stopwatch watch;
  is_learned_light(options.render.light);
  const fs::path out = options.out.empty() ? options.run / "light.exr" : options.out;
  if (out.extension() != ".exr")
    throw usage_error("a panorama is written as EXR", "--out", out.string(), "a name that ends in .exr");
  const fs::path png = fs::path(out).replace_extension(".png");
  const fs::path record = fs::path(out).replace_extension(".json");
  keep_json_apart(options.json, {out, png, record});
  const ResultFiles files(options.run, record, {out, png}, options.force);
  const Scene scene = read_run(options.run);
  const AskedPlace place = asked_place(scene, options);
  if (!place.note.empty()) say("light: " + place.note);
  Device device = Device::open(options.device);
  device.use_gemm(options.gemm);
  Provenance provenance = begin_provenance(options.command, device.fingerprint());
  inherit_facts(options.run, provenance);
  RenderSettings render = options.render;
  render.after_chunk = chunk_progress("light");
  take_light(render, options.lit_by, device, scene, provenance);

  const Rays rays = panorama_rays(place, options.size);
  const double built = device.build_seconds();
  SceneRadiance light(device, scene, render, rays.points.size());
  const RadianceAnswers answers = light.radiance(rays);
  const Image panorama = image_of(answers.radiance, options.size);

  give_up_if_interrupted("light");
  write_exr(files.staged(out), panorama, fits_half(panorama) ? ExrType::Half : ExrType::Float);
  write_png(files.staged(png), show_radiance(panorama, shown_exposure(scene.photo)), Encoding::Linear);
  const double seconds = watch.seconds();
  provenance.inputs.insert(provenance.inputs.begin(), record_file(options.run / "photo.exr"));
  provenance.facts[kPointFact] = text_of(place.point);
  if (!place.note.empty()) provenance.facts["place"] = place.note;
  provenance.figures["seconds"] = seconds;
  provenance.figures["seconds: building kernels"] = device.build_seconds() - built;
  for (const auto& [part, count] : answers.answered) provenance.figures["rays answered " + part] = count;
  provenance.ended = utc_now();
  files.commit(provenance);

  say(fmt::format("light: {} at {}, {}x{}, {:.1f} s: {}", render.light, text_of(place.point), options.size.width,
                  options.size.height, seconds, out.string()));
  nlohmann::ordered_json json{{"panorama", out.string()},
                              {"light", render.light},
                              {"point", {place.point.x, place.point.y, place.point.z}},
                              {"note", place.note},
                              {"uncertainty", mean(answers.uncertainty)},
                              {"seconds", seconds}};
  for (const auto& [part, count] : answers.answered) json["answered"][part] = count;
  return json_text(json, 2);
}

}  // namespace clerestory
