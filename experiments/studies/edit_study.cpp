#include "experiments/studies/edit_study.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "experiments/evaluation/picture_error.hpp"
#include "experiments/studies/room_study.hpp"
#include "experiments/studies/strip.hpp"
#include "experiments/truth/study_light.hpp"
#include "experiments/truth/traced_room.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

constexpr double kLeastShare = 0.02;  // of the view: a surface that shows less is not edited
constexpr int kMostStrips = 4;        // rooms shown

/// Pictures compared: the composite and the layer's render of the edited scene alone, by light; the photograph.
struct Compared {
  std::string who, label;
};
std::string edited_by(const std::string& light) { return "edit by " + light; }
std::string rendered_by(const std::string& light) { return "render by " + light; }
const std::string kPhotograph = "photograph";
std::vector<Compared> pictures(const std::vector<std::string>& lights) {
  std::vector<Compared> rows;
  for (const std::string& light : lights) rows.push_back({edited_by(light), "edit, " + light});
  for (const std::string& light : lights) rows.push_back({rendered_by(light), "render alone, " + light});
  rows.push_back({kPhotograph, "photograph unchanged"});
  return rows;
}

class EditStudy : public RoomStudy {
 public:
  using RoomStudy::RoomStudy;

 private:
  void measure() override {
    lights_ = config_.texts("edit.lights");
    for (const std::string& light : lights_) {
      settings_.light = study_light(light).light;
      if (!is_learned_light(settings_.light)) continue;
      use_light(settings_);
    }
    settings_.spp = config_.whole("edit.spp");
    measure_rooms([this](const ListedRoom& listed) { return run_room(listed); });
  }

  RoomFindings run_room(const ListedRoom& listed) {
    const std::int64_t r = listed.index;
    TracedRoom view = traced_room(listed);
    const World& world = view.room.scene;
    Scene& scene = view.scene;
    const int spp = config_.whole("data.spp");
    const std::uint32_t tracer_seed = Random(listed.seed).seed(kPhotographSeed);
    scene.photo = view.traced.picture(view.camera, spp, tracer_seed).mean;
    const auto exposure = static_cast<float>(exposure_of(scene.photo.data));
    scale(scene.photo.data, exposure);

    for (const std::string& light : lights_) lit_[light] = under_light(settings_, light, device_, scene);
    RoomFindings found;
    for (const EditCase& edit : edit_cases()) {
      stop_if_interrupted("study");
      const int material = material_of_surface(view.room, view.camera, view.maps, edit.surface, kLeastShare);
      if (material < 0) continue;
      TraceScene changed(device_, with_material(world, material, edit.change));
      // At equal seeds paths that do not meet the surface are equal: errors are those of the edit.
      Image truth = changed.picture(view.camera, spp, tracer_seed).mean;
      scale(truth.data, exposure);
      const Image mask = mask_of_material(world, view.maps, material);
      check_maps(changed.maps(view.camera), apply_edit(scene, mask, edit.change), edit);
      run_case(r, edit, scene, mask, truth, found);
    }
    return found;
  }

  /// The truth is that of the edit: maps agree, to the rounding of a texture's sum of three weighted values.
  static void check_maps(const TraceMaps& maps, const EditedScene& with, const EditCase& edit) {
    const std::size_t n = with.edited.size();
    for (std::size_t i = 0; i < n; ++i) {
      if (!with.edited[i]) continue;
      double off = std::max(std::abs(maps.roughness.data[i] - with.scene.material.data[i]),
                            std::abs(maps.metallic.data[i] - with.scene.material.data[n + i]));
      for (std::size_t c = 0; c < 3; ++c)
        off = std::max(off,
                       static_cast<double>(std::abs(maps.albedo.data[c * n + i] - with.scene.albedo.data[c * n + i])));
      if (off > 1e-5)
        throw Error(ErrorKind::Failed, "the traced room is not the edited one", edit.name,
                    fmt::format("off by {}", off));
    }
  }

