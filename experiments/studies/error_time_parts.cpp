#include "experiments/studies/error_time_parts.hpp"

#include <algorithm>
#include <functional>
#include <set>

#include "experiments/applications/light_choice.hpp"
#include "host/error.hpp"
#include "host/math/radiance.hpp"

namespace clerestory {
namespace {

constexpr std::int64_t kTruthFactor = 16;

/// Samples of the rows and of the truth, by the part's keys.
void read_samples(const Config& config, ErrorTimePart& part) {
  const std::string spp = part.name + ".spp", truth = part.name + ".truth_spp";
  part.spp = config.integers(spp), part.truth_spp = config.whole(truth);
  if (part.spp.empty() || std::ranges::adjacent_find(part.spp, std::greater_equal<>()) != part.spp.end())
    throw usage_error("not a list of samples", config.where(spp), fmt::format("[{}]", fmt::join(part.spp, ", ")),
                      "rising numbers");
  if (const std::int64_t least = kTruthFactor * part.spp.back(); part.truth_spp < least)
    throw usage_error("too few samples for a truth", config.where(truth), fmt::format("{}", part.truth_spp),
                      fmt::format("at least {}, {} times the most of {}", least, kTruthFactor, spp));
  if (part.truth_spp % part.truth_runs != 0)
    throw usage_error("these samples are not those of equal runs", config.where(truth),
                      fmt::format("{}", part.truth_spp), fmt::format("a multiple of {}", part.truth_runs));
}

/// By Sobol's points, whose noise is least: runs by other seeds are scrambled independently, of each other and of all
/// rows. Rows of independent points judge them in turn.
TimedEstimator truth_under(const std::string& light, LayerResult result) {
  TimedEstimator truth{"truth", {}, result};
  truth.settings.light = light;
  return truth;
}

ErrorTimePart pictures(const Config& config) {
  ErrorTimePart part{.name = "pictures", .title = "Pictures under the photograph as light", .light = "image"};
  part.note = "every sampler with all points";
  part.what = {"picture"}, part.floor = kLightFloor, part.truth = truth_under("image", LayerResult::Picture);
  for (const std::string& points : config.texts("pictures.points"))
    for (const std::string& sampler : config.texts("pictures.samplers")) {
      TimedEstimator estimator{sampler + ", " + points, {}};
      estimator.settings.sampler = sampler, estimator.settings.points = points;
      part.estimators.push_back(estimator);
    }
  return part;
}

ErrorTimePart gradients(const Config& config) {
  ErrorTimePart part{.name = "gradients", .title = "Gradients under the photograph as light", .light = "image"};
  part.note =
      "of the mean of (I - P)^2 / (P^2 + 0.01), I the re-render and P the photograph; one draw: dL/dI and dI of the "
      "same samples, two draws: of independent ones; sampler vndf_caps unless another is named";
  part.what = {"albedo", "roughness", "metallic", "normal", "radiance"};
  part.truth = truth_under("image", LayerResult::TwoDraws);
  for (const std::string& draws : config.texts("gradients.draws"))
    for (const std::string& sampler : config.texts("gradients.samplers"))
      for (const std::string& points : config.texts("gradients.points")) {
        TimedEstimator estimator{fmt::format("{} draw{}, {}", draws, draws == "one" ? "" : "s", points), {}};
        if (sampler != RenderSettings{}.sampler) estimator.name += ", " + sampler;
        estimator.settings.points = points, estimator.settings.sampler = sampler;
        estimator.result = draws == "one" ? LayerResult::OneDraw : LayerResult::TwoDraws;
        part.estimators.push_back(estimator);
        const int batches = config.whole("gradients.batches");
        if (batches == 1 || draws == "one") continue;
        estimator.name += fmt::format(", {} batches", batches), estimator.batches = batches;
        part.estimators.push_back(estimator);
      }
  return part;
}

ErrorTimePart learned(const Config& config) {
  ErrorTimePart part{.name = "learned", .title = "Pictures under learned light", .light = "net"};
  part.note =
      "each ray asks the nets by itself, and with one switch another; what the layer does not have has no row: "
      "specialised programs, samples by pixel; nor have MLPs of other widths, of which no weights are shipped";
  part.what = {"picture"}, part.floor = kLightFloor, part.truth = truth_under("net", LayerResult::Picture);
  for (const std::string& choice : config.texts("learned.switches")) {
    TimedEstimator estimator{choice, {}};
    estimator.settings.light = "net";
    if (choice == "shared") estimator.settings.sharing = Sharing::Always;
    if (choice == "dda") estimator.settings.ssrt = choice;
    if (choice == "independent") estimator.settings.points = choice;
    if (choice == "vndf_hemisphere" || choice == "guided") estimator.settings.sampler = choice;
    part.estimators.push_back(estimator);
  }
  return part;
}

/// What `clerestory invert` does by itself under a light.
RenderSettings best_under(const std::string& light) {
  RenderSettings best;
  best.light = light;
  choose_sampler(best);
  return best;
}

/// A part of the renderer, switched on alone: takes over what `best` does of it.
struct PlainSwitch {
  std::string name;
  bool of_nets = false;  // under other lights there is nothing to be switched
  void (*on)(RenderSettings& plain, const RenderSettings& best) = nullptr;
};
const std::vector<PlainSwitch>& plain_switches() {
  static const std::vector<PlainSwitch> all{
      {"sampler", false, [](RenderSettings& plain, const RenderSettings& best) { plain.sampler = best.sampler; }},
      {"points", false, [](RenderSettings& plain, const RenderSettings& best) { plain.points = best.points; }},
      {"ssrt", false, [](RenderSettings& plain, const RenderSettings& best) { plain.ssrt = best.ssrt; }},
      {"shared answers", true,
       [](RenderSettings& plain, const RenderSettings& best) {
         plain.sharing = best.sharing, plain.leave_out = {Saving::SharedAnswers};
       }},
      {"small shares", true,
       [](RenderSettings& plain, const RenderSettings&) { plain.leave_out = {Saving::SmallShares}; }}};
  return all;
}

ErrorTimePart against_plain(const Config& config, const std::string& light) {
  ErrorTimePart part{.name = "plain_" + light,
                     .title = fmt::format("A plain estimator and its parts, light = {}", light),
                     .light = light};
  RenderSettings plain;
  plain.light = light, plain.sharing = Sharing::Never, plain.leave_out.clear();
  plain.sampler = config.text("plain.sampler"), plain.points = config.text("plain.points"),
  plain.ssrt = config.text("plain.ssrt");
  part.note = fmt::format(
      "plain: {}, {} points, {}, every ray asks, nothing is left out; then each part alone as `clerestory invert` has "
      "it, "
      "then all",
      plain.sampler, plain.points, plain.ssrt);
  part.what = {"picture"}, part.floor = kLightFloor, part.against_plain = true;
  const RenderSettings best = best_under(light);
  part.truth = {"truth", best, LayerResult::Picture};
  part.truth.settings.sharing = Sharing::Never;
  part.estimators.push_back({"plain", plain});
  for (const PlainSwitch& one : plain_switches()) {
    if (one.of_nets && light != "net") continue;
    part.estimators.push_back({"plain, but " + one.name, plain});
    one.on(part.estimators.back().settings, best);
  }
  part.estimators.push_back({"all on", best});
  return part;
}

/// Two of one name would count as one.
void check_names(const ErrorTimePart& part) {
  std::set<std::string> names;
  for (const TimedEstimator& estimator : part.estimators)
    if (!names.insert(estimator.name).second)
      throw usage_error("an estimator stands there twice", part.name, estimator.name, "each once");
}

}  // namespace

void add_error_time_keys(Schema& schema) {
  schema.section("pictures", "Pictures under the photograph as light: every sampler with all points.")
      .integers("pictures.spp", {1, 4, 16, 64, 256, 1024}, "Samples a pixel", {1, 65536})
      .texts("pictures.samplers",
             {"vndf_caps", "guided", "vndf_hemisphere", "vndf_bounded", "ndf", "cosine", "uniform"},
             "Samplers; none: no pictures",
             {"vndf_caps", "guided", "vndf_hemisphere", "vndf_bounded", "ndf", "cosine", "uniform"})
      .texts("pictures.points", {"sobol", "independent"}, "Points", {"sobol", "independent"})
      .integer("pictures.truth_spp", 16384, "Samples a pixel of the truth", {4, 1 << 24});
  schema.section("gradients", "Gradients of a loss of the re-render under the photograph as light.")
      .integers("gradients.spp", {1, 4, 16, 64, 256, 1024}, "Samples a pixel", {1, 65536})
      .texts("gradients.draws", {"two", "one"}, "Whether dL/dI and dI have samples of their own; none: no gradients",
             {"two", "one"})
      .texts("gradients.samplers", {"vndf_caps"}, "Samplers", {"vndf_caps", "guided", "ndf", "ndf_roughness"})
      .texts("gradients.points", {"sobol", "independent"}, "Points", {"sobol", "independent"})
      .integer("gradients.batches", 1,
               "Of more, rows with two draws have another whose samples come in so many batches, which state the "
               "gradient's standard error",
               {1, 64})
      .integer("gradients.truth_spp", 16384, "Samples a pixel of the truth", {4, 1 << 24});
  schema.section("learned", "Pictures under learned light: one switch another than by default.")
      .integers("learned.spp", {1, 4, 16, 64, 256}, "Samples a pixel", {1, 65536})
      .texts("learned.switches", {"default", "shared", "dda", "independent", "vndf_hemisphere"},
             "Rows; none: no learned light", {"default", "shared", "dda", "independent", "vndf_hemisphere", "guided"})
      .integer("learned.truth_spp", 4096, "Samples a pixel of the truth", {4, 1 << 24});
  schema.section("plain", "What each part of the renderer gains over a plain estimator, and all of them together.")
      .texts("plain.lights", {}, "Under which light; none: not measured", {"image", "net"})
      .text("plain.sampler", "vndf_hemisphere", "Its sampler", {"vndf_caps", "vndf_hemisphere", "ndf", "cosine"})
      .text("plain.points", "independent", "Its points", {"sobol", "independent"})
      .text("plain.ssrt", "dda", "How its rays march", {"hierarchical", "dda"});
  for (const char* light : {"image", "net"}) {
    const std::string name = std::string("plain_") + light;
    schema.section(name, fmt::format("The same under light = {}.", light))
        .integers(name + ".spp", {1, 4, 16, 64, 256}, "Samples a pixel", {1, 65536})
        .integer(name + ".truth_spp", 4096, "Samples a pixel of the truth", {4, 1 << 24});
  }
}

std::vector<ErrorTimePart> error_time_parts(const Config& config) {
  if (const std::int64_t seeds = config.integer("study.seeds"); seeds < 2)
    throw usage_error("one seed does not tell a bias from noise", config.where("study.seeds"), fmt::format("{}", seeds),
                      "at least 2");
  std::vector<ErrorTimePart> asked{pictures(config), gradients(config), learned(config)}, parts;
  for (const std::string& light : config.texts("plain.lights")) asked.push_back(against_plain(config, light));
  for (ErrorTimePart& part : asked) {
    if (part.estimators.empty()) continue;
    check_names(part), read_samples(config, part);
    parts.push_back(std::move(part));
  }
  if (parts.empty())
    throw usage_error("nothing to measure", "pictures.samplers, gradients.draws, learned.switches, plain.lights",
                      "all empty", "one of them with entries");
  return parts;
}

}  // namespace clerestory
