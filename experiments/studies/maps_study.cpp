#include "experiments/studies/maps_study.hpp"

#include <cmath>
#include <cstdio>

#include "experiments/applications/run_folder.hpp"
#include "experiments/evaluation/rivals.hpp"
#include "experiments/evaluation/summary.hpp"
#include "experiments/studies/intervals.hpp"
#include "experiments/studies/room_study.hpp"
#include "experiments/studies/strip.hpp"
#include "experiments/truth/judged_maps.hpp"
#include "experiments/truth/predicted_scene.hpp"
#include "experiments/truth/traced_room.hpp"
#include "host/report/preview.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr int kMostSheets = 8;  // rooms shown

constexpr const char *kOurs = "ours", *kRival = "rival", *kConstant = "constant", *kPicture = "picture";  // who answers

/// Simple methods have their own keys and names (rivals()).
struct Answerer {
  std::string key, label;
};

class MapsStudy : public RoomStudy {
 public:
  using RoomStudy::RoomStudy;

 private:
  void measure() override {
    const fs::path ours = use_maps();
    rival_ = use_rival();
    lacks("InteriorVerse, whose pictures the paper shows");
    measure_rooms([&](const ListedRoom& listed) {
      TracedRoom room = photographed(listed);
      room.scene.photo = camera_picture(room.scene.photo);
      const PreparedView view = prepare_scene(room.scene, room.scene.width(), room.scene.height());
      RoomFindings found;
      std::vector<std::vector<StripPicture>> sheet;
      const auto judge_nets = [&](const Answerer& who, const fs::path& weights) {
        const Scene predicted = predicted_scene(device_, weights, room.scene.photo, room.camera, /*clipped=*/true);
        double scale = 0;
        const MapSet maps = relative_maps(predicted, &scale);
        add(found, who.key, map_errors(maps, view.truth, view.masks));
        sheet.push_back(row(who.label, room.scene.photo, maps, view.truth));
      };
      judge_nets({kOurs, own_label()}, ours);
      if (rival_) judge_nets({kRival, rival_label(*rival_)}, rival_->maps);
      sheet.push_back(row("truth", room.scene.photo, view.truth, view.truth));
      judge_others(found, view);
      if (listed.index < kMostSheets)
        write_sheet(run_.artifact(fmt::format("room{}_photo_albedo_roughness_metallic_normal_depth.png", listed.index)),
                    sheet);
      return found;
    });
  }

  static void add(RoomFindings& found, const std::string& who, const MapErrors& errors) {
    for (int m = 0; m < map_error_count; ++m)
      if (const auto& e = errors[static_cast<std::size_t>(m)])
        found.add(Finding{info(static_cast<MapError>(m)).key, "maps", who}, *e);
  }

  static void judge_others(RoomFindings& found, const PreparedView& view) {
    const RivalErrors simple = rival_errors(view);
    for (int r = 0; r < rival_count; ++r)
      add(found, rivals()[static_cast<std::size_t>(r)].key, simple[static_cast<std::size_t>(r)]);
    const ViewResult trivial = trivial_errors("room", view, nullptr);
    add(found, kPicture, trivial.picture), add(found, kConstant, trivial.constant);
  }

  /// Depth in the colours of the truth's range.
  static std::vector<StripPicture> row(const std::string& label, const Image& photo, const MapSet& maps,
                                       const MapSet& truth) {
    const auto shown = [&](const char* map, Image picture) {
      return StripPicture{label + ": " + map, std::move(picture)};
    };
    return {{"photograph", show_radiance(photo)},
            shown("albedo", show_radiance(maps.albedo)),
            shown("roughness", show_unit(channel(maps.material, 0))),
            shown("metallic", show_unit(channel(maps.material, 1))),
            shown("normals", show_normal(maps.normal)),
            shown("depth", show_depth(maps.depth, depth_range(truth.depth)))};
  }

  std::vector<double> rooms(MapError error, const std::string& who) const {
    std::vector<double> all;
    for (std::size_t r = 0; r < found().rooms(); ++r)
      all.push_back(found().value_or_nan(r, {info(error).key, "maps", who}));
    return all;
  }

  std::string conditions() const {
    return fmt::format(
        "{} rooms of {}, one photograph of {}x{} each, {} samples a pixel, clipped at white and stored in 8 bits; "
        "interval of 95 % by a bootstrap over rooms, ± half of it or from and up to.",
        found().rooms(), rooms_.file.filename().string(), config_.integer("data.width"), config_.integer("data.height"),
        config_.integer("data.spp"));
  }

  void conclude() override {
    std::vector<Answerer> who{{kOurs, own_label()}};
    if (rival_) who.push_back({kRival, rival_label(*rival_)});
    for (const RivalInfo& simple : rivals()) who.push_back({simple.key, simple.name});
    who.push_back({kPicture, "the picture itself"}), who.push_back({kConstant, "oracle: the view's best constant"});

    Table errors, less;
    errors.title = "Maps of unseen rooms";
    errors.note = conditions() +
                  " Less is better. Albedo up to one scale, depth up to one factor; Li et al. 2020 know no metal." +
                  lacking();
    less.title = own_label() + "'s error less the others', room by room";
    less.note = conditions() + " Below 0 ours is better; the verdict is none where the interval holds 0." + lacking();
    errors.columns = {{"maps"}};
    less.columns = {{"map"}, {"less"}};
    add_difference_columns(less, "", "ours is");
    for (int m = 0; m < map_error_count; ++m)
      errors.columns.push_back(
          {info(static_cast<MapError>(m)).name, info(static_cast<MapError>(m)).unit, Best::None, 3});
    for (const Answerer& one : who) {
      std::vector<Cell> cells{one.label};
      for (int m = 0; m < map_error_count; ++m) {
        const auto error = static_cast<MapError>(m);
        cells.push_back(with_interval(rooms(error, one.key)));
        if (one.key == kOurs) continue;
        if (const auto d = roomwise_difference(rooms(error, kOurs), rooms(error, one.key))) {
          std::vector<Cell> row{std::string(info(error).name), one.label};
          add_difference(row, *d);
          less.add(std::move(row));
        }
      }
      errors.add(std::move(cells));
    }
    write_table("1_maps", errors);
    std::fputs("\n", stdout);
    write_table("2_differences", less);
  }

  std::optional<Method> rival_;
};

}  // namespace

std::string run_maps_study(const Config& config, const std::vector<std::string>& command) {
  return MapsStudy(config, command).run();
}

}  // namespace clerestory
