#include "experiments/studies/leave_out_study.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/studies/room_study.hpp"
#include "experiments/truth/predicted_scene.hpp"
#include "experiments/truth/study_light.hpp"
#include "experiments/truth/traced_room.hpp"
#include "host/math/radiance.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"
#include "nets/scene_traits.hpp"

namespace clerestory {
namespace {

enum Stream : std::uint64_t { kSeeds = 4 };

/// What becomes of a room: its maps, and who lights it.
struct SceneKind {
  const char *name, *light;
  void (*change)(Scene& scene);
  bool predicted = false;
};

void set_material(Scene& scene, int channel, float value) {
  std::fill_n(scene.material.plane(channel), scene.material.pixels(), value);
}

/// The camera in the middle of an empty box of 4 x 3 x 8 metres.
void make_box(Scene& scene) {
  const Vec3 half{2, 1.5, 4};
  for (int y = 0; y < scene.height(); ++y)
    for (int x = 0; x < scene.width(); ++x) {
      const Vec3 ray = scene.camera.ray(x + 0.5, y + 0.5);
      int wall = 0;
      for (int c = 1; c < 3; ++c)
        if (half[c] / std::abs(ray[c]) < half[wall] / std::abs(ray[wall])) wall = c;
      scene.depth.at(0, y, x) = static_cast<float>(half[wall] / std::abs(ray[wall]));
      for (int c = 0; c < 3; ++c) scene.normal.at(c, y, x) = c != wall ? 0.0f : ray[wall] > 0 ? -1.0f : 1.0f;
    }
}

const std::vector<SceneKind>& scene_kinds() {
  static const std::vector<SceneKind> kinds{
      {"predicted maps", "net+lamps", [](Scene&) {}, true},
      {"true maps", "net+lamps", [](Scene&) {}},
      {"no metals", "net+lamps", [](Scene& s) { set_material(s, 1, 0); }},
      {"all mirrors", "net+lamps", [](Scene& s) { set_material(s, 0, 0), set_material(s, 1, 1); }},
      {"matt", "net+lamps", [](Scene& s) { set_material(s, 0, 1), set_material(s, 1, 0); }},
      {"one material", "net+lamps",
       [](Scene& s) {
         std::ranges::fill(s.albedo.data, 0.5f);
         set_material(s, 0, 0.5f), set_material(s, 1, 0);
       }},
      {"empty box", "net+lamps", make_box},
      {"no lamps", "net", [](Scene&) {}},
      {"photograph as light", "image", [](Scene&) {}},
      {"constant light", "constant", [](Scene&) {}}};
  return kinds;
}

constexpr const char* kAll = "all left out";
constexpr const char* kNone = "everything";

/// Root relMSE of a picture beside another over the pixels that have a depth.
double apart(const Image& picture, const Image& whole, const Scene& scene) {
  const std::vector<bool> used = pixels_with_depth(scene);
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < picture.data.size(); ++i)
    if (used[i % used.size()]) sum += relative_square(picture.data[i], whole.data[i]), ++count;
  return count > 0 ? std::sqrt(sum / count) : 0;
}

class LeaveOutStudy : public RoomStudy {
 public:
  using RoomStudy::RoomStudy;

 private:
  void measure() override {
    if (config_.integer("data.rooms") > static_cast<std::int64_t>(scene_kinds().size()))
      throw usage_error("more rooms than kinds of scenes", "data.rooms", std::to_string(config_.integer("data.rooms")),
                        fmt::format("at most {}", scene_kinds().size()));
    settings_.light = "net";
    use_light(settings_);
    maps_ = use_maps();
    measure_rooms([this](const ListedRoom& listed) { return run_scene(listed, kind_at(listed.index)); });
  }

  static const SceneKind& kind_at(std::int64_t index) { return scene_kinds()[static_cast<std::size_t>(index)]; }

