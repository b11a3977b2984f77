#include "experiments/studies/edge_study.hpp"

#include "experiments/applications/predict.hpp"
#include "experiments/evaluation/edge_band.hpp"
#include "experiments/studies/room_study.hpp"
#include "experiments/studies/strip.hpp"
#include "experiments/truth/judged_maps.hpp"
#include "experiments/truth/predicted_scene.hpp"
#include "experiments/truth/traced_room.hpp"
#include "host/report/preview.hpp"

namespace clerestory {
namespace {

constexpr int kMostStrips = 4;  // rooms shown

struct Answer {
  const char *key, *label;
};
constexpr Answer kOurs{"ours", "predicted"}, kJoint{"joint", "true small maps, joint bilateral"},
    kNearest{"nearest", "true small maps, nearest pixel"};
constexpr const char *kBand = "band", *kRest = "rest";
const Finding kShareOfPixels{"share"};

Finding finding(MapError error, const char* region, const Answer& answer) {
  return {info(error).key, region, answer.key};
}

class EdgeStudy : public RoomStudy {
 public:
  using RoomStudy::RoomStudy;

 private:
  void measure() override {
    const std::filesystem::path weights = use_maps();
    measure_rooms([&](const ListedRoom& listed) {
      TracedRoom room = photographed(listed);
      room.scene.photo = camera_picture(room.scene.photo);
      const PreparedView view = prepare_scene(room.scene, room.scene.width(), room.scene.height());
      const Scene predicted = predicted_scene(device_, weights, room.scene.photo, room.camera, /*clipped=*/true);
      const MapMasks band = edge_bands(view.truth, view.masks, config_.whole("edges.reach")),
                     rest = without(view.masks, band);
      RoomFindings found;
      const auto judge = [&](const Answer& answer, const MapSet& maps) {
        add(found, kBand, answer, map_errors(maps, view.truth, band));
        add(found, kRest, answer, map_errors(maps, view.truth, rest));
      };
      double scale = 0;
      judge(kOurs, relative_maps(predicted, &scale));
      const int width = config_.whole("edges.small_width"), height = width * room.camera.height / room.camera.width;
      const PreparedView small = prepare_scene(room.scene, width, height);
      judge(kJoint, joint_maps(small, view)), judge(kNearest, nearest_maps(small.truth, view));
      found.add(kShareOfPixels, share(band.albedo, view.masks.albedo));
      if (listed.index < kMostStrips) show(listed.index, room.scene.photo, predicted, view, band);
      return found;
    });
  }

  static void add(RoomFindings& found, const char* region, const Answer& answer, const MapErrors& errors) {
    for (int m = 0; m < map_error_count; ++m)
      if (const auto& e = errors[static_cast<std::size_t>(m)])
        found.add(finding(static_cast<MapError>(m), region, answer), *e);
  }

  MapSet joint_maps(const PreparedView& small, const PreparedView& view) {
    const auto large = [&](const Image& map, const Image& mask, const JointBilateral& by = {}) {
      return enlarged(device_, map, mask, small.image, view.image, by);
    };
    const MapSet& truth = small.truth;
    return {large(truth.albedo, small.masks.albedo), large(truth.normal, small.masks.geometry, enlarges_normals),
            large(truth.depth, small.masks.geometry), large(truth.material, small.masks.material)};
  }

  static MapSet nearest_maps(const MapSet& small, const PreparedView& view) {
    const auto large = [&](const Image& map) { return resize_nearest(map, view.image.width, view.image.height); };
    return {large(small.albedo), large(small.normal), large(small.depth), large(small.material)};
  }

  static double share(const Image& band, const Image& mask) {
    double in = 0, all = 0;
    for (std::size_t i = 0; i < mask.data.size(); ++i) in += band.data[i] > 0.5f, all += mask.data[i] > 0.5f;
    return all > 0 ? in / all : 0;
  }

  void show(std::int64_t index, const Image& photo, const Scene& predicted, const PreparedView& view,
            const MapMasks& band) {
    Image marked = view.truth.albedo;
    for (std::size_t i = 0; i < marked.pixels(); ++i)
      if (band.albedo.data[i] > 0.5f) marked.plane(0)[i] = 1;
    write_strip(run_.artifact(fmt::format("room{}_photo_albedo_truth_band.png", index)),
                {{"photograph", photo},
                 {"predicted albedo", predicted.albedo},
                 {"true albedo", view.truth.albedo},
                 {"band along its edges", marked}});
  }

  Measure over_rooms(const Finding& finding) const { return measure_of(found().values(finding)); }

  void conclude() override {
    Table table;
    table.title = "Maps along their edges";
    table.note = fmt::format(
        "{} rooms of {}, photographs of {}x{}, clipped at white, {} samples a pixel; mean over rooms ± deviation. "
        "Band: "
        "at most {} pixels from where the true map steps (docs/results.md), {:.0f} % of pixels for albedo. True small "
        "maps are {} pixels wide and are as good as any net of that size can answer. Rest: predicted, away from edges.",
        found().rooms(), rooms_.file.filename().string(), config_.whole("data.width"), config_.whole("data.height"),
        config_.whole("data.spp"), config_.whole("edges.reach"), 100 * over_rooms(kShareOfPixels).mean,
        config_.whole("edges.small_width"));
    table.columns = {{"map"}, {kOurs.label}, {kJoint.label}, {kNearest.label}, {"predicted over joint"}, {"rest"}};
    for (int m = 0; m < map_error_count; ++m) {
      const auto error = static_cast<MapError>(m);
      const Measure ours = over_rooms(finding(error, kBand, kOurs)), joint = over_rooms(finding(error, kBand, kJoint));
      table.add({fmt::format("{}, {}", info(error).name, info(error).unit), ours, joint,
                 over_rooms(finding(error, kBand, kNearest)), Measure{ours.mean / joint.mean},
                 over_rooms(finding(error, kRest, kOurs))});
    }
    write_table("edges", table);
  }
};

}  // namespace

void add_edge_keys(Schema& schema) {
  schema.section("edges", "Errors along the edges of maps.")
      .integer("edges.reach", 3, "Pixels to each side of an edge", {1, 100})
      .integer("edges.small_width", 160, "Pixels of the true maps that are brought back to the photograph's size",
               {16, 4096});
}

std::string run_edge_study(const Config& config, const std::vector<std::string>& command) {
  return EdgeStudy(config, command).run();
}

}  // namespace clerestory
