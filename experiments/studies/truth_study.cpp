#include "experiments/studies/truth_study.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "experiments/evaluation/picture_error.hpp"
#include "experiments/studies/room_study.hpp"
#include "experiments/studies/strip.hpp"
#include "experiments/truth/traced_room.hpp"
#include "experiments/truth/truth_light.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

std::vector<double> values_of(const Image& image) { return {image.data.begin(), image.data.end()}; }

void subtract(std::vector<double>& from, const std::vector<float>& what) {
  for (std::size_t i = 0; i < from.size(); ++i) from[i] -= what[i];
}

/// What is summed over batches for the picture with emitters.
struct Stated {
  std::vector<double> mean, variance;

  explicit Stated(std::size_t values) : mean(values, 0), variance(values, 0) {}
  /// One of n batches with the variance of its mean.
  template <class Values, class Variance>
  void add(const Values& values, Variance variance_of, double n) {
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += values[i] / n, variance[i] += variance_of(i) / (n * n);
  }
  Image picture(const Scene& scene) const {
    Image image(scene.width(), scene.height(), 3);
    std::transform(mean.begin(), mean.end(), image.data.begin(), [](double v) { return static_cast<float>(v); });
    return image;
  }
};

struct LightRow {
  std::string key, label;
};
const std::vector<LightRow>& light_rows() {
  static const std::vector<LightRow> rows{{"truth", "truth (the tracer)"},
                                          {"image", "image"},
                                          {"panorama", "panorama"},
                                          {"constant", "constant, mean of the photograph"},
                                          {"best", "constant, the view's best"}};
  return rows;
}

class TruthStudy : public RoomStudy {
 public:
  using RoomStudy::RoomStudy;

 private:
  void measure() override {
    measure_rooms([this](const ListedRoom& listed) { return run_room(listed); });
  }

  RoomFindings run_room(const ListedRoom& listed) {
    TracedRoom room = traced_room(listed);
    const TruthOptions options{config_.whole("truth.batches"), config_.whole("truth.layer_spp"),
                               config_.whole("truth.picture_spp"), config_.real("truth.level"), listed.seed};
    TruthComparison compared = compare_with_tracer(device_, room.traced, room.scene, options);
    RoomFindings found;
    found.add({"stated", "whole"}, compared.whole_by_stated), found.add({"dropped"}, compared.dropped);
    for (const auto& [region, a] : {std::pair{"reflected", compared.reflected}, {"whole", compared.whole}})
      for (const auto& [metric, value] : {std::pair{"pixels", a.pixels},
                                          {"values", a.values},
                                          {"within", a.within},
                                          {"difference", a.difference},
                                          {"error", a.error}})
        found.add({metric, region}, value);
    compare_lights(listed, room, compared, found);
    return found;
  }

  /// From here on pictures have the exposure of generated views: the 95th percentile of luminance is 0.9.
  void compare_lights(const ListedRoom& listed, TracedRoom& room, TruthComparison& compared, RoomFindings& found) {
    const auto exposure = static_cast<float>(exposure_of(compared.tracer.data));
    const auto exposed = [exposure](const Image& image) { return scaled(image, exposure); };
    Scene& scene = room.scene;
    const Image truth = exposed(compared.tracer);
    scene.photo = truth;
    RenderSettings settings;
    settings.spp = config_.whole("truth.light_spp"), settings.seed = Random(listed.seed).seed(kPhotographSeed);
    settings.thickness = config_.real("study.thickness");

    // Emitting pixels are shown as they are in every picture.
    const auto shown = [&](Image picture) {
      for (std::size_t i = 0; i < picture.data.size(); ++i)
        if (!compared.used[i % picture.pixels()]) picture.data[i] = truth.data[i];
      return picture;
    };
    std::vector<StripPicture> strip{{"tracer", truth}, {"layer under true light", shown(exposed(compared.layer))}};
    const auto note = [&](const std::string& light, const RadianceError& e, double seconds) {
      for (const auto& [metric, value] : {std::pair{"relmse", e.relmse}, {"psnr", e.psnr}, {"seconds", seconds}})
        found.add({metric, "picture", light}, value);
    };
    const TruthRendering traced = render_truth(device_, room.traced, scene, settings);
    Image picture(scene.width(), scene.height(), 3);
    picture.data = traced.whole.radiance.floats();
    note("truth", picture_error(exposed(picture), truth, compared.used), traced.seconds);
    for (const char* light : {"image", "panorama", "constant"}) {
      settings.light = light;
      render_scene(device_, scene, settings);  // kernels are built
      const Rendering rendered = render_scene(device_, scene, settings);
      note(light, picture_error(rendered.radiance, truth, compared.used), rendered.seconds);
      strip.push_back({light, shown(rendered.radiance)});
      if (settings.light == "constant")
        note("best", best_scaled_error(rendered.radiance, truth, compared.used), rendered.seconds);
    }
    write_strip(run_.artifact(fmt::format("room{}_tracer_truth_image_panorama_constant.png", listed.index)), strip);
  }

