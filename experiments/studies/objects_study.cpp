#include "experiments/studies/objects_study.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "experiments/applications/light_choice.hpp"
#include "experiments/studies/intervals.hpp"
#include "experiments/studies/objects_room.hpp"
#include "experiments/studies/room_study.hpp"
#include "experiments/studies/strip.hpp"
#include "experiments/studies/user_room.hpp"
#include "experiments/truth/study_light.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

constexpr int kMostSheets = 8;             // rooms shown
constexpr double kBlur = 0.5, kNoise = 2;  // gradient energy beyond which reflections are blur, or noise
constexpr double kLeastRatio = 1e-4;       // what a constant's gradient energy counts as at least

constexpr const char *kPsnr = "shown_psnr", *kSmape = "smape", *kGradients = "ln_gradients";  // metrics
constexpr const char* kRival = "rival";  // answers beside the lights that are named

const std::vector<std::string>& shapes() {
  static const std::vector<std::string> all{"ball", "bunny", "suzi"};
  return all;
}

bool is_simple(const ObjectAnswerer& who) { return !is_learned_light(who.render.light); }

class ObjectsStudy : public RoomStudy {
 public:
  using RoomStudy::RoomStudy;

 private:
  void measure() override {
    prepare();
    measure_rooms([this](const ListedRoom& listed) {
      const ObjectsRoom room = measure_objects_room(device_, listed, options_);
      RoomFindings found;
      for (const ObjectError& e : room.errors) {
        found.add({kPsnr, e.shape, e.answerer, e.maps}, e.shown_psnr);
        found.add({kSmape, e.shape, e.answerer, e.maps}, e.smape);
        found.add({kGradients, e.shape, e.answerer, e.maps}, std::log(std::max(e.gradients, kLeastRatio)));
      }
      if (listed.index < kMostSheets && !room.sheet.empty())
        write_sheet(run_.artifact(fmt::format("room{}_photo_truth_then_lights.png", listed.index)), room.sheet);
      return found;
    });
  }

  void prepare() {
    options_.width = config_.whole("data.width"), options_.height = config_.whole("data.height");
    options_.photo_spp = config_.whole("data.spp"), options_.truth_spp = config_.whole("objects.truth_spp");
    options_.baseline = config_.real("objects.baseline"), options_.roughness = config_.real("objects.roughness");
    options_.shapes = config_.texts("objects.shapes");
    for (const std::string& shape : options_.shapes)
      if (std::ranges::find(shapes(), shape) == shapes().end())
        throw usage_error("there is no such object", "objects.shapes", shape,
                          fmt::format("{}", fmt::join(shapes(), ", ")));
    RenderSettings render;
    render.spp = config_.whole("objects.spp");
    const std::filesystem::path maps = use_maps();
    for (const std::string& light : config_.texts("objects.lights")) {
      ObjectAnswerer who{light, light, maps, render};
      who.render.light = study_light(light).light;
      if (is_learned_light(who.render.light)) use_light(who.render);
      options_.answerers.push_back(std::move(who));
    }
    rival_ = use_rival();
    if (rival_) {
      use_light_of(*rival_, render);
      options_.answerers.push_back({kRival, render.light, rival_->maps, render});
    }
    for (const std::string& what : config_.texts("objects.lacking")) lacks(what);
  }

  std::string label(const std::string& answerer) const {
    return answerer == kRival ? rival_label(*rival_) : light_label(answerer, own_label());
  }

  std::vector<double> rooms(const char* metric, const std::string& maps, const std::string& shape,
                            const std::string& light) const {
    std::vector<double> all;
    for (std::size_t r = 0; r < found().rooms(); ++r)
      all.push_back(found().value_or_nan(r, {metric, shape, light, maps}));
    return all;
  }

  std::string conditions() const {
    const double baseline = config_.real("objects.baseline");
    return fmt::format(
        "{} rooms of {}, of which those count that have a place for an object{}; {} of {}x{}, clipped at white and "
        "stored in 8 bits. Metal of albedo 0.9 and roughness {:g}; pixels that an object covers whole; twice {} "
        "samples a pixel, truth by {}. Cameras and where objects stand are known, the scale of depth is not.",
        found().rooms(), rooms_.file.filename().string(),
        baseline > 0 ? fmt::format(" and for a second camera {:g} m beside the first", baseline) : "",
        baseline > 0 ? "photographs of both cameras, each answered from it alone and their mean taken,"
                     : "one photograph",
        config_.integer("data.width"), config_.integer("data.height"), config_.real("objects.roughness"),
        config_.integer("objects.spp"), config_.integer("objects.truth_spp"));
  }