  RoomFindings run_scene(const ListedRoom& listed, const SceneKind& kind) {
    const Random random(listed.seed);
    TracedRoom room = photographed(listed);
    Scene scene = kind.predicted ? predicted_scene(device_, maps_, room.scene.photo, room.camera, false) : room.scene;
    kind.change(scene);
    RenderSettings settings = under_light(settings_, kind.light, device_, scene);
    settings.spp = config_.whole("leave_out.spp");

    RoomFindings found;
    const SceneTraits traits = traits_of(scene, settings);
    const auto note = [&](const char* metric, const std::string& who, double value, std::int64_t item = 0) {
      found.add(Finding{metric, "render", who, kind.name}.of(item), value);
    };
    note("metals", kAll, traits.metals), note("lamps", kAll, static_cast<double>(traits.lamps));
    note("least roughness", kAll, traits.least_roughness), note("most roughness", kAll, traits.most_roughness);
    settings.seed = random.seed(kSeeds);
    const Rendering first = render_scene(device_, scene, settings);  // kernels are built
    note("hits", kAll, traits.traces ? first.hits / std::max(first.rays, 1.0) : std::nan(""));

    std::vector<std::pair<std::string, RenderSettings>> variants{{kAll, settings}, {kNone, settings}};
    variants[1].second.leave_out.clear();
    for (const Saved& saved : saved_in(traits, settings, first)) {
      variants.emplace_back(kind_of(saved.saving).name, settings);
      variants.back().second.leave_out.erase(saved.saving);
    }
    for (auto& [who, variant] : variants) render_scene(device_, scene, variant);
    for (std::int64_t s = 0; s < config_.integer("study.seeds"); ++s) {
      stop_if_interrupted("study");
      Image all;
      for (auto& [who, variant] : variants) {
        variant.seed = random.seed(kSeeds + static_cast<std::uint64_t>(s));
        const Rendering r = render_scene(device_, scene, variant);
        note("seconds", who, r.seconds, s);
        if (who == kAll) all = r.radiance;
        note("error", who, apart(all, r.radiance, scene), s);
        note("same bits", who, all.data == r.radiance.data ? 1 : 0, s);
      }
    }
    return found;
  }

  std::vector<double> seeds_of(const char* metric, const std::string& who, const char* scene) const {
    const auto rooms = found().present_by_seed({metric, "render", who, scene}, config_.integer("study.seeds"));
    return rooms.empty() ? std::vector<double>{} : rooms[0];
  }
  Cell cell(const char* metric, const char* scene, double factor = 1) const {
    std::vector<double> v = seeds_of(metric, kAll, scene);
    if (v.empty() || !std::isfinite(v[0])) return {};
    return Measure{factor * v[0]};
  }

  std::size_t scenes() const { return found().rooms(); }

  Table scenes_table() const {
    Table table;
    table.title = "A re-render with all left out that its scene does not need";
    table.note = fmt::format(
        "{} scenes of {}, {}x{}, {} samples a pixel: mean of {} seeds, kernels built before. Error: root relMSE (eps "
        "0.01) between the two pictures at equal seeds",
        scenes(), rooms_.file.filename().string(), config_.integer("data.width"), config_.integer("data.height"),
        config_.integer("leave_out.spp"), config_.integer("study.seeds"));
    table.columns = {
        {"scene"}, {"metal", "%"},      {"least roughness"}, {"most"},   {"rays that hit", "%"},
        {"lamps"}, {"everything", "s"}, {"left out", "s"},   {"factor"}, {"error", "root relMSE", Best::None, 2}};
    for (std::size_t i = 0; i < scenes(); ++i) {
      const char* name = scene_kinds()[i].name;
      const std::vector<double> whole = seeds_of("seconds", kNone, name), less = seeds_of("seconds", kAll, name);
      table.add({std::string(name), cell("metals", name, 100), cell("least roughness", name),
                 cell("most roughness", name), cell("hits", name, 100), cell("lamps", name), measure_of(whole),
                 measure_of(less), Measure{mean(whole) / mean(less)}, measure_of(seeds_of("error", kNone, name))});
    }
    return table;
  }

  Table savings_table() const {
    Table table;
    table.title = "What each of these saves";
    table.note =
        "Seconds of the re-render with this alone not left out, less those with all left out: mean over seeds, ± their "
        "spread. Error as above. What a scene gives no reason to leave out is not shown";
    table.columns = {{"scene", ""},
                     {"left out", ""},
                     {"saved", "s"},
                     {"of the re-render", "%"},
                     {"error", "root relMSE", Best::None, 2},
                     {"bits", ""}};
    for (std::size_t i = 0; i < scenes(); ++i)
      for (const SavingKind& kind : kSavings) {
        const char* name = scene_kinds()[i].name;
        const std::vector<double> with = seeds_of("seconds", kind.name, name), less = seeds_of("seconds", kAll, name);
        if (with.empty()) continue;
        std::vector<double> saved;
        for (std::size_t s = 0; s < with.size(); ++s) saved.push_back(with[s] - less[s]);
        const bool same = std::ranges::min(seeds_of("same bits", kind.name, name)) == 1;
        table.add({std::string(name), std::string(kind.name), measure_of(saved),
                   Measure{100 * mean(saved) / mean(with)}, measure_of(seeds_of("error", kind.name, name)),
                   std::string(same ? "the same" : "others")});
      }
    return table;
  }

  void conclude() override { write_table("leave_out", scenes_table()), write_table("savings", savings_table()); }

  RenderSettings settings_;
  std::filesystem::path maps_;
};

}  // namespace

void add_leave_out_keys(Schema& schema) {
  schema.section("leave_out", "What a re-render leaves out, in a scene of another kind for each room.")
      .integer("leave_out.spp", 64, "Samples a pixel", {16, 65536});
}

std::string run_leave_out_study(const Config& config, const std::vector<std::string>& command) {
  return LeaveOutStudy(config, command).run();
}

}  // namespace clerestory