  double value(std::size_t room, const Finding& finding) const {
    if (const std::optional<double> value = found().value(room, finding)) return *value;
    throw Error(ErrorKind::Failed, "a record lacks a value", run_.metrics_path().string(), text_of(finding));
  }
  Agreement agreement_of(std::size_t room, const char* region) const {
    return {value(room, {"pixels", region}), value(room, {"values", region}), value(room, {"within", region}),
            value(room, {"difference", region}), value(room, {"error", region})};
  }

  /// The table of agreement, and in the provenance what it says.
  Table agreement_table() {
    const double level = config_.real("truth.level");
    const int batches = config_.whole("truth.batches");
    Table table;
    table.title = "light = truth against the tracer";
    table.note = fmt::format(
        "Emitters left out, {:.2f} % of values are expected within the limits. With them fewer are: a lamp that few "
        "samples find makes errors lean to one side, which the limits, of errors that do not, know nothing of.",
        100 * level);
    table.columns = {{"room"},
                     {"pixels", "", Best::None, 6},
                     {"emitters left out: within", "%", Best::None, 4},
                     {"difference", "%, standard error"},
                     {"z"},
                     {"with emitters: within", "%", Best::None, 4},
                     {"by stated errors", "%", Best::None, 4},
                     {"difference", "%, standard error"},
                     {"z"}};
    const auto add = [&](const std::string& name, const Agreement& a, const Agreement& b, double stated) {
      table.add({name, Measure{a.pixels}, Measure{100 * a.share()}, Measure{100 * a.difference, 100 * a.error, batches},
                 Measure{a.z()}, Measure{100 * b.share()}, Measure{100 * stated},
                 Measure{100 * b.difference, 100 * b.error, batches}, Measure{b.z()}});
    };
    std::vector<Agreement> reflected, whole;
    std::vector<double> stated;
    for (std::size_t r = 0; r < found().rooms(); ++r) {
      reflected.push_back(agreement_of(r, "reflected")), whole.push_back(agreement_of(r, "whole"));
      stated.push_back(value(r, {"stated", "whole"}));
      add(fmt::format("{}", r), reflected.back(), whole.back(), stated.back());
    }
    const Agreement all = together(reflected);
    add("all", all, together(whole), mean(stated));
    const double least = least_share(all, level);
    provenance_.facts["light = truth, emitters left out"] = fmt::format(
        "{:.3f} % of {:.0f} values within the limits; chance leaves {:.3f} % and hardly less than {:.3f} %: {}",
        100 * all.share(), all.values, 100 * level, 100 * least, all.share() >= least ? "equal" : "not equal");
    return table;
  }

  Table light_table() const {
    Table table;
    table.title =
        fmt::format("Lights, {} samples a pixel: mean and deviation over rooms", config_.integer("truth.light_spp"));
    table.columns = {
        {"light"}, {"relMSE", "eps 0.01"}, {"PSNR", "dB, linear, clipped at 1", Best::None, 4}, {"time", "s a view"}};
    for (const LightRow& row : light_rows()) {
      std::vector<double> of[3];
      for (std::size_t r = 0; r < found().rooms(); ++r) {
        of[0].push_back(value(r, {"relmse", "picture", row.key})),
            of[1].push_back(value(r, {"psnr", "picture", row.key}));
        of[2].push_back(value(r, {"seconds", "picture", row.key}));
      }
      table.add({row.label, measure_of(of[0]), measure_of(of[1]), measure_of(of[2])});
    }
    return table;
  }