  Table objects_table() const {
    Table table;
    table.title = "Mirror objects put into unseen rooms";
    table.note = conditions() +
                 " ±: half the interval of 95 % by a bootstrap over rooms. Gradient energy: of log radiance, over the "
                 "truth's, geometric mean and that interval; 1 is right, below 0.5 is blur." +
                 lacking();
    table.columns = {{"maps"},
                     {"object"},
                     {"light"},
                     {"PSNR as shown", "dB"},
                     {"SMAPE", "eps 0.01"},
                     {"gradient energy", "times the truth's", Best::None, 2},
                     {"from", "95 %", Best::None, 2},
                     {"up to", "95 %", Best::None, 2},
                     {"rooms"}};
    for (const std::string& maps : {kPredictedMaps, kTrueMaps})
      for (const std::string& shape : options_.shapes)
        for (const ObjectAnswerer& who : options_.answerers) {
          const std::string& light = who.name;
          const std::vector<double> energy = rooms(kGradients, maps, shape, light);
          std::vector<double> there;
          std::ranges::copy_if(energy, std::back_inserter(there), [](double v) { return std::isfinite(v); });
          if (there.empty()) continue;
          const std::optional<Difference> interval = interval_over(energy);
          table.add({maps, shape, label(light), with_interval(rooms(kPsnr, maps, shape, light)),
                     with_interval(rooms(kSmape, maps, shape, light)), Measure{std::exp(mean(there))},
                     interval ? Cell(Measure{std::exp(interval->low)}) : Cell(),
                     interval ? Cell(Measure{std::exp(interval->high)}) : Cell(),
                     Measure{static_cast<double>(there.size())}});
        }
    return table;
  }

  /// The simple answer of the highest PSNR, or nothing.
  std::optional<std::string> best_simple(const std::string& maps, const std::string& shape) const {
    std::optional<std::string> best;
    double highest = 0;
    for (const ObjectAnswerer& who : options_.answerers) {
      if (!is_simple(who)) continue;
      const Cell cell = with_interval(rooms(kPsnr, maps, shape, who.name));
      const auto* psnr = std::get_if<Measure>(&cell);
      if (psnr && (!best || psnr->mean > highest)) best = who.name, highest = psnr->mean;
    }
    return best;
  }

  /// Every learned light against the better of the simple ones.
  Table bar_table() const {
    Table table;
    table.title = "Learned light and the better of the simple answers, room by room";
    table.note = fmt::format(
                     "The bar: PSNR above that of the better simple answer, the interval clear of 0, and gradient "
                     "energy {:g} to {:g} times the truth's. ",
                     kBlur, kNoise) +
                 conditions() + lacking();
    table.columns = {{"maps"}, {"object"}, {"light"}, {"less"}};
    add_difference_columns(table, "dB, PSNR as shown", "it is");
    table.columns.push_back({"gradient energy", "times the truth's", Best::None, 2});
    table.columns.push_back({"the bar"});
    for (const std::string& maps : {kPredictedMaps, kTrueMaps})
      for (const std::string& shape : options_.shapes) {
        const std::optional<std::string> simple = best_simple(maps, shape);
        for (const ObjectAnswerer& who : options_.answerers) {
          if (!simple || is_simple(who)) continue;
          const std::string& light = who.name;
          const auto d = roomwise_difference(rooms(kPsnr, maps, shape, light), rooms(kPsnr, maps, shape, *simple));
          std::vector<double> logs = rooms(kGradients, maps, shape, light);
          std::erase_if(logs, [](double v) { return !std::isfinite(v); });
          if (!d || logs.empty()) continue;
          const double energy = std::exp(mean(logs));
          const bool reached = d->verdict == "higher" && energy >= kBlur && energy <= kNoise;
          std::vector<Cell> row{maps, shape, label(light), label(*simple)};
          add_difference(row, *d);
          row.insert(row.end(), {Measure{energy}, reached ? "reached" : "missed"});
          table.add(std::move(row));
        }
      }
    return table;
  }

  void conclude() override {
    write_table("1_objects", objects_table());
    std::fputs("\n", stdout);
    write_table("2_bar", bar_table());
  }

  ObjectsOptions options_;
  std::optional<Method> rival_;
};

}  // namespace

void add_objects_keys(Schema& schema) {
  schema.section("objects", "Mirror objects in rooms.")
      .integer("objects.spp", 64, "Samples a pixel of each of two estimates of an answer", {2, 65536})
      .integer("objects.truth_spp", 1024, "Samples a pixel of the tracer's pictures that judge", {4, 65536})
      .texts("objects.shapes", {"ball", "bunny"}, "ball, or a model of assets/models")
      .real("objects.roughness", 0.02, "Of the metal they are made of", {0, 1})
      .real("objects.baseline", 0, "Metres to a second camera that takes a photograph of its own; 0: none", {0, 1})
      .texts("objects.lights", {"net+lamps", "net", "image", "mirrored+fit", "constant"},
             "Who answers, beside study.rival")
      .texts("objects.lacking", {}, "Rivals and data that a comparison would need and that are not here");
}

std::string run_objects_study(const Config& config, const std::vector<std::string>& command) {
  return ObjectsStudy(config, command).run();
}

}  // namespace clerestory