  void run_case(std::int64_t r, const EditCase& edit, const Scene& scene, const Image& mask, const Image& truth,
                RoomFindings& found) {
    const std::size_t n = scene.photo.pixels();
    std::vector<bool> edited(n), others(n);
    for (std::size_t i = 0; i < n; ++i) {
      const bool used = scene.depth.data[i] > 0 && scene.material.data[2 * n + i] == 0;
      edited[i] = used && mask.data[i] > 0, others[i] = used && mask.data[i] == 0;
    }
    if (std::none_of(others.begin(), others.end(), [](bool o) { return o; })) return;
    const auto note = [&](const std::string& who, std::int64_t seed, const Image& image, double seconds) {
      for (const auto& [region, used] : {std::pair{"edited", &edited}, {"others", &others}}) {
        const RadianceError e = picture_error(image, truth, *used);
        for (const auto& [metric, value] : {std::pair{"relmse", e.relmse}, {"psnr", e.psnr}, {"seconds", seconds}})
          found.add(Finding{metric, region, who, edit.key}.of(seed), value);
      }
    };
    const int bounces = config_.whole("edit.bounces");
    note(kPhotograph, 0, scene.photo, 0);
    Image shown;
    const Scene after = apply_edit(scene, mask, edit.change).scene;
    for (std::int64_t s = 0; s < config_.integer("edit.seeds"); ++s)
      for (const std::string& light : lights_) {
        RenderSettings& settings = lit_.at(light);
        settings.seed = static_cast<std::uint32_t>(s + 1);
        const Edit done = edit_scene(device_, scene, mask, edit.change, settings, bounces);
        note(edited_by(light), s, done.composite, done.seconds);
        const Rendering alone = render_scene(device_, after, settings);
        note(rendered_by(light), s, alone.radiance, alone.seconds);
        if (shown.data.empty()) shown = done.composite;
      }
    if (r < kMostStrips)
      write_strip(run_.artifact(fmt::format("room{}_{}_photo_edit_tracer.png", r, edit.key)),
                  {{"photograph", scene.photo}, {"edit", shown}, {"tracer", truth}});
  }

  /// Of one picture: a list of seeds for every room that has the case.
  Findings::BySeed values(const Finding& finding) const {
    return found().present_by_seed(finding, config_.integer("edit.seeds"));
  }
  static std::vector<double> means(const std::vector<std::vector<double>>& rooms) {
    std::vector<double> list;
    for (const std::vector<double>& seeds : rooms) list.push_back(mean(seeds));
    return list;
  }

  Table table_of(const std::string& region, const std::string& title) const {
    Table table;
    table.title = title;
    table.note =
        "Photograph and truth have one tracer seed: what an edit does not change has no noise, but in the render "
        "alone.";
    table.columns = {{"edit"},
                     {"picture"},
                     {"relMSE", "eps 0.01, rooms"},
                     {"median", "relMSE, rooms"},
                     {"spread", "over seeds", Best::None, 2},
                     {"PSNR", "dB, linear, clipped at 1, rooms", Best::None, 4},
                     {"closer than the photograph", "rooms, relMSE"},
                     {"of", "rooms"},
                     {"time", "s a view"}};
    std::vector<std::string> nowhere;
    for (const EditCase& edit : edit_cases()) {
      const std::vector<double> photo = means(values({"relmse", region, kPhotograph, edit.key}));
      if (photo.empty()) {
        nowhere.push_back(edit.name);
        continue;
      }
      for (const auto& [who, label] : pictures(lights_)) {
        const auto errors = values({"relmse", region, who, edit.key});
        const std::vector<double> of_rooms = means(errors);
        std::vector<double> spread;
        for (const std::vector<double>& seeds : errors) spread.push_back(standard_deviation(seeds));
        double closer = 0;
        for (std::size_t i = 0; i < photo.size(); ++i) closer += of_rooms[i] < photo[i];
        table.add({edit.name, label, measure_of(of_rooms), Measure{median(of_rooms)}, Measure{mean(spread)},
                   measure_of(means(values({"psnr", region, who, edit.key}))), Measure{closer},
                   Measure{static_cast<double>(photo.size())},
                   Measure{median(means(values({"seconds", region, who, edit.key})))}});
      }
    }
    if (!nowhere.empty()) table.title += fmt::format("; no view shows a surface for: {}", fmt::join(nowhere, ", "));
    return table;
  }