  void conclude() override {
    const Table agreements = agreement_table(), lights = light_table();
    write_table("agreement", agreements);
    std::fputs("\n", stdout);
    write_table("lights", lights);
    double dropped = 0;
    for (std::size_t r = 0; r < found().rooms(); ++r) dropped += value(r, {"dropped"});
    provenance_.figures["samples dropped as not finite"] = dropped;
  }
};

}  // namespace

TruthComparison compare_with_tracer(Device& device, TraceScene& traced, const Scene& scene,
                                    const TruthOptions& options) {
  const std::size_t pixels = scene.albedo.pixels();
  const auto n = static_cast<double>(options.batches);
  Batches our_reflected, our_whole, their_reflected, their_whole;
  Stated ours(3 * pixels), theirs(3 * pixels);
  TruthComparison result;
  RenderSettings settings;
  settings.spp = options.layer_spp;
  settings.points = "independent";  // the standard error of Sobol's points is stated too large
  for (int k = 0; k < options.batches; ++k) {
    stop_if_interrupted("study");
    settings.seed = Random(options.seed).seed(10 + 2 * static_cast<std::uint64_t>(k));
    const TruthRendering layer = render_truth(device, traced, scene, settings);
    ours.add(
        layer.whole.radiance.real, [&](std::size_t i) { return std::pow(layer.whole.standard_error.real[i], 2); }, n);
    our_reflected.push_back(layer.reflected.radiance.real), our_whole.push_back(layer.whole.radiance.real);

    const std::uint32_t seed = Random(options.seed).seed(11 + 2 * static_cast<std::uint64_t>(k));
    const TracePicture all = traced.picture(scene.camera, options.picture_spp, seed);
    const TracePicture direct = traced.picture(scene.camera, options.picture_spp, seed, 1);
    theirs.add(
        all.mean.data, [&](std::size_t i) { return static_cast<double>(all.variance.data[i]); }, n);
    their_whole.push_back(values_of(all.mean));
    their_reflected.push_back(their_whole.back());
    subtract(their_reflected.back(), direct.mean.data);

    result.dropped += layer.dropped + static_cast<double>(all.dropped.count + direct.dropped.count) +
                      render_counts(layer.whole.status, layer.whole.tally).dropped;
    if (k > 0) continue;
    for (std::size_t i = 0; i < pixels; ++i)
      result.used.push_back(layer.whole.status.real[i] == 0 && scene.material.data[2 * pixels + i] == 0);
  }
  result.reflected = agreement(our_reflected, their_reflected, result.used, options.level);
  result.whole = agreement(our_whole, their_whole, result.used, options.level);
  result.whole_by_stated =
      share_by_stated(ours.mean, ours.variance, theirs.mean, theirs.variance, result.used, options.level);
  result.layer = ours.picture(scene), result.tracer = theirs.picture(scene);
  return result;
}

void add_truth_keys(Schema& schema) {
  schema.section("truth", "The layer under true light against the tracer.")
      .integer("truth.batches", 16, "Independent estimates of each picture", {2, 1000})
      .integer("truth.layer_spp", 512, "Samples a pixel of one of the layer's", {2, 65536})
      .integer("truth.picture_spp", 1024, "Samples a pixel of one of the tracer's", {1, 65536})
      .real("truth.level", 0.9975, "Share of values that chance leaves inside the limits", {0.5, 0.9999})
      .integer("truth.light_spp", 64, "Samples a pixel in the comparison of lights", {2, 65536});
}

std::string run_truth_study(const Config& config, const std::vector<std::string>& command) {
  return TruthStudy(config, command).run();
}

}  // namespace clerestory
