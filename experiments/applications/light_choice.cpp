#include "experiments/applications/light_choice.hpp"

#include <algorithm>

#include "experiments/weights/shipped.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/io/data_files.hpp"
#include "host/report/progress.hpp"
#include "nets/known_lamps.hpp"

namespace clerestory {
namespace fs = std::filesystem;

void check_light_weights(const RenderSettings& settings, const fs::path& weights) {
  if (!is_learned_light(settings.light)) return;
  const fs::path path = light_or_shipped(weights);
  check_method(settings.light, read_light_sizes(path), path.string());
}

void load_light_nets(RenderSettings& settings, const fs::path& weights, Device device) {
  if (!is_learned_light(settings.light)) return;
  const fs::path path = light_or_shipped(weights);
  const LoadedLight loaded = load_light(path, std::move(device));
  check_method(settings.light, loaded.net, path.string());
  const auto nets = std::make_shared<LightNets>();
  nets->sizes = loaded.net, nets->longer_side = loaded.longer_side(), nets->states = loaded.states;
  nets->note = path.string();
  settings.nets = nets;
}

void take_light(RenderSettings& settings, const LightChoice& choice, Device& device, const Scene& scene,
                Provenance& record) {
  load_light_nets(settings, choice.weights, device);
  if (settings.nets)
    for (const std::filesystem::path& file : weights_files(settings.nets->note))
      record.inputs.push_back(record_file(file));
  record.facts["light"] = answerer_text(settings) + (choice.why.empty() ? "" : ", " + choice.why);
  say("light: " + record.facts["light"]);
  if (choice.lamps == "none" || (choice.lamps == "auto" && !is_learned_light(settings.light))) return;
  if (settings.light == "li2020") return void(record.facts["lamps"] = "none: the light of Li et al. answers alone");
  const LampFit fit = fit_lamps(device, scene, settings);
  settings.lamps = fit.lamps;
  record.facts["lamps"] = fmt::format(
      "{} of {} candidates; the photograph rendered again on a coarse grid, root mean square of relative errors: "
      "{:.3f} "
      "without, {:.3f} with them",
      fit.lamps.size(), fit.candidates, fit.before, fit.after);
  record.figures["seconds: lamps"] = fit.seconds, record.figures["lamps"] = static_cast<double>(fit.lamps.size());
}

void choose_light(RenderSettings& settings, LightChoice& choice, const std::string& light, bool asked) {
  settings.light = light, choice.why.clear();
  if (asked) {
    if (!choice.weights.empty() && !is_learned_light(light)) choice.why = "which needs no --light-weights";
  } else if (!choice.weights.empty()) {
    settings.light = light_of(read_light_sizes(light_or_shipped(choice.weights)));
  } else if (!is_learned_light(light)) {
    choice.why = "for there are no weights of the light in " + text_of(light_places());
  }
}

void choose_sampler(RenderSettings& settings) {
  if (settings.light == "image") settings.sampler = kGuidedSampler;
}

std::string answerer_text(const RenderSettings& settings) {
  return settings.nets ? fmt::format("{} ({})", settings.light, settings.nets->note) : settings.light;
}

std::vector<std::string> lights_to_choose() {
  if (shipped_light())
    return {"net", "completed", "out_of_view", "image", "panorama", "mirrored", "constant", "li2020"};
  return {"image", "panorama", "mirrored", "constant", "net", "completed", "out_of_view", "li2020"};
}

std::string lights_note() {
  return "Light: the default is what named weights answer for, else net where its weights are found. net is learned, "
         "for what is in view and for what is not; completed is the photograph where rays hit, and net's second part "
         "elsewhere; out_of_view is that part alone; image takes the photograph "
         "where rays hit and its mean elsewhere; panorama puts the photograph at infinity, mirrored repeats it from "
         "there all around; constant is its "
         "mean; "
         "li2020 is the light's net of Li et al. 2020, whose weights --method or --light-weights names.";
}

}  // namespace clerestory