  void conclude() override {
    const std::string by =
        fmt::format("{} samples a pixel, {} bounces follow the edit, {} seeds", config_.integer("edit.spp"),
                    config_.integer("edit.bounces"), config_.integer("edit.seeds"));
    write_table("edited", table_of("edited", "Edited pixels against the tracer: " + by));
    std::fputs("\n", stdout);
    write_table("others", table_of("others", "All other pixels against the tracer: " + by));
  }

  RenderSettings settings_;
  std::vector<std::string> lights_;
  std::map<std::string, RenderSettings> lit_;  // of the room at hand
};

}  // namespace

const std::vector<EditCase>& edit_cases() {
  static const std::vector<EditCase> cases{
      {"mirror", "floor to a mirror", EditedSurface::Floor, {{{0.9, 0.9, 0.9}}, 0.02, 1.0}},
      {"metal", "wall to glossy metal", EditedSurface::Wall, {{{0.8, 0.6, 0.35}}, 0.25, 1.0}},
      {"rough", "furniture to rough paint", EditedSurface::Furniture, {{{0.15, 0.35, 0.5}}, 0.9, 0.0}}};
  return cases;
}

int material_of_surface(const Room& room, const Camera& camera, const TraceMaps& maps, EditedSurface surface,
                        double least) {
  constexpr double kNear = 0.005;  // metres: rugs and skirtings stand off further
  std::map<int, std::size_t> shown;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * camera.width + x;
      if (maps.triangle[i] < 0 || maps.emitter[i] >= 0) continue;
      const Triangle& t = room.scene.triangles[static_cast<std::size_t>(maps.triangle[i])];
      const Vec3 p = camera.to_world(camera.unproject(x + 0.5, y + 0.5, maps.depth.data[i]));
      const Vec3 n(glm::normalize(glm::cross(t.v[1].position - t.v[0].position, t.v[2].position - t.v[0].position)));
      const bool floor = std::abs(p.y) < kNear && std::abs(n.y) > 0.99;
      const bool border =
          std::abs(std::abs(p.x) - 0.5 * room.size.x) < kNear || std::abs(std::abs(p.z) - 0.5 * room.size.z) < kNear;
      const bool wall = border && std::abs(n.y) < 0.01;
      const bool furniture = !floor && p.y > kNear && p.y < room.size.y - kNear &&
                             std::abs(p.x) < 0.5 * room.size.x - kNear && std::abs(p.z) < 0.5 * room.size.z - kNear;
      if (surface == EditedSurface::Floor ? floor : surface == EditedSurface::Wall ? wall : furniture)
        ++shown[t.material];
    }
  const auto most =
      std::max_element(shown.begin(), shown.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  const double enough = least * camera.width * camera.height;
  return most == shown.end() || static_cast<double>(most->second) < enough ? -1 : most->first;
}

World with_material(const World& world, int material, const MaterialEdit& change) {
  World changed = world;
  Material plain;
  const auto& a = *change.albedo;
  plain.color_a = plain.color_b =
      plain.color_c = {static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
  plain.roughness_a = plain.roughness_b = plain.roughness_c = static_cast<float>(*change.roughness);
  plain.metallic_a = plain.metallic_b = plain.metallic_c = static_cast<float>(*change.metallic);
  plain.uncapped = 1;
  changed.materials.at(static_cast<std::size_t>(material)) = plain;
  return changed;
}

Image mask_of_material(const World& world, const TraceMaps& maps, int material) {
  Image mask(maps.depth.width, maps.depth.height, 1);
  for (std::size_t i = 0; i < mask.pixels(); ++i)
    if (maps.triangle[i] >= 0 && maps.emitter[i] < 0 &&
        world.triangles[static_cast<std::size_t>(maps.triangle[i])].material == material)
      mask.data[i] = 1;
  return mask;
}

void add_edit_keys(Schema& schema) {
  schema.section("edit", "Materials replaced in rooms.")
      .integer("edit.spp", 64, "Samples a pixel", {2, 65536})
      .integer("edit.seeds", 3, "Repetitions with other seeds", {1, 1000})
      .texts("edit.lights", {"image", "panorama", "constant"}, "Who answers, +lamps with lamps fitted")
      .integer("edit.bounces", 2, "Bounces of light that follow the edit", {1, 8});
}

std::string run_edit_study(const Config& config, const std::vector<std::string>& command) {
  return EditStudy(config, command).run();
}

}  // namespace clerestory
